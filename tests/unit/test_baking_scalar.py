"""Baking without LLVM: the same algorithm in Mitsuba's scalar variant.

Objects of one Mitsuba variant are of no use in another, so every variant gets a process of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.base.paths import resources
from app.core.base.progress import Progress, Task
from app.words.progress import progress_words
from tests.helpers.meshes import sphere, write_obj

needs_llvm = pytest.mark.llvm
ROOT = Path(__file__).parents[2]

START = """
import sys, json, time
from pathlib import Path
import numpy as np
from app.core.baking.kernel_lanes import select_variant
variant, folder = sys.argv[1], Path(sys.argv[2])
mi = select_variant(variant)
"""

BAKE = """
import app.core.baking.bake as baking
from app.core.baking.bake import Quality, bake
from app.core.baking.scene import load_head
from app.core.baking.skin import find_skin
from app.core.base.errors import Cancelled
from app.core.base.progress import Token
from app.core.styles.styles import load_styles

baking._PROFILE_PATHS = 32
head = load_head("sphere", folder / "sphere.obj", None)

def run(work, report, token):
    baked = bake(
        head, find_skin("medium"), load_styles()[:2], environment=(4, 8), picture=8,
        quality=Quality(paths=64, glints=4, shadows=2, rank=32), seed=3, work=folder / work,
        report=report, token=token,
    )
    channels = [basis @ baked.transport.texel_basis for basis in baked.transport.pixel_basis]
    return np.stack(channels, axis=-1), baked.targets
"""


def python(script: str, *words: object) -> subprocess.CompletedProcess[str]:
    """Run a script in a process of its own that has not been told of any LLVM."""
    environment = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", script, *map(str, words)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


def answer(script: str, *words: object) -> dict[str, Any]:
    """JSON that a script prints in its last line."""
    done = python(script, *words)
    assert done.returncode == 0, done.stderr
    facts: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return facts


LANES = """
from app.core.baking.kernel_lanes import Table, Tally, negate, run_lanes
numbers = Table(np.array([5, 7, 9], np.uint32))
vectors = Table(np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]]))
tally = Tally(2)

def kernel(lane, rng):
    number, vector = numbers.take(lane % 3), vectors.take(lane % 3)
    odd = lane % 2 == 1
    none = numbers.take(lane + 1000, mi.Bool(False))
    tally.add(lane % 2, mi.Color3f(vector), negate(odd) | (lane == 3))
    return mi.Float(number), vector.y, rng.next_float32(), mi.Float(none)

found = run_lanes(7, 2**40 + 5, kernel)
print(json.dumps({"found": [one.tolist() for one in found], "tally": tally.sums(2).tolist()}))
"""


@pytest.mark.parametrize("variant", ["scalar", pytest.param("llvm", marks=needs_llvm)])
def test_a_kernel_reads_adds_and_returns_for_every_lane(variant: str, tmp_path: Path) -> None:
    facts = answer(START + LANES, variant, tmp_path)
    number, middle, chance, none = np.array(facts["found"])
    assert number.tolist() == [5, 7, 9, 5, 7, 9, 5]
    assert middle.tolist() == [2, 5, 8, 2, 5, 8, 2]
    assert none.tolist() == [0] * 7
    # Lanes 0, 2, 4 and 6 add to row 0, lane 3 alone to row 1.
    assert facts["tally"] == [[1 + 7 + 4 + 1, 2 + 8 + 5 + 2, 3 + 9 + 6 + 3], [1, 2, 3]]
    assert len(set(chance.tolist())) == 7
    assert chance.min() >= 0
    assert chance.max() < 1


@needs_llvm
def test_lanes_have_the_same_random_numbers_in_all_variants(tmp_path: Path) -> None:
    one, two = (answer(START + LANES, v, tmp_path)["found"] for v in ("scalar", "llvm"))
    np.testing.assert_allclose(np.array(one)[2], np.array(two)[2], atol=1e-7)


@pytest.mark.slow
@needs_llvm
def test_scalar_bakes_what_llvm_bakes(tmp_path: Path) -> None:
    write_obj(tmp_path / "sphere.obj", *sphere(2))
    save = """
matrix, targets = run("work", lambda share, message: None, Token())
np.savez(folder / f"{variant}.npz", matrix=matrix, targets=targets)
print("{}")
"""
    found = []
    for variant in ("llvm", "scalar"):
        answer(START + BAKE + save, variant, tmp_path)
        found.append(dict(np.load(tmp_path / f"{variant}.npz")))
    llvm, scalar = found
    for name in ("matrix", "targets"):
        assert llvm[name].shape == scalar[name].shape
        # Pieces and random numbers are alike: only rounding can send a path another way.
        assert scalar[name].mean(axis=(0, 1)) == pytest.approx(
            llvm[name].mean(axis=(0, 1)), rel=2e-3
        )
        error = np.sqrt(np.square(scalar[name] - llvm[name]).mean())
        assert error < 0.05 * np.sqrt(np.square(llvm[name]).mean())


TRACE = """
from app.core.baking.light_sources import TexelColumns
from app.core.baking.exposure import shine
from app.core.baking.exposure import vertex_points
from app.core.baking.scene import build_scene, frame_head, load_head
from app.core.baking.skin import find_skin
from app.core.baking.random_walk import scene_tables, trace_pixels
from benchmarks.truth.plain_walk import trace_plainly

