"""The result sheet: what is drawn where, in which colour, and that no words are lost."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.base import colour
from app.core.base.arrays import Bytes
from app.core.environment.environment import from_radiance
from app.core.portrait import display_pictures as pictures
from app.core.portrait.display_pictures import WELL
from app.core.solver.shortfall import Cause, LightShortfall, Origin, SavedReason
from app.core.solver.style_result import StyleResult
from app.export import result_card as card
from app.export import result_sheet as sheet
from app.export.canvas import SCALE, Page, text_width, wrap_text
from app.export.theme import Dark, draw_meter
from app.words.phrases.directions import SIDES
from app.words.portrait.heads import head_words
from benchmarks.speed.plain_portrait import portrait

pytestmark = pytest.mark.usefixtures("qapp")

PLACES = {"top": "from overhead"}


def result_of(
    name: str = "left-loop", title: str = "Loop", side: str = "left", **changes: Any
) -> StyleResult:
    """Make a style's result; only what the sheet shows matters."""
    curve = np.linspace(-20.0, 100.0, 64)
    plain = StyleResult(
        name=name,
        title=title,
        side=side,
        turn_index=9,
        turn_deg=50.625,
        turn_refined_deg=53.2,
        direction="clockwise",
        quality_curve=curve,
        match_curve=curve,
        strength_curve=curve,
        quality=1.0,
        match=88.0,
        strength=55.0,
        attainable=True,
        arc_deg=(39.0, 71.0),
        peaks=(),
    )
    return dataclasses.replace(plain, **changes)


LOST = result_of(
    "top",
    "Top",
    "none",
    attainable=False,
    match=14.0,
    shortfall=LightShortfall(Cause.NO_LIGHT, "match", 14.0, 45.0, Origin.ABOVE),
)


def is_amber(pixels: np.ndarray) -> np.ndarray:
    """Where a picture shows full amber, (H, W) bool."""
    return np.asarray((np.abs(pixels.astype(int) - Dark.AMBER) <= 6).all(axis=-1))


