"""Films a turn with the live camera, shows the progress and creates a place from the video.

A few times a second, the camera's newest picture is added to a queue. A job analyses each picture
and appends it to a video, which becomes the source of the place.
"""

from __future__ import annotations

import queue
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from app.core.base.arrays import Bytes
from app.core.base.errors import ProbeError
from app.core.base.progress import PhraseReport, Token
from app.core.measure.film.film import Film, FilmReader, flip
from app.core.text import tr
from app.devices.latest_frame import Mailbox
from app.devices.webcam.files import FilmWriter
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.screens.probe.live import Live
from app.ui.screens.turn.live.camera import LiveCamera

KEY: Final = "filming"
_EVERY_S: Final = 0.35
_LONGEST_S: Final = 90.0
_TOLD_S: Final = 4.0
_WAITING: Final = 12  # pictures; a slow computer skips some
_TURN: Final = tr("Turn around once, slowly, with the face in the picture. Then stop.")


@dataclass(slots=True, eq=False)
class _Roll:
    """The queue of pictures for the analysis job, and the job's latest message."""

    pictures: queue.Queue[tuple[float, Bytes]]
    over: threading.Event = field(default_factory=threading.Event)
    words: Mailbox[str] = field(default_factory=Mailbox)
    begun_s: float = -1.0
    last_s: float = -1.0


class Filming:
    """Films a turn and creates a place from the video."""

    def __init__(
        self, services: Services, place_controller: PlaceController, changed: Callable[[], None]
    ) -> None:
        self._services, self._place_controller, self._changed = services, place_controller, changed
        self._camera = LiveCamera(services, changed)
        self._roll = _Roll(queue.Queue(_WAITING))
        self.live: Live | None = None

    def toggle(self) -> None:
        """Start filming, or finish the current video and compute the light from it."""
        if self.live is not None:
            self._find_light(self.live)
            return
        self._roll = roll = _Roll(queue.Queue(_WAITING))
        self.live = Live(message=tr("Opening the camera…"))
        self._camera.start()
        self._services.runner.submit(
            KEY,
            lambda token, report: _take(roll, token, report),
            title=tr("Filming"),
            done=self._done,
            failed=self._failed,
            cancelled=self._end,
        )
        self._changed()

    def stop(self) -> None:
        """Stop filming and discard the video, if a turn is being filmed."""
        if self.live is not None:
            self._services.runner.cancel(KEY)

    def tick(self) -> None:
        """Queue the camera's newest picture. The view calls this regularly."""
        roll = self._roll
        if self.live is None or roll.over.is_set() or not self._camera.tick():
            return
        frame, now = self._camera.frame, self._services.clock.now()
        assert frame is not None
        if roll.begun_s < 0:
            roll.begun_s = now
        elapsed_s, words = now - roll.begun_s, roll.words.get()
        if elapsed_s - roll.last_s >= _EVERY_S and not roll.pictures.full():
            mirrored = self._services.model.settings.mirrored
            roll.pictures.put_nowait(
                (elapsed_s, flip(frame.picture) if mirrored else frame.picture)
            )
            roll.last_s = elapsed_s
        message = words or (_TURN if self.live.picture is None else self.live.message)
        self.live = Live(frame.picture, message=message)
        if elapsed_s >= _LONGEST_S:
            self._find_light(self.live)
        self._changed()

    def _find_light(self, live: Live) -> None:
        self._end(Live(live.picture, message=tr("Finding the light…")))

    def _end(self, live: Live | None = None) -> None:
        self._roll.over.set()
        self._camera.stop()
        self.live = live
        self._changed()

    def _failed(self, error: Exception) -> None:
        self._end()
        self._services.notify.tell_error(error, about="open")

    def _done(self, result: tuple[Film, Path, tempfile.TemporaryDirectory[str]]) -> None:
        self._end()
        self._place_controller.open_film(*result)


def _take(
    roll: _Roll, token: Token, report: PhraseReport
) -> tuple[Film, Path, tempfile.TemporaryDirectory[str]]:
    """Read the queued pictures, and return the film, its video file and the temporary folder."""
    folder = tempfile.TemporaryDirectory(prefix="turnlight-")
    video = Path(folder.name) / "film.mp4"
    due_s = _TOLD_S
    try:
        with FilmReader() as reader, FilmWriter(video, 1.0 / _EVERY_S) as writer:
            while not (roll.over.is_set() and roll.pictures.empty()):
                token.check()
                try:
                    time_s, picture = roll.pictures.get(timeout=0.1)
                except queue.Empty:
                    continue
                report(min(time_s / _LONGEST_S, 0.95), tr("Filming"))
                reader.add(time_s, picture)
                writer.add(picture)
                if time_s >= due_s:
                    due_s = time_s + _TOLD_S
                    roll.words.put(_so_far(reader, time_s))
            film = reader.film()
    except BaseException:
        folder.cleanup()
        raise
    return film, video, folder


def _so_far(reader: FilmReader, time_s: float) -> str:
    try:
        share = float(reader.film().visible.mean())
    except ProbeError as error:
        return tr("{seconds:.0f} s. {message}", seconds=time_s, message=error.message)
    if share >= 0.97:
        return tr("{seconds:.0f} s. The whole turn is covered: you can stop.", seconds=time_s)
    return tr(
        "{seconds:.0f} s. The face is visible for {degrees}° of 360°. Keep turning.",
        seconds=time_s,
        degrees=round(360 * share),
    )
