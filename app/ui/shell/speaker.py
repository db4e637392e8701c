"""The loudspeaker. Opened with the first sound; where there is none, everything stays quiet."""

from __future__ import annotations

import logging
import os
import shutil
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QLoggingCategory

from app.core.guidance.tones import RATE

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_BUFFER_BYTES: Final = 1 << 14
_log = logging.getLogger(__name__)


class Speaker:
    """Plays one sound at a time; see `app.ui.presenters.services.Sounds`."""

    def __init__(self) -> None:
        self._sink: Any = None
        self._buffer: QBuffer | None = None
        self._tried = False

    @property
    def available(self) -> bool:
        """Whether this computer can play sounds; the first question opens the loudspeaker."""
        self._open()
        return self._sink is not None

    def play(self, samples: NDArray[np.int16], volume: float = 1.0) -> None:
        """Play a sound from its beginning; one that still plays is cut off."""
        self._open()
        if self._sink is None:
            return
        self.stop()
        buffer = QBuffer()
        buffer.setData(QByteArray(samples.tobytes()))
        buffer.open(QIODevice.OpenModeFlag.ReadOnly)
        self._buffer = buffer
        self._sink.setVolume(min(max(volume, 0.0), 1.0))
        self._sink.start(buffer)

    def stop(self) -> None:
        """Be quiet."""
        if self._sink is not None:
            self._sink.stop()
        if self._buffer is not None:
            self._buffer.close()
            self._buffer = None

    def _open(self) -> None:
        if self._tried:
            return
        self._tried = True
        if not _may_sound():
            _log.info("no sound: there is no sound server")
            return
        # What it lacks of video and the like is of no interest here.
        QLoggingCategory.setFilterRules("qt.multimedia.*=false")
        try:
            # Its libraries may be missing where nothing else of Qt's is.
            from PySide6.QtMultimedia import QAudioFormat, QAudioSink, QMediaDevices
        except ImportError as error:
            _log.info("no sound: %s", error)
            return
        device = QMediaDevices.defaultAudioOutput()
        if device.isNull():
            _log.info("no sound: there is no loudspeaker")
            return
        form = QAudioFormat()
        form.setSampleRate(RATE)
        form.setChannelCount(1)
        form.setSampleFormat(QAudioFormat.SampleFormat.Int16)
        self._sink = QAudioSink(device, form)
        self._sink.setBufferSize(_BUFFER_BYTES)


def _may_sound() -> bool:
    """Whether a sound server answers, or would be started: without one Qt complains aloud."""
    if sys.platform in ("win32", "darwin") or os.environ.get("PULSE_SERVER"):
        return True
    if shutil.which("pulseaudio") is not None and os.geteuid() != 0:
        return True  # libpulse starts it
    running = Path(os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{os.getuid()}")
    own = os.environ.get("PULSE_RUNTIME_PATH")
    folders = [Path(own)] if own else [running / "pulse", Path("/run/pulse")]
    doors = [folder / "native" for folder in folders]
    doors += [running / "pipewire-0", *Path.home().glob(".config/pulse/*-runtime/native")]
    return any(_answers(door) for door in doors)


def _answers(door: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(1.0)
        try:
            line.connect(str(door))
        except OSError:
            return False
    return True
