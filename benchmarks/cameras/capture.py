"""Time from the last exposure to the environment, with a simulated camera on a slow link.

    python benchmarks/cameras/capture.py [--rate 40] [--model V] [--runs 3] [--scene FILE]

The camera runs in another process and serves real HTTP on the loopback address at the rate of a
Theta's Wi-Fi. Target: the transfer time of the bytes at that rate, plus one second.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]

from app.core.base.progress import Token  # noqa: E402
from app.core.measure.bracket import align_and_merge, measure  # noqa: E402
from app.core.measure.bracket.incoming_frames import ArrivingFrames  # noqa: E402
from app.core.styles.style_pack_file import load_named_pack  # noqa: E402
from app.devices.capture import capture_steps, fetching, file_integrity  # noqa: E402
from app.devices.capture.capture_steps import Capture  # noqa: E402
from app.devices.capture.exposures import bracket  # noqa: E402
from app.devices.capture.session import Session  # noqa: E402
from app.devices.clock import SystemClock  # noqa: E402
from app.devices.theta.client import OscClient  # noqa: E402
from app.devices.theta.endpoint import Endpoint  # noqa: E402
from app.devices.theta.link import Link  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from app.devices.capture.status import Status

ALLOWED_S = 1.0

# Parts of the time after the last exposure, which the user waits for, by name.
PARTS: tuple[tuple[str, Any, str], ...] = (
    ("finding", bracket, "gather"),
    ("thumbnails", fetching, "fetch_thumbnails"),
    ("files", fetching, "fetch_file"),
    ("last decoding", ArrivingFrames, "problem"),
    ("exif check", file_integrity, "check_frames"),
    ("frames handed over", align_and_merge, "open_frames"),
    ("aligning", align_and_merge, "_align"),
    ("merging", align_and_merge, "merge"),
    ("lamps, audit", measure, "finished"),
    ("writing", capture_steps, "write_exr"),
)


class Stopwatch:
    """Sums the wall time of the parts, and records the time of the last exposure."""

    def __init__(self) -> None:
        self.parts: dict[str, float] = {}
        self.exposed = 0.0
        self.written = 0.0

    def status(self, status: Status) -> None:
        if status.may_move and not self.exposed:
            self.exposed = time.perf_counter()

    def timed(self, name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def run(*words: Any, **named: Any) -> Any:
            began = time.perf_counter()
            try:
                return work(*words, **named)
            finally:
                spent = time.perf_counter() - began
                self.parts[name] = self.parts.get(name, 0.0) + spent
                if name == "writing":
                    self.written = time.perf_counter()

        return run

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        with contextlib.ExitStack() as stack:
            for name, module, function in PARTS:
                work = self.timed(name, getattr(module, function))
                stack.enter_context(patch.object(module, function, work))
            yield


@contextlib.contextmanager
def camera(options: argparse.Namespace) -> Iterator[str]:
    """Run a simulated camera in a separate process; yield its address."""
    command = [sys.executable, "-m", "app", "simulate-camera", "--scene", str(options.scene)]
    command += ["--model", options.model, "--rate", str(options.rate)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def once(url: str, folder: Path, rate: float) -> tuple[float, float, Stopwatch]:
    """Capture; return seconds from the last exposure to the end, and the transfer time."""
    clock, watch = SystemClock(), Stopwatch()
    link = Link(Endpoint.parse(url), clock)
    with watch.watching():
        result = Capture(
            OscClient(link, clock),
            Session.create(folder),
            clock,
            plan="paper",
            pack=load_named_pack("generic"),
            on_status=watch.status,
            token=Token(),
        ).run()
    link.close()
    transfer = sum(path.stat().st_size for path in result.frames) * 8e-6 / rate
    return watch.written - watch.exposed, transfer, watch


def main() -> None:
    parser = argparse.ArgumentParser(description="from the last exposure to the environment")
    parser.add_argument("--rate", type=float, default=40.0, help="Mbit/s")
    parser.add_argument("--model", default="V")
    parser.add_argument("--runs", type=int, default=3)
    scene = ROOT / "resources" / "demo" / "scenes" / "studio.exr"
    parser.add_argument("--scene", type=Path, default=scene)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place, camera(options) as url:
        for number in range(options.runs):
            total, transfer, watch = once(url, Path(place) / str(number), options.rate)
            over = total - transfer
            verdict = "reached" if over <= ALLOWED_S else "MISSED"
            print(
                f"run {number + 1}{' (cold)' if number == 0 else ''}: {total:.2f} s, of which the "
                f"bytes need {transfer:.2f} s; {over:.2f} s besides: {verdict}"
            )
            rest = total - sum(watch.parts.values())
            parts = {**watch.parts, "rest": rest}
            rows = [f"{name} {seconds:.2f}" for name, seconds in parts.items()]
            print(f"   {', '.join(rows)}", flush=True)


if __name__ == "__main__":
    main()
