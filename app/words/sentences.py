"""Tables that map each type of remark to its sentence."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeAlias

from app.core.base.remarks import Remark

Sentences: TypeAlias = Mapping[type[Remark], str | Callable[[Any], str]]
"""Sentence for each type of remark: text with field names in braces, or a function."""


def sentence_of(sentences: Sentences, remark: Remark) -> str:
    """Look up the sentence for a remark in a table."""
    entry = sentences[type(remark)]
    if not isinstance(entry, str):
        return entry(remark)
    return entry.format(**{each.name: getattr(remark, each.name) for each in fields(remark)})  # type: ignore[arg-type]
