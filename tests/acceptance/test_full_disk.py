"""A disk that takes no more: the old file stays whole, the exit code is 2, and a sentence says so.

Every command that writes and everything the window keeps, in processes of their own: under a limit
on the size of files, on a small disk that is full, and on one that is read-only.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import personality_named
from app.devices.simulated.scene import Scene
from app.devices.simulated.server import CameraServer
from tests.helpers.cameras import room
from tests.helpers.cases import sample_first
from tests.helpers.hostile_files import write_picture
from tests.helpers.hostile_runs import Case, Outcome, Zygote
from tests.helpers.saving import KINDS
from tests.helpers.scaled_clock import ScaledClock
from tests.helpers.simulated import stored

pytestmark = pytest.mark.skipif(os.name != "posix", reason="limits and disks as on POSIX")

OLD: Final = b"what was there before\n"
CALLS: Final[dict[str, tuple[tuple[str, ...], tuple[str, ...]]]] = {
    "render png": (("render", "light.exr", "--turn", "30", "-o", "out.png"), ("out.png",)),
    "render exr": (("render", "light.exr", "--turn", "30", "-o", "out.exr"), ("out.exr",)),
    "sheet": (("solve", "light.exr", "--sheet", "out.png"), ("out.png",)),
    "align": (("align", "photo.png", "photo.png", "-o", "out.png"), ("out.png",)),
    "merge": (
        ("merge", "a.png", "b.png", "--times", "0.1,0.02", "-o", "out.exr", "--preview", "p.png"),
        ("out.exr", "p.png"),
    ),
    "merge hdr": (
        ("merge", "a.png", "b.png", "--times", "0.1,0.02", "-o", "out.hdr"),
        ("out.hdr",),
    ),
    "scene": (
        ("bake", "--export-scene", "scene"),
        ("scene/scene.xml", "scene/meshes/skin.ply", "scene/meshes/eyes.ply"),
    ),
    "lamp": (("lamp", "add", "mine", "lamp.exr"), ()),
    "evaluate": (
        ("evaluate", "--scenes", "scenes", "-o", "out.html", "--json", "out.json"),
        ("out.html", "out.json"),
    ),
    "bench": (("call", "tests.helpers.saving", "bench_into", "."), ("speed.json",)),
    "bake": (
        (
            *("bake", "-o", "out.npz", "--front-only"),
            *("--quality", "draft", "--image", "8", "--env", "8x4"),
        ),
        ("out.npz", "out.styles.npz", "out.shape.npz"),
    ),
}
SPEED: Final = 20.0
LIMITS: Final = (0.0, 0.5, 0.9, 0.9999)


@pytest.fixture(scope="module")
def zygote(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Zygote]:
    with Zygote(tmp_path_factory.mktemp("runs")) as process:
        yield process


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Light, two exposures, a photograph and a lamp, all of noise, which no format packs."""
    folder = tmp_path_factory.mktemp("inputs")
    random = np.random.default_rng(4)
    light = random.random((64, 128, 3), np.float32)
    write_picture(folder / "light.exr", light, "float")
    (folder / "scenes").mkdir()
    shutil.copy(folder / "light.exr", folder / "scenes")
    lamp = np.full((64, 128, 3), 0.01, np.float32)
    lamp[28:32, 60:70] = 90.0
    write_picture(folder / "lamp.exr", lamp, "float")
    for name, share in (("a.png", 1.0), ("b.png", 0.2)):
        coded = np.rint((light * share) ** (1 / 2.2) * 255).astype(np.uint8)
        write_picture(folder / name, coded, "uint8")
    write_picture(folder / "photo.png", random.integers(0, 256, (240, 320, 3), np.uint8), "uint8")
    return folder


def _prepared(call: str, inputs: Path, work: Path) -> Case:
    """Put old files where the command will write, and name its inputs whole."""
    words, outputs = CALLS[call]
    for name in outputs:
        (work / name).parent.mkdir(parents=True, exist_ok=True)
        (work / name).write_bytes(OLD)
    there = {path.name for path in inputs.iterdir()}
    return Case(tuple(str(inputs / word) if word in there else word for word in words))


