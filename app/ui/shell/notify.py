"""Messages to the user: toasts, the list of messages, error messages and sounds."""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import shutil
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import CoreError
from app.core.base.memory import MemoryShort, is_memory_short
from app.core.guidance.beeps import RATE
from app.core.text import tr
from app.devices.errors import DeviceError
from app.ui.presenters.services import Action, Kind, Sounds
from app.ui.presenters.window_model import Event
from app.ui.widgets.messages import Toasts

_MOST_KEPT: Final = 200
_OURS: Final = tr(
    "Something went wrong inside Turnlight. Your measurements and strokes are saved. "
    "Try again, or restart Turnlight."
)
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """A message to the user, with its buttons.

    Attributes:
        actions: The label and the callable of each button.
    """

    moment: datetime
    text: str
    kind: Kind
    actions: tuple[Action, ...] = ()
    about: str = ""


class Notify:
    """The window's notifier (see `app.ui.presenters.services.Notifier`)."""

    def __init__(self, today: Callable[[], datetime]) -> None:
        self.changed = Event()
        self._today = today
        self._toasts: Toasts | None = None
        self._messages: deque[Message] = deque(maxlen=_MOST_KEPT)
        self._standing: list[Message] = []
        self._unread: list[Message] = []
        self._waiting: list[Message] = []

    @property
    def messages(self) -> tuple[Message, ...]:
        """All messages since the app started, oldest first."""
        return tuple(self._messages)

    @property
    def unread(self) -> int:
        """Number of unread messages, not counting confirmations."""
        return len(self._unread)

    def attach(self, toasts: Toasts | None) -> None:
        """Show messages in this window from now on, starting with any that are still unresolved.

        Args:
            toasts: The window's toasts, or None while the window is being rebuilt.
        """
        self._toasts = toasts
        if toasts is not None:
            waiting = [one for one in self._waiting if one not in self._standing]
            self._waiting.clear()
            for message in (*self._standing, *waiting):
                self._show(message)

    def tell(
        self,
        message: str,
        *,
        kind: Kind = "info",
        actions: Sequence[Action] = (),
        about: str = "",
        stay: bool = False,
    ) -> None:
        """Show a message (see `app.ui.presenters.services.Notifier.tell`)."""
        if about:
            self.mended(about)
        one = Message(self._today(), message, kind, tuple(actions), about)
        self._messages.append(one)
        if kind != "done":
            self._unread = [*self._unread, one][-_MOST_KEPT:]
        if kind in ("warning", "error"):
            _log.warning("told: %s", message)
        if stay or kind == "error":
            # A repeated message replaces the one on display.
            self._standing = [each for each in self._standing if each.text != message]
            self._standing.append(one)
        self._show(one)
        self.changed.emit()

    def tell_error(
        self, error: Exception, *, actions: Sequence[Action] = (), about: str = ""
    ) -> None:
        """Show an error (see `app.ui.presenters.services.Notifier.tell_error`)."""
        if isinstance(error, (CoreError, DeviceError)):
            words = str(error)
        elif is_memory_short(error):
            words = str(MemoryShort())
        elif isinstance(error, OSError):
            words = _file_words(error)
        else:
            _log.error("unexpected", exc_info=error)
            words = _OURS
        self.tell(words, kind="error", actions=actions, about=about)

    def mended(self, about: str) -> None:
        """Remove the messages about a problem that has been resolved."""
        for message in [each for each in self._standing if each.about == about]:
            self._mark_read(message)
            if self._toasts is not None:
                self._toasts.drop(message.text)

    def read(self) -> None:
        """Mark all messages as read without closing them."""
        self._unread.clear()
        self.changed.emit()

    def dismiss(self) -> None:
        """Close all messages."""
        self._standing.clear()
        if self._toasts is not None:
            self._toasts.clear()

    def _show(self, message: Message) -> None:
        if self._toasts is None:
            self._waiting.append(message)
            return
        self._toasts.tell(
            message.text,
            kind=message.kind,
            actions=message.actions,
            stay=message in self._standing,
            closed=lambda: self._mark_read(message),
        )

    def _mark_read(self, message: Message) -> None:
        """Mark a message as read because it was closed or resolved."""
        self._standing = [each for each in self._standing if each is not message]
        self._unread = [each for each in self._unread if each is not message]
        self.changed.emit()


def _file_words(error: OSError) -> str:
    reason = (error.strerror or str(error) or type(error).__name__).rstrip(".")
    if not error.filename:
        return tr("{reason}. Nothing was overwritten.", reason=reason)
    return tr("{file}: {reason}. Nothing was overwritten.", file=error.filename, reason=reason)


