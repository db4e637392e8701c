"""Bringing files over: breaks, lies and endless answers, on virtual time."""

import errno
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.devices.capture.download import ATTEMPTS, MAX_FILE_BYTES, fetch_file
from app.devices.capture.fetching import fetch_thumbnails
from app.devices.clock import VirtualClock
from app.devices.errors import (
    BadReply,
    CameraRefused,
    DeviceError,
    DownloadFailed,
    NotACamera,
    PasswordNeeded,
    Unreachable,
    not_written,
)
from app.devices.theta.messages import FileEntry

NAME = "R0010015.JPG"
URL = f"http://192.168.1.1/files/100RICOH/{NAME}"


def picture(seed: int = 1) -> bytes:
    codes = np.random.default_rng(seed).integers(0, 255, (256, 512, 3), np.uint8)
    done, data = cv2.imencode(".jpg", codes)
    assert done
    return data.tobytes()


DATA = picture()


def entry_of(size: int) -> FileEntry:
    return FileEntry(name=NAME, url=URL, size=size)


@dataclass
class Body:
    """A reply as `Incoming` gives it."""

    data: bytes
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)
    length: int | None = None
    breaks_after: int | None = None
    piece: int = 4096
    before: Callable[[], None] = lambda: None

    def chunks(self, size: int = 65536) -> Iterator[bytes]:
        sent = 0
        stop = len(self.data) if self.breaks_after is None else self.breaks_after
        while sent < stop:
            self.before()
            part = self.data[sent : min(sent + min(size, self.piece), stop)]
            sent += len(part)
            yield part
        if self.breaks_after is not None:
            raise Unreachable("The connection broke.")

    def close(self) -> None:
        pass


Answer = Callable[[int], Body]


class Camera:
    """Answers one request after the other with what it was given; the last answer repeats."""

    def __init__(self, clock: VirtualClock, *answers: Answer | DeviceError) -> None:
        self.clock, self.answers = clock, list(answers)
        self.starts: list[int] = []
        self.pictures: dict[str, bytes | DeviceError] = {}

    @contextmanager
    def open_file(self, url: str, *, start: int = 0) -> Iterator[Any]:
        self.starts.append(start)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, DeviceError):
            raise answer
        yield answer(start)

    def thumbnail(self, url: str) -> bytes:
        found = self.pictures[url]
        if isinstance(found, DeviceError):
            raise found
        return found


def plain(data: bytes = DATA, **changes: object) -> Answer:
    """A camera without ranges."""
    return lambda start: Body(data, length=len(data), **changes)  # type: ignore[arg-type]


def ranges(data: bytes = DATA, **changes: object) -> Answer:
    """A camera with ranges."""

    def answer(start: int) -> Body:
        if not start:
            return Body(data, length=len(data), **changes)  # type: ignore[arg-type]
        words = {"content-range": f"bytes {start}-{len(data) - 1}/{len(data)}"}
        rest = data[start:]
        return Body(rest, 206, words, len(rest), **changes)  # type: ignore[arg-type]

    return answer


@dataclass
class Bench:
    folder: Path
    clock: VirtualClock = field(default_factory=VirtualClock)
    token: Token = field(default_factory=Token)
    said: list[tuple[int, int, float]] = field(default_factory=list)

    @property
    def target(self) -> Path:
        return self.folder / NAME

    @property
    def part(self) -> Path:
        return self.folder / f"{NAME}.part"

    def report(self, received: int, size: int, rate: float) -> None:
        self.said.append((received, size, rate))

    def fetch(self, *answers: Answer | DeviceError, size: int = len(DATA)) -> Camera:
        camera = Camera(self.clock, *answers)
        self.camera = camera
        entry = entry_of(size)
        path = fetch_file(camera, entry, self.target, self.clock, self.token, self.report)
        assert path == self.target
        assert not self.part.exists()
        return camera


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_a_file_comes_over_with_progress_and_rate(bench: Bench) -> None:
    def pause() -> None:
        bench.clock.sleep(4096 / 500_000)

    bench.fetch(plain(before=pause))
    assert bench.target.read_bytes() == DATA
    fractions = [received / size for received, size, _ in bench.said]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    received, size, rate = bench.said[-1]
    assert rate == pytest.approx(500_000, rel=0.02)
    assert received == size
    assert len(bench.said) <= bench.clock.now() / 0.1 + 3


