"""`python -m tests.faulty_camera`: a camera with faults and a password, in a process of its own."""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path

import numpy as np
import pytest
import requests

from app.core.base.imaging.images import write_exr
from tests.faulty_camera.__main__ import main
from tests.faulty_camera.faults import FAULTS
from tests.helpers.camera_command import FAULTY, first_line, interrupt, running


@pytest.fixture
def scene(tmp_path: Path) -> str:
    path = tmp_path / "grey.exr"
    write_exr(path, np.full((64, 128, 3), 0.2, np.float32))
    return str(path)


@pytest.mark.skipif(
    sys.platform == "win32", reason="Windows cannot interrupt one process of a console"
)
def test_json_names_the_faults(scene: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    fault = sorted(FAULTS)[0]
    words = ["--scene", scene, "--json", "--port", str(port), "--fault", fault, "--seed", "3"]
    with running(*words, command=FAULTY) as process:
        facts = json.loads(first_line(process))
        assert facts == {"url": f"http://127.0.0.1:{port}", "model": "V", "faults": [fault]}
        code, _, err = interrupt(process)
    assert code == 130
    assert err.strip() == "Stopped."


def test_fault_strikes_over_http(scene: str) -> None:
    with running("--scene", scene, "--fault", "401", command=FAULTY) as process:
        url = first_line(process)
        assert requests.get(f"{url}/osc/info", timeout=600).status_code == 401


def test_password_is_demanded(scene: str) -> None:
    words = ["--scene", scene, "--user", "THETAYL1", "--password", "secret12"]
    with running(*words, command=FAULTY) as process:
        url = first_line(process)
        assert requests.get(f"{url}/osc/info", timeout=600).status_code == 401
        auth = requests.auth.HTTPDigestAuth("THETAYL1", "secret12")
        assert requests.get(f"{url}/osc/info", auth=auth, timeout=600).status_code == 200


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--fault", "dropped"], "no fault 'dropped'"),
        (["--user", "x"], "Add --password"),
        (["--model", "S", "--password", "12345678"], "cannot ask for a password"),
    ],
)
def test_bad_words(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    if "--fault" in words:
        assert all(name in captured.err for name in FAULTS)


def test_help_lists_the_faults(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    text = capsys.readouterr().out
    assert all(name in text and FAULTS[name] in text for name in FAULTS)
