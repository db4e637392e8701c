"""The Styles screen without a screen: cards, order, detail at any turn, ways on."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.core.base.angles import difference, whole, wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import Token
from app.core.places.place import Location, Place
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.gallery_portraits import exposure_in_mean_light
from app.core.portrait.light import portrait_light
from app.core.portrait.ratio_and_glare import glare, lighting_ratio
from app.core.solver.place_light import Facing, picture_at
from app.core.solver.shortfall import AreaShortfall, Aspect
from app.core.solver.turn_choice import LIMITS
from app.core.storage.item_library import DamagedItem
from app.core.styles.styles import NAMES, RARE, load_styles
from app.ui.presenters.window_model import Step
from app.ui.screens.styles.cards import CANNOT_READ, Sort
from app.ui.screens.styles.gallery import Sizes, look, question_of
from app.ui.screens.styles.screen import StylesState, StylesView
from app.words.phrases.directions import SIDES, light_words
from app.words.phrases.quantities import lower_first
from app.words.portrait.face_light import (
    CONVENTION,
    glare_sentence,
    ratio_line,
    ratio_sentence,
)
from app.words.verdict import close_to
from app.words.why_out_of_reach import reason_card, reason_sentence
from tests.helpers.pace import units
from tests.helpers.styles_screen import Table, head, lamp_light, scene_light

TITLES = len({style.title for style in load_styles()})
"""Left and right are one card."""


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return Table(tmp_path)


def attached(table: Table) -> MagicMock:
    view = MagicMock(spec=StylesView)
    table.presenter.attach(view)
    return view


def last(view: MagicMock) -> StylesState:
    state = view.show_state.call_args.args[0]
    assert isinstance(state, StylesState)
    return state


def needle(table: Table) -> float | None:
    return table.model.needle_deg


def goal(table: Table) -> float | None:
    return table.model.goal_deg


class TestSidesAndDirections:
    """One lamp at azimuth p: butterfly at p, left split at p + 90, right split at p - 90."""

    @pytest.mark.parametrize("lamp", [40.0, -100.0])
    @pytest.mark.parametrize("front", [0.0, 60.0])
    @pytest.mark.usefixtures("best_turns")
    def test_one_lamp(self, table: Table, lamp: float, front: float) -> None:
        table.open(lamp_light(lamp, 35.0), front)
        for name, turn in (
            ("butterfly", lamp - front),
            ("left-split", lamp + 90.0 - front),
            ("right-split", lamp - 90.0 - front),
        ):
            card = table.card(name)
            way = 1 if card.way == "clockwise" else -1
            shown = way * int(card.turn.removesuffix("°"))
            assert abs(difference(shown, turn)) <= 8.0, (name, card.turn, card.way)

    def test_a_lamp_at_the_sitters_right_hand_side_needs_a_clockwise_turn(
        self, table: Table
    ) -> None:
        # Azimuth grows to the right of who faces the centre: butterfly needs a turn towards it.
        table.open(lamp_light(40.0, 35.0))
        table.presenter.choose("butterfly")
        state = table.presenter.resolve().detail
        assert state.way == "clockwise"
        assert state.direction == "clockwise"
        assert state.clock == "towards 1 o’clock"
        assert state.here_tag == f"Here, at {state.turn}"

    def test_counter_clockwise_has_a_minus_on_the_picture(self, table: Table) -> None:
        table.open(lamp_light(-40.0, 35.0))
        table.presenter.choose("butterfly")
        state = table.presenter.resolve().detail
        assert state.direction == "counter-clockwise"
        assert state.here_tag == f"Here, at −{state.turn}"

    def test_the_key_light_is_on_the_side_of_the_name(self, table: Table) -> None:
        """Pictures, not words: image right is the sitter's left."""
        table.open(lamp_light(25.0, 20.0))
        for name, brighter in (("left-split", "right"), ("right-split", "left")):
            table.presenter.choose(name)
            here = table.presenter.resolve().detail.here
            assert here is not None
            left, right = here[:, :100].mean(), here[:, 100:].mean()
            assert (right > left) == (brighter == "right")
        table.presenter.choose("left-split")
        assert table.presenter.resolve().detail.side == light_words("left")


