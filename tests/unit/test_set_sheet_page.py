"""The set sheet: what is drawn where, left and right, clockwise, and that no words are lost."""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.angles import at_turn
from app.core.base.colour import FloatImage, luminance
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce, reduce_light, reduce_radiance
from app.core.measure.finish.findings import find
from app.core.portrait.ratio_and_glare import Glare, LightingRatio
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from app.core.text import set_language
from app.export import set_page as strip
from app.export import set_plan as plan
from app.export.canvas import SCALE, Anchor, Colour, Page, Point, Weight, text_width
from app.export.set_page import (
    ANY_TURN,
    HEIGHT,
    OUT_OF_REACH,
    PLAN_AT,
    STAY,
    STRIP_AT,
    WIDTH,
    draw,
    draw_page,
)
from app.export.set_sheet import SetSheet, SheetLamp, assemble, lamps_of
from app.export.theme import Print
from app.words.portrait.face_light import glare_sentence
from tests.helpers.pace import units
from tests.helpers.synthetic import lamp_environment

pytestmark = pytest.mark.usefixtures("qapp")

DEMO = resources() / "demo"
GREY = np.full((64, 128, 3), 96, np.uint8)
RATIO = LightingRatio(2.0, "left")
GLARE = Glare("strong", 12.0, 30.0, 0.3, "sun")


