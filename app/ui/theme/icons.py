"""The icon set, rendered from vector files at the screen's scale in the colour of the text.

The drawings are SVG files in ``resources/icons``, on a 24-unit grid, with lines 1.75 units wide and
round ends. Their colour is ``currentColor``. The half disc in the logo uses the dark theme's amber,
which is replaced with the amber of the current theme.
"""

from __future__ import annotations

from functools import cache
from typing import Final

from PySide6.QtCore import QByteArray, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap, QPixmapCache
from PySide6.QtSvg import QSvgRenderer

from app.core.base.atomic_files import os_errors_as
from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.text import tr
from app.ui.theme.theme import PALETTES, theme

ICONS: Final = tuple(sorted(file.stem for file in (resources() / "icons").glob("*.svg")))
"""Names of all icons, in alphabetical order."""

_SIZES: Final = (16, 20, 24, 28, 40)
_OPAQUE: Final = 255


@cache
def _source(name: str) -> str:
    if name not in ICONS:
        raise KeyError(name)
    path = resources() / "icons" / f"{name}.svg"
    missing, hint = tr("The icon {name} is missing."), tr("Reinstall Turnlight.")
    with os_errors_as(CoreError, missing, hint, name=path.name):
        return path.read_text(encoding="utf-8")


def _render(name: str, colour: QColor, pixels: int) -> QPixmap:
    """Render an icon as a square pixmap whose side length is given in device pixels."""
    text = _source(name).replace("currentColor", colour.name())
    text = text.replace(PALETTES["dark"]["amberfill"], theme().c.amberfill.name())
    pixmap = QPixmap(pixels, pixels)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    QSvgRenderer(QByteArray(text.encode())).render(painter, QRectF(0, 0, pixels, pixels))
    if colour.alpha() < _OPAQUE:
        # Apply the opacity to the whole drawing, so that crossing lines do not add up.
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_DestinationIn)
        painter.fillRect(pixmap.rect(), colour)
    painter.end()
    return pixmap


def icon_pixmap(name: str, size: int, colour: QColor, dpr: float = 1.0) -> QPixmap:
    """Return an icon rendered at the screen's scale, using the cache if possible.

    Args:
        size: Width and height in scaled logical pixels, such as ``theme().px(20)``. Each side of
            the result is ``round(size * dpr)`` device pixels long.

    Raises:
        KeyError: If there is no such icon.
        CoreError: If the icon's file is missing.
    """
    pixels = max(1, round(size * dpr))
    key = f"turnlight/{name}/{pixels}/{dpr}/{colour.rgba():x}/{theme().c.amberfill.rgb():x}"
    pixmap = QPixmap()
    if not QPixmapCache.find(key, pixmap):
        pixmap = _render(name, colour, pixels)
        pixmap.setDevicePixelRatio(dpr)
        QPixmapCache.insert(key, pixmap)
    return pixmap


def draw_icon(
    painter: QPainter, name: str, rect: QRect | QRectF, size: int, colour: QColor
) -> None:
    """Draw an icon in the centre of a rectangle, at a size that is already scaled."""
    # Do not use the widget's ratio, because the painter's target may have another scale.
    dpr = painter.deviceTransform().m11()
    pixmap = icon_pixmap(name, size, colour, dpr)
    centre = QRectF(rect).center()
    # Align the icon with whole device pixels to keep its lines sharp.
    x = round((centre.x() - size / 2) * dpr) / dpr
    y = round((centre.y() - size / 2) * dpr) / dpr
    painter.drawPixmap(QPointF(x, y), pixmap)


def icon(name: str, colour: QColor | None = None) -> QIcon:
    """Return an icon, with its disabled look, for Qt's own widgets such as menu entries."""
    t = theme()
    result = QIcon()
    for size in _SIZES:
        for dpr in (1.0, 2.0):
            normal = icon_pixmap(name, t.px(size), colour or t.c.text, dpr)
            result.addPixmap(normal)
            grey = icon_pixmap(name, t.px(size), t.c.dis, dpr)
            result.addPixmap(grey, QIcon.Mode.Disabled)
            if t.contrast:
                # The menu entry under the mouse is white on black.
                light = icon_pixmap(name, t.px(size), t.c.panel, dpr)
                result.addPixmap(light, QIcon.Mode.Active)
    return result