class TestCards:
    def test_two_groups_common_styles_first_then_by_grade_and_match(self, table: Table) -> None:
        state = table.open(scene_light("sunrise")).presenter.resolve()
        gives, rest = state.groups
        assert (gives.title, rest.title) == ("This place gives", "Not here")
        assert (gives.count, rest.count) == (len(gives.cards), len(rest.cards))
        results = {one.name: one for one in table.model.results}
        for group, within in ((gives, True), (rest, False)):
            assert {results[card.key].attainable for card in group.cards} == {within}
            rank = [
                (card.key in RARE, results[card.key].grade == "soft", -results[card.key].match)
                for card in group.cards
            ]
            assert rank == sorted(rank)
        titles = [card.title for card in state.cards]
        assert len(set(titles)) == len(titles) == TITLES

    def test_a_card_shows_the_better_side_and_switches_to_the_other(self, table: Table) -> None:
        presenter = table.open(scene_light("sunrise")).presenter
        results = {one.name: one for one in table.model.results}
        for card in presenter.resolve().cards:
            assert bool(card.other) == (card.side != "none")
            if card.other:
                shown, hidden = results[card.key], results[card.other]
                assert (shown.attainable, shown.grade != "soft", shown.match) >= (
                    (hidden.attainable, hidden.grade != "soft", hidden.match)
                )
                assert SIDES[hidden.side].partition(" (")[0] in card.other_words
        order = [card.title for card in presenter.resolve().cards]
        first = next(card for card in presenter.resolve().cards if card.other)
        presenter.choose(first.key)
        actions = {action.key: action for action in presenter.actions()}
        assert actions["other-side"].enabled()
        actions["other-side"].run()
        assert table.model.chosen == first.other
        assert table.card(first.other).other == first.key
        presenter.choose("flat")
        assert not {a.key: a for a in presenter.actions()}["other-side"].enabled()
        # It still shows the side that was chosen last, in the same place.
        cards = presenter.resolve().cards
        assert first.other in [card.key for card in cards]
        assert [card.title for card in cards] == order
        table.model.update(light=scene_light("studio"))
        assert first.other not in presenter._recent

    def test_equal_pictures_are_offered_once(self, table: Table) -> None:
        table.open(scene_light("sunrise"))
        loop, rembrandt = (
            next(one for one in table.model.results if one.name == name)
            for name in ("left-loop", "left-rembrandt")
        )
        equal = replace(
            rembrandt,
            turn_refined_deg=loop.turn_refined_deg,
            grade="yes",
            shortfall=None,
            looks_more_like=None,
            same_picture=("left-loop",),
            match=loop.match - 1.0,
        )
        both = (replace(loop, same_picture=("left-rembrandt",), looks_more_like=None), equal)
        table.model.update(results=both)
        (card,) = table.presenter.resolve().cards[: len(both)][:1]
        assert (card.key, card.word, card.line) == ("left-loop", "Yes", "also reads as Rembrandt")
        assert table.presenter.resolve().groups[0].count == 1
        table.presenter.choose("left-rembrandt")
        card = table.presenter.resolve().cards[0]
        assert (card.key, card.line) == ("left-rembrandt", "also reads as loop")
        # Of two grades, the better one does not speak for the other.
        softer = replace(equal, grade="soft", looks_more_like="left-loop")
        table.model.update(results=(both[0], softer))
        lines = {card.key: (card.word, card.line) for card in table.presenter.resolve().cards}
        assert lines["left-rembrandt"] == ("Soft", "reads as loop")

    def test_a_card_has_one_word_and_at_most_five_more(self, table: Table) -> None:
        for name in ("sunrise", "interior", "city", "night"):
            cards = table.open(scene_light(name)).presenter.resolve().cards
            grades = {one.name: one.grade for one in table.model.results}
            words = {"yes": "Yes", "soft": "Soft", "no": "–"}
            assert all(card.word == words[grades[card.key] or "yes"] for card in cards)
            assert max(len(card.line.split()) for card in cards) <= 5
            for card in cards:
                assert "match" not in card.line
                assert card.line or card.word == "Yes"

    def test_numbers_on_card_and_in_the_detail_are_the_same(self, table: Table) -> None:
        table.open(scene_light())
        for result in table.model.results:
            table.presenter.choose(result.name)
            card, detail = table.card(result.name), table.presenter.resolve().detail
            assert detail.match == str(max(math.floor(result.match), 0))
            assert detail.turn == f"{abs(whole(result.turn_refined_deg))}°"
            if card.in_reach:
                assert (card.turn, card.way) == (detail.turn, detail.way)
            else:
                assert card.turn == ""
                assert detail.verdict
                assert detail.arc is None

    def test_names_for_those_who_cannot_see(self, table: Table) -> None:
        table.open(scene_light())
        result = next(one for one in table.model.results if one.name == "left-rembrandt")
        turned = replace(
            result,
            turn_refined_deg=96.2,
            match=96.4,
            attainable=True,
            shortfall=None,
            grade="yes",
            neighbour=None,
        )
        others = tuple(one for one in table.model.results if one is not result)
        table.model.update(results=(*others, turned))
        assert table.card("left-rembrandt").spoken == (
            "Rembrandt, light from the sitter’s left, camera right, turn 96 degrees clockwise, yes"
        )
        butterfly = table.card("butterfly").spoken
        assert butterfly.startswith("Butterfly, light from in front and above, turn ")
        assert "out of reach: " in table.card("badger").spoken

    @pytest.mark.parametrize("limit", [44.0, 45.0])
    def test_a_match_just_under_the_limit_never_reads_as_the_limit(
        self, table: Table, limit: float
    ) -> None:
        table.open(scene_light())
        result = next(one for one in table.model.results if one.name == "badger")
        near = replace(result, match=44.97)
        table.model.update(results=(near,))
        table.presenter.choose("badger")
        assert table.presenter.resolve().detail.match == "44"

    def test_what_is_missing_is_said_with_both_numbers(self, table: Table) -> None:
        table.open(scene_light())
        result = next(one for one in table.model.results if one.name == "left-loop")
        shortfall = AreaShortfall(
            Aspect.NOSE_SHADOW, "Loop", "left cheek", "left nose shadow", 0.3, 0.4
        )
        shallow = replace(result, attainable=False, grade="no", shortfall=shortfall)
        table.model.update(results=(shallow,))
        assert table.card("left-loop").line == lower_first(reason_card(shallow.shortfall))
        table.presenter.choose("left-loop")
        detail = table.presenter.resolve().detail
        assert detail.reason == f"{reason_sentence(shallow.shortfall)}."
        assert detail.verdict.startswith(f"The best match here is {math.floor(result.match)} at ")

    def test_what_a_picture_may_be_taken_for_is_said(self, table: Table) -> None:
        table.open(scene_light())
        result = next(one for one in table.model.results if one.name == "left-loop")
        taken = replace(
            result,
            attainable=True,
            grade="soft",
            looks_more_like="left-rembrandt",
            neighbour=None,
            shortfall=None,
        )
        table.model.update(results=(taken,))
        card = table.card("left-loop")
        assert (card.word, card.line) == ("Soft", "reads as Rembrandt")
        assert f"Reads as Rembrandt, {SIDES['left']}, not Loop" in card.tip
        assert card.spoken.endswith(", soft")

    def test_filters_count_and_keep(self, table: Table) -> None:
        presenter = table.open(scene_light()).presenter
        assert dict(presenter.resolve().filters) == {"all": f"All {TITLES}", "mine": "Mine 0"}
        for key, count in {"mine": 0, "all": TITLES}.items():
            presenter.set_filter(key)
            assert len(presenter.resolve().cards) == count
        presenter.set_filter("mine")
        (group,) = presenter.resolve().groups
        assert "Paint a style" in group.empty

    def test_sorting(self, table: Table) -> None:
        presenter = table.open(scene_light("sunrise")).presenter
        presenter.set_sort(Sort.NAME)
        for group in presenter.resolve().groups:
            names = [card.title for card in group.cards]
            assert names == sorted(names)
        presenter.set_sort("turn")
        turns = [int(card.turn[:-1]) for card in presenter.resolve().groups[0].cards]
        assert len(turns) > 3
        assert turns == sorted(turns)

    def test_a_place_without_any_style_says_what_to_do(self, table: Table) -> None:
        table.open(scene_light())
        none = tuple(replace(one, attainable=False, grade="no") for one in table.model.results)
        table.model.update(results=none)
        gives, rest = table.presenter.resolve().groups
        assert gives.cards == ()
        assert "lamp" in gives.empty
        assert rest.count == TITLES

    def test_out_of_reach_is_grey(self, table: Table) -> None:
        table.open(scene_light())
        for card in table.presenter.resolve().cards:
            for picture in (card.target, card.here):
                assert picture is not None
                assert picture.shape == (127, 99, 3)
                assert (np.ptp(picture.astype(int), axis=2).max() <= 1) == (not card.in_reach)