def _check_refused(call: str, done: Outcome, work: Path) -> None:
    """No silent loss: what was not written was said, and is as it was."""
    outputs = CALLS[call][1]
    assert "Traceback" not in done.err
    assert not [path for path in work.rglob(".*") if path.is_file()]
    whole = [fault for fault in done.faults if "incomplete" in fault]
    old = [name for name in outputs if (work / name).read_bytes() == OLD]
    assert len(whole) <= len(old), done.faults
    if done.code == 0:
        assert not old
        return
    assert done.code == 2, done.err
    last = done.err.strip().splitlines()[-1]
    assert last.startswith("turnlight: "), done.err
    assert "/." not in last, "names a temporary file"
    if outputs:
        assert old
    else:
        assert not list((work / "home").rglob("*.json"))


@pytest.mark.slow
@pytest.mark.parametrize("call", sample_first(CALLS, 5))
def test_a_limit_on_the_size_of_files(
    call: str, zygote: Zygote, inputs: Path, tmp_path: Path
) -> None:
    """At next to nothing, half and nearly all of each command's largest file."""
    work = tmp_path / "free"
    work.mkdir()
    done = zygote.run(_prepared(call, inputs, work), work=work)
    assert (done.code, done.faults) == (0, ()), done.err
    largest = max(path.stat().st_size for path in work.rglob("*") if path.is_file())
    for number, limit in enumerate(LIMITS):
        size = min(max(int(limit * largest), 1000), largest - 1)
        work = tmp_path / f"limit{number}"
        work.mkdir()
        case = _prepared(call, inputs, work)
        done = zygote.run(case, {"RLIMIT_FSIZE": size}, work)
        _check_refused(call, done, work)
        assert done.code == 2, (size, largest)


class Camera:
    """A simulated camera on a port of this machine, and a program that captures from it."""

    def __init__(self, zygote: Zygote, url: str, camera: SimulatedCamera) -> None:
        self._zygote, self._camera = zygote, camera
        self._case = Case(("call", "tests.helpers.saving", "capture_from", url, f"{SPEED:g}"))
        self._options = dict(camera.options)

    def capture(self, work: Path, limit: int = 0) -> Outcome:
        """Capture, or go on with it; the camera has its own settings back in any case."""
        done = self._zygote.run(self._case, {"RLIMIT_FSIZE": limit} if limit else None, work)
        options = {name: self._camera.options[name] for name in self._options}
        assert options == self._options
        return done

    def check_refused(self, done: Outcome, work: Path) -> None:
        """One sentence and 2; no picture was lost, and nothing half-written has a name."""
        assert done.code == 2, done.err
        assert not done.faults
        last = done.err.strip().splitlines()[-1]
        assert last.startswith("turnlight: "), done.err
        assert "/." not in last, "names a temporary file"
        assert not [path for path in work.rglob(".*") if path.is_file()]

    def check_finished(self, done: Outcome, work: Path) -> None:
        """The frames that were shot are here, and their light."""
        assert (done.code, done.faults) == (0, ()), done.err
        frames = list((work / "session" / "originals").iterdir())
        written = {file.data for file in stored(self._camera)}
        assert len(frames) == 3
        assert {path.read_bytes() for path in frames} <= written
        assert (work / "session" / "environment.exr").is_file()


@pytest.fixture
def camera(zygote: Zygote) -> Iterator[Camera]:
    clock = ScaledClock(SPEED)
    simulated = SimulatedCamera(
        Scene(room()), personality_named("V"), clock, shape=(256, 512), rate_mbit=2.0
    )
    with CameraServer(simulated, clock=clock) as server:
        yield Camera(zygote, server.url, simulated)
    simulated.close()


