"""What a picture file says of itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.core.measure.read.metadata import read_header

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.measure.read.frame import Frame


def read_frame(path: Path | str) -> Frame:
    return read_header(path).frame