heads = Path(sys.argv[3])
head = load_head("generic", heads / "generic.ply", heads / "generic-eyes.ply")
skin, size, shape = find_skin("medium"), 40, (4, 8)
scene = build_scene(head, skin, frame_head(head, size))
tables = scene_tables(scene, head, skin, vertex_points(head), size)
# The outline, an eye, and the nose.
pixels = np.array([17 * size + 6, 17 * size + 15, 20 * size + 20], np.int32)
gathered = trace_pixels(tables, pixels, 200, 1)
np.savez(
    folder / f"{variant}.npz",
    share=gathered.share.sum(axis=1),
    lean=np.abs(gathered.lean).sum(axis=1),
    shine=shine(scene, size, pixels, TexelColumns(*shape), 32, 1).sum(axis=1),
    plain=trace_plainly(tables, pixels, 200, 1, shape).sum(axis=1),
)
print("{}")
"""


@pytest.mark.slow
@needs_llvm
def test_scalar_follows_the_same_paths_on_a_head_with_eyes(tmp_path: Path) -> None:
    for variant in ("llvm", "scalar"):
        answer(START + TRACE, variant, tmp_path, resources() / "heads")
    llvm, scalar = (np.load(tmp_path / f"{variant}.npz") for variant in ("llvm", "scalar"))
    for name in ("share", "lean", "shine", "plain"):
        assert llvm[name].any()
        np.testing.assert_allclose(scalar[name], llvm[name], rtol=0.02, atol=2e-3)


@pytest.mark.slow
@pytest.mark.alone
def test_a_scalar_bake_reports_often_stops_at_once_and_goes_on(tmp_path: Path) -> None:
    write_obj(tmp_path / "sphere.obj", *sphere(1))
    stop = """
from app.core.baking import kernel_lanes as lanes
lanes._SCALAR_SHARE = 1 << 13  # small pieces, so that little work goes the ways of much
heard = []

def listen(share, message):
    heard.append((time.monotonic(), share))

whole, _ = run("whole", listen, Token())
silence = max(b[0] - a[0] for a, b in zip(heard, heard[1:]))
backwards = min(b[1] - a[1] for a, b in zip(heard, heard[1:]))

stopped_after = {}
for place, share in (("light", 0.03), ("walk", 0.6)):
    token, asked = Token(), []
    def cancel(now, message):
        if now >= share and not asked:
            asked.append(time.monotonic())
            token.cancel()
    try:
        run("stopped", cancel, token)
    except Cancelled:
        stopped_after[place] = time.monotonic() - asked[0]

parts = sorted(file.stem for file in folder.rglob("*.npz"))
began, heard[:] = time.monotonic(), []
again, _ = run("stopped", listen, Token())
print(json.dumps({
    "silence": silence, "backwards": backwards, "stopped_after": stopped_after, "parts": parts,
    "same": bool(np.array_equal(whole, again)),
    "left": [file.name for file in folder.rglob("*.npz")],
}))
"""
    facts = answer(START + BAKE + stop, "scalar", tmp_path)
    assert facts["silence"] < 3
    assert facts["backwards"] >= 0
    assert set(facts["stopped_after"]) == {"light", "walk"}
    assert max(facts["stopped_after"].values()) < 2
    # Light, profile and the first pixels are on the shelf.
    assert {"0", "profile", "sky-0", "light0-0", "light1-0"} <= set(facts["parts"])
    assert facts["same"]
    assert facts["left"] == []


CLI = """
import sys
from app import cli
from app.core.baking import kernel_lanes as lanes

lanes.find_llvm = lambda: None
sys.exit(cli.main(sys.argv[1:]))
"""


def test_auto_without_llvm_says_that_it_is_slow_and_goes_on_in_scalar(tmp_path: Path) -> None:
    head = write_obj(tmp_path / "sphere.obj", *sphere(1))
    target = tmp_path / "scene"
    words = ["bake", "--head", head, "--variant", "auto", "--image", 8, "--export-scene", target]
    done = python(CLI, *words)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("No LLVM 16 or newer was found") == 1
    assert "hundreds of times more slowly" in done.stderr
    assert "libllvm" in done.stderr
    assert (target / "scene.xml").is_file()


def test_scalar_that_was_asked_for_is_not_remarked_on(tmp_path: Path) -> None:
    head = write_obj(tmp_path / "sphere.obj", *sphere(1))
    words = ["bake", "--head", head, "--variant", "scalar", "--image", 8]
    done = python(CLI, *words, "--export-scene", tmp_path / "scene")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.slow
def test_the_command_bakes_in_scalar_from_mesh_to_files_that_solve(tmp_path: Path) -> None:
    from app.core.solver.transport import load_transport
    from app.core.styles.style_pack_file import load_pack, pack_path

    head = write_obj(tmp_path / "sphere.obj", *sphere(1))
    target = tmp_path / "ball.npz"
    words = ["bake", "--head", head, "--variant", "auto", "--image", 8, "--env", "8x4"]
    done = python(CLI, *words, "--quality", "draft", "--front-only", "--json", "-o", target)
    assert done.returncode == 0, done.stderr
    assert "No LLVM" in done.stderr
    assert progress_words(Progress(Task.FOLLOWING_LIGHT)) in done.stderr
    facts = json.loads(done.stdout)
    transport = load_transport(target)
    assert facts["sha256"] == transport.digest
    assert transport.header.environment == (4, 8)
    assert load_pack(pack_path(target)).preintegrated.shape[1:] == (4, 8)
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "ball.npz",
        "ball.shape.npz",
        "ball.styles.npz",
        "sphere.obj",
    ]
