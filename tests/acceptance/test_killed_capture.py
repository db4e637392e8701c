"""A capture that is killed at any moment loses nothing that was complete, and can be gone on with.

A child process captures from a simulated camera over real HTTP, twenty times as fast as in life,
and is killed at a random moment; again and again in one folder, until it comes to its end.
"""

import hashlib
import multiprocessing
import os
import random
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.environment.environment import read_environment
from app.core.places.journal import SessionJournal
from app.devices.capture.file_integrity import sha256_of, whole_picture
from app.devices.capture.session import Session
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import personality_named
from app.devices.simulated.scene import Scene
from app.devices.simulated.server import CameraServer
from tests.helpers.cameras import room
from tests.helpers.killed import capture_into
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.simulated import stored

pytestmark = [
    pytest.mark.sweep,
    pytest.mark.skipif(sys.platform == "win32", reason="there is no kill -9"),
]

KILLS = 50
SPEED = 20.0
SHAPE = (256, 512)
RATE_MBIT = 0.5  # a file takes as long as a real one at 40 Mbit/s
MOST_RUNS = 150

CONTEXT: Any = multiprocessing.get_context("forkserver" if sys.platform != "win32" else "spawn")


class Trial:
    """One camera, one folder after the other."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.home = root / "home"
        self.home.mkdir()
        self.clock = ScaledClock(SPEED)
        self.camera = SimulatedCamera(
            Scene(room()),
            personality_named("V"),
            self.clock,
            shape=SHAPE,
            rate_mbit=RATE_MBIT,
        )
        self.options = dict(self.camera.options)
        self.folders = 0
        self.folder = root
        self.known: dict[str, str] = {}
        self.new_folder()

    def new_folder(self) -> None:
        self.folders += 1
        self.folder = self.root / f"session-{self.folders}"
        self.known = {}

    def start(self, url: str) -> Any:
        """Start a child and wait until it begins."""
        listens, tells = CONTEXT.Pipe(duplex=False)
        child = CONTEXT.Process(
            target=capture_into, args=(url, self.folder, SPEED, self.home, tells)
        )
        child.start()
        tells.close()
        with listens:
            assert listens.recv() == "begins"
        return child

    def complete_files(self) -> dict[str, str]:
        """Checksums of the files that have their names."""
        place = self.folder / "originals"
        names = os.listdir(place) if place.is_dir() else []
        return {name: sha256_of(place / name) for name in names if not name.endswith(".part")}

    def look(self) -> str:
        """Check the folder as a kill has left it; returns how far it had come."""
        before = self.complete_files()
        assert set(self.known.items()) <= set(before.items())  # nothing was lost or changed
        on_camera = {hashlib.sha256(f.data).hexdigest() for f in stored(self.camera)}
        assert set(before.values()) <= on_camera
        if not self.folder.exists():
            return "nothing"
        journal = Session.open_or_create(self.folder).journal
        assert self.complete_files() == before
        self.known = before
        for frame in journal.frames:
            assert frame.done == (frame.local in before)
            if frame.done:
                assert frame.sha256 == before[frame.local]
                assert whole_picture(self.folder / "originals" / frame.local)
        return journal.stage

    def check_end(self) -> SessionJournal:
        """Check a folder whose capture came to its end."""
        self.look()
        journal = Session.open(self.folder).journal
        assert journal.finished
        assert journal.settings_to_restore == {}
        assert len(journal.frames) == 3
        assert all(frame.done for frame in journal.frames)
        light = read_environment(self.folder / journal.environment).radiance
        assert np.isfinite(light).all()
        assert light.shape == (SHAPE[0], SHAPE[1], 3)
        assert {k: v for k, v in self.camera.options.items() if k in self.options} == self.options
        return journal


@pytest.mark.timeout(280)
def test_fifty_killed_captures_lose_nothing(tmp_path: Path) -> None:
    CONTEXT.set_forkserver_preload(["tests.helpers.killed"])
    generator = random.Random(4)
    trial = Trial(tmp_path)
    stages: Counter[str] = Counter()
    finished = kills = runs = 0
    longest = 1.0
    with CameraServer(trial.camera, clock=trial.clock) as server:
        while kills < KILLS or finished < 5:
            runs += 1
            assert runs < MOST_RUNS
            child = trial.start(server.url)
            began = time.monotonic()
            # The first shows how long it takes; later a run is killed now and then at the end.
            kill = runs > 1 and kills < KILLS
            child.join(generator.uniform(0.0, 1.1 * longest) if kill else 60.0)
            if child.is_alive():
                child.kill()
                child.join()
                assert kill, "a capture took longer than a minute"
                kills += 1
                stages[trial.look()] += 1
                continue
            assert child.exitcode == 0
            longest = max(longest, time.monotonic() - began)
            trial.check_end()
            finished += 1
            trial.new_folder()
    trial.camera.close()
    print(f"{kills} kills in {runs} runs: {dict(stages)}; {finished} captures came to their end")
    assert len(stages) >= 4
    assert os.listdir(trial.home) == []
    others = {path.name for path in tmp_path.iterdir()} - {"home"}
    assert all(name.startswith("session-") for name in others)
    for folder in others - {trial.folder.name}:
        names = {"session.json", "originals", "thumbnails", "environment.exr"}
        assert set(os.listdir(tmp_path / folder)) == names
