"""`turnlight capture` as a user meets it: a simulated camera in, a session folder out."""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.cli import main
from app.commands import capture as command
from app.commands.capture import MAY_MOVE, RESTORED
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.environment.environment import from_radiance, read_environment
from app.core.measure.read.frame import Exposure
from app.core.styles.style_pack_file import load_named_pack
from app.devices.capture.session import Session
from app.devices.capture.status import Status
from app.devices.clock import VirtualClock
from app.devices.errors import Unreachable
from app.devices.passwords import Credentials
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from app.devices.simulated.preview import LivePicture
from app.devices.theta.camera_identity import FoundCamera
from app.devices.theta.endpoint import ACCESS_POINT
from benchmarks.light.shots.brackets import write_bracket
from tests.helpers.camera_command import FAULTY, GOOD

ROOT = Path(__file__).resolve().parents[2]
TURNLIGHT = [sys.executable, "-m", "app"]
ENOUGH_S = 120.0


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small room."""
    light = read_environment(resources() / "demo" / "scenes" / "studio.exr").radiance
    small = light.reshape(128, light.shape[0] // 128, 256, -1, 3).mean(axis=(1, 3))
    path = tmp_path_factory.mktemp("scene") / "room.exr"
    write_exr(path, np.ascontiguousarray(small, np.float32))
    assert from_radiance(small.astype(np.float32), "room").shape == (128, 256)
    return path


@contextmanager
def camera(scene: Path, *words: str, command: tuple[str, ...] = GOOD) -> Iterator[str]:
    """A simulated camera in a process of its own; gives its address."""
    line = [sys.executable, "-m", *command, "--scene", str(scene), *words]
    with subprocess.Popen(
        line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            assert process.stdout is not None
            yield process.stdout.readline().strip()
        finally:
            process.terminate()
            process.wait(600)


def start(*words: object) -> subprocess.Popen[str]:
    """`turnlight capture` in a process of its own."""
    command = [*TURNLIGHT, "capture", *map(str, words)]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finish(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    with process:
        out, err = process.communicate(timeout=ENOUGH_S)
    assert "Traceback" not in err
    return process.returncode, out, err


def refused(capsys: pytest.CaptureFixture[str], code: int, *words: object) -> str:
    assert main(["capture", *map(str, words)]) == code
    error = capsys.readouterr().err
    assert "Traceback" not in error
    return error


@pytest.mark.slow
def test_an_interrupted_capture_is_gone_on_with_to_its_end(scene: Path, tmp_path: Path) -> None:
    folder = tmp_path / "place"
    with camera(scene, "--model", "V", "--rate", "8") as url:
        process = start("--camera", url, "-o", folder)
        assert process.stderr is not None
        said = ""
        for line in process.stderr:
            said += line
            if MAY_MOVE in line:
                break
        process.send_signal(signal.SIGINT)
        code, out, err = finish(process)
        assert code == 130, said + err
        assert out == ""
        assert "Stopping" in err
        journal = json.loads((folder / "session.json").read_text())
        assert journal["settings_to_restore"] == {}

        code, out, err = finish(start("--camera", url, "-o", folder, "--json"))
        assert code == 0, err
        assert "Resuming the unfinished session" in err
        assert "Exposure 1" not in err
    values: dict[str, Any] = json.loads(out)
    assert values["camera"]["model"] == "RICOH THETA V"
    assert values["camera"]["url"] == url
    assert set(values["seconds"]) == {"metering", "exposing", "download", "merge"}
    frames = values["frames"]
    assert [round(frame["ev"] - frames[1]["ev"]) for frame in frames] == [2, 0, -2]
    assert Path(values["environment"]).parent == folder
    assert read_environment(Path(values["environment"])).shape[0] >= 1024
    assert len(list((folder / "originals").iterdir())) == 3
    code, _, err = finish(start("--camera", url, "-o", folder))
    assert code == 2
    assert "already finished" in err


@pytest.mark.slow
def test_the_table_names_frames_times_and_file(scene: Path, tmp_path: Path) -> None:
    lock = ("--user", "THETAYN1", "--password", "12345678")
    with camera(scene, "--model", "Z1", *lock, command=FAULTY) as url:
        secret = tmp_path / "secret"
        secret.write_text("12345678\n")
        words = ("--user", "THETAYN1", "--password-file", secret)
        code, out, err = finish(start("--camera", url, "-o", tmp_path / "a", *words))
        assert code == 0, err
        code, _, error = finish(start("--camera", url, "-o", tmp_path / "b"))
        assert code == 3
        assert "password" in error
    assert out.count(".JPG") == 3
    assert "metering" in out
    assert "environment.exr" in out
    assert "Exposure 2 of 3" in err
    assert "s left" in err
    assert "12345678" not in (tmp_path / "a" / "session.json").read_text()


@pytest.mark.slow
def test_a_watched_folder_gives_the_bracket_that_comes(tmp_path: Path) -> None:
    light = read_environment(resources() / "demo" / "scenes" / "studio.exr").radiance
    metered = meter(light, THETA_V)
    exposures = [
        Exposure(metered.shutter_s * 2.0**stop, metered.iso, metered.aperture)
        for stop in (0.0, 2.0, -2.0)
    ]
    folder = tmp_path / "incoming"
    folder.mkdir()
    process = start("--watch", folder, "-o", tmp_path / "out", "--json")
    assert process.stderr is not None
    assert "Waiting for photos" in process.stderr.readline()
    write_bracket(folder, light, THETA_V, exposures, shape=(128, 256))
    code, out, err = finish(process)
    assert code == 0, err
    values = json.loads(out)
    assert len(values["frames"]) == 3
    assert values["camera"]["model"] == "RICOH THETA V"
    assert values["seconds"]["merge"] > 0
    assert values["environment"] == str(tmp_path / "out" / "environment.exr")
    assert read_environment(Path(values["environment"])).shape == (128, 256)
    assert len(os.listdir(folder)) == 3


def test_nobody_at_the_address_is_a_device_failure(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    error = refused(capsys, 3, "--camera", "http://127.0.0.1:9", "-o", tmp_path / "a")
    assert error.rstrip().endswith(".")


def test_bad_usage_is_one_sentence(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    url = "http://127.0.0.1:9"
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("dear")
    (tmp_path / "empty").write_text("")
    assert "-o" in refused(capsys, 2, "--camera", url)
    assert "--watch" in refused(capsys, 2, "-o", tmp_path / "a")
    assert "not allowed" in refused(capsys, 2, "--camera", url, "--watch", tmp_path)
    assert "not from a session" in refused(capsys, 2, "--camera", url, "-o", tmp_path / "full")
    assert "delay" in refused(capsys, 2, "--camera", url, "-o", tmp_path / "a", "--delay", "99")
    words = ("--camera", url, "-o", tmp_path / "a", "--user", "me")
    assert "used together" in refused(capsys, 2, *words)
    assert "no password" in refused(capsys, 2, *words, "--password-file", tmp_path / "empty")
    assert "cannot be read" in refused(capsys, 2, *words, "--password-file", tmp_path / "missing")
    assert "--watch" in refused(capsys, 2, "--watch", tmp_path, "--delay", "2")
    assert refused(capsys, 3, "--watch", tmp_path / "missing").count("\n") >= 1
    assert "choose from" in refused(capsys, 2, "--camera", url, "--plan", "all")
    assert not (tmp_path / "a").exists()
    assert os.listdir(tmp_path / "full") == ["letter.txt"]


def test_the_second_interrupt_ends_at_once() -> None:
    program = (
        "import os, signal, time\n"
        "from app.commands.shared.console import stopping\n"
        "from app.core.base.progress import Token\n"
        "token = Token()\n"
        "with stopping(token):\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    print(token.cancelled, flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(5)\n"
        "    print('still here')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.stdout == "True\n"
    assert done.returncode == -signal.SIGINT


def test_signals_are_as_before_afterwards() -> None:
    from app.commands.shared.console import stopping

    before = signal.getsignal(signal.SIGINT)
    with stopping(Token()):
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.slow
def test_a_finished_session_gives_its_camera_back_what_it_owes(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "place"
    session = Session.create(folder)
    session.update(
        stage="done",
        finished="2026-01-01T12:00:00+00:00",
        serial="1",
        settings_to_restore={"sleepDelay": 300},
    )
    with camera(scene, "--model", "V") as url:
        words = ("--camera", url, "-o", folder)
        assert "A different camera" in refused(capsys, 3, *words)
        session.update(serial="")
        assert main(["capture", *map(str, words)]) == 0
        told = capsys.readouterr()
        assert told.out == f"{RESTORED}\n"
        assert "not been restored yet" in told.err
        assert Session.open(folder).journal.settings_to_restore == {}
        assert "already finished" in refused(capsys, 2, *words)


def test_a_camera_that_is_owed_settings_is_sought_but_does_not_stop_the_merge(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody(*words: object) -> FoundCamera:
        raise Unreachable("Nothing answers.")

    def reach(owed: dict[str, int], finished: str = "", complete: bool = True) -> object:
        journal = SimpleNamespace(settings_to_restore=owed, finished=finished)
        session: Any = SimpleNamespace(complete=complete, journal=journal, owes=bool(owed))
        args = argparse.Namespace(camera="auto")
        return command._reach(args, session, None, VirtualClock(), Token())

    monkeypatch.setattr(command, "find_camera", nobody)
    assert reach({}) == (None, None)
    assert capsys.readouterr().err == ""
    assert reach({"sleepDelay": 300}) == (None, None)
    assert "not been restored yet" in capsys.readouterr().err
    with pytest.raises(Unreachable):
        reach({"sleepDelay": 300}, finished="yesterday")
    with pytest.raises(Unreachable):
        reach({}, complete=False)


@pytest.mark.parametrize("asks", [True, False])
def test_only_a_password_that_the_camera_wanted_is_kept(
    monkeypatch: pytest.MonkeyPatch, asks: bool
) -> None:
    kept: list[str] = []
    keyring = SimpleNamespace(set=lambda user, password: kept.append(user))
    monkeypatch.setattr(command, "Passwords", lambda say: keyring)
    monkeypatch.setattr(command, "remember", lambda camera: None)
    found = FoundCamera("V", ACCESS_POINT, "V", "1", "typed", needs_password=asks)
    command.keep(found, None, Credentials("me", "secret"))
    command.keep(found, None, None)
    assert kept == (["me"] if asks else [])


def test_a_first_answer_is_said_once(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    light = read_environment(scene).radiance
    tell = command.StatusTeller(VirtualClock(), load_named_pack("generic"))
    tell(Status(message="Bringing the frames over"))
    assert "Rough" not in capsys.readouterr().err
    for _ in range(2):
        tell(Status(message="Metering", metered=LivePicture(light, (160, 320)).frame(0)))
    lines = capsys.readouterr().err.splitlines()
    rough = [line for line in lines if "Rough" in line]
    assert len(rough) == 1
    assert rough[0].startswith("Rough first answer: ")
    assert "°" in rough[0]
