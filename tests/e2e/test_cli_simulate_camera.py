"""`turnlight simulate-camera`: started as a process, asked over HTTP, interrupted."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import requests

from app.cli import main
from app.commands.simulate_camera import MEAN_CD_M2, scene_scale
from app.core.base.colour import luminance
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from app.core.environment.environment import from_radiance, solid_angles
from tests.helpers.camera_command import first_line, interrupt, running

ROOT = Path(__file__).resolve().parents[2]


no_signals = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows cannot interrupt one process of a console"
)


@pytest.fixture
def scene(tmp_path: Path) -> str:
    path = tmp_path / "grey.exr"
    write_exr(path, np.full((64, 128, 3), 0.2, np.float32))
    return str(path)


@no_signals
def test_url_first_then_a_camera_until_interrupted(scene: str) -> None:
    with running("--scene", scene, "--model", "Z1", "--log") as process:
        url = first_line(process)
        assert url.startswith("http://127.0.0.1:")
        info = requests.get(f"{url}/osc/info", timeout=600)
        assert info.json()["model"] == "RICOH THETA Z1"
        state = requests.post(f"{url}/osc/state", timeout=600)
        assert "state" in state.json()
        code, out, err = interrupt(process)
    assert code == 130
    assert out == ""
    assert '"GET /osc/info HTTP/1.1" 200' in err
    assert "Traceback" not in err
    assert err.rstrip().endswith("Stopped.")


@no_signals
def test_json_names_what_was_asked_for(scene: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with running("--scene", scene, "--json", "--port", str(port)) as process:
        said = json.loads(first_line(process))
        assert said == {"url": f"http://127.0.0.1:{port}", "model": "V"}
        code, _, err = interrupt(process)
    assert code == 130
    assert err.strip() == "Stopped."


@no_signals
def test_interrupted_while_the_preview_is_open(scene: str) -> None:
    with running("--scene", scene) as process:
        url = first_line(process)
        with requests.post(
            f"{url}/osc/commands/execute",
            json={"name": "camera.getLivePreview"},
            stream=True,
            timeout=600,
        ) as preview:
            assert b"---osclivepreview---" in next(preview.iter_content(1000))
            code, _, err = interrupt(process)
    assert code == 130
    assert err.strip() == "Stopped."


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--scene", "nowhere.exr"], "nowhere.exr"),
        (["--model", "Q"], "invalid choice: 'Q'"),
        (["--port", "70000"], "70000 is not a port"),
        (["--rate", "0"], "0 is not a number above 0"),
    ],
)
def test_bad_words(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate-camera", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err
    assert len(captured.err.strip().splitlines()) == 1


def test_a_port_that_is_taken(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["simulate-camera", "--scene", scene, "--port", port]) == 2
    assert f"Cannot listen on port {port}" in capsys.readouterr().err


def test_scale() -> None:
    light = np.random.default_rng(0).random((32, 64, 3), np.float32)
    environment = from_radiance(light.copy(), "noise")
    scaled = luminance(light) * scene_scale(environment)
    weights = solid_angles((32, 64))[:, None] * np.ones(64)
    assert np.average(scaled, weights=weights) == pytest.approx(MEAN_CD_M2, rel=1e-4)


def test_the_scene_of_choice_is_there() -> None:
    assert (resources() / "demo" / "scenes" / "courtyard.exr").is_file()


def test_it_ends_when_its_input_is_closed() -> None:
    """As when the program that started it was killed."""
    with subprocess.Popen(
        [sys.executable, "-m", "app", "simulate-camera", "--until-eof"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert first_line(process).startswith("http://")
            assert process.stdin is not None
            process.stdin.close()
            assert process.wait(timeout=600) == 0
        finally:
            process.kill()
