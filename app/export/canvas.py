"""Pages drawn with QPainter, either as an image in memory or as a PDF with searchable text.

All lengths are in logical pixels, 96 per inch. This is the only module of the package that imports
Qt. It needs no window and works on any thread once the fonts are loaded. If there is no
QGuiApplication, it creates one that needs no display.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QMarginsF, QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFont,
    QFontDatabase,
    QFontMetricsF,
    QGuiApplication,
    QImage,
    QPagedPaintDevice,
    QPageSize,
    QPainter,
    QPainterPath,
    QPdfWriter,
    QPen,
    QPolygonF,
)

from app.core.base.angles import arc_width, at_turn
from app.core.base.errors import CoreError
from app.core.base.native import plain_numbers
from app.core.base.paths import resources
from app.core.base.visible_text import visible
from app.core.text import tr

Point: TypeAlias = tuple[float, float]
"""Position in logical pixels, with x to the right and y down."""

Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, width and height in logical pixels."""

Colour: TypeAlias = tuple[int, int, int]
"""Red, green and blue as sRGB bytes."""

Weight: TypeAlias = Literal[400, 500, 600, 700]
Anchor: TypeAlias = Literal["left", "middle", "right"]

SCALE: Final = 2
"""Number of image pixels per logical pixel."""

PIXELS_PER_INCH: Final = 96 * SCALE
"""Resolution to store in the file so that viewers show logical pixels at their intended size."""

FAMILY: Final = "Inter"
"""Family name of the bundled font."""

WEIGHTS: Final[dict[int, str]] = {400: "Regular", 500: "Medium", 600: "SemiBold", 700: "Bold"}
"""Bundled font weights, with the suffixes of their file names."""

_EM: Final = 256  # glyphs are laid out at this size and scaled down, to avoid rounding
# scale from layout size to drawn size; font sizes on sheets are slightly below the em
_SHARE: Final = 1.028 / _EM
_SHARP: Final = 0.25  # radians; smaller bends are treated as part of a curve
_PDF_DPI: Final = 1200


@cache
def load_fonts() -> None:
    """Register the bundled font files once per process.

    Raises:
        CoreError: If a font file is missing or damaged.
    """
    _application()
    for word in WEIGHTS.values():
        path = resources() / "fonts" / f"{FAMILY}-{word}.otf"
        if _add_font(path) < 0:
            raise CoreError(
                tr("The font {name} cannot be read.", name=path.name),
                tr("Reinstall Turnlight."),
            )


def _add_font(path: Path) -> int:
    try:
        return QFontDatabase.addApplicationFontFromData(path.read_bytes())
    except OSError:
        return -1


@cache
def _application() -> QGuiApplication | None:
    """Create the windowless application that fonts require, or return None if there is one."""
    if QGuiApplication.instance() is not None:
        return None
    application = QGuiApplication(["turnlight", "-platform", "offscreen"])
    plain_numbers()
    return application


def _font(weight: Weight) -> QFont:
    load_fonts()
    font = QFont(FAMILY)
    font.setPixelSize(_EM)
    font.setWeight(QFont.Weight(weight))
    font.setHintingPreference(QFont.HintingPreference.PreferNoHinting)
    # Alternate glyphs do not map back to characters, so a PDF search would miss them.
    font.setFeature(QFont.Tag("calt"), 0)
    return font


def text_width(text: str, size: float, weight: Weight = 400) -> float:
    """Return the width of a line in logical pixels, with kerning."""
    return float(QFontMetricsF(_font(weight)).horizontalAdvance(visible(text))) * size * _SHARE


