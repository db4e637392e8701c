"""Killed at any moment, and with another process at the same files, a place loses nothing.

`STEPS` runs an act again and again in processes of its own, each of which is ended at a later call
to the file system than the one before, without any clean-up, as by a power cut.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.core.places.files.light import read_light
from app.core.places.files.originals import sweep
from app.core.places.place_folder import create_place, read_place, write_place
from app.core.places.place_list import list_places, list_trash
from tests.helpers.waiting import until

ROOT = Path(__file__).resolve().parents[2]
NOW = datetime(2026, 6, 21, 12, 5, tzinfo=UTC)

pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are forked and killed")

SETUP = """
import os, shutil, sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
import numpy as np
from app.core.places.files.light import store_environment
from app.core.places.files.originals import adopt_files
from app.core.places.place_list import delete_place, restore_place
from app.core.places.place_folder import create_place, read_place, write_place
base = Path(sys.argv[1])
now = datetime(2026, 6, 21, 12, 5, tzinfo=UTC)
light = np.random.default_rng(1).gamma(0.2, size=(32, 64, 3)).astype(np.float32)
"""

STEPS = (
    SETUP
    + """
ACTS = {
    "create": lambda root: create_place(root, "Café", now),
    "write": lambda root: write_place(root / "p", replace(read_place(root / "p"), notes="new")),
    "light": lambda root: keep_light(root / "p"),
    "adopt": lambda root: adopt_files(root / "p", sorted((root / "card").iterdir())),
    "delete": lambda root: delete_place(root / "p", now),
    "restore": lambda root: restore_place(next((root / ".trash").iterdir())),
}

def keep_light(folder):
    stored = store_environment(folder, light)
    write_place(folder, replace(read_place(folder), notes="new", environment=stored.environment,
        fingerprint=stored.fingerprint))

