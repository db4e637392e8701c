"""Warnings and notes beside a result, as data; `app.words.remarks` makes their sentences.

Each kind of remark is a frozen dataclass whose fields are the numbers and names of its sentence.
A package keeps its remarks in `remarks.py`, or beside the result they belong to. Places save a
remark under the names of its class and fields: renaming either needs a reader of the old name.
"""

from __future__ import annotations

from dataclasses import dataclass


class Remark:
    """Something worth knowing about a result."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class PlainRemark(Remark):
    """A sentence: from a camera, which speaks for itself, or out of an earlier file."""

    sentence: str