class TestStates:
    def test_before_a_head_is_there(self, table: Table) -> None:
        view = attached(table)
        assert last(view).cards == ()
        assert last(view).busy
        table.open()
        assert len(last(view).cards) == TITLES
        assert not last(view).busy

    def test_no_light_targets_but_no_turns(self, table: Table) -> None:
        state = table.open().presenter.resolve()
        assert all(card.target is not None and card.here is None for card in state.cards)
        assert not any(card.turn or card.word for card in state.cards)
        assert [group.title for group in state.groups] == [""]
        assert not state.measured
        assert state.detail.main == "probe"
        assert state.detail.main_words == "Go to Probe"
        assert state.detail.target is not None
        table.presenter.main()
        assert table.model.step is Step.PROBE

    def test_no_light_can_be_looked_through_and_painted(self, table: Table) -> None:
        table.open().presenter.choose("left-loop")
        assert table.presenter.resolve().detail.title == "Loop"
        table.presenter.paint()
        assert table.model.painting == "left-loop"

    def test_out_of_reach(self, table: Table) -> None:
        table.open(scene_light()).presenter.choose("badger")
        detail = table.presenter.resolve().detail
        result = table.model.result
        assert result is not None
        assert not result.attainable
        turn = f"{abs(whole(result.turn_refined_deg))}° {detail.direction}"
        number = max(math.floor(result.match), 0)
        assert detail.verdict == f"The best match here is {number} at {turn}."
        assert detail.reason == f"{reason_sentence(result.shortfall)}."
        assert (detail.main, detail.main_words) == ("lamp", "Try a lamp")
        table.presenter.main()
        assert table.model.step is Step.LIGHT
        assert table.model.goal_deg is None

    def test_busy_keeps_old_numbers_until_all_new_ones_are_there(self, table: Table) -> None:
        table.open(scene_light())
        view = attached(table)
        before = [(card.key, card.turn, card.version) for card in last(view).cards]
        table.runner.held = {"solve", "styles-pictures"}
        table.model.update(front_deg=30.0)
        assert last(view).busy
        assert [(card.key, card.turn, card.version) for card in last(view).cards] == before
        table.runner.release("solve")
        assert last(view).busy
        assert [(card.key, card.turn, card.version) for card in last(view).cards] == before
        table.runner.release("styles-pictures")
        assert not last(view).busy
        after = {card.key: card for card in last(view).cards}
        assert all(after[key].version > version for key, _, version in before)

    def test_a_damaged_style_is_a_card_of_its_own(self, table: Table) -> None:
        table.open(scene_light())
        file = table.folder / "styles" / "broken.toml"
        table.model.update(damaged_styles=(DamagedItem(file, CoreError("It has no weights.")),))
        state = table.presenter.resolve()
        card = state.cards[-1]
        assert card.damaged == file
        assert card.target is None
        assert not card.turn
        assert card.line == CANNOT_READ
        assert dict(state.filters)["mine"] == "Mine 1"
        assert dict(state.filters)["all"] == f"All {TITLES + 1}"
        table.presenter.choose(card.key)
        assert table.model.chosen != card.key

    def test_nothing_is_shown_while_another_screen_is_in_front(self, table: Table) -> None:
        view = attached(table.open(scene_light()))
        table.presenter.leave()
        shown = view.show_state.call_count
        table.presenter.look_at(10.0)
        assert view.show_state.call_count == shown
        table.presenter.enter()
        assert last(view).detail.here_tag == "Here, at 10°"
        table.presenter.detach()
        table.presenter.look_at(20.0)
        assert last(view).detail.here_tag == "Here, at 10°"