def cut_at(limit):
    count = 0
    def guard(act):
        def guarded(*args, **more):
            nonlocal count
            count += 1
            if count == limit:
                if act is write_bytes:  # half of it is on the disk
                    act(args[0], args[1][: len(args[1]) // 2])
                os._exit(9)
            return act(*args, **more)
        return guarded
    write_bytes = Path.write_bytes
    Path.write_bytes = guard(write_bytes)
    for name in ("replace", "rename", "link", "unlink", "mkdir", "fsync", "chmod", "rmdir"):
        setattr(os, name, guard(getattr(os, name)))

for limit in range(1, 60):
    root = base / f"{limit:02d}"
    shutil.copytree(base / "template", root)
    child = os.fork()
    if child == 0:
        cut_at(limit)
        ACTS[sys.argv[2]](root)
        os._exit(0)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0:
        print(limit)
        break
"""
)

FLOOD = (
    SETUP
    + """
place = read_place(base)
print("ready", flush=True)
number = 0
while True:
    number += 1
    word = f"{sys.argv[2]} {number} "
    write_place(base, replace(place, name=word, notes=word * 4000))
"""
)


def run_steps(tmp_path: Path, act: str) -> list[Path]:
    """Roots after an act that was cut off at its 1st, 2nd, ... call; the last one went through."""
    (tmp_path / "template").mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, "-c", STEPS, str(tmp_path), act],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    count = int(done.stdout)
    # Some calls there must have been, or nothing was cut off.
    assert count > 2
    return [tmp_path / f"{number:02d}" for number in range(1, count + 1)]


@pytest.fixture
def template(tmp_path: Path) -> Path:
    folder = tmp_path / "template"
    place = create_place(folder, "Court", NOW)
    place.rename(folder / "p")
    card = folder / "card"
    card.mkdir()
    for number in range(2):
        (card / f"R{number}.JPG").write_bytes(bytes([number]) * 3000)
    return folder


def test_cut_off_while_made(tmp_path: Path) -> None:
    *cut, whole = run_steps(tmp_path, "create")
    assert [each.name for each in list_places(whole)] == ["Café"]
    for root in cut:
        # There whole or not at all; what was staged is never taken for a place.
        for summary in list_places(root):
            assert (summary.name, summary.trouble) == ("Café", None)
            assert read_place(summary.folder).remarks == ()
        sweep(root, time.time() + 7200)
        assert not [path for path in root.iterdir() if path.name.startswith(".")]
        # And nothing stands in the way of trying again.
        assert read_place(create_place(root, "Café", NOW)).name == "Café"


def test_cut_off_while_written(tmp_path: Path, template: Path) -> None:
    *cut, whole = run_steps(tmp_path, "write")
    assert read_place(whole / "p").notes == "new"
    seen = set()
    for root in cut:
        place = read_place(root / "p")
        assert place.remarks == ()
        seen.add(place.notes)
        write_place(root / "p", place)
        sweep(root / "p", time.time() + 7200)
        assert sorted(path.name for path in (root / "p").iterdir()) == ["place.json"]
    assert seen == {"", "new"}


@pytest.mark.slow
def test_cut_off_while_light_is_kept(tmp_path: Path, template: Path) -> None:
    *cut, whole = run_steps(tmp_path, "light")
    assert read_light(whole / "p", read_place(whole / "p"))[1] == ()
    states = set()
    for root in cut:
        place = read_place(root / "p")
        assert place.remarks == ()
        # Either as it was, or with the new light, whole.
        states.add((place.notes, bool(place.environment)))
        if place.environment:
            assert read_light(root / "p", place)[1] == ()
    assert states == {("", False), ("new", True)}


def test_cut_off_while_files_are_copied(tmp_path: Path, template: Path) -> None:
    card = {path.name: path.read_bytes() for path in (template / "card").iterdir()}
    for root in run_steps(tmp_path, "adopt"):
        assert {path.name: path.read_bytes() for path in (root / "card").iterdir()} == card
        folder = root / "p" / "originals"
        for path in folder.glob("*") if folder.exists() else ():
            if not path.name.startswith("."):
                assert path.read_bytes() == card[path.name]


@pytest.mark.parametrize("act", ["delete", "restore"])
def test_cut_off_while_moved(tmp_path: Path, template: Path, act: str) -> None:
    if act == "restore":
        (template / ".trash").mkdir()
        (template / "p").rename(template / ".trash" / "20260621T120500Z--p")
    count = 0
    for root in run_moves(tmp_path, act):
        count += 1
        found = [(each.name, each.folder) for each in list_places(root)]
        found += [(each.name, each.folder) for each in list_trash(root)]
        assert [name for name, _ in found] == ["Court"]
        assert read_place(found[0][1]).remarks == ()
    assert count >= 2


def run_moves(tmp_path: Path, act: str) -> list[Path]:
    subprocess.run(
        [sys.executable, "-c", STEPS, str(tmp_path), act],
        cwd=ROOT,
        capture_output=True,
        timeout=600,
        check=True,
    )
    return sorted(path for path in tmp_path.iterdir() if path.name.isdigit())


@contextmanager
def flood(folder: Path, word: str) -> Iterator[subprocess.Popen[str]]:
    """A process that writes a place without end, each time something else."""
    process = subprocess.Popen(
        [sys.executable, "-c", FLOOD, str(folder), word],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def check_whole(folder: Path) -> str:
    place = read_place(folder)
    assert place.remarks == ()
    if place.notes:
        # Name and notes of one and the same writing.
        assert place.notes == f"{place.name} " * 4000
    return place.name.split()[0]


@pytest.mark.slow
def test_killed_while_writing_again_and_again(tmp_path: Path) -> None:
    folder = create_place(tmp_path, "Court", NOW)
    rng = random.Random(4)
    for number in range(8):
        with flood(folder, f"w{number}") as process:
            time.sleep(rng.uniform(0.005, 0.08))
            process.send_signal(signal.SIGKILL)
            process.wait(600)
        assert process.returncode == -signal.SIGKILL
        check_whole(folder)
        assert [each.trouble for each in list_places(tmp_path)] == [None]
    assert check_whole(folder).startswith("w")
    sweep(folder, time.time() + 7200)
    assert [path.name for path in folder.iterdir()] == ["place.json"]


@pytest.mark.slow
def test_two_processes_at_the_same_place(tmp_path: Path) -> None:
    folder = create_place(tmp_path, "Court", NOW)
    seen = set()
    with flood(folder, "one"), flood(folder, "two"):

        def both() -> bool:
            seen.add(check_whole(folder))
            return {"one", "two"} <= seen

        until(both)
    assert check_whole(folder) in ("one", "two")