def head(size: int = 40, value: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Make a disc as a picture (N, N, 3) and its coverage (N, N)."""
    y, x = np.mgrid[:size, :size] - (size - 1) / 2.0
    coverage = np.clip(0.4 * size - np.hypot(x, y) + 0.5, 0.0, 1.0).astype(np.float32)
    tone = np.array([1.0, 0.7, 0.5], np.float32) * np.float32(value)
    return coverage[..., None] * tone, coverage


def data_of(result: StyleResult) -> card.CardData:
    """Make a card's data with the same picture twice."""
    return card.CardData(result, lambda size: drawn(result.name, size), PLACES, 45.0)


def drawn(_name: str, size: tuple[int, int]) -> list[Bytes]:
    """Show the same picture twice."""
    picture, coverage = head()
    return [colour.to_bytes(portrait(picture, coverage, size))] * 2


def sheet_of(results: list[StyleResult], **more: object) -> np.ndarray:
    """Draw a sheet of a plain sheet."""
    radiance = np.full((32, 64, 3), 0.3, np.float32)
    radiance[:16] = 1.0
    return sheet.draw_sheet(
        results,
        drawn,
        from_radiance(radiance, "hall"),
        "Hall",
        "generic",
        **more,  # type: ignore[arg-type]
    )


def test_sheet_has_a_fixed_width_and_grows_with_the_cards() -> None:
    few = sheet_of([result_of()])
    many = sheet_of([dataclasses.replace(result_of(), name=f"s{i}") for i in range(7)])
    assert few.dtype == np.uint8
    assert few.shape[1] == many.shape[1] == 1680 * SCALE
    assert many.shape[0] > few.shape[0] + 200 * SCALE
    assert few.nbytes < 100e6


def test_sheet_without_styles_or_reach_is_still_drawn() -> None:
    assert sheet_of([]).shape[1] == 1680 * SCALE
    assert sheet_of([LOST]).std() > 0.0


def test_verdict_is_written_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = "Strong light on the left, high. Best: right Rembrandt, loop, split. No deep shadows."
    written, write = [], Page.text

    def note(page: Page, at: Any, text: str, *more: Any, **options: Any) -> float:
        written.append(text)
        return write(page, at, text, *more, **options)

    monkeypatch.setattr(Page, "text", note)
    for results in ([result_of()], [LOST]):
        written.clear()
        sheet_of(results)
        assert verdict not in " ".join(written)
        sheet_of(results, verdict=verdict)
        assert verdict in " ".join(written)


def test_order_is_in_reach_by_match_then_out_of_reach() -> None:
    results = [LOST, result_of(match=50.0), result_of(name="right-loop", side="right", match=90.0)]
    assert (sheet_of(results) == sheet_of(results[::-1])).all()


def test_a_style_that_is_rarely_wanted_alone_is_not_called_the_best() -> None:
    asked = []

    def noted(name: str, size: tuple[int, int]) -> list[Bytes]:
        asked.append((name, size))
        return drawn(name, size)

    top = result_of(name="top", side="none", match=95.0)
    place = from_radiance(np.ones((8, 16, 3), np.float32), "hall")
    sheet.draw_sheet([top, LOST, result_of(match=80.0)], noted, place, "Hall", "generic")
    large = max(size for _, size in asked)
    assert [name for name, size in asked if size == large] == ["left-loop"]
    assert [name for name, size in asked if size != large] == ["left-loop", "top", LOST.name]


@pytest.mark.slow
def test_amber_is_for_turns_only() -> None:
    # Two patches of amber are not turns: half the logo's disc, and nothing else.
    lost = sheet_of([LOST])
    rows, _ = np.nonzero(is_amber(lost))
    assert rows.size > 0
    assert rows.max() < 80 * SCALE
    assert is_amber(sheet_of([result_of()]))[700 * SCALE :].any()


def test_the_theme_is_neutral() -> None:
    lost = sheet_of([LOST])[760 * SCALE :]
    # Cards out of reach have no colour at all: equal red, green and blue everywhere.
    assert (lost.max(axis=-1) == lost.min(axis=-1)).all()


@pytest.mark.parametrize("length", [1, 8, 30])
def test_reasons_are_never_clipped(length: int) -> None:
    words = " ".join(["light"] * length)
    result = dataclasses.replace(LOST, shortfall=SavedReason(words))
    height = card.height_of(data_of(result))
    lines = wrap_text(words, 12, 132)
    assert " ".join(lines) == words
    assert all(text_width(line, 12) <= 132 for line in lines)
    # Room from the first line's baseline to the numbers at the foot.
    assert height - 44 - (card._BLOCK_TOP + 24) >= 16 * len(lines) - 1e-9
    canvas = Page(card.WIDTH, height, Dark.BG)
    card.draw_card(canvas, (0.0, 0.0), height, data_of(result))
    # Nothing but the card's panel in the strip beside its lower edge.
    strip = canvas.pixels[-9 * SCALE : -2 * SCALE, 20 * SCALE : -20 * SCALE]
    assert (strip == Dark.PANEL).all()


def test_cards_in_reach_show_amber_and_others_grey_pictures() -> None:
    for result in (result_of(), LOST):
        canvas = Page(card.WIDTH, 320, Dark.BG)
        card.draw_card(canvas, (0.0, 0.0), 320, data_of(result))
        face = canvas.pixels[68 * SCALE, 68 * SCALE].astype(int)
        assert is_amber(canvas.pixels).any() == result.attainable
        assert (np.ptp(face) > 10) == result.attainable


def test_pictures_are_compared_at_the_same_exposure() -> None:
    picture, coverage = head()
    one = portrait(picture, coverage, (80, 80))
    other = portrait(picture * np.float32(37.0), coverage, (80, 80))
    np.testing.assert_allclose(one, other, atol=2e-3)
    assert colour.luminance(one)[40, 40] == pytest.approx(0.62, abs=0.06)


def test_portraits_lie_on_the_wells_grey_with_clean_edges() -> None:
    picture, coverage = head(value=1.0)
    shown = portrait(picture, coverage, (120, 120))
    np.testing.assert_allclose(shown[0, 0], WELL[0] / 255.0, atol=1e-3)
    # From the middle outward red falls from skin to well without a dark or bright fringe.
    red = shown[60, 60:, 0]
    assert (np.diff(red) < 0.015).all()
    assert red.min() > WELL[0] / 255.0 - 0.02


def test_greying_keeps_the_background_and_darkens_the_head() -> None:
    picture, coverage = head()
    shown = portrait(picture, coverage, (80, 80))
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
        result_of(f"s{i}", "Below side", "left", turn_refined_deg=turn)
        for i, turn in enumerate(turns)
    ]
    flags = sheet.make_flags(results)
    assert len(flags) == len(turns)
    for one, other in itertools.permutations(flags, 2):
        start, stop = one.x, one.x + sheet.flag_width(one)
        if one.lane == other.lane:
            assert other.x > stop or other.x + sheet.flag_width(other) < start
        # A pole that ends further down does not run through these words.
        elif other.lane > one.lane and other.x != one.x:
            assert not start < other.x < stop
    assert sheet.lanes_height(flags) >= 20.0 * len({flag.lane for flag in flags})


