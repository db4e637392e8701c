"""The result sheet: what is drawn where, in which colour, and that no words are lost."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base import colour
from app.core.solver import pictures
from app.core.solver.environment import from_radiance
from app.core.solver.pictures import WELL
from app.export.result_sheet import card, draw_sheet, place, plot
from app.export.result_sheet.canvas import Canvas, circle_points
from app.export.result_sheet.lettering import Lettering
from app.export.result_sheet.theme import AMBER, BG, PANEL, SCALE, TEXT
from app.export.result_sheet.words import arc_words, head_words, side_words, turn_words

PLACES = {"top": "from overhead"}
LETTERS = Lettering()


@dataclasses.dataclass(frozen=True)
class Result:
    """A style's result with only what the sheet shows."""

    name: str = "left-loop"
    title: str = "Loop"
    side: str = "left"
    turn_refined_deg: float = 53.2
    match_curve: tuple[float, ...] = tuple(np.linspace(-20.0, 100.0, 64))
    match: float = 88.0
    strength: float = 55.0
    attainable: bool = True
    reason: str | None = None
    arc_deg: tuple[float, float] = (39.0, 71.0)


LOST = Result(
    "top",
    "Top",
    "none",
    attainable=False,
    match=14.0,
    reason="No strong light from above: match 14",
)


def is_amber(pixels: np.ndarray) -> np.ndarray:
    """Where a picture shows full amber, (H, W) bool."""
    return np.asarray((np.abs(pixels.astype(int) - AMBER) <= 6).all(axis=-1))


