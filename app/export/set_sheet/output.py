"""Writing a set sheet: PNG for screens, PDF for printers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.base import images
from app.core.base.errors import CoreError
from app.core.base.files import atomic_write_bytes
from app.export.result_sheet.lettering import Anchor, Lettering, Weight
from app.export.result_sheet.theme import PIXELS_PER_INCH, TEXT, Colour
from app.export.set_sheet.page import draw
from app.export.set_sheet.pdf import Word, page_of
from app.export.set_sheet.theme import HEIGHT, WIDTH

if TYPE_CHECKING:
    from pathlib import Path

    from app.export.result_sheet.canvas import Canvas
    from app.export.set_sheet.data import SetSheet

_QUALITY: Final = 93


def write_png(path: Path, sheet: SetSheet) -> None:
    """Write a set sheet as a picture of 192 pixels per inch, atomically.

    Raises
    ------
    CoreError
        When the file cannot be written.
    """
    images.write_png(path, draw(sheet), PIXELS_PER_INCH)


def write_pdf(path: Path, sheet: SetSheet) -> None:
    """Write a set sheet as a PDF of one A4 page whose words can be searched, atomically.

    Raises
    ------
    CoreError
        When the file cannot be written.
    """
    atomic_write_bytes(path, pdf_bytes(sheet))


def pdf_bytes(sheet: SetSheet) -> bytes:
    """Make the PDF of a set sheet in memory.

    Raises
    ------
    CoreError
        If the page's picture cannot be packed.
    """
    lettering = _Remembering()
    page = draw(sheet, lettering)
    # Full colour resolution: letters and amber lines would get coloured fringes otherwise.
    options = [
        cv2.IMWRITE_JPEG_QUALITY,
        _QUALITY,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    ]
    done, packed = cv2.imencode(".jpg", np.ascontiguousarray(page[..., ::-1]), options)
    if not done:
        raise CoreError("The page could not be packed.", "Write it as a PNG instead.")
    title = f"{sheet.title}, {sheet.place}" if sheet.place else sheet.title
    size = (page.shape[1], page.shape[0])
    return page_of(packed.tobytes(), size, (WIDTH, HEIGHT), lettering.words, title)


class _Remembering(Lettering):
    """Lettering that keeps what it wrote, and where."""

    def __init__(self) -> None:
        super().__init__()
        self.words: list[Word] = []

    def draw(
        self,
        canvas: Canvas,
        at: tuple[float, float],
        text: str,
        size: float,
        weight: Weight = 400,
        colour: Colour = TEXT,
        anchor: Anchor = "left",
    ) -> float:
        end = super().draw(canvas, at, text, size, weight, colour, anchor)
        width = self.width(text, size, weight)
        if text.strip():
            self.words.append(Word(end - width, at[1], text, size, width))
        return end