def test_flags_stand_at_their_turns_and_only_for_what_is_in_reach() -> None:
    flags = sheet.make_flags([result_of(turn_refined_deg=0.0), LOST])
    (flag,) = flags
    assert flag.x == sheet._PANORAMA_WIDTH / 2.0
    assert (flag.turn, flag.title, flag.side) == ("0°", "Loop", "sitter’s left")


def test_words() -> None:
    assert head_words("female") == "Female head"
    assert head_words("generic-light") == "Generic head, light skin"
    assert head_words("my-head") == "Head my-head"
    assert card.side_of(result_of(), {}) == SIDES["left"]
    assert card.side_of(LOST, PLACES) == "from overhead"
    assert card.side_of(LOST, {}) == ""


@pytest.mark.parametrize(("turn", "dx", "dy"), [(0, 0, -1), (90, 1, 0), (180, 0, 1), (-90, -1, 0)])
def test_polar_plot_has_clockwise_to_the_right(turn: float, dx: int, dy: int) -> None:
    canvas = Page(100, 100, Dark.PANEL)
    card._draw_polar(canvas, (50, 50), 40, [10.0] * 64, turn, (turn - 5.0, turn + 5.0), 45.0)
    rows, columns = np.nonzero(is_amber(canvas.pixels))
    where = np.array([columns.mean(), rows.mean()]) / SCALE - 50.0
    assert where @ (dx, dy) > 10.0
    assert abs(where @ (dy, dx)) < 2.0


@pytest.mark.parametrize(
    ("match", "share"), [(-5, 0.0), (0, 0.0), (50, 0.5), (100, 1.0), (120, 1.0)]
)
def test_meter_is_filled_in_proportion(match: float, share: float) -> None:
    canvas = Page(220, 20, Dark.PANEL)
    colours = (Dark.TEXT, Dark.TRACK, Dark.PANEL)
    draw_meter(canvas, (10, 8, 200, 4), match, 45.0, colours)
    row = canvas.pixels[10 * SCALE, 10 * SCALE : 210 * SCALE, 0]
    # The tick and the gaps beside it take 4 of the 200 px.
    assert (row == Dark.TEXT[0]).mean() == pytest.approx(share, abs=0.025)
    above = canvas.pixels[6 * SCALE, :, 0]
    tick = np.nonzero(above == Dark.TEXT[0])[0].mean() / SCALE
    assert tick == pytest.approx(10 + 0.45 * 200, abs=0.5)