def test_a_break_is_continued_where_the_camera_can(bench: Bench) -> None:
    camera = bench.fetch(ranges(breaks_after=5000), ranges())
    assert camera.starts == [0, 5000]
    assert bench.target.read_bytes() == DATA


def test_a_break_starts_again_where_the_camera_cannot(bench: Bench) -> None:
    camera = bench.fetch(plain(breaks_after=5000), plain())
    assert camera.starts == [0, 5000]
    assert bench.target.read_bytes() == DATA


def test_a_part_of_an_earlier_run_is_continued(bench: Bench) -> None:
    bench.part.write_bytes(DATA[:9000])
    assert bench.fetch(ranges()).starts == [9000]
    assert bench.target.read_bytes() == DATA


def test_a_part_that_is_whole_already_is_only_renamed(bench: Bench) -> None:
    bench.part.write_bytes(DATA)
    assert bench.fetch(Unreachable("Nobody is there.")).starts == []


def test_a_file_that_is_there_is_not_fetched_again(bench: Bench) -> None:
    bench.target.write_bytes(DATA)
    assert bench.fetch(Unreachable("Nobody is there.")).starts == []


def test_another_file_of_that_name_is_not_written_over(bench: Bench) -> None:
    bench.target.write_bytes(b"mine")
    with pytest.raises(DownloadFailed, match="already exists"):
        bench.fetch(plain())
    assert bench.target.read_bytes() == b"mine"


@pytest.mark.parametrize(
    "words", ["bytes 0-9/99", "bytes 5001-6000/6001", "", "bytes x", "bytes 5000-4000/*"]
)
def test_a_range_that_does_not_fit_is_not_believed(bench: Bench, words: str) -> None:
    def lie(start: int) -> Body:
        return Body(DATA[:100], 206, {"content-range": words})

    camera = bench.fetch(plain(breaks_after=5000), lie, plain())
    assert camera.starts == [0, 5000, 0]
    assert bench.target.read_bytes() == DATA


def test_a_refused_range_starts_again(bench: Bench) -> None:
    bench.part.write_bytes(DATA[:9000])
    refusal = CameraRefused("No such range.", status=416)
    assert bench.fetch(refusal, plain()).starts == [9000, 0]


def test_every_gain_earns_new_attempts(bench: Bench) -> None:
    step = len(DATA) // 12
    camera = bench.fetch(ranges(breaks_after=step), *[ranges(breaks_after=step)] * 11, ranges())
    assert len(camera.starts) > ATTEMPTS
    assert bench.target.read_bytes() == DATA


def test_a_link_that_stays_down_is_given_up_in_time_and_the_part_kept(bench: Bench) -> None:
    with pytest.raises(DownloadFailed, match="nobody answers") as caught:
        bench.fetch(ranges(breaks_after=5000), Unreachable("nobody answers"))
    assert bench.part.read_bytes() == DATA[:5000]
    assert caught.value.hint
    assert len(bench.camera.starts) <= ATTEMPTS + 1
    assert bench.clock.now() < 30.0


def test_pauses_grow(bench: Bench) -> None:
    times: list[float] = []

    def busy(start: int) -> Body:
        times.append(bench.clock.now())
        raise CameraRefused("Busy.", code="serviceUnavailable", status=503)

    with pytest.raises(DownloadFailed):
        bench.fetch(busy)
    pauses = np.diff(times)
    assert len(times) == ATTEMPTS
    assert (np.diff(pauses) > 0).all()