@pytest.mark.slow
@pytest.mark.parametrize("limit", sample_first([20_000, 1_200, 200, 500_000], 1))
def test_a_capture_under_a_limit(limit: int, camera: Camera, tmp_path: Path) -> None:
    """Journal, picture for metering, environment: whichever does not fit, it can be continued."""
    camera.check_refused(camera.capture(tmp_path, limit), tmp_path)
    camera.check_finished(camera.capture(tmp_path), tmp_path)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 152 KB, as in the issue."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=152k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("no disk can be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("call", sample_first(CALLS, 3))
def test_a_disk_that_is_full(call: str, zygote: Zygote, inputs: Path, small_disk: Path) -> None:
    case = _prepared(call, inputs, small_disk)
    free = os.statvfs(small_disk)
    (small_disk / "filler").write_bytes(bytes((free.f_bavail - 1) * free.f_bsize))
    done = zygote.run(case, work=small_disk)
    assert done.code == 2
    _check_refused(call, done, small_disk)


@pytest.mark.parametrize("call", CALLS)
def test_a_disk_that_is_read_only(
    call: str, zygote: Zygote, inputs: Path, small_disk: Path
) -> None:
    case = _prepared(call, inputs, small_disk)
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    done = zygote.run(case, work=small_disk)
    assert done.code == 2
    _check_refused(call, done, small_disk)


PROTECTED: Final = [(call, "folder") for call in CALLS] + [
    (call, "file") for call, (_, outputs) in CALLS.items() if outputs
]


@pytest.mark.parametrize(("call", "what"), sample_first(PROTECTED, 8))
def test_what_somebody_has_protected(
    call: str, what: str, zygote: Zygote, inputs: Path, tmp_path: Path
) -> None:
    """The folder, or the files that are there; root's rights are taken away for it."""
    case = replace(_prepared(call, inputs, tmp_path), plain=True)
    paths = [path for path in (tmp_path, *tmp_path.rglob("*")) if path.is_dir()]
    if what == "file":
        paths = [tmp_path / name for name in CALLS[call][1]]
    before = {path: path.stat().st_mode for path in paths}
    for path, mode in before.items():
        path.chmod(mode & 0o555)
    done = zygote.run(case, work=tmp_path)
    for path, mode in before.items():
        path.chmod(mode)
    assert done.code == 2
    _check_refused(call, done, tmp_path)
    assert [name for name in CALLS[call][1] if (tmp_path / name).read_bytes() != OLD] == []


@pytest.mark.slow
@pytest.mark.parametrize("size", sample_first(["150k", "16k", "4k"], 1))
def test_a_capture_onto_a_full_disk(size: str, camera: Camera, small_disk: Path) -> None:
    def remount(size: str) -> None:
        subprocess.run(["mount", "-o", f"remount,size={size}", str(small_disk)], check=True)

    remount(size)
    camera.check_refused(camera.capture(small_disk), small_disk)
    remount("200m")
    camera.check_finished(camera.capture(small_disk), small_disk)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_what_the_window_keeps(kind: str, zygote: Zygote, tmp_path: Path) -> None:
    """The earlier version is read again whole, or the new one is there; nothing between."""

    def call(name: str, *words: str, limit: int = 0) -> Outcome:
        case = Case(("call", "tests.helpers.saving", name, kind, *words))
        return zygote.run(case, {"RLIMIT_FSIZE": limit} if limit else None, tmp_path)

    assert call("save", "2").code == 0
    second = call("shown").out
    # The files of locks are empty.
    sizes = [path.stat().st_size for path in tmp_path.rglob("*") if path.is_file()]
    sizes = [size for size in sizes if size]
    shutil.rmtree(tmp_path)
    tmp_path.mkdir()
    assert call("save", "1").code == 0
    first = call("shown").out
    assert first != second
    refused = 0
    for limit in sorted({*(2 * size // 3 for size in sizes), max(sizes) - 1}):
        done = call("save", "2", limit=limit)
        assert "Traceback" not in done.err
        assert done.code in (0, 2)
        after = call("shown")
        assert after.code == 0, after.err
        assert after.out == (second if done.code == 0 else first)
        refused += done.code == 2
        assert done.code == 0 or ("/." not in done.err and done.err.strip())
        if done.code == 0:
            break
    assert refused
