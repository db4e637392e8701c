"""The live preview without a screen, and the sign of a capture with its voice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from app.devices.capture.status import Stage, Status
from app.ui.presenters.window_model import Step
from app.ui.screens.probe.capture.distant_sign import DistantSign, sign_of
from app.ui.screens.probe.live import KEY, OPENING, ROUGH, Live
from tests.helpers.probe_screen import Bench


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", lambda handle: None)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    made = Bench(tmp_path)
    made.presenter.enter()
    return made


def watched(bench: Bench, pictures: int) -> list[Live]:
    """Look through the preview for so many pictures, then close it."""
    seen: list[Live] = []

    def beat() -> None:
        live = bench.presenter.resolve().live
        if live is not None and live.picture is not None:
            seen.append(live)
        if len(seen) >= pictures:
            bench.presenter.live.stop()

    bench.runner.beats.append(beat)
    bench.presenter.live.toggle()
    bench.runner.beats.remove(beat)
    return seen


class TestPreview:
    def test_the_three_best_styles_marked_as_rough(self, bench: Bench) -> None:
        live = watched(bench, 3)[-1]
        assert live.picture is not None
        assert live.picture.shape == (512, 1024, 3)
        assert 1 <= len(live.cards) <= 3
        for card in live.cards:
            assert "rough" in card.note
            assert ("needs the bracket" in card.note) == card.unsure
            assert card.turn.endswith("°")
            assert card.grade in ("in reach", "in reach, soft")
            assert card.title in card.spoken
        assert bench.presenter.resolve().live is None
        assert bench.rig.camera.preview.body is None

    def test_a_capture_closes_it_first(self, bench: Bench) -> None:
        states = []

        def beat() -> None:
            states.append(bench.presenter.resolve())
            if states[-1].live is not None and bench.model.light is None:
                bench.runner.beats.remove(beat)
                bench.presenter.live.stop()

        bench.runner.beats.append(beat)
        bench.presenter.live.toggle()
        assert KEY in bench.runner.ran
        bench.presenter.capture()
        assert bench.presenter.resolve().has_place
        assert bench.presenter.resolve().live is None

    def test_taking_a_capture_stops_the_preview(self, bench: Bench) -> None:
        bench.runner.held |= {KEY, "capture"}
        bench.presenter.live.toggle()
        assert bench.presenter.resolve().live is not None
        bench.presenter.capture()
        assert bench.presenter.resolve().live is None

    @pytest.mark.parametrize("ends", ["left", "opened"])
    def test_it_ends_with_the_screen_and_with_another_light(self, bench: Bench, ends: str) -> None:
        bench.runner.held.add(KEY)
        bench.presenter.live.toggle()
        assert bench.presenter.resolve().live is not None
        if ends == "left":
            bench.presenter.leave()
        else:
            bench.presenter.open_demo()
        assert bench.presenter.resolve().live is None

    def test_a_lost_camera_is_said_and_it_goes_on_by_itself(self, bench: Bench) -> None:
        camera, told = bench.rig.camera, []
        reachable, times = camera.reachable, [0]

        def beat() -> None:
            live = bench.presenter.resolve().live
            if live is None:
                return
            told.append(live.message)
            times[0] += 1
            if times[0] == 3:
                camera.reachable = lambda: False  # type: ignore[method-assign]
                camera.reconnect()
            if told.count(ROUGH) > 4 and "lost" in " ".join(told):
                bench.presenter.live.stop()

        # The screen's clock goes on while the reader waits for the camera.
        sleep = bench.rig.clock.sleep

        def slept(seconds: float) -> None:
            sleep(seconds)
            bench.presenter.tick()
            beat_quietly()

        def beat_quietly() -> None:
            live = bench.presenter.resolve().live
            if live is not None and live.trouble:
                told.append(live.message)
                camera.reachable = reachable  # type: ignore[method-assign]

        bench.rig.clock.sleep = slept  # type: ignore[method-assign]
        bench.runner.beats.append(beat)
        bench.presenter.live.toggle()
        assert any(message.startswith("Preview lost") for message in told)
        assert told[-1] == ROUGH

    def test_a_camera_that_takes_its_time_is_not_lost(self, bench: Bench) -> None:
        bench.runner.held.add(KEY)
        live = bench.presenter.live
        live.toggle()
        bench.rig.clock.sleep(30.0)
        live.tick()
        assert live.live is not None
        assert live.live.message == OPENING
        live._why = "Busy."
        live.tick()
        assert live.live == Live(message="Busy.", trouble=True)

    def test_a_slow_computer_answers_less_often_and_of_the_newest(self, bench: Bench) -> None:
        bench.runner.held |= {KEY, "live-answer"}
        live = bench.presenter.live
        live.toggle()
        for data in (b"1", b"2", b"3"):
            live._pictures.put(data)
            live.tick()
        assert bench.runner.ran.count("live-answer") == 1
        bench.runner.release("live-answer")
        bench.runner.held.add("live-answer")
        assert live._pictures.get() == b"3"


class TestSign:
    def test_its_words_at_each_stage(self) -> None:
        exposing = Status(Stage.EXPOSING, "Exposure 3 of 6", shot=3, shots=6)
        assert sign_of(Status(), 0, 5) == DistantSign()
        assert sign_of(Status(Stage.METERING, "Metering"), 0, 5).big == "Get ready"
        assert sign_of(Status(Stage.METERING, "Metering"), 0, 0).big == "Kneel now"
        assert sign_of(exposing, 4, 5) == DistantSign("act", "4", "Kneel now", spoken="Kneel now")
        assert sign_of(exposing, 3, 5).spoken == "three"
        frame = sign_of(exposing, 0, 5)
        assert (frame.kind, frame.big, frame.caption) == ("act", "Frame 3 of 6", "Stay down")
        assert frame.fraction == pytest.approx(2 / 6)
        for status in (replace(exposing, may_move=True), Status(Stage.MERGING, may_move=True)):
            assert sign_of(status, 0, 5).kind == "move"
            assert sign_of(status, 0, 5).big == "You may move"

    @pytest.mark.parametrize("model", ["V", "S", "SC2", "insta360"])
    def test_every_camera_counts_down(self, tmp_path: Path, model: str) -> None:
        """Brackets of the camera's own and single pictures alike."""
        bench = Bench(tmp_path, {"model": model} if model != "insta360" else {"model": "generic"})
        bench.presenter.enter()
        seen: list[DistantSign] = []

        def beat() -> None:
            running = bench.presenter.resolve().running
            if running is not None:
                seen.append(running.sign)

        sleep = bench.rig.clock.sleep

        def slept(seconds: float) -> None:
            sleep(seconds)
            bench.presenter.tick()
            beat()

        bench.rig.clock.sleep = slept  # type: ignore[method-assign]
        bench.runner.beats.append(beat)
        bench.presenter.capture()
        big = list(dict.fromkeys(sign.big for sign in seen))
        assert big.index("5") < big.index("1") < big.index("You may move")
        frames = [words for words in big if words.startswith("Frame")]
        assert frames == [f"Frame {number} of 3" for number in (1, 2, 3)][-len(frames) :]
        assert any(sign.picture is not None for sign in seen if sign.kind == "act")

    def test_a_voice_says_it_once_and_only_where_it_is_wanted(self, bench: Bench) -> None:
        sleep = bench.rig.clock.sleep

        def slept(seconds: float) -> None:
            sleep(seconds)
            bench.presenter.tick()

        bench.rig.clock.sleep = slept  # type: ignore[method-assign]
        bench.presenter.capture()
        assert bench.sounds.said == []
        bench.model.update(settings=bench.model.settings.with_("voice", True))
        bench.presenter.capture()
        said = bench.sounds.said
        assert said[:4] == ["Kneel now", "three", "two", "one"]
        assert said[-2:] == ["Frame 3 of 3", "You may move"]
        assert len(said) == len(set(said))


class TestBackToTheStyle:
    def test_clipped_then_the_full_range_then_the_same_style(self, bench: Bench) -> None:
        bench.presenter.capture()
        assert bench.model.place is not None
        assert bench.model.place.capture is not None
        assert bench.model.place.capture.plan == "paper"
        name = sorted(one.name for one in bench.model.results if one.attainable)[-1]
        bench.model.update(step=Step.PROBE, chosen=name, recapture=True)
        assert bench.model.place.capture.plan == "full"
        assert bench.model.step == Step.STYLES
        assert bench.model.chosen == name
        assert not bench.model.recapture

    def test_without_a_camera_probe_says_so(self, bench: Bench) -> None:
        bench.presenter.open_demo()
        bench.model.update(camera=None)
        bench.model.update(step=Step.PROBE, recapture=True)
        assert bench.presenter.resolve().running is None
        assert bench.model.step == Step.PROBE
        assert not bench.model.recapture
