"""The open place: answers of a closed one, goals of another style, places that cannot be kept."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import MagicMock

import cv2
import numpy as np
import pytest

from app.core.base.colour import srgb_encode
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_exr, write_image
from app.core.base.paths import resources
from app.core.base.remarks import PlainRemark
from app.core.cautions.caution import Hazard
from app.core.environment.environment import read_environment
from app.core.environment.remarks import LayerChosen
from app.core.measure.finish.findings import Findings, LampFinding, find
from app.core.measure.finish.remarks import SunRestored
from app.core.places.place import CaptureFacts, FrameFacts, Place
from app.core.places.place_folder import PlaceSummary, create_place, read_place
from app.core.places.place_list import list_places
from app.core.second_light.place_brightness import stated_white
from app.core.solver.head_shape import shape_path
from app.core.solver.transport import save_transport
from app.core.styles.style_pack_file import pack_path, save_pack
from app.ui.presenters.places_list import PlacesListPresenter, PlacesListState
from app.ui.screens.light.screen import LightPresenter
from app.ui.screens.probe.capture.camera import CameraBlock
from app.ui.screens.probe.capture.notice import (
    CARDS_SHOW_ANSWERS,
    CARDS_SHOW_TURNS,
    Notice,
    advice_notice,
)
from app.words.remarks import remark_words
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.probes import place
from tests.helpers.styles_screen import HoldingRunner, Table, on_time, scene_light
from tests.helpers.synthetic import lambert_sphere_transport, own_head, synthetic_pack

SCENE = resources() / "demo" / "scenes" / "studio.exr"


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return on_time(Table(tmp_path, ImmediateRunner()))


def test_answers_of_a_place_that_was_closed_are_given_up(tmp_path: Path) -> None:
    runner = HoldingRunner()
    table = Table(tmp_path, runner)
    runner.held.add("solve")
    table.open(scene_light())
    assert runner.running("solve")
    table.desk.close()
    assert not runner.running("solve")
    assert table.model.results == ()


def test_a_panorama_that_states_its_brightness_is_a_place_of_known_brightness(
    table: Table, tmp_path: Path
) -> None:
    path = tmp_path / "merged.exr"
    write_exr(path, np.ones((64, 128, 3), np.float32), 40.0)
    table.desk.open_paths([path])
    place, folder = table.model.place, table.model.place_folder
    assert place is not None
    assert folder is not None
    assert place.capture is not None
    assert place.capture.white_cd_m2 == pytest.approx(40.0)
    assert stated_white(folder / place.environment) == pytest.approx(40.0)


def test_what_arrives_does_not_stop_what_arrived_before(tmp_path: Path) -> None:
    runner = HoldingRunner()
    table = on_time(Table(tmp_path, runner))
    runner.held.add("open-arrived")
    table.open()
    for _ in range(2):
        table.desk.take_in([SCENE])
    assert runner.ran.count("open-arrived") == 1
    runner.release("open-arrived")
    assert len(list_places(tmp_path / "places")) == 2


def test_the_goal_of_one_style_is_none_of_another(table: Table) -> None:
    table.open(scene_light())
    first, other = (result.name for result in table.model.results[:2])
    table.model.update(chosen=first, goal_deg=33.0, needle_deg=12.0)
    LightPresenter(table.services, table.desk).choose(other)
    model = table.model
    assert (model.chosen, model.goal_deg, model.needle_deg) == (other, None, None)
    assert model.result is not None
    assert model.target_turn_deg == model.result.turn_refined_deg


def test_a_style_that_is_gone_takes_its_goal_with_it(table: Table) -> None:
    table.open(scene_light())
    table.model.update(chosen="mine", goal_deg=33.0)
    table.model.update(front_deg=90.0)
    assert table.model.chosen != "mine"
    assert table.model.goal_deg is None


def test_the_list_shows_the_new_name_before_the_disk_has_it(table: Table, tmp_path: Path) -> None:
    table.open()
    table.desk.open_paths([SCENE])
    folder = table.model.place_folder
    assert folder is not None
    shelf, view = PlacesListPresenter(table.services, table.desk), MagicMock()
    shelf.attach(view)
    other = create_place(tmp_path / "places", "Other", table.services.today())
    assert table.model.place is not None
    shelf._read(((PlaceSummary(folder, "old", table.model.place.made_at),), {}, {}, (), (0, 0)))
    table.desk.change("rename", name="New")
    shelf._read(
        (
            (
                PlaceSummary(folder, "old", table.model.place.made_at),
                PlaceSummary(other, "Other", table.model.place.made_at),
            ),
            {},
            {},
            (),
            (0, 0),
        )
    )
    state: PlacesListState = view.show_state.call_args[0][0]
    assert [row.name for row in state.rows] == ["New", "Other"]


class TestHeadsOfOnesOwn:
    def test_they_are_listed_after_those_that_ship(self, table: Table, tmp_path: Path) -> None:
        anna = own_head(tmp_path / "heads", "anna")
        (tmp_path / "heads" / "half.npz").write_bytes(anna.read_bytes())  # without its pack
        assert table.desk.heads.titles()[-1] == (str(anna), "Head anna")
        assert not any("half" in title for _, title in table.desk.heads.titles())
        table.open(scene_light())
        table.desk.heads.load(str(anna))
        assert table.model.head is not None
        assert table.model.head.name == str(anna)
        assert len(table.model.results) == len(table.model.head.pack.styles)

    def test_a_chosen_file_is_remembered(self, table: Table, tmp_path: Path) -> None:
        elsewhere = own_head(tmp_path / "elsewhere", "ben")
        table.desk.heads.choose(elsewhere)
        assert table.model.head is not None
        assert table.model.sitter == "Head ben"
        assert table.model.settings.own_head == str(elsewhere)
        table.desk.heads.load("generic")
        assert (str(elsewhere), "Head ben") in table.desk.heads.titles()
        elsewhere.unlink()
        assert (str(elsewhere), "Head ben") not in table.desk.heads.titles()

    @pytest.mark.parametrize("part", ["head", "pack", "shape", "size"])
    def test_what_cannot_be_used_gives_way_to_the_generic_head(
        self, table: Table, tmp_path: Path, part: str
    ) -> None:
        anna = own_head(tmp_path / "heads", "anna")
        if part == "head":
            anna.unlink()
        elif part == "pack":
            pack_path(anna).write_bytes(b"nothing")
        elif part == "shape":
            shape_path(anna).unlink()
        else:
            pack = synthetic_pack(shape=(16, 32))
            transport = lambert_sphere_transport(shape=(16, 32))
            header = replace(pack.header, transport_sha256=save_transport(anna, transport))
            save_pack(pack_path(anna), replace(pack, header=header))
        table.desk.heads.load(str(anna))
        assert len(table.told.errors) == 1
        assert isinstance(table.told.errors[0], CoreError)
        assert table.model.head is not None
        assert table.model.head.name == "generic"


def test_one_photograph_is_a_rough_place_that_names_doubtful_turns(
    table: Table, tmp_path: Path
) -> None:
    light = place([(-70.0, 15.0, 30.0, 8.0), (80.0, 40.0, 30.0, 8.0)], (64, 128))
    codes = np.rint(255.0 * srgb_encode(np.minimum(light, 1.0))).astype(np.uint8)
    file = tmp_path / "sphere.png"
    assert cv2.imwrite(str(file), codes)
    table.open()
    table.desk.open_paths([file])
    found, folder = table.model.place, table.model.place_folder
    assert found is not None
    assert found.capture is not None
    assert folder is not None
    assert found.capture.plan == "rough"
    assert found.capture.frames[0].shutter_s == 0.0
    (rough,) = found.capture.cautions
    doubtful = rough.styles
    assert doubtful
    assert read_place(folder).capture == found.capture
    # Whoever opens the file alone is told as well.
    assert read_environment(folder / found.environment).rough
    notice = advice_notice(found, find(light), None, CameraBlock())
    assert notice is not None
    assert notice.title.startswith("Rough answer")
    # The cards name them as users know them.
    assert notice.body.endswith(CARDS_SHOW_TURNS)
    assert not any(name in notice.body for name in doubtful)
    for card in table.presenter.resolve().cards:
        assert ("Doubtful" in card.tip) == (card.key in doubtful)


def test_a_panorama_with_a_gap_and_a_clipped_lamp_marks_its_styles(
    table: Table, tmp_path: Path
) -> None:
    light = place([(-70.0, 15.0, 30.0, 8.0), (80.0, 40.0, 30.0, 8.0)], (64, 128))
    light[40, 3:40] = 3.0  # Else the lamps are panels of even radiance.
    alpha = np.ones((64, 128, 1), np.float32)
    alpha[48:] = 0.0
    file = tmp_path / "gap.exr"
    pixels = np.dstack([light * alpha, alpha])
    write_image(file, pixels, "float", {}, ("R", "G", "B", "A"))
    table.open()
    table.desk.open_paths([file])
    found, folder = table.model.place, table.model.place_folder
    assert found is not None
    assert found.capture is not None
    assert folder is not None
    facts = found.capture
    assert facts.blind == pytest.approx(0.146, abs=0.01)
    clipped, unseen = facts.cautions
    assert (clipped.hazard, unseen.hazard) == (Hazard.CLIPPED, Hazard.UNSEEN)
    assert clipped.styles
    assert read_place(folder).capture == facts
    # The file that is kept still says what was not seen.
    kept = read_environment(folder / found.environment)
    assert kept.unseen is not None
    assert kept.unseen[48:].all()
    assert kept.clipped is not None
    lamps = find(light, clipped=kept.clipped).lamps
    assert any(lamp.clipped for lamp in lamps)
    notice = advice_notice(found, find(light), None, CameraBlock())
    assert notice is not None
    assert "leaves 15% of the sphere empty" in f"{notice.title} {notice.body}"
    assert notice.body.endswith(CARDS_SHOW_ANSWERS)
    doubtful = {*clipped.styles, *(unseen.styles or ())}
    for card in table.presenter.resolve().cards:
        assert ("Doubtful" in card.tip) == (card.key in doubtful)


def test_layers_are_asked_for_and_one_is_opened(table: Table, tmp_path: Path) -> None:
    file = tmp_path / "layers.exr"
    key, fill = place([(-70.0, 15.0, 30.0, 8.0)], (64, 128)), place([], (64, 128))
    names = tuple(f"{layer}.{channel}" for layer in ("key", "fill") for channel in "RGB")
    write_image(file, np.dstack([key, fill]), "float", {}, names)
    asked: list[tuple[str, ...]] = []
    table.open()
    table.desk.layer_asker = lambda: asked.append(table.desk.layers)
    table.desk.open_paths([file])
    assert [set(each) for each in asked] == [{"key", "fill"}]
    table.desk.choose_layer("key")
    assert table.model.light is not None
    assert table.model.light.environment.radiance.max() == 8.0
    assert table.model.place is not None
    assert table.model.place.capture is not None
    assert any(
        isinstance(remark, LayerChosen) and remark.layer == "key"
        for remark in table.model.place.capture.warnings
    )


def test_a_ball_says_how_fine_it_is_and_what_it_does_not_show() -> None:
    facts = CaptureFacts(
        plan="ball", notes=(PlainRemark("It resolves 0.5°."), PlainRemark("3 % was not seen."))
    )
    ball = Place("Ball", datetime(2026, 6, 21, 12, tzinfo=UTC), capture=facts)
    notice = advice_notice(ball, find(place([], (64, 128))), None, CameraBlock())
    assert notice == Notice("note", "It resolves 0.5°.", "3 % was not seen.")
    # What must be said comes first; nothing is left out.
    ball = replace(ball, capture=replace(facts, warnings=(PlainRemark("Frame 2 moved."),)))
    notice = advice_notice(ball, find(place([], (64, 128))), None, CameraBlock())
    assert notice == Notice("advice", "Frame 2 moved.", "It resolves 0.5°. 3 % was not seen.")
    # A sun that no frame holds; each sentence is said once.
    sun = Findings((LampFinding("A", "sun", 40.0, 30.0, 0.5, 0.6, True),))
    restored = SunRestored("A", 30.0, "clear", 95000.0, 70000.0, 110000.0)
    notes = (PlainRemark("It resolves 0.5°."), restored)
    facts = CaptureFacts(plan="ball", notes=notes, frames=(FrameFacts("a.jpg", 0.01),))
    notice = advice_notice(replace(ball, capture=facts), sun, None, CameraBlock())
    assert notice is not None
    assert notice.body == f"{remark_words(restored)} It resolves 0.5°."


def test_a_panorama_says_what_was_repaired_and_what_is_a_guess(
    table: Table, tmp_path: Path
) -> None:
    light = place([(-70.0, 15.0, 30.0, 8.0)], (64, 128))
    light[3, 7] = np.nan
    write_exr(tmp_path / "kept.exr", light, rough=True)
    table.open()
    table.desk.open_paths([tmp_path / "kept.exr"])
    found = table.model.place
    assert found is not None
    notice = advice_notice(found, find(np.nan_to_num(light)), None, CameraBlock())
    assert notice is not None
    said = (notice.title, *notice.body.splitlines())
    assert any("1 NaN texel" in line for line in said), said
    assert any("kept was made from one photo" in line for line in said), said
