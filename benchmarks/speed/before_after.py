"""CPU time of a few hot paths, for the imported version of the program.

    PYTHONPATH=CHECKOUT python benchmarks/speed/before_after.py

Prints one JSON object of milliseconds, the best of many calls. Run it on two checkouts in turn.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from typing import TYPE_CHECKING

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.portrait.gallery_portraits import framing, portraits
from app.core.solver.place_light import pictures_at, prepare
from app.core.solver.solve import solve_all
from app.core.styles.style_pack_file import load_named_pack, load_transport_of

if TYPE_CHECKING:
    from collections.abc import Callable

SCENE = resources() / "demo" / "scenes" / "interior.exr"


def best(work: Callable[[], object], seconds: float = 1.5) -> float:
    work()
    least, stop = np.inf, time.perf_counter() + seconds
    while time.perf_counter() < stop:
        start = time.process_time()
        work()
        least = min(least, time.process_time() - start)
    return round(1e3 * float(least), 3)


def process(*words: str) -> float:
    """Return the best CPU time of a whole process, user and system."""
    least = np.inf
    for _ in range(6):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "app", *words], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        least = min(least, used)
    return round(1e3 * float(least), 1)


def main() -> None:
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    light = prepare(read_environment(SCENE))
    turns = [one.turn_refined_deg for one in solve_all(pack, light.searched)]
    coverage = pack.coverage.astype(np.float32)
    wanted = framing(transport.size, (136, 188))
    found = {
        "solve.picture": best(lambda: solve_all(pack, light.searched, "picture")),
        "solve.paper": best(lambda: solve_all(pack, light.searched, "paper")),
        "environment.turn": best(lambda: reduce_radiance(light.fine, (32, 64), 40.0)),
        "gallery.all": best(
            lambda: portraits(pictures_at(transport, light, turns), coverage, wanted)
        ),
        "start.help": process("--help"),
        "start.solve": process("solve", str(SCENE)),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
