"""``turnlight bake`` as a user runs it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from app.cli import main
from app.core.portrait.head_views import load_views, views_path
from app.core.solver.head_shape import load_shape, shape_path
from app.core.solver.transport import load_transport, render, to_image
from app.core.styles.style_pack_file import load_pack, pack_path
from app.core.styles.styles import NAMES
from tests.helpers.meshes import sphere, write_obj, write_ply

if TYPE_CHECKING:
    from pathlib import Path

needs_llvm = pytest.mark.llvm


@needs_llvm
def test_a_small_head_is_baked_exported_and_solved_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target, scene = tmp_path / "small.npz", tmp_path / "scene"
    words = ["bake", "--env", "16x8", "--image", "12", "--quality", "draft", "--json"]
    assert main([*words, "-o", str(target), "--export-scene", str(scene)]) == 0
    printed = capsys.readouterr()
    facts = json.loads(printed.out)
    assert facts["transport"] == str(target)
    assert 0 < facts["noise"] < 1
    assert " 95%  Writing the head" in printed.err
    assert printed.err.splitlines()[-1] == "100%  Writing the head"
    transport, pack = load_transport(target), load_pack(pack_path(target))
    assert transport.environment_shape == (8, 16)
    assert transport.size == 12
    assert pack.header.transport_sha256 == transport.digest == facts["sha256"]
    assert len(pack.styles) == len(NAMES)
    assert (scene / "scene.xml").is_file()
    assert {file.name for file in (scene / "meshes").iterdir()} == {"skin.ply", "eyes.ply"}
    assert not list(tmp_path.glob("*.bake"))
    views = load_views(views_path(target), transport.digest, load_shape(shape_path(target)))
    assert views.yaws == (-45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0)
    light = np.ones((8, 16, 3), np.float32)
    straight, aside = (
        to_image(one, render(one, light)).mean()
        for one in (transport, views.at(30.0, pack.styles).transport)
    )
    assert aside == pytest.approx(straight, rel=0.15)


@pytest.mark.mitsuba
def test_the_renderers_remarks_do_not_stand_in_the_answer(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """It writes to the descriptor itself, in colour, here about edges as Blender exports them."""
    edges = "element edge 1\nproperty int vertex1\nproperty int vertex2\n|0 1\n"
    mesh = write_ply(tmp_path / "ball.ply", *sphere(2), edges)
    words = ["bake", "--head", str(mesh), "--unit", "100", "--json"]
    assert main([*words, "--export-scene", str(tmp_path / "scene")]) == 0
    assert json.loads(capfd.readouterr().out) == {"scene": str(tmp_path / "scene" / "scene.xml")}


@needs_llvm
def test_a_head_of_ones_own_without_eyes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = write_obj(tmp_path / "ball.obj", *sphere(2))
    target = tmp_path / "ball.npz"
    words = ["--head", str(mesh), "--skin", "dark", "--quality", "draft", "--front-only"]
    assert main(["bake", *words, "--env", "8x4", "--image", "8", "-o", str(target)]) == 0
    assert f"transport: {target}" in capsys.readouterr().out
    header = load_transport(target).header
    assert (header.head, header.skin) == ("ball", "dark")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "--export-scene DIR"),
        (["-o", "t.npz", "--env", "64x64"], "twice as wide as it is high"),
        (["-o", "t.npz", "--env", "wide"], "must have the form 64x32"),
        (["-o", "t.npz", "--image", "4"], "--image must be"),
        (["-o", "t.npz", "--seed", "-1"], "--seed must be"),
        (["-o", "t.zip"], "must be an .npz file"),
        (["-o", "missing/t.npz"], "missing"),
        (["-o", "t.npz", "--skin", "green"], "no skin tone"),
        (["-o", "t.npz", "--variant", "abacus"], "no variant"),
        pytest.param(
            ["-o", "t.npz", "--head", "nobody.ply", "--variant", "scalar"],
            "no head file",
            marks=pytest.mark.mitsuba,
        ),
        pytest.param(
            ["-o", "t.npz", "--head", "generic-eyes", "--variant", "scalar"],
            "no head file",
            marks=pytest.mark.mitsuba,
        ),
    ],
)
def test_bad_words_give_one_sentence_and_no_file(
    words: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["bake", *words]) == 2
    printed = capsys.readouterr()
    assert sentence in printed.err
    assert "Traceback" not in printed.err
    assert printed.out == ""
    assert list(tmp_path.iterdir()) == []
