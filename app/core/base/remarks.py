"""What there is to report beside a result, as data; `app.words.remarks` makes the sentences.

A remark is a frozen dataclass of its own: what it is about is its type, what it says are its
fields. Each package has its remarks in `remarks.py`, or beside what they are about.
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
