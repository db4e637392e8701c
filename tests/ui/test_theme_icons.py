"""Icons: all there, all drawn, at the screen's resolution and in the colour asked for."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor, QIcon, QImage, QPainter, QPixmap

from app.core.base.paths import resources
from app.ui.theme import set_theme, theme
from app.ui.theme.icons import ICONS, draw_icon, icon, icon_pixmap

pytestmark = pytest.mark.usefixtures("qapp")

RED = QColor("#c02010")


def rgba(picture: QPixmap | QImage) -> NDArray[np.uint8]:
    image = picture.toImage() if isinstance(picture, QPixmap) else picture
    image = image.convertToFormat(QImage.Format.Format_RGBA8888)
    data = np.frombuffer(image.constBits(), np.uint8)
    return data.reshape(image.height(), image.bytesPerLine() // 4, 4)[:, : image.width()].copy()


@pytest.mark.parametrize("name", ICONS)
def test_each_is_drawn_in_its_colour_inside_its_square(name: str) -> None:
    picture = rgba(icon_pixmap(name, 24, RED, 2.0))
    assert picture.shape == (48, 48, 4)
    opaque = picture[picture[..., 3] == 255][:, :3]
    allowed = [RED.getRgb()[:3], theme().c.amberfill.getRgb()[:3]]  # type: ignore[index]
    assert len(opaque) > 15
    assert all(any(np.abs(p.astype(int) - a).max() <= 2 for a in allowed) for p in opaque)
    # A drawing that reaches the edge is cut off there.
    edge = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    assert edge[:, 3].max() <= 128


@pytest.mark.parametrize("name", ICONS)
def test_each_follows_the_rules_of_the_set(name: str) -> None:
    text = (resources() / "icons" / f"{name}.svg").read_text(encoding="utf-8")
    assert 'viewBox="0 0 24 24"' in text
    assert 'stroke-width="1.75"' in text
    assert 'stroke-linecap="round"' in text
    colours = set(re.findall(r"#[0-9a-f]{6}", text))
    assert colours == ({"#f2bc4b"} if name == "logo" else set())
    assert "<image" not in text
    assert "href" not in text


def test_drawings_that_mean_something_else_look_different() -> None:
    same = [{"turn", "clockwise"}, {"restore", "counterclockwise"}, {"theta", "front-lens"}]
    same += [{"bulb", "light"}, {"ignore", "not-possible"}]
    seen: dict[bytes, set[str]] = {}
    for name in ICONS:
        seen.setdefault(rgba(icon_pixmap(name, 24, RED)).tobytes(), set()).add(name)
    doubles = [names for names in seen.values() if len(names) > 1]
    assert sorted(map(sorted, doubles)) == sorted(map(sorted, same))


def test_turning_directions_are_mirror_images() -> None:
    right = rgba(icon_pixmap("clockwise", 24, RED, 2.0))[..., 3].astype(int)
    left = rgba(icon_pixmap("counterclockwise", 24, RED, 2.0))[..., 3].astype(int)
    # The same outline mirrored; only the rasteriser's rounding may differ.
    assert np.abs(right - left[:, ::-1]).mean() < 2
    assert np.abs(right - left).mean() > 10


def test_the_logo_takes_the_amber_of_the_theme() -> None:
    set_theme("contrast")
    picture = rgba(icon_pixmap("logo", 40, QColor("#000000")))
    assert tuple(picture[20, 26, :3]) == (0xFF, 0xB4, 0x00)
    assert tuple(picture[20, 14]) == (0, 0, 0, 0)


def test_a_colour_that_lets_through_is_the_same_all_over() -> None:
    faint = QColor(RED)
    faint.setAlphaF(0.5)
    assert rgba(icon_pixmap("close", 40, faint, 2.0))[..., 3].max() <= 129


def test_what_was_drawn_once_is_taken_from_the_cache() -> None:
    first = icon_pixmap("sun", 20, RED, 2.0)
    assert icon_pixmap("sun", 20, RED, 2.0).cacheKey() == first.cacheKey()
    assert icon_pixmap("sun", 20, RED, 1.0).cacheKey() != first.cacheKey()


@pytest.mark.parametrize("dpr", [1.0, 1.5, 2.0])
def test_it_is_drawn_at_the_resolution_of_what_it_is_drawn_on(dpr: float) -> None:
    image = QImage(round(40 * dpr), round(40 * dpr), QImage.Format.Format_ARGB32_Premultiplied)
    image.setDevicePixelRatio(dpr)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    draw_icon(painter, "stop", QRect(8, 8, 24, 24), 24, RED)
    painter.end()
    rows = np.flatnonzero(rgba(image)[:, :, 3].any(axis=1)) / dpr
    # Square of 13 with a line of 1.75, from 5.5 in a box that starts at 8.
    assert rows[0] == pytest.approx(8 + 5.5 - 0.875, abs=1.01 / dpr)
    assert rows[-1] == pytest.approx(8 + 18.5 + 0.875, abs=1.01 / dpr)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(KeyError):
        icon_pixmap("../../secret", 24, RED)


def test_icons_for_menus_have_a_disabled_look() -> None:
    made = icon("trash")
    normal = rgba(made.pixmap(20))
    grey = rgba(made.pixmap(20, QIcon.Mode.Disabled))
    assert normal[..., 0][normal[..., 3] == 255].max() == theme().c.text.red()
    assert grey[..., 0][grey[..., 3] == 255].max() == theme().c.dis.red()


def test_in_contrast_the_chosen_entry_has_a_white_icon() -> None:
    set_theme("contrast")
    chosen = rgba(icon("trash").pixmap(20, QIcon.Mode.Active))
    assert chosen[..., 0][chosen[..., 3] == 255].min() == 255