class TestDetail:
    def test_the_needle_moves_everything(self, table: Table) -> None:
        view = attached(table.open(scene_light()))
        table.presenter.choose("left-rembrandt")
        best = last(view).detail
        assert best.at_best
        assert best.needle == pytest.approx(best.best)
        table.presenter.look_at(-120.4)
        moved = last(view).detail
        assert needle(table) == -120.4
        assert not moved.at_best
        assert moved.turn == "120°"
        assert moved.direction == "counter-clockwise"
        assert moved.good_from == best.good_from
        assert moved.best == best.best
        assert moved.target is best.target
        assert moved.weights is best.weights
        assert moved.panorama is best.panorama
        for one, two in ((moved.here, best.here), (moved.background, best.background)):
            assert one is not None
            assert two is not None
            assert np.abs(one.astype(int) - two).mean() > 3
        table.presenter.go_best()
        assert needle(table) is None
        assert last(view).detail.match == best.match

    @pytest.mark.full_size
    def test_a_moving_needle_shows_a_draft_and_a_resting_one_all_pixels(self, table: Table) -> None:
        light = scene_light()
        view = attached(table.open(light))
        table.presenter.choose("left-rembrandt")
        job, runner = "styles-detail-larger", table.runner
        runner.held.add(job)
        table.presenter.look_at(40.0)
        runner.waiting[job]()
        draft = last(view).detail.here
        looking = last(view).detail.lamps_note
        runner.release(job)
        rest = last(view).detail
        assert draft is not None
        assert rest.here is not None
        assert np.abs(draft.astype(int) - rest.here).mean() < 2.0, "the same, less sharp"
        assert not np.array_equal(draft, rest.here)
        owner = table.model.head
        assert owner is not None
        linear = picture_at(owner.transport, light, 40.0)
        whole = owner.portraits([linear], rest.here.shape[:2], [Facing(light, 40.0)])[0]
        np.testing.assert_array_equal(rest.here, whole)
        assert looking == "Looking for catchlights…"
        assert "atchlight" in rest.lamps_note.replace(looking, "")

    def test_match_between_the_turns_of_the_grid(self, table: Table) -> None:
        """Against the correlation of the pictures themselves."""
        table.open(scene_light()).presenter.choose("left-split")
        one = head()
        pixels, region = one.transport.pixels, one.pack.region_on(one.transport)
        target = one.pack.target("left-split").reshape(-1, 3)[pixels]
        # The search sees luminance only and 64 turns; the pictures are in colour.
        for turn in (45.0, 101.25, -67.5, 61.9, -33.3):
            table.presenter.look_at(turn)
            here = picture_at(one.transport, scene_light(), turn).reshape(-1, 3)[pixels]
            weights = np.asarray(one.transport.header.luminance_weights)
            both = np.cov(target @ weights, here @ weights, aweights=region)
            match = 100 * both[0, 1] / np.sqrt(both[0, 0] * both[1, 1])
            shown = table.presenter.resolve().detail.match
            assert abs(float(shown) - max(match, 0.0)) <= 4.0

    def test_front_moves_turns_and_not_pictures(self, table: Table) -> None:
        table.open(scene_light()).presenter.choose("left-rembrandt")
        before = table.presenter.resolve().detail
        table.model.update(front_deg=25.0)
        after = table.presenter.resolve().detail
        assert difference(before.needle, after.needle) == pytest.approx(25.0, abs=1e-6)
        for name in ("here", "background"):
            one, two = getattr(before, name), getattr(after, name)
            assert np.abs(one.astype(int) - two).max() <= 1

    def test_a_peak_is_taken_and_home_returns(self, table: Table) -> None:
        table.open(scene_light())
        result = next(one for one in table.model.results if len(one.peaks) > 1)
        table.presenter.choose(result.name)
        detail = table.presenter.resolve().detail
        assert detail.peaks == tuple(peak.turn_refined_deg for peak in result.peaks[1:])
        table.presenter.take_peak(0)
        assert table.model.needle_deg == pytest.approx(result.peaks[1].turn_refined_deg)
        assert detail.best is not None
        table.presenter.look_at(detail.best)
        assert table.model.needle_deg is None

    def test_ratio_and_convention(self, table: Table) -> None:
        table.open(lamp_light(0.0, 20.0)).presenter.choose("left-split")
        table.presenter.look_at(40.0)
        detail = table.presenter.resolve().detail
        one = head()
        linear = picture_at(one.transport, lamp_light(0.0, 20.0), 40.0)
        wanted = lighting_ratio(one.transport, linear.reshape(-1, 3)[one.transport.pixels])
        assert detail.ratio_short == ratio_line(wanted)
        assert ratio_sentence(wanted) in detail.ratio_tip
        assert CONVENTION in detail.ratio_tip

    def test_a_lamp_in_the_eyes_is_warned_of_at_that_turn_only(self, table: Table) -> None:
        light = lamp_light(50.0, 20.0)
        assert glare(light.environment.radiance, 50.0).warns
        table.open(light).presenter.choose("left-split")
        table.presenter.look_at(50.0)
        facing = table.presenter.resolve().detail
        assert facing.glare.startswith("Bright lamp in ")
        assert glare_sentence(glare(light.environment.radiance, 50.0)) in facing.glare_tip
        assert "straight ahead" in facing.glare
        table.presenter.look_at(-130.0)
        assert table.presenter.resolve().detail.glare == ""

    def test_the_sun_is_called_the_sun(self, table: Table) -> None:
        place = Place(
            name="Roof",
            made_at=table.services.today(),
            location=Location(sun_azimuth_deg=50.0, sun_elevation_deg=20.0),
        )
        table.model.update(place=place)
        table.open(lamp_light(50.0, 20.0)).presenter.choose("butterfly")
        table.presenter.look_at(52.0)
        assert table.presenter.resolve().detail.glare.startswith("Sun in ")

    def test_quality_is_shown_when_quality_decides(self, table: Table) -> None:
        settings = table.model.settings.with_("paper_mode", True)
        table.model.update(settings=settings)
        table.open(scene_light()).presenter.choose("left-loop")
        detail = table.presenter.resolve().detail
        assert detail.curve_name == "Quality by turn"
        assert max(detail.curve) == pytest.approx(100.0)

    def test_plots_say_what_cards_say(self, table: Table) -> None:
        """One source for match, C and the limit, whichever rule counts."""
        for objective in ("picture", "paper"):
            settings = table.model.settings.with_("paper_mode", objective == "paper")
            table.model.update(settings=settings)
            table.open(scene_light())
            for name in [one.name for one in table.model.results]:
                table.presenter.choose(name)
                card, detail = table.card(name), table.presenter.resolve().detail
                if objective == "paper":
                    assert f", {detail.numbers}, " in card.spoken
                    assert card.line.startswith(f"C {detail.quality}")

    def test_the_papers_own_rule_greys_by_c(self, table: Table) -> None:
        settings = table.model.settings.with_("paper_mode", True)
        table.model.update(settings=settings)
        state = table.open(scene_light()).presenter.resolve()
        light = scene_light().searched @ np.array([0.2126, 0.7152, 0.0722])
        largest = {one.name: one.quality_curve.max() / light.mean() for one in table.model.results}
        cards = [table.card(one.name) for one in table.model.results]
        reach = {card.key: card.in_reach for card in cards}
        assert reach == {name: value >= LIMITS.quality for name, value in largest.items()}
        ours = {one.name: one.attainable for one in table.model.results}
        apart = sum(reach[name] != ours[name] for name in ours)
        assert 0 < apart < len(NAMES)
        assert (
            state.rules == f"The paper’s rule and ours disagree on {apart} of {len(NAMES)} styles."
        )
        for card in cards:
            assert ("ours:" in card.line) == (reach[card.key] != ours[card.key])
            assert (card.turn != "") == card.in_reach

    def test_median_and_least_c_are_marked_and_shown(self, table: Table) -> None:
        table.model.update(settings=table.model.settings.with_("paper_mode", True))
        table.open(scene_light()).presenter.choose("left-loop")
        detail, result = table.presenter.resolve().detail, table.model.result
        assert result is not None
        assert detail.here_tag == "Maximum"
        median, least = detail.marks
        curve = result.quality_curve
        assert least.turn_deg == wrap(5.625 * int(np.argmin(curve)))
        off = curve[round(median.turn_deg / 5.625) % 64] - np.median(curve)
        assert abs(off) <= np.ptp(curve) / 8
        for mark in detail.marks:
            linear = picture_at(head().transport, scene_light(), mark.turn_deg)
            here = Facing(scene_light(), mark.turn_deg)
            np.testing.assert_array_equal(mark.picture, head().portrait(linear, (208, 200), here))
        table.model.update(settings=table.model.settings.with_("paper_mode", False))
        assert table.presenter.resolve().detail.marks == ()

    def test_pictures_of_equal_size(self, table: Table) -> None:
        table.open(scene_light())
        table.presenter.sized(Sizes((30, 40), (104, 100), (34, 32)))
        state = table.presenter.resolve()
        assert state.detail.target is not None
        assert state.detail.here is not None
        assert state.detail.target.shape == state.detail.here.shape == (104, 100, 3)
        assert state.detail.background is not None
        assert state.detail.background.shape == (34, 32, 3)
        assert {card.here.shape for card in state.cards if card.here is not None} == {(30, 40, 3)}