def head(size: int = 40, value: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Make a disc as a picture (N, N, 3) and its coverage (N, N)."""
    y, x = np.mgrid[:size, :size] - (size - 1) / 2.0
    coverage = np.clip(0.4 * size - np.hypot(x, y) + 0.5, 0.0, 1.0).astype(np.float32)
    tone = np.array([1.0, 0.7, 0.5], np.float32) * np.float32(value)
    return coverage[..., None] * tone, coverage


def data_of(result: Result) -> card.CardData:
    """Make a card's data with the same picture twice."""
    picture, coverage = head()
    return card.CardData(result, picture, picture * np.float32(3.0), coverage, PLACES, 45.0)


def sheet_of(results: list[Result], **more: object) -> np.ndarray:
    """Draw a sheet of a plain place."""
    picture, coverage = head()
    radiance = np.full((32, 64, 3), 0.3, np.float32)
    radiance[:16] = 1.0
    named = {result.name: picture for result in results}
    return draw_sheet(
        results,
        named,
        named,
        coverage,
        from_radiance(radiance, "hall"),
        "Hall",
        "generic",
        **more,  # type: ignore[arg-type]
    )


def test_sheet_has_a_fixed_width_and_grows_with_the_cards() -> None:
    few = sheet_of([Result()])
    many = sheet_of([dataclasses.replace(Result(), name=f"s{i}") for i in range(7)])
    assert few.dtype == np.uint8
    assert few.shape[1] == many.shape[1] == 1680 * SCALE
    assert many.shape[0] > few.shape[0] + 200 * SCALE
    assert few.nbytes < 100e6


def test_sheet_without_styles_or_reach_is_still_drawn() -> None:
    assert sheet_of([]).shape[1] == 1680 * SCALE
    assert sheet_of([LOST]).std() > 0.0


def test_order_is_in_reach_by_match_then_out_of_reach() -> None:
    results = [LOST, Result(match=50.0), Result(name="right-loop", side="right", match=90.0)]
    assert (sheet_of(results) == sheet_of(results[::-1])).all()


def test_unknown_pictures_are_an_error() -> None:
    picture, coverage = head()
    place_ = from_radiance(np.ones((8, 16, 3), np.float32), "hall")
    with pytest.raises(KeyError):
        draw_sheet([Result()], {}, {"left-loop": picture}, coverage, place_, "Hall", "generic")


def test_amber_is_for_turns_only() -> None:
    # Two patches of amber are not turns: half the logo's disc, and nothing else.
    lost = sheet_of([LOST])
    rows, _ = np.nonzero(is_amber(lost))
    assert rows.size > 0
    assert rows.max() < 80 * SCALE
    assert is_amber(sheet_of([Result()]))[700 * SCALE :].any()


def test_the_theme_is_neutral() -> None:
    lost = sheet_of([LOST])[760 * SCALE :]
    # Cards out of reach have no colour at all: equal red, green and blue everywhere.
    assert (lost.max(axis=-1) == lost.min(axis=-1)).all()


@pytest.mark.parametrize("length", [1, 8, 30])
def test_reasons_are_never_clipped(length: int) -> None:
    words = " ".join(["light"] * length)
    result = dataclasses.replace(LOST, reason=words)
    height = card.height_of(data_of(result), LETTERS)
    lines = LETTERS.wrap(words, 12, 132)
    assert " ".join(lines) == words
    assert all(LETTERS.width(line, 12) <= 132 for line in lines)
    # Room from the first line's baseline to the numbers at the foot.
    assert height - 44 - (card._BLOCK_TOP + 24) >= 16 * len(lines) - 1e-9
    canvas = Canvas(card.WIDTH, height, BG)
    card.draw_card(canvas, (0.0, 0.0), height, data_of(result), LETTERS)
    # Nothing but the card's panel in the strip beside its lower edge.
    strip = canvas.pixels[-9 * SCALE : -2 * SCALE, 20 * SCALE : -20 * SCALE]
    assert (strip == PANEL).all()


def test_cards_in_reach_show_amber_and_others_grey_pictures() -> None:
    for result in (Result(), LOST):
        canvas = Canvas(card.WIDTH, 320, BG)
        card.draw_card(canvas, (0.0, 0.0), 320, data_of(result), LETTERS)
        face = canvas.pixels[68 * SCALE, 68 * SCALE].astype(int)
        assert is_amber(canvas.pixels).any() == result.attainable
        assert (np.ptp(face) > 10) == result.attainable


def test_pictures_are_compared_at_the_same_exposure() -> None:
    picture, coverage = head()
    one = pictures.portrait(picture, coverage, (80, 80))
    other = pictures.portrait(picture * np.float32(37.0), coverage, (80, 80))
    np.testing.assert_allclose(one, other, atol=2e-3)
    assert colour.luminance(one)[40, 40] == pytest.approx(0.62, abs=0.06)


def test_portraits_lie_on_the_wells_grey_with_clean_edges() -> None:
    picture, coverage = head(value=1.0)
    shown = pictures.portrait(picture, coverage, (120, 120))
    np.testing.assert_allclose(shown[0, 0], WELL[0] / 255.0, atol=1e-3)
    # From the middle outward red falls from skin to well without a dark or bright fringe.
    red = shown[60, 60:, 0]
    assert (np.diff(red) < 0.015).all()
    assert red.min() > WELL[0] / 255.0 - 0.02


def test_greying_keeps_the_background_and_darkens_the_head() -> None:
    picture, coverage = head()
    shown = pictures.portrait(picture, coverage, (80, 80))
    grey = pictures.greyed(shown)
    np.testing.assert_allclose(grey[0, 0], shown[0, 0], atol=1e-3)
    assert (np.ptp(grey, axis=2) == 0.0).all()
    assert grey[40, 40, 0] < 0.75 * colour.luminance(shown)[40, 40]


def test_panorama_comes_round_to_the_front() -> None:
    radiance = np.full((32, 64, 3), 0.1, np.float32)
    radiance[10:20, 48] = 5.0  # azimuth +90
    shown = pictures.panorama(from_radiance(radiance, "hall"), 90.0, (64, 128))
    assert abs(int(np.argmax(shown[30, :, 0])) - 64) <= 2


def test_repaired_texels_are_filled_for_the_eye_only() -> None:
    radiance = np.full((32, 64, 3), 0.5, np.float32)
    radiance[10, 10] = -1.0
    environment = from_radiance(radiance, "hall")
    shown = pictures.panorama(environment, 0.0, (32, 64))
    assert np.ptp(shown) < 0.01
    assert environment.radiance[10, 10].max() == 0.0


TURNS = st.lists(st.floats(-179.9, 180.0), min_size=0, max_size=18)


@given(TURNS)
@settings(max_examples=50, deadline=None)
def test_flags_never_collide(turns: list[float]) -> None:
    results = [
        Result(f"s{i}", "Below side", "left", turn_refined_deg=turn) for i, turn in enumerate(turns)
    ]
    flags = place.make_flags(results, {}, LETTERS)
    assert len(flags) == len(turns)
    for one, other in itertools.permutations(flags, 2):
        start, stop = one.x, one.x + place.flag_width(one, LETTERS)
        if one.lane == other.lane:
            assert other.x > stop or other.x + place.flag_width(other, LETTERS) < start
        # A pole that ends further down does not run through these words.
        elif other.lane > one.lane and other.x != one.x:
            assert not start < other.x < stop
    assert place.lanes_height(flags) >= 20.0 * len({flag.lane for flag in flags})


def test_flags_stand_at_their_turns_and_only_for_what_is_in_reach() -> None:
    flags = place.make_flags([Result(turn_refined_deg=0.0), LOST], {}, LETTERS)
    (flag,) = flags
    assert flag.x == place.WIDTH / 2.0
    assert (flag.turn, flag.title, flag.side) == ("0°", "Loop", "sitter’s left")


@pytest.mark.parametrize(
    ("turn", "expected"),
    [
        (96.4, ("96°", "clockwise")),
        (-96.4, ("96°", "counter-clockwise")),
        (180.0, ("180°", "clockwise")),
        (0.4, ("0°", "no turn needed")),
        (-0.4, ("0°", "no turn needed")),
    ],
)
def test_turn_words(turn: float, expected: tuple[str, str]) -> None:
    assert turn_words(turn) == expected


def test_words() -> None:
    assert arc_words((170.0, -160.2)) == "170° to −160°"
    assert head_words("female") == "Female head"
    assert head_words("generic-light") == "Generic head, light skin"
    assert head_words("my-head") == "Head my-head"
    assert side_words(Result(), {}) == "sitter’s left (camera right)"
    assert side_words(LOST, PLACES) == "from overhead"
    assert side_words(LOST, {}) == ""


def test_lettering_is_inter_and_kerned() -> None:
    assert Path(LETTERS._folder / "Inter-Bold.otf").is_file()
    apart = LETTERS.width("T", 100) + LETTERS.width("o", 100)
    assert LETTERS.width("To", 100) == pytest.approx(apart - 7.5, abs=1.0)
    assert LETTERS.width("", 12) == 0.0
    canvas = Canvas(100, 30, BG)
    end = LETTERS.draw(canvas, (10, 20), "96°", 16, 700, TEXT)
    assert end == pytest.approx(10 + LETTERS.width("96°", 16, 700))
    levels = np.unique(canvas.pixels)
    assert levels.size > 10, "letters have smooth edges"
    columns = np.nonzero((canvas.pixels[..., 0] > 0x60).any(axis=0))[0] / SCALE
    assert 10 <= columns.min() <= 13
    assert end - 4 <= columns.max() <= end + 1


def test_letters_of_one_weight_never_show_up_in_another() -> None:
    # OpenCV mixes glyphs up when faces are released and loaded again.
    def drawn() -> np.ndarray:
        letters, canvas = Lettering(), Canvas(200, 60, BG)
        letters.draw(canvas, (10, 20), "Light", 16, 400)
        letters.draw(canvas, (10, 50), "Light", 16, 700)
        return canvas.pixels

    first = drawn()
    for _ in range(5):
        assert (drawn() == first).all()
    regular, bold = first[: 30 * SCALE], first[30 * SCALE :]
    assert bold.astype(float).sum() > regular.astype(float).sum() * 1.02


def test_missing_fonts_fall_back_to_the_built_in_one(tmp_path: Path) -> None:
    assert Lettering(tmp_path).width("96°", 16) > 10


def test_long_names_get_an_ellipsis() -> None:
    short = LETTERS.shorten("A place with a very long name", 16, 100)
    assert short.endswith("…")
    assert LETTERS.width(short, 16) <= 100
    assert LETTERS.shorten("Hall", 16, 100) == "Hall"


def test_shapes_have_the_area_that_they_should() -> None:
    canvas = Canvas(60, 60, (0, 0, 0))
    canvas.dot((30.25, 29.75), 20.0, (200, 200, 200))
    area = canvas.pixels[..., 0].sum() / 200.0 / SCALE**2
    assert area == pytest.approx(np.pi * 400, rel=0.01)
    canvas = Canvas(60, 60, (0, 0, 0))
    canvas.panel((10, 10, 40, 30), (200, 200, 200), 8.0)
    area = canvas.pixels[..., 0].sum() / 200.0 / SCALE**2
    assert area == pytest.approx(1200 - (4 - np.pi) * 64, rel=0.01)


def test_shapes_are_cut_at_the_edge_of_the_canvas() -> None:
    canvas = Canvas(20, 20, (0, 0, 0))
    canvas.dot((0.0, 0.0), 8.0, TEXT)
    canvas.stroke([(-50.0, 10.0), (50.0, 10.0)], TEXT, 2.0)
    canvas.dot((500.0, 500.0), 8.0, TEXT)
    assert canvas.pixels[0, 0, 0] == TEXT[0]
    assert canvas.pixels[-1, -1, 0] == 0


def test_dashes_leave_gaps() -> None:
    whole, dashed = Canvas(80, 80, (0, 0, 0)), Canvas(80, 80, (0, 0, 0))
    whole.stroke(circle_points((40, 40), 30), TEXT, 1.0)
    dashed.dashes(circle_points((40, 40), 30, 400), TEXT, 1.0, 2.0, 3.0)
    share = dashed.pixels.astype(float).sum() / whole.pixels.sum()
    assert 0.3 < share < 0.75


@pytest.mark.parametrize(("turn", "dx", "dy"), [(0, 0, -1), (90, 1, 0), (180, 0, 1), (-90, -1, 0)])
def test_polar_plot_has_clockwise_to_the_right(turn: float, dx: int, dy: int) -> None:
    canvas = Canvas(100, 100, PANEL)
    plot.polar(canvas, (50, 50), 40, [10.0] * 64, turn, (turn - 5.0, turn + 5.0), 45.0)
    rows, columns = np.nonzero(is_amber(canvas.pixels))
    where = np.array([columns.mean(), rows.mean()]) / SCALE - 50.0
    assert where @ (dx, dy) > 10.0
    assert abs(where @ (dy, dx)) < 2.0


@pytest.mark.parametrize(
    ("match", "share"), [(-5, 0.0), (0, 0.0), (50, 0.5), (100, 1.0), (120, 1.0)]
)
def test_meter_is_filled_in_proportion(match: float, share: float) -> None:
    canvas = Canvas(220, 20, PANEL)
    plot.meter(canvas, (10, 8, 200, 4), match, 45.0, TEXT)
    row = canvas.pixels[10 * SCALE, 10 * SCALE : 210 * SCALE, 0]
    # The tick and the gaps beside it take 4 of the 200 px.
    assert (row == TEXT[0]).mean() == pytest.approx(share, abs=0.025)
    above = canvas.pixels[6 * SCALE, :, 0]
    tick = np.nonzero(above == TEXT[0])[0].mean() / SCALE
    assert tick == pytest.approx(10 + 0.45 * 200, abs=0.5)