def wrap_text(text: str, size: float, limit: float, weight: Weight = 400) -> list[str]:
    """Break text into lines of at most `limit` logical pixels. A longer word gets its own line."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size, weight) <= limit:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def shorten(text: str, size: float, limit: float, weight: Weight = 400) -> str:
    """Truncate text that is wider than `limit` logical pixels, adding an ellipsis."""
    if text_width(text, size, weight) <= limit:
        return text
    head = text
    while head and text_width(f"{head.rstrip()}…", size, weight) > limit:
        head = head[:-1]
    return f"{head.rstrip()}…"


def circle_points(centre: Point, radius: float, count: int = 96) -> list[Point]:
    """Return ``count`` points on a circle, clockwise from the top, then the first one again."""
    return [at_turn(centre, radius, 360.0 * index / count) for index in range(count + 1)]


def sector(centre: Point, radius: float, arc_deg: tuple[float, float]) -> list[Point]:
    """Return the outline of a sector, including its centre, with a clockwise arc."""
    extent = arc_width(arc_deg)
    steps = max(int(extent / 3.0), 1)
    rim = [at_turn(centre, radius, arc_deg[0] + extent * k / steps) for k in range(steps + 1)]
    return [centre, *rim]


class Page:
    """A drawing surface: an image with `SCALE` pixels per logical pixel, or a PDF page.

    Args:
        pdf: PDF writer to draw to (see `pdf_bytes`), or None to draw an image.
    """

    def __init__(
        self, width: float, height: float, colour: Colour, pdf: QPagedPaintDevice | None = None
    ) -> None:
        self.width = width
        size = round(width * SCALE), round(height * SCALE)
        self._image = None if pdf else QImage(*size, QImage.Format.Format_RGB32)
        self._painter = QPainter()
        if self._image is not None:
            self._image.fill(QColor(*colour))
        device = self._image or pdf
        assert device is not None
        if not self._painter.begin(device):
            raise CoreError(tr("The page cannot be drawn."), tr("Free some memory and try again."))
        scale = SCALE if pdf is None else pdf.logicalDpiX() / 96.0
        self._painter.scale(scale, scale)
        self._painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)

    def close(self) -> None:
        """End painting. Nothing can be drawn afterwards."""
        if self._painter.isActive():
            self._painter.end()

    def __del__(self) -> None:
        # An image must outlive its painter, in whatever order they are collected.
        self.close()

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """The image so far, as (H, W, 3) uint8 sRGB. A PDF page has none."""
        assert self._image is not None
        high, wide = self._image.height(), self._image.width()
        words = np.frombuffer(self._image.constBits(), np.uint8).reshape(high, -1, 4)
        return np.ascontiguousarray(words[:, :wide, 2::-1])

    def panel(
        self, box: Box, colour: Colour, radius: float = 0.0, edge: Colour | None = None
    ) -> None:
        """Draw a filled rounded rectangle, optionally with a 1 px edge along its inside."""
        if edge is not None:
            self._fill(_rounded(box, radius), edge)
            x, y, width, height = box
            box, radius = (x + 1, y + 1, width - 2, height - 2), max(radius - 1, 0.0)
        self._fill(_rounded(box, radius), colour)

    def stroke(
        self,
        points: Sequence[Point],
        colour: Colour,
        width: float = 1.0,
        *,
        closed: bool = False,
        opacity: float = 1.0,
        dashes: tuple[float, float] | None = None,
    ) -> None:
        """Draw a polyline with round joins and round ends.

        Args:
            dashes: Lengths of the dashes and gaps, in logical pixels, measured between the centres
                of the round ends.
        """
        pen = QPen(_ink(colour, opacity), width)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        # Qt's round joins leave lumps on dense curves, so only real corners are rounded.
        joins = Qt.PenJoinStyle
        pen.setJoinStyle(joins.RoundJoin if self._image is None else joins.BevelJoin)
        if dashes is not None:
            pen.setDashPattern([length / width for length in dashes])
        self._painter.strokePath(_path(points, closed=closed), pen)
        if self._image is not None and dashes is None and opacity == 1.0:
            for corner in _corners(points, closed=closed):
                self.dot(corner, width / 2.0, colour)

    def shape(self, points: Sequence[Point], colour: Colour, opacity: float = 1.0) -> None:
        """Fill a polygon."""
        self._fill(_path(points, closed=True), colour, opacity)

    def dot(self, centre: Point, radius: float, colour: Colour) -> None:
        """Draw a filled circle."""
        path = QPainterPath()
        path.addEllipse(QPointF(*centre), radius, radius)
        self._fill(path, colour)

    def picture(self, box: Box, display: NDArray[np.float32], radius: float = 0.0) -> None:
        """Draw an image, optionally with rounded corners.

        Args:
            box: Target area, aligned to whole pixels.
            display: NDArray[np.float32], (h, w, 3). sRGB in 0..1, at the size returned by
                `Page.size_of`.
        """
        pixels = np.ascontiguousarray((display * 255.0 + 0.5).astype(np.uint8))
        high, wide = pixels.shape[:2]
        image = QImage(pixels.data, wide, high, 3 * wide, QImage.Format.Format_RGB888)
        self._painter.save()
        if self._image is None:
            self._painter.setClipPath(_rounded(box, radius))
        else:
            image = _cut(image, radius * SCALE)
        self._painter.drawImage(QRectF(*box), image)
        self._painter.restore()

    @contextmanager
    def clipped(self, box: Box) -> Iterator[None]:
        """Restrict drawing to a box, which must be aligned to whole pixels."""
        self._painter.save()
        self._painter.setClipRect(QRectF(*box))
        yield
        self._painter.restore()

    def text(
        self,
        at: Point,
        text: str,
        size: float,
        weight: Weight,
        colour: Colour,
        anchor: Anchor = "left",
        room: float = math.inf,
    ) -> float:
        """Draw a line of text.

        Args:
            at: Anchor point on the baseline, at the start, middle or end of the line.
            room: Maximum width in logical pixels. A longer line, such as a translation, is set in
                smaller type instead of being truncated.

        Returns:
            The x coordinate of the end of the line.
        """
        text = visible(text)
        width = text_width(text, size, weight)
        size, width = (size * room / width, room) if width > room else (size, width)
        start = at[0] - {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor] * width
        if text.strip():
            self._painter.save()
            # Snap baselines to whole pixels, so that the feet of all letters are equally sharp.
            self._painter.translate(start, round(at[1] * SCALE) / SCALE)
            self._painter.scale(size * _SHARE, size * _SHARE)
            if self._image is None:
                self._painter.setFont(_font(weight))
                self._painter.setPen(_ink(colour))
                # Draw word by word, because Qt would emit spaces as tabs, which breaks searching.
                for word in re.finditer(r"\S+", text):
                    across = QFontMetricsF(_font(weight)).horizontalAdvance(text[: word.start()])
                    self._painter.drawText(QPointF(across, 0.0), word[0])
            else:
                # Drawing outlines makes letters look the same on every system.
                path = QPainterPath()
                path.addText(QPointF(0.0, 0.0), _font(weight), text)
                self._painter.fillPath(path, _ink(colour))
            self._painter.restore()
        return start + width

    @staticmethod
    def size_of(box: Box) -> tuple[int, int]:
        """Return the number of pixel rows and columns in a box."""
        x, y, width, height = box
        return (
            round((y + height) * SCALE) - round(y * SCALE),
            round((x + width) * SCALE) - round(x * SCALE),
        )

    def _fill(self, path: QPainterPath, colour: Colour, opacity: float = 1.0) -> None:
        self._painter.fillPath(path, _ink(colour, opacity))


def pdf_bytes(width: float, height: float, title: str, draw: Callable[[Page], None]) -> bytes:
    """Return a PDF with one white page that has vector outlines, images and embedded fonts."""
    load_fonts()
    data = QByteArray()
    buffer = QBuffer(data)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setResolution(_PDF_DPI)
    writer.setTitle(title)
    writer.setCreator("Turnlight")
    millimetres = QPageSize.Unit.Millimeter
    inch = 25.4 / 96.0
    writer.setPageSize(QPageSize(QSizeF(width * inch, height * inch), millimetres))
    writer.setPageMargins(QMarginsF())
    canvas = Page(width, height, (255, 255, 255), writer)
    draw(canvas)
    canvas.close()
    buffer.close()
    return bytes(data.data())


def _ink(colour: Colour, opacity: float = 1.0) -> QColor:
    ink = QColor(*colour)
    ink.setAlphaF(opacity)
    return ink


def _path(points: Sequence[Point], *, closed: bool) -> QPainterPath:
    path = QPainterPath()
    path.addPolygon(QPolygonF([QPointF(*point) for point in points]))
    if closed:
        path.closeSubpath()
    return path


def _corners(points: Sequence[Point], *, closed: bool) -> list[Point]:
    """Return the points at which a line bends sharply."""
    path = np.asarray([*points, *points[:2]] if closed else points, np.float64)
    across, down = np.diff(path, axis=0).T
    heading = np.arctan2(down, across)
    bend = np.abs((np.diff(heading) + np.pi) % (2.0 * np.pi) - np.pi)
    return [(float(x), float(y)) for x, y in path[1:-1][bend > _SHARP]]


def _rounded(box: Box, radius: float) -> QPainterPath:
    path = QPainterPath()
    path.addRoundedRect(QRectF(*box), radius, radius)
    return path


def _cut(image: QImage, radius: float) -> QImage:
    """Round the corners of an image with alpha, since clipping is not antialiased."""
    cut = QImage(image.size(), QImage.Format.Format_ARGB32_Premultiplied)
    cut.fill(Qt.GlobalColor.transparent)
    painter = QPainter(cut)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.fillPath(_rounded((0.0, 0.0, cut.width(), cut.height()), radius), QBrush(image))
    painter.end()
    return cut
