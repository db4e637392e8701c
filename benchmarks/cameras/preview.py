"""Live pictures, from a network camera in another process to decoded pictures in this one.

    python benchmarks/cameras/preview.py [--seconds S] [--rounds N] [--json]

Measures the pictures per second that arrive and are decoded, the share of one core that this
process needs for it (reading, parsing, decoding), and the age of a picture when decoded: the sender
records when each picture leaves, every picture carries its number, and both processes read the same
clock. On a busy machine, use the best of several rounds.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

# Before numpy starts a thread for each core.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from app.core.base.paths import resources  # noqa: E402
from app.core.environment.environment import read_environment  # noqa: E402
from app.devices.clock import SystemClock  # noqa: E402
from app.devices.mjpeg import MjpegParser, decode  # noqa: E402
from app.devices.simulated.exchange import Reply  # noqa: E402
from app.devices.simulated.preview import (  # noqa: E402
    LOOP,
    PREVIEW_HEADERS,
    LivePicture,
    preview_pieces,
)
from app.devices.simulated.server import CameraServer  # noqa: E402
from app.devices.webcam.network import MjpegWebcam  # noqa: E402
from app.devices.webcam.network_connection import Address  # noqa: E402
from tests.helpers.live_marks import read_number  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.devices.simulated.exchange import Piece, Request

FPS = 30.0
LEAST_FPS = 28.0
MOST_CORE = 0.15
MOST_FRAMES_OLD = 2.0
WARM_UP_S = 1.0


@dataclass(frozen=True)
class Round:
    """One measurement.

    Attributes:
        fps: Decoded pictures per second.
        core: Share of one core.
        frames_old, ms_old: Age of decoded pictures, 99th percentile, in pictures sent since and in
            ms.
        frames_old_median, ms_old_median: Median of the same.
    """

    fps: float
    core: float
    frames_old: float
    frames_old_median: float
    ms_old: float
    ms_old_median: float

    @property
    def good(self) -> bool:
        return (
            self.fps >= LEAST_FPS and self.core <= MOST_CORE and self.frames_old <= MOST_FRAMES_OLD
        )


class Noted:
    """A network camera that records when each picture leaves."""

    def __init__(self, clock: SystemClock) -> None:
        self._clock = clock
        self._picture = live_picture()
        self.times: list[float] = []

    def answer(self, request: Request) -> Reply:
        del request
        return Reply(200, PREVIEW_HEADERS, self._pieces())

    def _pieces(self) -> Iterator[Piece]:
        for piece in preview_pieces(self._picture, FPS, self._clock):
            if isinstance(piece, bytes) and piece.startswith(b"\xff\xd8"):
                self.times.append(time.monotonic())
            yield piece


def live_picture() -> LivePicture:
    place = read_environment(resources() / "demo" / "scenes" / "courtyard.exr")
    return LivePicture(place.radiance, (512, 1024))


def serve() -> None:
    """Run as the sender: print the address, and when stdin ends, the times."""
    clock = SystemClock()
    noted = Noted(clock)
    with CameraServer(noted, clock=clock) as server:
        print(server.url, flush=True)
        sys.stdin.read()
    print(json.dumps(noted.times), flush=True)


def receive(url: str, seconds: float) -> tuple[float, float, list[tuple[int, float]]]:
    """Receive pictures; return wall time, CPU time, and each picture's number and time."""
    cv2.setNumThreads(1)
    webcam = MjpegWebcam(Address.parse(f"{url}/video"), SystemClock())
    seen: list[tuple[int, float]] = []
    webcam.open()
    try:
        start = used = math.inf
        end = time.monotonic() + 20.0
        frame = None
        while time.monotonic() < end:
            # Kept until the next one, as on a screen. If freed at once, its memory would be
            # requested from the system again each time, which can cost as much as decoding.
            frame = webcam.frames.get(1.0) or frame
            if frame is None:
                continue
            now = time.monotonic()
            number = read_number(frame.picture)
            if start == math.inf and webcam.count > WARM_UP_S * FPS:
                start, used, end = now, time.process_time(), now + seconds
            elif start < now and number is not None:
                seen.append((number, now))
        wall, cpu = time.monotonic() - start, time.process_time() - used
    finally:
        webcam.close()
    return wall, cpu, seen


def measure(seconds: float) -> Round:
    with subprocess.Popen(
        [sys.executable, __file__, "--serve"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as sender:
        assert sender.stdout is not None
        wall, cpu, seen = receive(sender.stdout.readline().strip(), seconds)
        sent = np.array(json.loads(sender.communicate(timeout=30)[0]))
    ages, times = [], []
    for number, now in seen:
        newest = int(np.searchsorted(sent, now)) - 1
        age = (newest - number) % LOOP
        ages.append(age)
        times.append(1000.0 * (now - sent[newest - age]))
    return Round(
        fps=len(seen) / wall,
        core=cpu / wall,
        frames_old=float(np.percentile(ages, 99)),
        frames_old_median=float(np.median(ages)),
        ms_old=float(np.percentile(times, 99)),
        ms_old_median=float(np.median(times)),
    )


def parts() -> dict[str, float]:
    """Return milliseconds per picture for parsing and decoding alone, the best of many."""
    cv2.setNumThreads(1)
    picture = live_picture()
    pieces = (p for p in preview_pieces(picture, FPS, SystemClock()) if isinstance(p, bytes))
    stream = b"".join(next(pieces) for _ in range(2 * LOOP))
    frames: list[bytes] = []
    parsing = decoding = math.inf
    for _ in range(20):
        parser = MjpegParser("---osclivepreview---")
        start = time.perf_counter()
        frames = [
            f for at in range(0, len(stream), 16384) for f in parser.feed(stream[at : at + 16384])
        ]
        parsing = min(parsing, (time.perf_counter() - start) / LOOP)
    for data in frames * 3:
        start = time.perf_counter()
        decode(data)
        decoding = min(decoding, time.perf_counter() - start)
    return {
        "bytes": sum(map(len, frames)) / len(frames),
        "parsing_ms": 1000.0 * parsing,
        "decoding_ms": 1000.0 * decoding,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, default=3, help="at most; stops at a good one")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    if args.serve:
        serve()
        return 0
    rounds: list[Round] = []
    while len(rounds) < args.rounds and not (rounds and rounds[-1].good):
        rounds.append(measure(args.seconds))
    costs = parts()
    if args.json:
        print(json.dumps({"rounds": [asdict(each) for each in rounds]} | costs))
    else:
        for each in rounds:
            print(
                f"{each.fps:5.2f} pictures/s, {100 * each.core:5.2f} % of a core, "
                f"age {each.frames_old_median:g} pictures or {each.ms_old_median:.1f} ms "
                f"(99th of 100: {each.frames_old:g}, {each.ms_old:.1f} ms)"
            )
        print(
            f"a picture of {costs['bytes']:.0f} bytes: parsing {costs['parsing_ms']:.3f} ms, "
            f"decoding {costs['decoding_ms']:.2f} ms"
        )
    return 0 if any(each.good for each in rounds) else 1


if __name__ == "__main__":
    sys.exit(main())