class TestWaysOn:
    def test_turn_to_this_takes_the_turn_that_is_shown(self, table: Table) -> None:
        table.open(scene_light()).presenter.choose("left-loop")
        table.presenter.look_at(33.0)
        table.presenter.main()
        assert table.model.goal_deg == 33.0
        assert table.model.step is Step.TURN

    def test_another_style_has_another_goal(self, table: Table) -> None:
        table.open(scene_light()).presenter.open("left-loop")
        assert goal(table) is not None
        table.presenter.look_at(12.0)
        table.presenter.choose("butterfly")
        assert goal(table) is None
        assert needle(table) is None
        assert table.model.chosen == "butterfly"

    def test_out_of_reach_can_be_turned_to_all_the_same(self, table: Table) -> None:
        table.open(scene_light()).presenter.choose("badger")
        table.presenter.turn()
        assert table.model.step is Step.TURN
        assert table.model.goal_deg is not None

    def test_actions_say_what_the_keys_do(self, table: Table) -> None:
        table.open(scene_light())
        actions = {action.key: action for action in table.presenter.actions()}
        hints = [(a.keys or a.shortcut.split(";")[0], a.hint) for a in actions.values() if a.hint]
        assert hints == [("Arrows", "choose"), ("Return", "turn"), ("P", "paint")]
        first = table.presenter.resolve().cards[0].key
        table.presenter.choose(first)
        actions["next-style"].run()
        assert table.model.chosen == table.presenter.resolve().cards[1].key
        actions["paint-new"].run()
        assert table.model.painting == ""
        assert actions["set-sheet"].enabled()
        assert not actions["rename-style"].enabled()

    def test_copying_the_numbers(self, table: Table) -> None:
        view = attached(table.open(scene_light()))
        table.presenter.choose("left-rembrandt")
        table.presenter.files.copy_numbers()
        text = view.copy.call_args.args[0]
        detail = last(view).detail
        assert f"Turn: {detail.turn} {detail.direction}, {detail.clock}" in text
        assert f"Match {detail.match}, contrast {detail.contrast}" in text
        assert SIDES["left"] in text