_PERIOD_MS: Final = 40  # three such buffers are queued, which delays every sound
_QUIET_S: Final = 2.0  # the device is closed after this silence, so that a laptop can sleep
_CLOSING_S: Final = 1.0
# Without this list, the library falls back to a silent device. ALSA is left out, because it prints
# errors to stderr if there is no sound card.
_BACKENDS: Final = ("WASAPI", "DSOUND", "WINMM", "COREAUDIO", "PULSEAUDIO")


class Speaker(Sounds):
    """Plays one sound at a time (see `app.ui.presenters.services.Sounds`).

    The device is opened for the first sound. If there is no device, everything stays silent.
    Starting and stopping a device takes time, so both are done on a separate thread.
    """

    def __init__(self) -> None:
        self._device: Any = None
        self._tried = False
        self._sound = b""
        self._wake = threading.Event()
        self._closing = False

    @property
    def available(self) -> bool:
        """Whether this computer can play sounds.

        The first time this property is read, it opens the device.
        """
        if not self._tried:
            self._tried = True
            self._device = _device()
            if self._device is not None:
                thread = threading.Thread(target=self._run, name="loudspeaker", daemon=True)
                thread.start()
                atexit.register(self._close, thread)
        return self._device is not None

    def play(self, samples: NDArray[np.int16], volume: float = 1.0) -> None:
        """Play a sound from the beginning, cutting off any sound that is still playing."""
        if self.available:
            louder = samples * min(max(volume, 0.0), 1.0)
            self._sound = louder.astype(samples.dtype).tobytes()
            self._wake.set()

    def stop(self) -> None:
        """Stop the sound that is playing."""
        self._sound = b""

    @property
    def speaks(self) -> bool:
        """Whether the system can speak text."""
        return bool(_voice())

    def say(self, words: str) -> None:
        """Speak text with the system's voice."""
        if self.speaks:
            threading.Thread(target=_say, args=(words,), name="voice", daemon=True).start()

    def _run(self) -> None:
        """Run the device whenever there is sound to play."""
        while self._wake.wait() and not self._closing:
            frames = self._frames()
            next(frames)
            try:
                self._device.start(frames)
                while self._wake.is_set() and not self._closing:
                    self._wake.clear()
                    self._wake.wait(_QUIET_S + len(self._sound) / (2.0 * RATE))
                self._device.stop()
            except Exception as error:  # noqa: BLE001 - work goes on without sound
                _log.info("no sound: %s", error)
                self._device = None
                return
        self._device.close()

    def _frames(self) -> Generator[bytes, int, None]:
        """Yield data for the device's buffer. The device fills any remainder with silence."""
        sound, position = b"", 0
        frames = yield b""
        while True:
            if sound is not self._sound:
                sound, position = self._sound, 0
            part = sound[position : position + 2 * frames]
            position += len(part)
            frames = yield part

    def _close(self, thread: threading.Thread) -> None:
        """Close the device before Python ends, because the device calls into Python."""
        self._closing = True
        self._wake.set()
        thread.join(_CLOSING_S)


_TALK_S: Final = 10.0
_SAYS: Final = "TURNLIGHT_SAYS"
# The text is passed in a variable, because PowerShell would parse it as part of the script.
_SAPI: Final = (
    "Add-Type -AssemblyName System.Speech; "
    f"(New-Object System.Speech.Synthesis.SpeechSynthesizer).Speak($env:{_SAYS})"
)
_VOICES: Final = {
    "darwin": (("say",),),
    "win32": (("powershell", "-NoProfile", "-NonInteractive", "-Command", _SAPI),),
    "linux": (("spd-say", "--wait"), ("espeak-ng",), ("espeak",)),
}


@cache
def _voice() -> tuple[str, ...]:
    """Return the command that speaks its argument or the variable `_SAYS`.

    The command is empty if the system has none.
    """
    for program, *options in _VOICES.get(sys.platform, ()):
        if (path := shutil.which(program)) is not None:
            return (path, *options)
    return ()


def _say(words: str) -> None:
    command = (*_voice(), *(() if sys.platform == "win32" else (words,)))
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        subprocess.run(  # noqa: S603 - the command comes from `_voice`
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_TALK_S,
            check=False,
            env={**os.environ, _SAYS: words},
        )


def _device() -> Any:
    """Return the sound device, already opened, or None if there is none."""
    try:
        # The library has no build for Linux on ARM.
        import miniaudio

        return miniaudio.PlaybackDevice(
            output_format=miniaudio.SampleFormat.SIGNED16,
            nchannels=1,
            sample_rate=RATE,
            buffersize_msec=_PERIOD_MS,
            backends=[miniaudio.Backend[name] for name in _BACKENDS],
            app_name="Turnlight",
        )
    except Exception as error:  # noqa: BLE001 - everything else works without sound
        _log.info("no sound: %s", error)
        return None
