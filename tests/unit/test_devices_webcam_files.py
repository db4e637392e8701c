"""Films, and a video in place of a webcam, on virtual time."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.measure.film.frames import FrameClock, film_frames
from app.devices.clock import VirtualClock
from app.devices.webcam import WebcamError, WebcamState
from app.devices.webcam.files import (
    VideoFile,
    check_video,
)
from tests.helpers.films import retimed, write_film
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.waiting import PATIENCE_S, until

Bytes = NDArray[np.uint8]
FPS: Final = 10.0


def level(number: int) -> Bytes:
    """Give an even picture that says its number by its grey."""
    return np.full((64, 96, 3), 40 + 20 * number, np.uint8)


def number_of(picture: Bytes) -> int:
    return round((float(picture.mean()) - 40.0) / 20.0)


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("video") / "walk.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), FPS, (96, 64))
    assert writer.isOpened()
    for number in range(8):
        writer.write(level(number))
    writer.release()
    return path


def code_of(call: Callable[[], object]) -> str:
    with pytest.raises(WebcamError) as caught:
        call()
    assert caught.value.hint
    return caught.value.code


class TestFilmTimes:
    def test_film_frames_have_the_times_of_the_file(self, tmp_path: Path) -> None:
        steps = [0.1, 0.1, 0.033, 0.4, 0.05, 0.25, 0.1, 0.1]
        frames = tuple(level(number) for number in range(8))
        film = retimed(write_film(tmp_path / "vfr.mp4", frames, FPS), steps)
        found = list(film_frames(film, 8, 0))
        times = [time_s for time_s, _, _ in found]
        assert times == pytest.approx(np.cumsum([0.0, *steps[:-1]]), abs=1e-3)
        assert [number_of(picture) for _, _, picture in found] == list(range(8))
        some = [time_s for time_s, _, _ in film_frames(film, 3, 0)]
        assert some == pytest.approx([times[0], times[3], times[7]])

    def test_film_frames_of_an_even_rate_are_evenly_apart(self, video: Path) -> None:
        times = [time_s for time_s, _, _ in film_frames(video, 8, 0)]
        assert times == pytest.approx(np.arange(8) / FPS, abs=1e-3)

    @pytest.mark.parametrize(
        ("stamps", "times"),
        [
            ((0.0, 0.5, 0.6), (0.0, 0.5, 0.6)),
            ((7.0, 7.5, 7.6), (0.0, 0.5, 0.6)),  # an edit list may begin anywhere
            ((0.0, 0.0, 0.0), (0.0, 0.1, 0.2)),  # no timestamps
            ((math.nan, math.nan, math.inf), (0.0, 0.1, 0.2)),
            ((0.0, 0.3, 0.2, 0.4), (0.0, 0.3, 0.4, 0.6)),  # one that goes back
            ((0.0, 1e9, 1e9 + 0.3), (0.0, 0.1, 0.4)),
            ((-0.04, 0.0, 0.04), (0.0, 0.04, 0.08)),
        ],
    )
    def test_frame_clock_falls_back_to_the_rate(
        self, stamps: tuple[float, ...], times: tuple[float, ...]
    ) -> None:
        clock = FrameClock(FPS)
        assert [clock.time_of(stamp) for stamp in stamps] == pytest.approx(times)


class TestVideo:
    def player(self, path: Path, clock: VirtualClock, width: int = 0) -> VideoFile:
        return VideoFile(path, clock, width=width)

    def test_it_plays_at_its_own_pace_and_begins_again(self, video: Path) -> None:
        clock = VirtualClock(100.0)
        player = self.player(video, clock)
        player.connect()
        numbers: list[int] = []
        times: list[float] = []
        while len(numbers) < 20:
            picture = player.read()
            if picture is not None:
                numbers.append(number_of(picture))
                times.append(clock.now() - 100.0)
        player.disconnect()
        assert numbers == [*range(8), *range(8), *range(4)]
        np.testing.assert_allclose(np.diff(times[:8]), 1.0 / FPS, atol=0.02)
        assert times[-1] == pytest.approx(20 / FPS, abs=0.15)

    def test_a_slow_reader_makes_it_slower_and_not_hurried(self, video: Path) -> None:
        clock = VirtualClock()
        player = self.player(video, clock)
        player.connect()
        for _ in range(3):
            player.read()
        clock.sleep(60.0)
        before = clock.now()
        for _ in range(4):
            player.read()
        player.disconnect()
        assert clock.now() - before < 4 / FPS + 0.01

    def test_pictures_are_made_no_wider_than_is_wanted(self, video: Path) -> None:
        player = self.player(video, VirtualClock(), 48)
        player.connect()
        picture = player.read()
        player.disconnect()
        assert picture is not None
        assert picture.shape == (32, 48, 3)

    def test_a_disk_that_is_pulled_out_and_put_back(self, video: Path, tmp_path: Path) -> None:
        disk, away = tmp_path / "disk", tmp_path / "away"
        disk.mkdir()
        shutil.copy(video, disk)
        webcam = VideoFile(disk / video.name, ScaledClock(10.0))
        assert webcam.name == video.name
        webcam.open()
        until(lambda: webcam.count > 3)
        disk.rename(away)
        until(lambda: (error := webcam.error) is not None and error.code == "no-file")
        assert webcam.state is not WebcamState.LIVE
        count = webcam.count
        away.rename(disk)
        until(lambda: webcam.count > count + 3)
        assert webcam.error is None
        webcam.close(PATIENCE_S)

    @pytest.mark.parametrize(
        "content",
        [
            b"",
            b"#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n",
            b"ffconcat version 1.0\nfile '/etc/passwd'\n",
            b"v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\n",
            b"GIF89a" + b"\x00" * 400,
            b"\x89PNG\r\n\x1a\n" + b"\x00" * 400,
            b"G" + b"\x00" * 399,
        ],
    )
    def test_what_holds_no_pictures_itself_is_refused(self, tmp_path: Path, content: bytes) -> None:
        path = tmp_path / "film.mp4"
        path.write_bytes(content)
        assert code_of(lambda: check_video(path)) == "bad-file"
        assert code_of(self.player(path, VirtualClock()).connect) == "bad-file"

    def test_missing_files_and_folders(self, tmp_path: Path) -> None:
        assert code_of(lambda: check_video(tmp_path / "no.mp4")) == "no-file"
        assert code_of(lambda: check_video(tmp_path)) == "no-file"
        assert code_of(lambda: check_video(Path("a\x00b"))) == "no-file"

    @pytest.mark.parametrize("kept", [8, 100, 700])
    def test_a_cut_file_never_ends_otherwise(self, video: Path, tmp_path: Path, kept: int) -> None:
        path = tmp_path / "cut.avi"
        path.write_bytes(video.read_bytes()[:kept] + bytes(range(256)))
        player = self.player(path, VirtualClock())
        codes = []
        for call in (player.connect, *[player.read] * 30):
            try:
                call()
            except WebcamError as error:
                codes.append(error.code)
        player.disconnect()
        assert set(codes) <= {"bad-file"}

    def test_kinds_that_are_known_by_what_is_in_them(self, tmp_path: Path) -> None:
        path = tmp_path / "film"
        packets = (b"G" + bytes(187)) * 2
        for content in (
            b"\x00\x00\x00\x18ftypmp42",
            b"\x1a\x45\xdf\xa3" + bytes(20),
            b"RIFF\x00\x00\x00\x00AVI LIST",
            b"\x00\x00\x01\xba" + bytes(20),
            packets,
            (bytes(4) + b"G" + bytes(187)) * 2,
        ):
            path.write_bytes(content)
            check_video(path)

    def test_ffmpeg_that_fails_or_lies(self, video: Path) -> None:
        def player(lying: Lying) -> VideoFile:
            return VideoFile(video, VirtualClock(), capture=lambda _: lying)

        for lying in (Lying(opens=False), Lying(side=90_000.0), Lying(side=0.0)):
            assert code_of(player(lying).connect) == "bad-file"
            assert lying.released == 1
        for lying in (Lying(), Lying(error=cv2.error("broken"))):
            open_one = player(lying)
            open_one.connect()
            assert code_of(open_one.read) == "bad-file"
            open_one.disconnect()
            assert code_of(open_one.read) == "bad-file"

        def fails(name: str) -> Lying:
            raise cv2.error(name)

        assert code_of(VideoFile(video, VirtualClock(), capture=fails).connect) == "bad-file"


@dataclass
class Lying:
    """A file in which there are no pictures."""

    opens: bool = True
    side: float = 64.0
    error: Exception | None = None
    released: int = 0

    def isOpened(self) -> bool:
        return self.opens

    def read(self) -> tuple[bool, object]:
        if self.error is not None:
            raise self.error
        return False, None

    def set(self, propId: int, value: float) -> bool:
        return propId < 0 < value

    def get(self, propId: int) -> float:
        return self.side if propId in (3, 4) else 0.0

    def release(self) -> None:
        self.released += 1