@pytest.mark.slow
@pytest.mark.alone
def test_all_pictures_of_a_place_cost_less_than_one_by_one(table: Table) -> None:
    """A ratio on the same machine in the same moment, so that a slow one cannot fail it."""
    table.open(scene_light())
    question = question_of(table.model, (127, 99))
    assert question is not None
    known = look(question, None, Token())
    name = table.model.results[0].name
    table.presenter.choose(name)
    at_once = units(lambda: look(question, known, Token(), quick=True), 5)

    def one_by_one() -> None:
        for result in table.model.results:
            picture_at(head().transport, scene_light(), wrap(result.turn_refined_deg))

    single = units(one_by_one, 5)
    # All pictures with their exposure and framing against as many bare ones.
    assert at_once < 2.5 * single


@pytest.mark.slow
@pytest.mark.alone
def test_a_turn_of_the_needle_costs_about_three_bare_pictures(table: Table) -> None:
    table.open(scene_light()).presenter.choose("left-rembrandt")
    attached(table)
    table.presenter.look_at(1.0)
    turns = iter(np.linspace(-170, 170, 60))
    moved = units(lambda: table.presenter.look_at(float(next(turns))), 30)
    whole = head().full
    assert whole is not None
    shape, skin = whole
    light = portrait_light(scene_light().environment.radiance)
    bare = units(lambda: portrait_picture(shape, skin, light, 33.0), 30)
    assert moved < 4.0 * bare


