"""Filming a turn with the live camera, without a screen."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.progress import Token, silent
from app.core.measure.film.film import read_film
from app.core.places.files.shots import photo_of, read_shots
from app.core.styles.style_pack_file import load_named_pack
from app.devices.webcam import WebcamFrame
from app.ui.screens.probe.filming import Filming
from tests.helpers.films import turn_frames
from tests.helpers.probe_screen import Bench
from tests.unit.test_measure_film import stood_still


class Camera:
    """Gives the next picture at each tick."""

    def __init__(self, pictures: Iterator[Any]) -> None:
        self._pictures = pictures
        self.frame: WebcamFrame | None = None
        self.open = False

    def start(self) -> None:
        self.open = True

    def stop(self) -> None:
        self.open = False

    def tick(self) -> bool:
        picture = next(self._pictures, None)
        if picture is None:
            return False
        self.frame = WebcamFrame(picture, 0)
        return True


class Held:
    """Keeps the job, to be run in a thread of its own."""

    def __init__(self) -> None:
        self.work: Callable[..., Any] | None = None
        self.how: dict[str, Any] = {}

    def submit(self, key: str, work: Callable[..., Any], **how: Any) -> None:
        self.work, self.how = work, how

    def cancel(self, key: str) -> None:
        self.how["cancelled"]()


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def filming(bench: Bench, held: Held, monkeypatch: pytest.MonkeyPatch, count: int) -> Filming:
    made = bench.presenter.filming
    camera = Camera(iter(turn_frames("interior", count)))
    monkeypatch.setattr(made, "_camera", camera)
    for name in ("submit", "cancel"):
        monkeypatch.setattr(bench.services.runner, name, getattr(held, name))
    return made


@pytest.mark.slow
def test_a_filmed_turn_becomes_a_place_with_its_video(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    held, opened = Held(), []
    made = filming(bench, held, monkeypatch, 41)
    monkeypatch.setattr(bench.desk, "open_film", lambda *what: opened.append(what))
    made.toggle()
    assert held.work is not None
    results: list[Any] = []
    take = held.work
    work = threading.Thread(target=lambda: results.append(take(Token(), silent)), daemon=True)
    work.start()
    messages = set()
    for _ in range(41):
        while made._roll.pictures.full():
            time.sleep(0.01)
        bench.rig.clock.sleep(0.4)
        made.tick()
        assert made.live is not None
        messages.add(made.live.message)
    made.toggle()
    work.join(120.0)
    held.how["done"](results[0])
    (film, video, folder) = opened[0]
    assert film.visible.mean() > 0.9
    assert video.stat().st_size > 10_000
    assert any("of 360°" in words or "whole turn" in words for words in messages)
    assert made.live is None
    folder.cleanup()


def test_a_film_can_be_given_up(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    held = Held()
    made = filming(bench, held, monkeypatch, 2)
    made.toggle()
    made.tick()
    assert made.live is not None
    assert made.live.picture is not None
    made.stop()
    assert made.live is None


def test_without_a_face_it_says_so(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    held = Held()
    made = filming(bench, held, monkeypatch, 0)
    made.toggle()
    made.toggle()
    assert held.work is not None
    with pytest.raises(Exception, match="No face") as told:
        held.work(Token(), silent)
    held.how["failed"](told.value)
    assert made.live is None


def test_what_was_filmed_is_kept_with_its_place(bench: Bench) -> None:
    film, folder = stood_still([float(yaw) for yaw in range(-48, 50, 4)]), TemporaryDirectory()
    video = Path(folder.name) / "film.mp4"
    video.write_bytes(b"a film" * 20)
    bench.desk.open_film(film, video, folder)
    place, kept = bench.model.place, bench.model.place_folder
    assert place is not None
    assert kept is not None
    assert place.capture is not None
    assert place.name == "Filmed turn"
    assert place.capture.warnings == film.notes
    assert (kept / "originals" / "film.mp4").read_bytes() == b"a film" * 20
    assert not video.exists()


@pytest.mark.slow
def test_the_film_shows_its_own_frame_of_each_style_that_it_offers(bench: Bench) -> None:
    frames = turn_frames("studio", 42)
    film = read_film((0.5 * n, n / len(frames), each) for n, each in enumerate(frames))
    folder = TemporaryDirectory()
    video = Path(folder.name) / "film.mp4"
    video.write_bytes(b"a film")
    bench.desk.open_film(film, video, folder)
    kept = bench.model.place_folder
    assert kept is not None
    shots, lost = read_shots(kept)
    offered = [one for one in film.results(load_named_pack("generic")) if one.attainable]
    assert [one.style for one in shots] == [one.name for one in offered]
    assert len(shots) >= 3
    assert not lost
    for shot, result in zip(shots, offered, strict=True):
        frame = film.frame_at(result.turn_refined_deg)
        assert shot.facing_deg is not None
        assert abs(difference(shot.facing_deg, result.turn_refined_deg)) < 5.0
        picture, shown = cv2.imread(str(photo_of(kept, shot))), film.pictures[frame]
        assert picture is not None
        assert shown is not None
        assert np.array_equal(picture[..., ::-1], shown)
        assert max(shown.shape) <= 256