def test_a_camera_that_is_busy_for_a_while_is_waited_for(bench: Bench) -> None:
    busy = CameraRefused("Busy.", code="serviceUnavailable", status=503)
    assert bench.fetch(busy, busy, plain()).starts == [0, 0, 0]


def test_what_cannot_pass_is_said_at_once(bench: Bench) -> None:
    with pytest.raises(CameraRefused):
        bench.fetch(CameraRefused("Gone.", code="notFound", status=404))
    assert len(bench.camera.starts) == 1


@pytest.mark.parametrize("error", [PasswordNeeded("Who are you?"), NotACamera("A router.")])
def test_a_stranger_in_between_is_no_end(bench: Bench, error: DeviceError) -> None:
    assert bench.fetch(error, plain()).starts == [0, 0]
    bench.target.unlink()
    with pytest.raises(DownloadFailed) as caught:
        bench.fetch(error)
    assert caught.value.code == "interrupted"


@pytest.mark.parametrize("listed", [0, len(DATA) - 700, len(DATA) + 900])
def test_a_wrong_size_in_the_list_is_overruled_by_two_whole_files(
    bench: Bench, listed: int
) -> None:
    camera = bench.fetch(plain(), size=listed)
    assert len(camera.starts) == (1 if listed == 0 else 2)
    assert bench.target.read_bytes() == DATA


def test_a_cut_file_with_an_end_marker_is_fetched_again(bench: Bench) -> None:
    cut = DATA[: len(DATA) // 2] + b"\xff\xd9"
    for size in (len(DATA), 0):
        bench.target.unlink(missing_ok=True)
        assert len(bench.fetch(plain(cut), plain(), size=size).starts) == 2
        assert bench.target.read_bytes() == DATA


def test_a_file_that_ends_early_without_saying_so_is_continued(bench: Bench) -> None:
    def short(start: int) -> Body:
        return Body(DATA[:7000], length=7000)

    assert bench.fetch(short, ranges()).starts == [0, 7000]
    assert bench.target.read_bytes() == DATA


def test_a_file_cut_on_the_camera_is_no_refused_request(bench: Bench) -> None:
    cut = DATA[:7000]

    def answer(start: int) -> Body:
        if start >= len(cut):
            raise CameraRefused("No such range.", status=416)
        return ranges(cut)(start)

    with pytest.raises(DownloadFailed, match="arrived damaged") as caught:
        bench.fetch(answer)
    assert caught.value.code == "damaged"
    # To go on from there was tried once.
    assert bench.camera.starts == [0, 7000, 0, 0, 0]
    assert bench.part.read_bytes() == cut


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (Unreachable("nobody"), "interrupted"),
        (BadReply("Nonsense."), "bad-answers"),
        (CameraRefused("Busy.", status=503), "bad-answers"),
    ],
)
def test_codes_tell_a_broken_link_from_other_failures(
    bench: Bench, error: DeviceError, code: str
) -> None:
    with pytest.raises(DownloadFailed) as caught:
        bench.fetch(error)
    assert caught.value.code == code


def test_a_wrong_content_length_does_not_matter_once_all_is_here(bench: Bench) -> None:
    def long(start: int) -> Body:
        return Body(DATA, length=len(DATA) + 5000, breaks_after=len(DATA))

    assert bench.fetch(long).starts == [0]
    assert bench.target.read_bytes() == DATA


