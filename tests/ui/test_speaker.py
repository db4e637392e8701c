"""The loudspeaker where there is none: silent in every way."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import sys
import numpy as np
from app.ui.shell.speaker import Speaker
speaker = Speaker()
speaker.play(np.zeros(100, np.int16))
speaker.stop()
print(speaker.available, "PySide6.QtMultimedia" in sys.modules)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="sound servers are Linux's")
@pytest.mark.parametrize("left_behind", [False, True])
def test_without_a_sound_server_nothing_is_said_and_nothing_loaded(
    tmp_path: Path, left_behind: bool
) -> None:
    if left_behind:
        (tmp_path / "pulse").mkdir()
        with socket.socket(socket.AF_UNIX) as line:
            line.bind(str(tmp_path / "pulse" / "native"))
    env = {key: value for key, value in os.environ.items() if not key.startswith("PULSE_")}
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env={**env, "XDG_RUNTIME_DIR": str(tmp_path), "HOME": str(tmp_path), "PATH": ""},
        cwd=Path(__file__).resolve().parents[2],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "False False\n"
