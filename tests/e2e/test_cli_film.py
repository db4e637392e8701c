"""`turnlight film` as a user meets it: a video in, the styles that it showed out."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.core.base.angles import difference
from app.core.base.arrays import Bytes
from app.core.base.imaging.images import write_exr
from app.core.base.progress import Token, silent
from app.core.environment.environment import read_environment
from app.core.localization.features import build_index
from app.core.localization.views import look
from app.core.places.intake import sort_out
from app.core.places.load_saved import load_place
from app.core.places.open_files import OpenOptions, make_place
from app.core.solver.solve import solve_all
from app.core.storage.settings import Settings
from app.core.styles.style_pack_file import load_named_pack
from tests.helpers.cases import sample_first
from tests.helpers.films import LENS, STEP_DEG, frame, retimed, turn_frames, write_film
from tests.unit.test_facing import place

PLACE = "sunrise"


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A head that turns a little more than once, filmed by a camera that goes around with it."""
    return write_film(tmp_path_factory.mktemp("film") / "turn.mp4", turn_frames(PLACE, 42))


def said(film: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, object]:
    assert main(["film", str(film), "--json", *more]) == 0
    facts: dict[str, object] = json.loads(capsys.readouterr().out)
    return facts


@pytest.mark.slow
def test_a_filmed_turn_tells_what_the_place_can_do(
    film: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "light.exr"
    facts = said(film, capsys, "-o", str(target))
    assert facts["frames"] == 42
    assert facts["seen"] == 1.0
    assert facts["notes"] == []
    truth = {one.name: one for one in solve_all(load_named_pack("generic"), place(PLACE).searched)}
    offered = 0
    for style in facts["styles"]:  # type: ignore[attr-defined]
        true_deg = style["time_s"] * 2.0 * STEP_DEG
        assert difference(style["heading_deg"], true_deg) < 3.0
        own = truth[style["name"]]
        if style["grade"] in ("yes", "soft") and own.attainable:
            offered += 1
            curve = own.match_curve
            at = round(style["turn_refined_deg"] / 5.625) % 64
            assert (curve.max() - curve[at]) / np.ptp(curve) <= 0.1, style["name"]
    assert offered >= 4
    assert read_environment(target).shape[0] * 2 == read_environment(target).shape[1]


@pytest.mark.slow
def test_times_are_those_of_the_file_at_a_variable_frame_rate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = np.where(np.arange(42) % 5 < 2, 0.2, 0.7)
    film = write_film(tmp_path / "vfr.mp4", turn_frames(PLACE, 42))
    facts = said(retimed(film, steps.tolist()), capsys)
    shown = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    for style in facts["styles"]:  # type: ignore[attr-defined]
        number = int(np.abs(shown - style["time_s"]).argmin())
        assert style["time_s"] == pytest.approx(shown[number], abs=1e-3)
        assert abs(difference(style["heading_deg"], number * STEP_DEG)) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("words", sample_first([["--mirrored"], []], 1))
def test_mirrored_film_gives_the_true_turns(
    film: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    """With the place, by itself; without, where it is said."""
    swapped = tuple(np.ascontiguousarray(one[:, ::-1]) for one in turn_frames(PLACE, 42))
    mirror = write_film(tmp_path / "selfie.mp4", swapped)
    light = tmp_path / "light.exr"
    write_exr(light, place(PLACE).environment.radiance)
    where = () if words else ("--place", str(light))
    found, true = said(mirror, capsys, *words, *where), said(film, capsys)
    assert (found["mirrored"], true["mirrored"]) == (True, None)
    for one, other in zip(found["styles"], true["styles"], strict=True):  # type: ignore[call-overload]
        assert one["name"] == other["name"]
        if other["grade"] == "yes":
            assert difference(one["turn_refined_deg"], other["turn_refined_deg"]) < 8.0


def refused(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["film", str(path)]) in (2, 3)
    lines = [line for line in capsys.readouterr().err.splitlines() if "%" not in line]
    return lines[-1]


def test_a_camera_that_stands_still_shows_a_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    same = tuple([frame(PLACE, 90.0)] * 10)
    assert "does not turn" in refused(write_film(tmp_path / "still.mp4", same), capsys)


def test_a_film_without_a_face_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty: tuple[Bytes, ...] = tuple(
        look(place(PLACE).display, 10.0 * number, LENS) for number in range(24)
    )
    assert "No face" in refused(write_film(tmp_path / "empty.mp4", empty), capsys)


@pytest.mark.parametrize("content", [b"", b"no video", b"\0\0\0\x18ftypmp42" + bytes(200)])
def test_what_is_no_film_is_refused(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "film.mp4"
    path.write_bytes(content)
    assert "cannot be played" in refused(path, capsys)


def test_a_missing_film_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "gone.mp4 is missing" in refused(tmp_path / "gone.mp4", capsys)


@pytest.mark.slow
def test_live_it_says_on_the_way_what_is_known(
    film: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["film", str(film), "--live"]) == 0
    out, err = capsys.readouterr()
    assert err.count("After ") >= 3
    assert "from the first frame" in out


@pytest.mark.slow
def test_in_the_window_it_is_a_place_that_keeps_its_film(film: Path, tmp_path: Path) -> None:
    now = datetime(2026, 11, 28, tzinfo=UTC)
    made = make_place(sort_out([film]), OpenOptions(tmp_path, now, Settings()), Token(), silent)
    assert made.folder is not None
    assert made.trouble is None
    assert (made.folder / "originals" / film.name).stat().st_size == film.stat().st_size
    again = load_place(made.folder)
    assert again.place.capture is not None
    assert again.place.capture.plan == "film"
    # What a live camera finds its way back by.
    assert len(build_index(again.light.display)) >= 48