def disc(size: tuple[int, int]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    rows, columns = np.mgrid[: size[0], : size[1]] - np.reshape(size, (2, 1, 1)) / 2
    near = np.hypot(rows, columns) < 0.4 * min(size)
    picture = np.repeat(near[..., None], 3, axis=2).astype(np.uint8) * np.uint8(188)
    return picture, picture


def assembled(
    result: StyleResult, transport: Transport, radiance: FloatImage, turn_deg: float | None = None
) -> SetSheet:
    turn = result.turn_refined_deg if turn_deg is None else turn_deg
    lit = reduce_light(radiance, transport.environment_shape, turn)
    return assemble(
        result,
        transport,
        radiance,
        place="x",
        face_picture=lit,
        draw=lambda _, size: disc(size),
        turn_deg=turn_deg,
    )


def sheet_of(**changes: Any) -> SetSheet:
    plain = SetSheet(
        title="Rembrandt",
        side="left",
        turn_deg=96.2,
        arc_deg=(79.0, 111.0),
        match=88.9,
        strength=55.5,
        panorama=GREY,
        place="North studio",
        draw=disc,
        ratio=RATIO,
        made_text="21 Nov 2026, 14:05",
        age="Measured 25 min ago, the sun has moved 6 degrees: capture again.",
        head="Generic head, medium skin",
    )
    return dataclasses.replace(plain, **changes)


class Listening(Page):
    """A page that remembers its words and where they end."""

    def __init__(self) -> None:
        super().__init__(WIDTH, HEIGHT, Print.PAPER)
        self.words: list[tuple[str, float, float, float]] = []

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
        end = super().text(at, text, size, weight, colour, anchor, room)
        wide = min(text_width(text, size, weight), room)
        self.words.append((text, end - wide, end, at[1]))
        return end


def written(sheet: SetSheet) -> list[tuple[str, float, float, float]]:
    """What a page says: words, where they start and end, and their baseline."""
    canvas = Listening()
    draw_page(canvas, sheet)
    return canvas.words


def said(sheet: SetSheet) -> str:
    return " ".join(word[0] for word in written(sheet))


def near(page: NDArray[np.uint8], place: tuple[float, float], colour: Colour, reach: float) -> int:
    """How many pixels around a place have a colour."""
    x, y = (round(value * SCALE) for value in place)
    r = round(reach * SCALE)
    patch = page[max(y - r, 0) : y + r, max(x - r, 0) : x + r].astype(int)
    return int((np.abs(patch - colour).max(axis=-1) <= 8).sum())


CENTRE = plan.centre_of(PLAN_AT)


def test_the_page_is_a4_and_white() -> None:
    page = draw(sheet_of())
    assert page.shape == (round(HEIGHT * SCALE), round(WIDTH * SCALE), 3)
    assert pytest.approx((210.0, 297.0), abs=0.15) == (WIDTH / 96 * 25.4, HEIGHT / 96 * 25.4)
    assert (page[:60] == Print.PAPER).all()
    assert (page[:, :60] == Print.PAPER).all()


def test_it_says_the_turn_the_side_and_the_rest() -> None:
    words = said(sheet_of())
    for text in (
        "Rembrandt",
        "Light from the sitter’s left (camera right)",
        "96°",
        "clockwise",
        "towards 3 o’clock",
        "Walk to your left, around the sitter.",
        "Good from 79° to 111°.",
        "88 of 100",
        ", contrast 55% of the studio’s",
        "2.0 stops, 4:1 (key plus fill : fill),",
        "North studio",
        "21 Nov 2026, 14:05",
        "Measured 25 min ago, the sun has moved 6 degrees: capture again.",
        "Here, 96° clockwise",
        "Behind the sitter",
        "Background of the picture",
        "Generic head, medium skin.",
    ):
        assert text in words, text


def test_counter_clockwise_is_to_the_right_and_on_the_other_side() -> None:
    words = said(sheet_of(turn_deg=-96.2, arc_deg=(-111.0, -79.0), side="right"))
    for text in (
        "counter-clockwise",
        "towards 9 o’clock",
        "Walk to your right, around the sitter.",
        "Light from the sitter’s right (camera left)",
        "Good from −111° to −79°.",
    ):
        assert text in words, text


@pytest.mark.parametrize("turn", [96.0, -96.0, 45.0, -150.0, 180.0])
def test_the_photographer_walks_around_the_plan(turn: float) -> None:
    page = draw(sheet_of(turn_deg=turn, arc_deg=(turn - 10, turn + 10)))
    # Turn 0 is up and clockwise to the right, as on a clock.
    spot = at_turn(CENTRE, plan.RADIUS, turn)
    assert (spot[0] > CENTRE[0]) == (0 < turn < 180)
    assert near(page, spot, Print.INK, 5.0) > 300
    # Where they stood there is no black camera.
    assert near(page, at_turn(CENTRE, plan.RADIUS, 0.0), Print.INK, 5.0) == 0
    # The walk is drawn the way it goes, and not the other way round.
    assert near(page, at_turn(CENTRE, plan.RADIUS, 0.6 * turn), Print.AMBER, 3.0) > 20
    if abs(turn) < 180:
        assert near(page, at_turn(CENTRE, plan.RADIUS, -0.6 * turn), Print.AMBER, 3.0) == 0


@pytest.mark.parametrize("turn", [90.0, -90.0, 30.0])
def test_the_sitter_faces_the_photographer(turn: float) -> None:
    page = draw(sheet_of(turn_deg=turn, arc_deg=(turn - 2, turn + 2)))
    # The nose sticks out of the head towards the photographer and nowhere else.
    assert near(page, at_turn(CENTRE, 31.0, turn), Print.INK, 2.0) > 8
    assert near(page, at_turn(CENTRE, 31.0, turn + 180.0), Print.INK, 2.0) == 0
    assert near(page, at_turn(CENTRE, 31.0, -turn), Print.INK, 2.0) == 0


@pytest.mark.parametrize(("turn", "yaw"), [(96.2, 30.0), (-60.0, -45.0), (0.0, 15.0)])
def test_nose_and_lens_are_two_where_the_face_is_turned_aside(turn: float, yaw: float) -> None:
    sheet = sheet_of(turn_deg=turn, arc_deg=(turn - 2, turn + 2), yaw_deg=yaw)
    page, nose = draw(sheet), round(turn) - yaw
    # The head and its arrow point to the nose's turn, the camera and its line stand at the lens's.
    assert near(page, at_turn(CENTRE, 31.0, nose), Print.INK, 2.0) > 8
    assert near(page, at_turn(CENTRE, 50.0, nose), Print.INK, 3.0) > 12
    assert near(page, at_turn(CENTRE, 50.0, turn - 2.0 * yaw), Print.INK, 3.0) == 0
    assert near(page, at_turn(CENTRE, plan.RADIUS, turn), Print.INK, 5.0) > 300
    assert near(page, at_turn(CENTRE, 60.0, turn), Print.INK, 5.0) > 8
    words, size = written(sheet), abs(round(yaw))
    stand, point = ("right", "left") if yaw > 0 else ("left", "right")
    told = " ".join(word[0] for word in words)
    assert f"Stand {size}° to the sitter’s {stand} of their nose." in told
    assert f"“Nose {size}° to your {point}, eyes to me.”" in told
    assert "faces you" not in told
    assert "You and the sitter" not in told
    # The panorama names it where it is, between the marks of the photographer.
    (tag,) = [word for word in words if word[0] == "The nose points here"]
    assert (tag[1] + tag[2]) / 2.0 == pytest.approx(STRIP_AT[0] + strip.x_of(nose), abs=1.0)
    middle = STRIP_AT[1] + 0.4 * strip.STRIP_HEIGHT
    assert near(page, (STRIP_AT[0] + strip.x_of(nose), middle), Print.ON_TAG, 4.0) > 30


def test_the_facts_at_a_yaw_stay_in_their_column() -> None:
    reason = "Light only from one side, and far too little of it to be of any use"
    for words in (
        written(sheet_of(yaw_deg=-30.0, glare=GLARE, reason=reason)),
        written(sheet_of(yaw_deg=30.0, glare=GLARE)),
    ):
        left = [word for word in words if word[1] < PLAN_AT[0] and 260 < word[3] < 515]
        assert max(word[2] for word in left) < PLAN_AT[0]
        assert max(word[3] for word in left) < 500.0


def test_light_falls_by_the_nose_and_into_eyes_that_look_at_the_lens() -> None:
    light = lamp_environment(20.0, 10.0, shape=(128, 256))
    radiance = np.repeat(light[..., None], 3, axis=2).astype(np.float32) + np.float32(0.001)
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    straight = solve_all(pack, luminance(reduce_radiance(radiance)), styles=["butterfly"])[0]
    aside = dataclasses.replace(straight.seen_from(-30.0), yaw_deg=30.0)
    before, after = (assembled(one, transport, radiance) for one in (straight, aside))
    assert after.yaw_deg == 30.0
    assert after.turn_deg == pytest.approx(before.turn_deg + 30.0)
    flows = [one.flow.azimuth_deg for one in (before, after) if one.flow]
    assert flows[1] == pytest.approx(flows[0], abs=0.1)
    # From the lens, 30 deg clockwise of the nose, the lamp is as much farther to their left.
    glares = [one.glare.azimuth_deg for one in (before, after) if one.glare]
    assert glares[1] == pytest.approx(glares[0] + 30.0, abs=1.5)


@pytest.mark.parametrize(("front", "azimuth"), [(0.0, 90.0), (0.0, -60.0), (-40.0, 60.0)])
def test_a_lamp_is_drawn_where_it_is(front: float, azimuth: float) -> None:
    lamp = SheetLamp("A", azimuth, 10.0, 0.5)
    page = draw(sheet_of(turn_deg=10.0, arc_deg=(5, 15), front_deg=front, lamps=(lamp,)))
    turn = azimuth - front
    assert near(page, at_turn(CENTRE, plan.RING, turn), Print.AMBER_FILL, 8.0) > 300
    assert near(page, at_turn(CENTRE, plan.RING, -turn), Print.AMBER_FILL, 8.0) == 0
    x = STRIP_AT[0] + strip.x_of(turn)
    y = STRIP_AT[1] + strip.STRIP_HEIGHT * (strip.TOP_DEG - 10.0) / (
        strip.TOP_DEG - strip.BOTTOM_DEG
    )
    assert near(page, (x, y), Print.AMBER_FILL, 8.0) > 300


def test_lamps_of_one_direction_stand_in_a_row_the_strongest_outside() -> None:
    lamps = tuple(
        SheetLamp(name, azimuth, 10.0, 0.3)
        for name, azimuth in (("A", 150.0), ("B", 151.0), ("C", 160.0), ("D", -100.0))
    )
    sheet = sheet_of(turn_deg=10.0, arc_deg=(5, 15), lamps=lamps)
    stands = plan._stands(sheet)
    assert [turn for turn, _ in stands] == [150.0, 151.0, 160.0, -100.0]
    spots = [at_turn(CENTRE, radius, turn) for turn, radius in stands]
    # No disc, 19 across, covers another.
    assert min(math.dist(one, two) for one, two in combinations(spots, 2)) >= 19.0
    assert stands[1][1] < stands[0][1] == stands[3][1] == plan.RING
    page = draw(sheet)
    assert all(near(page, spot, Print.AMBER_FILL, 8.0) > 200 for spot in spots)


def test_left_on_the_plan_is_the_sitters_left() -> None:
    # Split from the sitter's left with the lamp at azimuth 0: the turn is 90, and the sitter, who
    # then faces 3 o'clock, has 12 o'clock at their left.
    light = lamp_environment(0.0, 10.0, shape=(128, 256))
    radiance = np.repeat(light[..., None], 3, axis=2).astype(np.float32) + np.float32(0.001)
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    result = solve_all(pack, luminance(reduce_radiance(radiance)), styles=["left-split"])[0]
    sheet = assembled(result, transport, radiance)
    assert sheet.turn_deg == pytest.approx(90.0, abs=1.5)
    assert sheet.ratio is not None
    assert sheet.ratio.key_side == "left"
    (lamp,) = sheet.lamps
    assert lamp.azimuth_deg == pytest.approx(0.0, abs=1.0)
    page = draw(sheet)
    assert near(page, at_turn(CENTRE, plan.RING, 0.0), Print.AMBER_FILL, 8.0) > 300
    assert near(page, at_turn(CENTRE, plan.RADIUS, 90.0), Print.INK, 5.0) > 300


def test_the_background_is_what_lies_behind_the_sitter() -> None:
    # Azimuth 180 + 90 = -90 is painted green, all else is grey.
    panorama = np.full((128, 256, 3), 90, np.uint8)
    panorama[:, 32:96] = (20, 200, 20)
    sheet = sheet_of(turn_deg=90.0, panorama=panorama)
    view = strip.background(sheet, (50, 50))
    assert view.shape == (50, 50, 3)
    assert (view[..., 1] > 0.7).all()
    other = strip.background(dataclasses.replace(sheet, front_deg=180.0), (50, 50))
    assert (np.abs(other - 90 / 255) < 0.02).all()


def test_the_strip_has_the_front_in_its_middle() -> None:
    panorama = np.full((128, 256, 3), 90, np.uint8)
    panorama[:, 190:194] = (20, 200, 20)  # azimuth 90
    page = draw(sheet_of(turn_deg=0.0, arc_deg=(-5, 5), panorama=panorama, front_deg=60.0))
    spot = (STRIP_AT[0] + strip.x_of(30.0), STRIP_AT[1] + 60.0)
    assert near(page, spot, (20, 200, 20), 3.0) > 50


@pytest.mark.parametrize("turn", [90.0, -150.0])
def test_the_marks_on_the_strip(turn: float) -> None:
    page = draw(sheet_of(turn_deg=turn))
    middle = STRIP_AT[1] + 0.4 * strip.STRIP_HEIGHT
    x = STRIP_AT[0]
    assert near(page, (x + strip.x_of(turn), middle), Print.AMBER_FILL, 4.0) > 30
    assert near(page, (x + strip.x_of(-turn), middle), Print.AMBER_FILL, 4.0) == 0
    # The frame around the background: its left edge is 22.5 degrees beside the middle.
    assert near(page, (x + strip.x_of(turn + 180.0 - 22.5), middle), Print.AMBER_FILL, 4.0) > 5


def test_no_turn_needs_no_walk() -> None:
    words = said(sheet_of(turn_deg=0.2, arc_deg=(-180.0, 180.0)))
    assert "no turn needed" in words
    assert STAY in words
    assert ANY_TURN in words
    assert "o’clock" not in words


def test_warnings_and_reasons_are_there() -> None:
    words = said(sheet_of(glare=GLARE, reason="No light from beneath"))
    assert glare_sentence(GLARE) in words
    assert OUT_OF_REACH.format(reason="No light from beneath") in words
    assert "key on the" in words


def test_all_facts_at_once_stay_in_their_column() -> None:
    reason = "Light only from one side, and far too little of it to be of any use"
    words = written(sheet_of(glare=GLARE, reason=reason))
    left = [word for word in words if word[1] < PLAN_AT[0] and 260 < word[3] < 505]
    assert left
    assert max(word[2] for word in left) < PLAN_AT[0]
    assert max(word[3] for word in left) < 500.0


@pytest.mark.parametrize("turn", [179.7, -179.2, -134.5, 8.0])
def test_the_large_figures_stay_beside_the_plan(turn: float) -> None:
    words = written(sheet_of(turn_deg=turn))
    top = [word for word in words if word[1] < PLAN_AT[0] and 130 < word[3] < 215]
    assert len(top) >= 3
    assert max(word[2] for word in top) <= PLAN_AT[0] - 10.0


def test_verdict_is_on_one_line_between_panorama_and_notes() -> None:
    verdict = "Soft light behind, high. Best: flat, silhouette."
    assert verdict not in said(sheet_of())
    lines = {text: y for text, _, _, y in written(sheet_of(verdict=verdict, notes="Chair."))}
    assert lines["0°"] + 12.0 < lines[verdict] < lines["Chair."] - 12.0
    (long,) = (
        word for word in written(sheet_of(verdict="Best: " + "loop, " * 60)) if "loop" in word[0]
    )
    assert long[0].endswith("…")
    assert long[2] <= WIDTH - strip.MARGIN


def test_long_names_and_notes_stay_on_the_page() -> None:
    sheet = sheet_of(
        title="My own style with a name that goes on and on and on",
        place="A_very_long_name_of_a_place_" * 5,
        age="Measured 25 min ago, the sun has moved 6 degrees, up to 13 degrees along the horizon: "
        "capture again, and look whether the shadow of the house has come near.",
        notes="Chair one step from the window. " * 30,
    )
    words = written(sheet)
    assert min(word[1] for word in words) >= 40.0
    assert max(word[2] for word in words) <= WIDTH - 43.5


def test_words_of_a_longer_language_stay_in_their_places() -> None:
    set_language("test")
    try:
        words = written(
            sheet_of(glare=GLARE, reason="Too soft", lamps=(SheetLamp("A", 60.0, 30.0, 0.5),))
        )
    finally:
        set_language("en")
    beside = [word for word in words if word[1] < PLAN_AT[0] - 20.0 and 130 < word[3] < 520]
    assert max(word[2] for word in beside) <= PLAN_AT[0] - 10.0
    on_plan = [word for word in words if word[1] >= PLAN_AT[0] and 130 < word[3] < 520]
    assert max(word[2] for word in on_plan) <= PLAN_AT[0] + plan.WIDTH
    tags = sorted((word for word in words if 700.0 < word[3] < 735.0), key=lambda word: word[1])
    assert len(tags) == 3
    assert all(one[2] <= two[1] - 17.0 for one, two in pairwise(tags))
    foot = sorted((word for word in words if word[3] > HEIGHT - 40.0), key=lambda word: word[1])
    assert len(foot) == 2
    assert foot[0][2] < foot[1][1]


def test_only_lamps_that_matter_are_shown() -> None:
    small = [SheetLamp(name, 20.0 * k, 5.0, 0.01) for k, name in enumerate("CDE")]
    large = [SheetLamp(name, 60.0 * k, 5.0, 0.2) for k, name in enumerate("ABFGH")]
    sun = SheetLamp("S", 100.0, 40.0, 0.0001, sun=True)
    shown = sheet_of(lamps=(*large, *small, sun)).visible_lamps
    assert [lamp.name for lamp in shown] == ["S", "A", "B", "F"]


def test_lamps_of_an_environment() -> None:
    light = lamp_environment(70.0, 30.0, 5.0, (128, 256), fill=0.05).astype(np.float32)
    radiance = np.repeat(light[..., None], 3, axis=2)
    (lamp,) = lamps_of(find(radiance), sun=(70.5, 29.0))
    assert (lamp.azimuth_deg, lamp.elevation_deg) == pytest.approx((70.0, 30.0), abs=1.0)
    assert lamp.sun
    # Irradiance 1 of the lamp beside 4 pi 0.05 of the fill.
    assert lamp.share == pytest.approx(1.0 / (1.0 + 4.0 * math.pi * 0.05), abs=0.03)
    assert not lamps_of(find(radiance), sun=(-70.0, 30.0))[0].sun


@cache
def real_sheet(scene: str, style: str) -> SetSheet:
    pack = load_named_pack("generic")
    environment = read_environment(DEMO / scene)
    result = solve_all(pack, luminance(reduce(environment)), styles=[style])[0]
    return assembled(result, load_transport_of(pack, "generic"), environment.radiance)


@pytest.mark.parametrize(
    ("scene", "style"),
    [
        ("scenes/sunrise.exr", "butterfly"),
        ("scenes/interior.exr", "right-rim"),
        ("location/probe-3.exr", "left-rembrandt"),
    ],
)
def test_real_places_give_a_full_sheet(scene: str, style: str) -> None:
    sheet = real_sheet(scene, style)
    words = said(sheet)
    assert "key plus fill" in words
    assert sheet.panorama.shape[1] == 2 * sheet.panorama.shape[0] >= 1024
    assert sheet.lamps
    if style == "butterfly":
        assert "shines into the sitter’s" in words


def test_another_turn_has_its_own_numbers() -> None:
    pack = load_named_pack("generic")
    environment = read_environment(DEMO / "scenes" / "interior.exr")
    result = solve_all(pack, luminance(reduce(environment)), styles=["left-loop"])[0]
    sheet = assembled(result, load_transport_of(pack, "generic"), environment.radiance, -45.0)
    assert sheet.turn_deg == -45.0
    assert sheet.match == result.match_curve[56]


@pytest.mark.slow
@pytest.mark.alone
def test_a_sheet_costs_less_than_1000_units() -> None:
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    environment = read_environment(DEMO / "location" / "probe-3.exr")
    result = solve_all(pack, luminance(reduce(environment)), styles=["left-loop"])[0]
    assert units(lambda: draw(assembled(result, transport, environment.radiance))) < 1000