def test_a_picture_damaged_on_the_camera_is_told_apart_and_kept(bench: Bench) -> None:
    bad = DATA[: len(DATA) // 2] + bytes(len(DATA) - len(DATA) // 2)
    with pytest.raises(DownloadFailed, match="damaged") as caught:
        bench.fetch(plain(bad))
    assert caught.value.code == "damaged-on-camera"
    assert len(bench.camera.starts) == 2
    assert bench.part.read_bytes() == bad


def test_an_endless_answer_is_cut(bench: Bench) -> None:
    endless = DATA + bytes(3 << 20)
    bench.fetch(lambda start: Body(endless))
    assert bench.target.read_bytes() == DATA
    assert max(received for received, _, _ in bench.said) <= len(DATA) + (1 << 20)


def test_an_endless_answer_of_nothing_is_given_up(bench: Bench) -> None:
    with pytest.raises(DownloadFailed):
        bench.fetch(lambda start: Body(bytes(4 << 20), piece=65536))
    assert bench.part.stat().st_size <= len(DATA) + (1 << 20)


def test_a_file_too_long_is_not_begun(bench: Bench) -> None:
    with pytest.raises(DownloadFailed, match="too large for a photo"):
        bench.fetch(plain(), size=MAX_FILE_BYTES + 1)
    assert bench.camera.starts == []


def test_a_drip_is_no_link(bench: Bench) -> None:
    def drop() -> None:
        bench.clock.sleep(5.0)

    def drip(start: int) -> Body:
        return Body(DATA, piece=10, before=drop)

    with pytest.raises(DownloadFailed, match="too slow"):
        bench.fetch(drip)
    assert bench.clock.now() < 200.0


def test_a_full_disk_is_said_before(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = shutil.disk_usage(bench.folder)._replace(free=1 << 20)
    monkeypatch.setattr("app.devices.capture.download.shutil.disk_usage", lambda path: usage)
    with pytest.raises(DownloadFailed, match="1 MB left") as caught:
        bench.fetch(plain())
    assert caught.value.code == "disk-full"
    assert bench.camera.starts == []


def test_a_folder_that_is_gone_is_a_sentence(bench: Bench) -> None:
    bench.folder = bench.folder / "gone"
    with pytest.raises(DownloadFailed, match=r"Cannot write to .*gone: no such file") as caught:
        bench.fetch(plain())
    assert caught.value.code == "disk"
    assert (
        caught.value.hint
        == not_written(DownloadFailed, bench.folder, OSError(errno.ENOENT, "")).hint
    )


def test_a_disk_that_fills_up_meanwhile_is_said_as_for_every_file_of_a_capture(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*paths: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("app.devices.capture.download.os.replace", full)
    with pytest.raises(DownloadFailed, match=r"Cannot write to .*: no space left") as caught:
        bench.fetch(plain())
    assert (
        caught.value.hint
        == not_written(DownloadFailed, bench.folder, OSError(errno.ENOSPC, "")).hint
    )
    assert caught.value.code == "disk"


def test_cancelling_keeps_the_part(bench: Bench) -> None:
    count = 0

    def stop() -> None:
        nonlocal count
        count += 1
        if count == 4:
            bench.token.cancel()

    with pytest.raises(Cancelled):
        bench.fetch(ranges(before=stop))
    assert bench.part.read_bytes() == DATA[: 3 * 4096]


def test_cancelling_ends_a_pause(bench: Bench) -> None:
    class Stopping(VirtualClock):
        def sleep(self, seconds: float) -> None:
            super().sleep(seconds)
            bench.token.cancel()

    bench.clock = Stopping()
    with pytest.raises(Cancelled):
        bench.fetch(Unreachable("nobody"))
    assert bench.clock.now() < 0.2


def test_thumbnails_are_a_gift(bench: Bench) -> None:
    camera = Camera(bench.clock, plain())
    camera.pictures = {
        "a": DATA + b"rest",
        "b": BadReply("Nonsense."),
        "c": b"no picture",
        "d": DATA,
    }
    wanted = {url: bench.folder / f"{url}.jpg" for url in camera.pictures}
    wanted["d"].write_bytes(b"kept")
    found = fetch_thumbnails(camera, wanted, bench.token)
    assert sorted(found) == ["a", "d"]
    assert wanted["a"].read_bytes() == DATA
    assert wanted["d"].read_bytes() == b"kept"
    assert not wanted["b"].exists()
    camera.pictures["a"] = Unreachable("nobody")
    wanted["a"].unlink()
    assert fetch_thumbnails(camera, wanted, bench.token) == {}
