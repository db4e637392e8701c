"""How a table of sentences is written and read: the sentence of each kind of remark."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeAlias

from app.core.base.remarks import Remark

Sentences: TypeAlias = Mapping[type[Remark], str | Callable[[Any], str]]
"""By remark: a sentence with the names of its fields in braces, or a function that writes it."""


def sentence_of(sentences: Sentences, remark: Remark) -> str:
    """Write a remark by its entry in a table."""
    entry = sentences[type(remark)]
    if not isinstance(entry, str):
        return entry(remark)
    return entry.format(**{each.name: getattr(remark, each.name) for each in fields(remark)})  # type: ignore[arg-type]
