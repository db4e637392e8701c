"""Freed memory goes back to the system."""

from __future__ import annotations

import subprocess
import sys

import pytest

SCRIPT = """
import threading
import numpy as np
from app.ui.shell.jobs import give_back, keep_little

def used():
    with open("/proc/self/statm") as stream:
        return int(stream.read().split()[1]) * 4096 / 1e6

keep_little()
before = used()

def work():
    for size in (3, 5, 8, 13, 21):
        held = [np.ones(size << 17) for _ in range(6)]
        small = [bytearray(2000) for _ in range(4_000)]
        del held

threads = [threading.Thread(target=work) for _ in range(4)]
for one in threads:
    one.start()
for one in threads:
    one.join()
freed = used()
give_back()
print(before, freed, used())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_what_threads_have_freed_goes_back() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, timeout=600
    )
    before, freed, trimmed = (float(word) for word in done.stdout.split())
    assert freed < before + 100.0, "small pieces at most, and no large array"
    assert trimmed < before + 20.0
