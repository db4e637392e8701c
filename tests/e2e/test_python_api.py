"""The public Python API, as docs/python.md shows it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import turnlight
from app.cli import main as command_line
from app.core.base.colour import luminance
from app.core.solver.transport import load_named

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "resources" / "demo" / "scenes" / "sunrise.exr"


@pytest.fixture(scope="module")
def environment() -> turnlight.Environment:
    return turnlight.read_environment(SCENE)


def test_the_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scenes = tmp_path / SCENE.parent.relative_to(ROOT)
    scenes.mkdir(parents=True)
    shutil.copy(SCENE, scenes)
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) >= 5
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Flat")
    assert len(lines) == 15
    # The merged bracket answers as the panorama of which its frames were made.
    before, after = (
        {one.name: one for one in turnlight.solve(names[light])}
        for light in ("environment", "merged")
    )
    for name in ("butterfly", "left-loop"):
        shift = after[name].turn_refined_deg - before[name].turn_refined_deg
        assert abs(shift) < 2.0
    face = cv2.imread("face.png")
    assert face is not None
    assert face.shape == (320, 256, 3)
    assert (tmp_path / "places" / names["place"].folder.name / "place.json").is_file()


def test_solve_answers_as_the_command_does(
    environment: turnlight.Environment, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command_line(["solve", str(SCENE), "--yaw", "short", "--json"]) == 0
    styles = json.loads(capsys.readouterr().out)["styles"]
    results = turnlight.solve(environment, yaw="short")
    assert [result.name for result in results] == [style["name"] for style in styles]
    for result, style in zip(results, styles, strict=True):
        assert result.turn_refined_deg == pytest.approx(style["turn_refined_deg"], abs=1e-6)
        assert (result.grade, result.yaw_deg) == (style["grade"], style["yaw_deg"])


def test_solve_counts_turns_from_the_photographer(environment: turnlight.Environment) -> None:
    (ahead,) = turnlight.solve(environment, styles=["left-loop"])
    (aside,) = turnlight.solve(environment, styles=["left-loop"], front_deg=90.0)
    difference = (ahead.turn_refined_deg - aside.turn_refined_deg) % 360.0
    assert difference == pytest.approx(90.0, abs=1e-9)


def test_render_is_linear_in_the_light(environment: turnlight.Environment) -> None:
    double = turnlight.Environment(environment.radiance * 2.0, "double")
    once, twice = (turnlight.render(one, 40.0) for one in (environment, double))
    np.testing.assert_allclose(twice.linear, 2.0 * once.linear, rtol=1e-4, atol=1e-6)
    assert np.abs(twice.srgb.astype(int) - once.srgb).max() <= 1
    transport = load_named("generic")
    face = once.srgb.reshape(-1, 3)[transport.pixels[transport.face]]
    assert 0.4 < luminance(face / 255.0).mean() < 0.8


def test_a_place_keeps_its_light_and_turns(
    environment: turnlight.Environment, tmp_path: Path
) -> None:
    place = turnlight.Place.load(turnlight.Place.create([SCENE], tmp_path, name="B").folder)
    assert (place.name, place.front_deg, place.results) == ("B", 0.0, ())
    np.testing.assert_allclose(
        place.environment.radiance, environment.radiance, rtol=1e-3, atol=1e-6
    )
    names = ("left-loop", "right-split")
    here = {result.name: result.turn_refined_deg for result in place.solve()}
    for result in turnlight.solve(environment, styles=names):
        assert here[result.name] == pytest.approx(result.turn_refined_deg, abs=0.5)
    assert place.render(30.0).linear.shape == turnlight.render(environment, 30.0).linear.shape


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: turnlight.read_environment("nowhere.exr"), "nowhere.exr"),
        (lambda: turnlight.Place.load("nowhere"), "nowhere"),
        (lambda: turnlight.solve(turnlight.read_environment(SCENE), "nobody"), "nobody"),
        (lambda: turnlight.solve(turnlight.read_environment(SCENE), styles=["lop"]), "lop"),
        (lambda: turnlight.render(turnlight.read_environment(SCENE), 0.0, height=9), "9"),
    ],
)
def test_bad_input_is_a_core_error(call: Any, words: str) -> None:
    with pytest.raises(turnlight.CoreError, match=words):
        call()


def test_the_api_is_imported_without_an_app_on_the_path(tmp_path: Path) -> None:
    """A folder named app where Python runs must not be taken for ours."""
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "__init__.py").write_text("raise SystemExit('the wrong app')\n")
    path = os.pathsep.join(map(str, (tmp_path, ROOT)))

    def run(code: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=False,
        )

    done = run("import turnlight; print(turnlight.CoreError.__module__)")
    assert done.stdout == "app.core.base.errors\n", done.stderr
    done = run("import sys, turnlight; sys.modules['app'] = sys; turnlight.CoreError")
    assert "Another package named “app”" in done.stderr


def test_every_public_name_has_a_docstring() -> None:
    for name in turnlight.__all__:
        assert getattr(turnlight, name).__doc__, name
    for name, member in vars(turnlight.Place).items():
        assert name.startswith("_") or member.__doc__ or member.__func__.__doc__, name


def test_measure_stops_when_its_token_is_cancelled(tmp_path: Path) -> None:
    light = turnlight.read_environment(SCENE).radiance[::2, ::2]
    for number, gain in enumerate((0.1, 1.0)):
        frame = (255 * np.clip(gain * light, 0, 1) ** (1 / 2.2)).astype(np.uint8)
        cv2.imwrite(str(tmp_path / f"{number}.png"), frame[..., ::-1])
    options = turnlight.MeasureOptions(times=(0.01, 0.1))
    steps: list[float] = []
    token = turnlight.Token()

    def report(fraction: float, _step: object) -> None:
        steps.append(fraction)
        token.cancel()

    with pytest.raises(turnlight.Cancelled):
        turnlight.measure([tmp_path], options=options, token=token, report=report)
    assert steps
