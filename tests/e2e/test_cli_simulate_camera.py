"""`turnlight simulate-camera`: started as a process, asked over HTTP, interrupted."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import requests

from app.cli import main
from app.commands.simulate_camera import MEAN_CD_M2, scene_scale
from app.core.base.colour import luminance
from app.core.base.images import write_exr
from app.core.base.paths import resources
from app.core.solver.environment import from_radiance, solid_angles
from app.devices.simulated.faults import FAULTS

ROOT = Path(__file__).resolve().parents[2]


@contextlib.contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-m", "app", "simulate-camera", *words],
        cwd=ROOT,
        env={**os.environ, "PYTHONUTF8": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def first_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().rstrip("\n")


def interrupt(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Press Ctrl-C; the exit code and what was still said."""
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=600)
    return process.returncode, out, err


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
    fault = sorted(FAULTS)[0]
    words = ["--scene", scene, "--json", "--port", str(port), "--fault", fault, "--seed", "3"]
    with running(*words) as process:
        said = json.loads(first_line(process))
        assert said == {"url": f"http://127.0.0.1:{port}", "model": "V", "faults": [fault]}
        code, _, err = interrupt(process)
    assert code == 130
    assert err.strip() == "Stopped."


def test_a_password_is_asked_for(scene: str) -> None:
    with running("--scene", scene, "--user", "THETAYL1", "--password", "secret12") as process:
        url = first_line(process)
        assert requests.get(f"{url}/osc/info", timeout=600).status_code == 401
        auth = requests.auth.HTTPDigestAuth("THETAYL1", "secret12")
        assert requests.get(f"{url}/osc/info", auth=auth, timeout=600).status_code == 200


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
        (["--fault", "dropped"], "no fault 'dropped'"),
        (["--scene", "nowhere.exr"], "nowhere.exr"),
        (["--model", "Q"], "invalid choice: 'Q'"),
        (["--port", "70000"], "70000 is not a port"),
        (["--rate", "0"], "0 is not a number above 0"),
        (["--user", "x"], "Add --password"),
        (["--model", "S", "--password", "12345678"], "cannot ask for a password"),
    ],
)
def test_bad_words(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate-camera", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    if "--fault" in words:
        assert all(name in captured.err for name in FAULTS)


def test_a_port_that_is_taken(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["simulate-camera", "--scene", scene, "--port", port]) == 2
    assert f"Cannot listen at port {port}" in capsys.readouterr().err


def test_help_lists_the_faults(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate-camera", "--help"]) == 0
    text = capsys.readouterr().out
    assert all(name in text and FAULTS[name] in text for name in FAULTS)


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
