"""What pages are drawn with: shapes, pictures and words, as a picture and as a PDF."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from app.core.base.errors import CoreError
from app.export import canvas as canvas_module
from app.export.canvas import SCALE, Page, circle_points, shorten, text_width, wrap_text

pytestmark = pytest.mark.usefixtures("qapp")

BLACK, WHITE = (0, 0, 0), (0xED, 0xED, 0xED)


def test_letters_are_inter_and_kerned() -> None:
    apart = text_width("T", 100) + text_width("o", 100)
    assert text_width("To", 100) == pytest.approx(apart - 7.7, abs=1.0)
    assert text_width("", 12) == 0.0
    # Inter's own width of a capital H, 0.74 em, and our sizes are 1/1.028 em.
    assert text_width("H", 100) == pytest.approx(76.1, abs=0.1)
    canvas = Page(100, 30, BLACK)
    end = canvas.text((10, 20), "96°", 16, 700, WHITE)
    assert end == pytest.approx(10 + text_width("96°", 16, 700))
    levels = np.unique(canvas.pixels)
    assert levels.size > 10, "letters have smooth edges"
    assert (np.ptp(canvas.pixels, axis=2) == 0).all(), "and no coloured fringes"
    columns = np.nonzero((canvas.pixels[..., 0] > 0x60).any(axis=0))[0] / SCALE
    assert 10 <= columns.min() <= 13
    assert end - 4 <= columns.max() <= end + 1


def test_four_weights_are_four_faces() -> None:
    def ink(weight: int) -> float:
        canvas = Page(200, 30, BLACK)
        canvas.text((10, 20), "Light", 16, weight, WHITE)  # type: ignore[arg-type]
        return float(canvas.pixels.astype(float).sum())

    inks = [ink(weight) for weight in (400, 500, 600, 700)]
    assert all(more > less * 1.02 for less, more in pairwise(inks))


def test_words_end_where_they_are_asked_to() -> None:
    canvas = Page(100, 60, BLACK)
    for y, anchor in ((18, "left"), (36, "middle"), (54, "right")):
        canvas.text((50, y), "Light", 12, 400, WHITE, anchor)  # type: ignore[arg-type]
    for row, where in ((0, 1.0), (18, 0.0), (36, -1.0)):
        lit = canvas.pixels[row * SCALE : (row + 20) * SCALE, :, 0] > 0x60
        columns = np.nonzero(lit.any(axis=0))[0] / SCALE
        middle = 50 + where * text_width("Light", 12) / 2
        assert (columns.min() + columns.max()) / 2 == pytest.approx(middle, abs=1.5)  # bearings


def test_missing_fonts_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(canvas_module, "resources", lambda: tmp_path)
    with pytest.raises(CoreError, match=r"Inter-Regular\.otf.*Reinstall Turnlight"):
        canvas_module.load_fonts.__wrapped__()


def test_long_names_get_an_ellipsis() -> None:
    short = shorten("A place with a very long name", 16, 100)
    assert short.endswith("…")
    assert text_width(short, 16) <= 100
    assert shorten("Hall", 16, 100) == "Hall"
    assert wrap_text("a place with verylongwords", 16, 60) == ["a place", "with", "verylongwords"]


def test_shapes_have_the_area_that_they_should() -> None:
    canvas = Page(60, 60, (0, 0, 0))
    canvas.dot((30.25, 29.75), 20.0, (200, 200, 200))
    area = canvas.pixels[..., 0].sum() / 200.0 / SCALE**2
    assert area == pytest.approx(np.pi * 400, rel=0.01)
    canvas = Page(60, 60, (0, 0, 0))
    canvas.panel((10, 10, 40, 30), (200, 200, 200), 8.0)
    area = canvas.pixels[..., 0].sum() / 200.0 / SCALE**2
    assert area == pytest.approx(1200 - (4 - np.pi) * 64, rel=0.01)


def test_shapes_are_cut_at_the_edge_of_the_canvas() -> None:
    canvas = Page(20, 20, (0, 0, 0))
    canvas.dot((0.0, 0.0), 8.0, WHITE)
    canvas.stroke([(-50.0, 10.0), (50.0, 10.0)], WHITE, 2.0)
    canvas.dot((500.0, 500.0), 8.0, WHITE)
    assert canvas.pixels[0, 0, 0] == WHITE[0]
    assert canvas.pixels[-1, -1, 0] == 0


def test_dashes_leave_gaps() -> None:
    ring = circle_points((40, 40), 30)
    whole, dashed = Page(80, 80, (0, 0, 0)), Page(80, 80, (0, 0, 0))
    whole.stroke(ring, WHITE, 1.0)
    dashed.stroke(ring, WHITE, 1.0, dashes=(2.0, 3.0))
    share = dashed.pixels.astype(float).sum() / whole.pixels.sum()
    assert 0.3 < share < 0.75


def test_corners_are_round_and_curves_smooth() -> None:
    canvas = Page(60, 60, BLACK)
    canvas.stroke([(10, 10), (50, 10), (50, 50)], WHITE, 10.0)
    square, diagonal = (
        canvas.pixels[5 * SCALE, 55 * SCALE - 1],
        canvas.pixels[7 * SCALE, 53 * SCALE - 1],
    )
    assert square[0] == 0
    assert diagonal[0] == WHITE[0]
    canvas = Page(60, 60, BLACK)
    canvas.stroke(circle_points((30, 30), 20), WHITE, 4.0, closed=True)
    light = canvas.pixels[..., 0].astype(float)
    # A circle looks the same from above and from the side.
    assert np.abs(light - light.T).max() <= 8


def test_pictures_have_round_corners() -> None:
    canvas = Page(40, 40, BLACK)
    box = (10.0, 10.0, 20.0, 20.0)
    shown = np.full((*canvas.size_of(box), 3), (0.2, 0.4, 0.8), np.float32)
    canvas.picture(box, shown, 6.0)
    assert (canvas.pixels[10 * SCALE, 10 * SCALE] == 0).all()
    assert tuple(canvas.pixels[20 * SCALE, 20 * SCALE]) == (51, 102, 204)
    edge = canvas.pixels[10 * SCALE : 16 * SCALE, 10 * SCALE : 16 * SCALE, 2]
    assert np.unique(edge).size > 5, "smooth, not stairs"


def test_pages_are_drawn_alike_on_other_threads() -> None:
    def drawn(_: int) -> bytes:
        canvas = Page(120, 40, BLACK)
        canvas.text((5, 30), "96° clockwise", 16, 600, WHITE)
        canvas.dot((110, 20), 8, WHITE)
        return canvas.pixels.tobytes()

    here = drawn(0)
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(drawn, range(40))) == {here}


def test_a_command_needs_no_display_and_no_application(tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "from app.export.canvas import Page\n"
        "canvas = Page(80, 30, (0, 0, 0))\n"
        "canvas.text((5, 20), '96°', 16, 700, (255, 255, 255))\n"
        "assert canvas.pixels.max() > 200\n"
        "assert 'PySide6.QtWidgets' not in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        # A platform that is not there, as in a terminal of a machine far away.
        env={"PATH": "", "QT_QPA_PLATFORM": "xcb", "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
