"""Filming a turn with the live camera: what it sees, how far it has come, and the place it makes.

The camera's newest picture is put into a queue a few times a second; a job looks at each and keeps
it in a video, which becomes the place's source.
"""

from __future__ import annotations

import queue
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.core.base.arrays import Bytes
from app.core.base.errors import ProbeError
from app.core.base.progress import Report, Token
from app.core.film.film import Film, FilmReader
from app.core.text import tr
from app.devices.mailbox import Mailbox
from app.devices.webcam.files import FilmWriter
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.screens.probe.state import Live
from app.ui.screens.turn.camera import LiveCamera

KEY: Final = "filming"
_EVERY_S: Final = 0.35
_LONGEST_S: Final = 90.0
_TOLD_S: Final = 4.0
_WAITING: Final = 12  # pictures: a slow computer leaves some out
_TURN: Final = tr("Turn slowly, once around, with the face in the picture. Then stop.")


@dataclass(frozen=True, slots=True, eq=False)
class _Taken:
    """A film that was taken, in a folder that goes when it is no longer wanted."""

    film: Film
    video: Path
    folder: tempfile.TemporaryDirectory[str]


class Filming:
    """A film, while it is taken."""

    def __init__(
        self, services: Services, desk: PlaceController, changed: Callable[[], None]
    ) -> None:
        self._services, self._desk, self._changed = services, desk, changed
        self._camera = LiveCamera(services, changed)
        self._pictures: queue.Queue[tuple[float, Bytes]] = queue.Queue(_WAITING)
        self._over, self._words = threading.Event(), Mailbox[str]()
        self._begun_s = self._last_s = 0.0
        self.live: Live | None = None

    def toggle(self) -> None:
        """Begin a film, or end it and find its light."""
        if self.live is not None:
            self._end()
            return
        self._pictures, self._words = queue.Queue(_WAITING), Mailbox()
        self._over = threading.Event()
        self._begun_s, self._last_s = -1.0, -1.0
        self.live = Live(message=tr("Opening the camera…"))
        self._camera.start()
        pictures, over, words = self._pictures, self._over, self._words
        self._services.runner.submit(
            KEY,
            lambda token, report: _take(pictures, over, words, token, report),
            title=tr("Filming"),
            done=self._done,
            failed=self._failed,
            cancelled=self._stopped,
        )
        self._changed()

    def stop(self) -> None:
        """Give a film up; none being taken is no fault."""
        if self.live is not None:
            self._services.runner.cancel(KEY)

    def tick(self) -> None:
        """Take the camera's newest picture; called by the view."""
        if self.live is None or self._over.is_set() or not self._camera.tick():
            return
        frame, now = self._camera.frame, self._services.clock.now()
        assert frame is not None
        if self._begun_s < 0:
            self._begun_s = now
        gone, words = now - self._begun_s, self._words.get()
        if gone - self._last_s >= _EVERY_S and not self._pictures.full():
            self._pictures.put_nowait((gone, frame.picture))
            self._last_s = gone
        message = words or (_TURN if self.live.picture is None else self.live.message)
        self.live = Live(frame.picture, message=message)
        if gone >= _LONGEST_S:
            self._end()
        self._changed()

    def _end(self) -> None:
        self._over.set()
        self._camera.stop()
        if self.live is not None:
            self.live = Live(self.live.picture, message=tr("Finding the light…"))
        self._changed()

    def _stopped(self) -> None:
        self._over.set()
        self._camera.stop()
        self.live = None
        self._changed()

    def _failed(self, error: Exception) -> None:
        self._stopped()
        self._services.notify.tell_error(error, about="open")

    def _done(self, taken: _Taken) -> None:
        self._stopped()
        self._desk.open_film(taken.film, taken.video, taken.folder)


def _take(
    pictures: queue.Queue[tuple[float, Bytes]],
    over: threading.Event,
    words: Mailbox[str],
    token: Token,
    report: Report,
) -> _Taken:
    """Look at pictures as they come until the film is over, and keep them in a video."""
    folder = tempfile.TemporaryDirectory(prefix="turnlight-")
    video = Path(folder.name) / "film.mp4"
    due_s = _TOLD_S
    try:
        with FilmReader() as reader, FilmWriter(video, 1.0 / _EVERY_S) as writer:
            while not (over.is_set() and pictures.empty()):
                token.check()
                try:
                    time_s, picture = pictures.get(timeout=0.1)
                except queue.Empty:
                    continue
                report(min(time_s / _LONGEST_S, 0.95), tr("Filming"))
                reader.add(time_s, picture)
                writer.add(picture)
                if time_s >= due_s:
                    due_s = time_s + _TOLD_S
                    words.put(_so_far(reader, time_s))
            film = reader.film()
    except BaseException:
        folder.cleanup()
        raise
    return _Taken(film, video, folder)


def _so_far(reader: FilmReader, time_s: float) -> str:
    try:
        share = float(reader.film().shown.mean())
    except ProbeError as error:
        return tr("{seconds:.0f} s. {message}", seconds=time_s, message=error.message)
    if share >= 0.97:
        return tr("{seconds:.0f} s. The whole turn is seen: you can stop.", seconds=time_s)
    return tr(
        "{seconds:.0f} s. The face is seen at {degrees}° of 360°. Go on turning.",
        seconds=time_s,
        degrees=round(360 * share),
    )
