"""Peak memory of merging large brackets, above a bare interpreter and above the imports.

    python benchmarks/speed/merge_memory.py [--frames 3 --width 5376] [--frames 13 --width 11008]
                                            [--full]

Frames are made in a temporary folder (one noisy picture, repeated, as JPEG) and removed afterwards.
Each merge runs in a separate interpreter, whose peak resident size the system reports (Linux only).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
TILE = 688

CHILD = """
import json, sys, time
from pathlib import Path
def peak():
    # Not getrusage: its peak is handed down from the process that starts this one.
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))
bare = peak()
sys.path.insert(0, sys.argv[1])
import cv2, numpy, OpenImageIO
from app.core.measure.read.frame import Bracket, Exposure, Frame
from app.core.measure.bracket.merge import SIZE, merge
from app.core.measure.read.pixels import open_frames
from app.core.measure.bracket.curve.response import srgb_response
imported = peak()
files = sorted(Path(sys.argv[2]).iterdir())
width = int(sys.argv[3])
frames = tuple(
    Frame(f, (width // 2, width), exposure=Exposure(4.0**-i)) for i, f in enumerate(files)
)
started = time.perf_counter()
with open_frames(Bracket(frames, tuple(f.exposure.ev for f in frames))) as stack:
    size = None if sys.argv[4] == "full" else SIZE
    merged = merge(stack, srgb_response(), stack.stops, size=size)
seconds = time.perf_counter() - started
print(json.dumps({"bare": bare, "imported": imported, "peak": peak(), "seconds": seconds,
                  "shape": merged.radiance.shape, "mean": float(merged.radiance.mean())}))
"""


def write_frames(folder: Path, count: int, width: int) -> None:
    """Write frames two stops apart, with noise in every pixel."""
    generator = np.random.default_rng(3)
    light = cv2.GaussianBlur(generator.random((TILE, TILE, 3)).astype(np.float32), (0, 0), 6.0)
    light = np.exp(12.0 * (light - light.mean()) / light.std() / 3.0)
    for index in range(count):
        share = light * np.float32(4.0 ** (1.0 - index)) * 0.2
        share += generator.normal(0.0, 0.005, share.shape).astype(np.float32)
        codes = np.rint(255.0 * np.clip(share, 0.0, 1.0) ** (1.0 / 2.2)).astype(np.uint8)
        repeats = -(-width // TILE)
        whole = np.tile(codes, (repeats, repeats, 1))[: width // 2, :width]
        cv2.imwrite(str(folder / f"{index:02d}.jpg"), whole)


def measure(count: int, width: int, full: bool) -> None:
    """Merge in a separate interpreter and print its memory."""
    with tempfile.TemporaryDirectory() as folder:
        write_frames(Path(folder), count, width)
        size = "full" if full else "reduced"
        command = [sys.executable, "-c", CHILD, str(ROOT), folder, str(width), size]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    got = json.loads(output)
    megabyte = 1e6
    print(
        f"{count} x {width} x {width // 2} to {got['shape'][1]} columns: "
        f"{(got['peak'] - got['bare']) / megabyte:.0f} MB above a bare interpreter, "
        f"{(got['peak'] - got['imported']) / megabyte:.0f} MB above the imports, "
        f"{got['seconds']:.1f} s",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="peak memory of merging")
    parser.add_argument("--frames", type=int, action="append")
    parser.add_argument("--width", type=int, action="append")
    parser.add_argument("--full", action="store_true", help="keep the frames' own size")
    options = parser.parse_args()
    counts, widths = options.frames or [3, 13], options.width or [5376, 11008]
    for count, width in zip(counts, widths, strict=True):
        measure(count, width, options.full)


if __name__ == "__main__":
    main()
