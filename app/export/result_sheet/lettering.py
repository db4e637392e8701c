"""Lettering in Inter, which travels with the program: measuring, wrapping and drawing text."""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import cv2

from app.core.base.paths import resources
from app.export.result_sheet.canvas import FINE, Canvas, Mask
from app.export.result_sheet.theme import SCALE, TEXT, Colour

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

Weight: TypeAlias = Literal[400, 500, 600, 700]
Anchor: TypeAlias = Literal["left", "middle", "right"]

_FILES: Final[dict[Weight, str]] = {
    400: "Inter-Regular.otf",
    500: "Inter-Medium.otf",
    600: "Inter-SemiBold.otf",
    700: "Inter-Bold.otf",
}


class Lettering:
    """The faces of one font, loaded when first needed."""

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or resources() / "fonts"
        self._kerning: dict[str, dict[str, float]] | None = None

    def width(self, text: str, size: float, weight: Weight = 400) -> float:
        """Measure a line.

        Parameters
        ----------
        size : float
            Font size in logical pixels.

        Returns
        -------
        float
            Advance width in logical pixels, kerned.
        """
        return self._runs(text, size, weight)[1] / FINE

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
        """Draw a line of text.

        Parameters
        ----------
        at : tuple[float, float]
            Where the line starts (or its middle, or its end), on the baseline.
        size : float
            Font size in logical pixels.

        Returns
        -------
        float
            Where the line ends, x in logical pixels.
        """
        runs, fine_width = self._runs(text, size, weight)
        width = fine_width / FINE
        start = at[0] - {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor] * width
        # Baselines stand on whole pixels, so that all the feet of a line are equally sharp.
        baseline = round(at[1] * SCALE) / SCALE
        face, em = self._face(weight), round(size * FINE)

        def draw(mask: Mask, corner: tuple[float, float]) -> None:
            for offset, run in runs:
                x = round((start - corner[0]) * FINE + offset)
                y = round((baseline - corner[1]) * FINE)
                # Masks have one channel; OpenCV takes the ink's first value.
                cv2.putText(mask, run, (x, y), (255,), face, em, 0)

        if runs:
            box = (start - 2.0, baseline - 1.2 * size, width + 4.0, 1.6 * size)
            canvas.fill(box, colour, draw)
        return start + width

    def wrap(self, text: str, size: float, limit: float, weight: Weight = 400) -> list[str]:
        """Break text into lines.

        Parameters
        ----------
        size : float
            Font size in logical pixels.
        """
        lines: list[str] = []
        for word in text.split():
            longer = f"{lines[-1]} {word}" if lines else word
            if lines and self.width(longer, size, weight) <= limit:
                lines[-1] = longer
            else:
                lines.append(word)
        return lines

    def shorten(self, text: str, size: float, limit: float, weight: Weight = 400) -> str:
        """Cut text that is too long, with an ellipsis in its place.

        Parameters
        ----------
        size : float
            Font size in logical pixels.

        Returns
        -------
        str
            The text, or as much of it as fits.
        """
        if self.width(text, size, weight) <= limit:
            return text
        kept = text
        while kept and self.width(f"{kept.rstrip()}…", size, weight) > limit:
            kept = kept[:-1]
        return f"{kept.rstrip()}…"

    def _runs(
        self, text: str, size: float, weight: Weight
    ) -> tuple[list[tuple[float, str]], float]:
        """Split a line where its letters are kerned: offsets with text, and the whole width.

        OpenCV places letters by their advance only, hence each run starts where the last one
        ended, moved by the pair's kerning. In mask pixels.
        """
        face, em, pairs = self._face(weight), round(size * FINE), self._pairs(weight)
        runs: list[tuple[float, str]] = []
        at, start = 0.0, 0
        for index in range(1, len(text) + 1):
            kern = pairs.get(text[index - 1 : index + 1], 0.0)
            if index < len(text) and not kern:
                continue
            run = text[start:index]
            runs.append((at, run))
            at += cv2.getTextSize((0, 0), run, (0, 0), face, em, 0)[2] + kern * em
            start = index
        return runs, at

    def _pairs(self, weight: Weight) -> Mapping[str, float]:
        if self._kerning is None:
            try:
                text = (self._folder / "kerning.json").read_text(encoding="utf-8")
                self._kerning = json.loads(text)
            except (OSError, ValueError):
                self._kerning = {}
        return self._kerning.get(str(weight), {})

    def _face(self, weight: Weight) -> cv2.FontFace:
        return _load_face(str(self._folder / _FILES[weight]))


@cache
def _load_face(path: str) -> cv2.FontFace:
    """Load a font file, once and for good.

    OpenCV keeps drawn glyphs by the face's address: a face that takes the memory of a released
    one gets that one's letters. Hence no face is ever released.
    """
    face = cv2.FontFace()
    if face.set(path):
        return face
    # OpenCV's own sans serif stands in where a file is missing or its name defeats OpenCV.
    return cv2.FontFace("sans")
