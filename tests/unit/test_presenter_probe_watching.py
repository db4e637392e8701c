"""A watched folder: brackets that arrive become places; and the words of the probe's screen."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from app.core.measure.finish.findings import Findings, LampFinding
from app.core.measure.finish.lamp_detection import Source
from app.devices.errors import DownloadFailed, Unreachable
from app.ui.screens.probe.capture.notice import DISCONNECTED, FRAMES_SAVED, HowFar, trouble_notice
from app.ui.screens.probe.capture.plans import plan_parts
from app.ui.screens.probe.lamps import lamp_rows
from app.words.lights import NAMES, share_words
from tests.helpers.probe_screen import Bench


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", lambda handle: None)


def bracket(bench: Bench) -> list[Path]:
    """Take frames with the simulated camera, for somebody else to drop somewhere."""
    result = bench.rig.shoot("paper")
    return list(result.frames)


class TestWatching:
    def test_a_bracket_that_arrives_becomes_a_place(self, tmp_path: Path) -> None:
        bench = Bench(tmp_path)
        frames = bracket(bench)
        folder = tmp_path / "arriving"
        folder.mkdir()
        watching = bench.presenter.watching
        sleep = bench.rig.clock.sleep
        copied: list[Path] = []

        def slept(seconds: float) -> None:
            # The first look has been taken by now; what comes after it is new.
            if not copied:
                copied.extend(Path(shutil.copy2(frame, folder)) for frame in frames)
            if bench.model.place is not None:
                bench.runner.cancel("watch")
            sleep(seconds)

        bench.rig.clock.sleep = slept  # type: ignore[method-assign]
        watching.start(folder)
        assert bench.model.place is not None
        assert bench.model.place.capture is not None
        assert len(bench.model.place.capture.frames) == 3
        assert any("bracket of 3 frames" in message for message in bench.told.messages)
        assert watching.folder is None
        assert all(path.is_file() for path in copied)

    def test_a_folder_that_is_not_there(self, tmp_path: Path) -> None:
        bench = Bench(tmp_path)
        bench.presenter.watching.start(tmp_path / "gone")
        assert bench.presenter.watching.folder is None
        assert "cannot be read" in bench.told.messages[-1]

    def test_it_is_shown_and_can_be_stopped(self, tmp_path: Path) -> None:
        bench = Bench(tmp_path)
        bench.runner.held.add("watch")
        bench.presenter.watching.start(tmp_path)
        assert bench.presenter.resolve().watching == tmp_path.name
        bench.presenter.watching.stop()
        assert bench.presenter.resolve().watching == ""

    def test_the_folder_of_the_settings_is_watched_from_the_start(self, tmp_path: Path) -> None:
        bench = Bench(tmp_path)
        bench.runner.held.add("watch")
        folder = tmp_path / "in"
        bench.model.update(settings=bench.model.settings.with_("watch_folder", str(folder)))
        bench.presenter.enter()
        assert bench.presenter.watching.folder == folder
        bench.presenter.watching.stop()
        bench.presenter.enter()
        assert bench.presenter.watching.folder is None

    def test_the_same_folder_again_goes_on_being_watched(self, tmp_path: Path) -> None:
        bench = Bench(tmp_path)
        ends: list[Callable[[], None]] = []

        def submit(key: str, work: object, **calls: Any) -> None:
            ends.append(calls["cancelled"])

        bench.runner.submit = submit  # type: ignore[method-assign]
        watching = bench.presenter.watching
        watching.start(tmp_path)
        watching.start(tmp_path)
        # The first wait has ended by now, and says so only when the second has begun.
        ends[0]()
        assert watching.folder == tmp_path
        ends[1]()
        assert watching.folder is None


class TestWords:
    def test_a_lower_bound_is_never_rounded_up(self) -> None:
        assert share_words(0.6499, True) == "at least 64%"
        assert share_words(0.6499, False) == "65%"
        assert share_words(0.0047, True) == "at least 0.4%"

    def test_a_row_is_read_out_whole(self) -> None:
        lamp = LampFinding("A", "window", 47.4, 30.2, 20.0, 0.64, True)
        (row,) = lamp_rows(Findings((lamp,)), 0.0)
        assert row.spoken.startswith(f"A, {NAMES['window']}, {row.where}, ")
        assert re.findall("[0-9]+", row.spoken) == ["47", "30", "64"]
        assert share_words(0.64, clipped=True) in row.spoken

    @pytest.mark.parametrize(
        ("kind", "name"),
        [("ground", "Bright ground"), ("wall", "Bright wall"), ("above", "Sky or ceiling")],
    )
    def test_a_bright_area_is_called_what_it_is(self, kind: Source, name: str) -> None:
        lamp = LampFinding("A", kind, 47.4, 12.0, 40.0, 0.64, True)
        assert lamp_rows(Findings((lamp,)), 0.0)[0].name == name

    def test_plans_before_any_camera(self) -> None:
        paper, full = plan_parts(None, None)
        assert paper.second.startswith("3 frames, ")
        assert int(full.second.removeprefix("up to ").split()[0]) > 3


class TestTroubles:
    def test_one_frame_is_here_of_seven(self) -> None:
        notice = trouble_notice(
            DownloadFailed("Gone.", "", "interrupted"), HowFar(1, 7, False, True)
        )
        assert notice.title == DISCONNECTED.format(here=1, total=7)
        assert notice.body.startswith(f"{FRAMES_SAVED[1]} ")
        assert notice.buttons == (("resume", "Resume"),)

    def test_it_went_away_before_any_frame(self) -> None:
        notice = trouble_notice(Unreachable("No answer.", "Go nearer."), HowFar(0, 3, True, True))
        assert "while taking the frames" in notice.title
        notice = trouble_notice(Unreachable("No answer.", "Go nearer."), HowFar())
        assert (notice.title, notice.body) == ("No answer.", "Go nearer.")
        assert [key for key, _ in notice.buttons] == ["again", "search"]