def test_a_card_says_what_its_picture_may_be_taken_for(table: Table) -> None:
    table.open(scene_light())
    titles = {style.name: style.title for style in load_styles()}
    told = [one for one in table.model.results if one.grade == "yes" and not one.same_picture]
    assert told
    for result in told:
        table.presenter.choose(result.name)
        card, detail = table.card(result.name), table.presenter.resolve().detail
        words = close_to(titles[str(result.neighbour)])
        assert detail.close.startswith(words)
        assert words in card.tip
        assert words in card.spoken


def test_no_style_that_is_rarely_wanted_alone_comes_first(table: Table) -> None:
    table.open(scene_light())
    rare = {style.name for style in load_styles() if style.name in RARE}
    assert {"below", "top", "left-below-side", "hair-light", "silhouette"} <= rare
    cards = table.presenter.resolve().cards
    first = {one.name: one.grade for one in table.model.results}[cards[0].key]
    usual = [one.name for one in table.model.results if one.grade == first and one.name not in rare]
    assert not usual or cards[0].key in usual


class TestExposure:
    """Each picture by its own light, or all by that of the style in front."""

    @pytest.fixture
    def table(self, table: Table) -> Table:
        """With the settings that the tests' head has, so that no other is loaded."""
        plain = table.model.settings.with_("hair", "plain").with_("behind", "grey")
        table.model.update(settings=plain)
        return table

    def test_it_is_said_in_stops_from_a_face_in_the_mean_light(self, table: Table) -> None:
        light = scene_light()
        table.open(light).presenter.choose("left-loop")
        detail = table.presenter.resolve().detail
        linear, here = picture_at(head().transport, light, detail.needle), Facing(light, 0.0)
        (exposed,) = head().exposures([linear], [here])
        zero = exposure_in_mean_light(head().transport, light.searched)
        assert detail.here_exposed == f"{np.log2(exposed / zero):+.1f} stops".replace("-", "−")
        assert "average light" in detail.exposed_tip
        assert detail.target_exposed == ""
        table.presenter.swap(True)
        swapped = table.presenter.resolve().detail
        assert (swapped.target_exposed, swapped.here_exposed) == (detail.here_exposed, "")

    def test_all_pictures_here_by_the_exposure_of_the_style_in_front(self, table: Table) -> None:
        table.open(scene_light("courtyard")).presenter.choose("left-loop")
        free = {card.key: card for card in table.presenter.resolve().cards}
        table.presenter.expose_alike()
        assert table.model.settings.same_exposure
        state = table.presenter.resolve()
        assert state.same_exposure
        alike = {card.key: card for card in state.cards}
        np.testing.assert_array_equal(alike["left-loop"].here, free["left-loop"].here)
        exposed = _exposures(table)
        for key, card in alike.items():
            assert card.target is not None and free[key].target is not None  # noqa: PT018
            np.testing.assert_array_equal(card.target, free[key].target)
            if abs(np.log2(exposed[key] / exposed["left-loop"])) > 0.3 and card.in_reach:
                brighter = float(np.mean(card.here)) > float(np.mean(free[key].here))  # type: ignore[arg-type]
                assert brighter == (exposed["left-loop"] > exposed[key])
        said = state.detail.here_exposed
        table.presenter.look_at(state.detail.needle + 90.0)
        turned = table.presenter.resolve().detail
        assert turned.here_exposed == said, "the needle leaves it where it is"
        assert "set by the selected style" in turned.exposed_tip

    @pytest.mark.full_size
    def test_another_choice_exposes_all_by_its_own(self, table: Table) -> None:
        table.open(scene_light("courtyard")).presenter.choose("left-loop")
        free = table.card("right-rim").here
        table.presenter.expose_alike()
        table.presenter.choose("right-rim")
        _assert_alike(table.card("right-rim").here, free)
        table.presenter.expose_alike()
        assert not table.presenter.resolve().same_exposure
        table.presenter.choose("left-loop")
        _assert_alike(table.card("right-rim").here, free)

    def test_pictures_are_made_again_only_for_that(self, table: Table) -> None:
        table.open(scene_light()).presenter.choose("left-loop")
        table.runner.ran.clear()
        table.presenter.choose("butterfly")
        assert "styles-pictures-larger" not in table.runner.ran
        table.presenter.expose_alike()
        table.presenter.expose_alike()
        made = [key for key in table.runner.ran if key == "styles-pictures-larger"]
        assert len(made) == 2
        assert "styles-pictures" not in table.runner.ran, "the gallery is not dimmed"


def _assert_alike(picture: Bytes | None, other: Bytes | None) -> None:
    """Compare pictures to one code, as exposures are rounded."""
    assert picture is not None
    assert other is not None
    np.testing.assert_allclose(picture, other, atol=1)


def _exposures(table: Table) -> dict[str, float]:
    light, results = table.model.light, table.model.results
    assert light is not None
    turns = [result.turn_refined_deg for result in results]
    linear = [picture_at(head().transport, light, turn) for turn in turns]
    lights = [
        Facing(light, result.turn_refined_deg, head().expose_of(result.name)) for result in results
    ]
    found = head().exposures(linear, lights)
    return {result.name: gain for result, gain in zip(results, found, strict=True)}
