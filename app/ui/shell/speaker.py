"""The loudspeaker. Opened with the first sound; where there is none, everything stays quiet."""

from __future__ import annotations

import atexit
import logging
import threading
from collections.abc import Generator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.guidance.tones import RATE

_PERIOD_MS: Final = 40  # three of these are on their way: so much later a sound is heard
_QUIET_S: Final = 2.0  # after this the device is closed, so that a laptop can rest
_CLOSING_S: Final = 1.0
# Without a choice the library falls back to a device that plays nothing; ALSA alone complains
# on stderr where there is no sound card.
_BACKENDS: Final = ("WASAPI", "DSOUND", "WINMM", "COREAUDIO", "PULSEAUDIO")
_log = logging.getLogger(__name__)


class Speaker:
    """Plays one sound at a time; see `app.ui.presenters.services.Sounds`.

    A device takes its time to start and to stop, so that a thread does both.
    """

    def __init__(self) -> None:
        self._device: Any = None
        self._tried = False
        self._sound = b""
        self._wanted = threading.Event()
        self._closing = False

    @property
    def available(self) -> bool:
        """Whether this computer can play sounds; the first question opens the loudspeaker."""
        if not self._tried:
            self._tried = True
            self._device = _device()
            if self._device is not None:
                thread = threading.Thread(target=self._run, name="loudspeaker", daemon=True)
                thread.start()
                atexit.register(self._close, thread)
        return self._device is not None

    def play(self, samples: NDArray[np.int16], volume: float = 1.0) -> None:
        """Play a sound from its beginning; one that still plays is cut off."""
        if self.available:
            louder = samples * min(max(volume, 0.0), 1.0)
            self._sound = louder.astype(samples.dtype).tobytes()
            self._wanted.set()

    def stop(self) -> None:
        """Be quiet."""
        self._sound = b""

    def _run(self) -> None:
        """Keep the device running while there is something to hear."""
        while self._wanted.wait() and not self._closing:
            frames = self._frames()
            next(frames)
            try:
                self._device.start(frames)
                while self._wanted.is_set() and not self._closing:
                    self._wanted.clear()
                    self._wanted.wait(_QUIET_S + len(self._sound) / (2.0 * RATE))
                self._device.stop()
            except Exception as error:  # noqa: BLE001 - a broken loudspeaker stops no work
                _log.info("no sound: %s", error)
                self._device = None
                return
        self._device.close()

    def _frames(self) -> Generator[bytes, int, None]:
        """Give the device what is to be heard next; it adds silence to what is too short."""
        sound, heard = b"", 0
        frames = yield b""
        while True:
            if sound is not self._sound:
                sound, heard = self._sound, 0
            part = sound[heard : heard + 2 * frames]
            heard += len(part)
            frames = yield part

    def _close(self, thread: threading.Thread) -> None:
        """Stop before Python ends: the device calls into it."""
        self._closing = True
        self._wanted.set()
        thread.join(_CLOSING_S)


def _device() -> Any:
    """Open the loudspeaker, None where there is none."""
    try:
        # It has no build for Linux on ARM.
        import miniaudio

        return miniaudio.PlaybackDevice(
            output_format=miniaudio.SampleFormat.SIGNED16,
            nchannels=1,
            sample_rate=RATE,
            buffersize_msec=_PERIOD_MS,
            backends=[miniaudio.Backend[name] for name in _BACKENDS],
            app_name="Turnlight",
        )
    except Exception as error:  # noqa: BLE001 - whatever is wrong there, all else works
        _log.info("no sound: %s", error)
        return None
