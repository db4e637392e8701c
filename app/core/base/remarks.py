"""Warnings and notes about a result, stored as data. `app.words.remarks` writes their text.

Each kind of remark is a frozen dataclass whose fields are the numbers and names in its sentence. A
package defines its remarks in `remarks.py` or next to the result they belong to. A place saves a
remark under the names of its class and fields. If either is renamed, files with the old name must
remain readable.
"""

from __future__ import annotations

from dataclasses import dataclass


class Remark:
    """A warning or a note about a result."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class PlainRemark(Remark):
    """A sentence from a camera or from a file written by an earlier version."""

    sentence: str
