"""Check my shot: opens, checks, lists and saves the photos taken at the place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.angles import difference, whole
from app.core.base.arrays import Bytes
from app.core.base.progress import PhraseReport, Token
from app.core.base.remarks import Remark
from app.core.localization.features import HeadingIndex
from app.core.localization.photo_location import PHOTO_ENDINGS, is_panorama
from app.core.measure.film.movie_header import VIDEO_ENDINGS
from app.core.places.files.shots import (
    Shot,
    is_frame,
    mark_shot,
    purge_shots,
    read_shots,
    thumbnail_of,
)
from app.core.text import tr
from app.devices.clock import wait
from app.devices.watched_folder.watch import WatchedFolder
from app.ui.presenters.file_changes import SerialQueue, T
from app.ui.presenters.services import Services
from app.ui.presenters.undo_stack import Undoable
from app.ui.screens.turn.photos.check_job import (
    ShotContext,
    check_film,
    check_photo,
    shot_context,
)
from app.words.phrases.directions import key_words, ratio_words
from app.words.phrases.quantities import time_words
from app.words.phrases.turns import likeness_words, sureness_words, taken_words
from app.words.remarks import sentences
from app.words.why_out_of_reach import grade_words

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController

REMOVED: Final = tr("{name} removed from this place. Your own file is untouched.")
TURN_UNKNOWN: Final = tr("Background not found here, so the turn is unknown")
TURN_NOT_SHOWN: Final = tr("Neither the background nor the face shows the turn")
DROP_WORDS: Final = tr("Drop the photo you took, a film of the turn, or a panorama")
"""Hint naming the kinds of files that can be dropped while the screen is visible."""

_MOST_AT_ONCE: Final = 20
_WATCH: Final = "turn-watch"
_POLL_S: Final = 0.5
_MOST_PICTURES: Final = 200
_SAME_GOAL_DEG: Final = 0.5


@dataclass(frozen=True, slots=True)
class ShotRow:
    """One row in the list of photos.

    Attributes:
        sentence: Text such as "In the light, 3° short of the best".
        face: Text that compares the face with the style's prediction, or an empty string if there
            is none.
        new: Whether this is the last photo checked.
        again: Whether the photo missed the light, in which case another turn may help.
        pictured: Whether there is a thumbnail.
        thumbnail: Thumbnail, (h, w, 3) uint8 sRGB, or None if there is none. It is ignored in
            comparisons.
    """

    key: str
    name: str
    sentence: str
    detail: str
    face: str = ""
    icon: str = "target"
    inside: bool = False
    new: bool = False
    again: bool = False
    pictured: bool = False
    thumbnail: Bytes | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ShotsState:
    """The photos taken at the open place, newest first.

    Attributes:
        busy: The task in progress, or an empty string if there is none.
        before, after: The last two photos taken for the same style.
        mirrored: Whether to treat a new photo as mirrored if its background is inconclusive.
    """

    rows: tuple[ShotRow, ...] = ()
    busy: str = ""
    before: ShotRow | None = None
    after: ShotRow | None = None
    mirrored: bool = False


class Shots:
    """Checks and lists the photos taken at the open place."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        index: Callable[[], HeadingIndex | None],
        changed: Callable[[], None],
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._index = index
        self._changed = changed
        self._work = SerialQueue(services, "turn-shots")
        self._folder: Path | None = None
        self._shots: tuple[Shot, ...] = ()
        self._pictures: dict[str, Bytes] = {}
        self._busy = 0
        self._latest = ""

    # -- the open place ------------------------------------------------------------------------

    def follow(self) -> None:
        """Load the photos taken at the current place."""
        folder = self._services.model.place_folder
        if folder == self._folder:
            return
        self._folder, self._shots, self._pictures, self._latest = folder, (), {}, ""
        if folder is None:
            return

        def work(*_: object) -> tuple[tuple[Shot, ...], tuple[Remark, ...]]:
            purge_shots(folder)
            return read_shots(folder)

        self._work.submit(
            work, done=lambda answer: self._read(folder, answer[0], sentences(answer[1]))
        )

    def _read(self, folder: Path, shots: tuple[Shot, ...], warnings: tuple[str, ...]) -> None:
        if folder != self._folder:
            return
        self._shots = shots
        for warning in warnings:
            self._services.notify.tell(warning, kind="warning")
        self._want_pictures()
        self._changed()

    def _want_pictures(self) -> None:
        folder = self._folder
        missing = [one for one in self._shots[-_MOST_PICTURES:] if one.key not in self._pictures]
        if folder is None or not missing:
            return

        def work(token: Token, _report: PhraseReport) -> dict[str, Bytes]:
            pictures = {}
            for one in missing:
                token.check()
                picture = thumbnail_of(folder, one)
                if picture is not None:
                    pictures[one.key] = picture
            return pictures

        def done(pictures: dict[str, Bytes]) -> None:
            if folder == self._folder:
                self._pictures |= pictures
                self._changed()

        self._services.runner.submit("turn-shot-pictures", work, done=done)

    # -- opening -------------------------------------------------------------------------------

    def take(self, paths: Sequence[Path]) -> bool:
        """Check photos that were dropped or chosen. If any is a panorama, open them all as a place.

        Returns:
            Whether the files are photos or a video and there is a goal against which to check them.
        """
        if len(paths) == 1 and paths[0].suffix.lower() in VIDEO_ENDINGS:
            return self._check_film(paths[0])
        is_photo = all(path.suffix.lower() in PHOTO_ENDINGS for path in paths)
        if not paths or not is_photo or len(paths) > _MOST_AT_ONCE or self._context() is None:
            return False
        files = tuple(paths)
        self._run(lambda token, report: _panorama_among(files), partial(self._sorted, files))
        return True

    def _check_film(self, video: Path) -> bool:
        """Check a video of the turn, and list its best frames as photos."""
        context = self._context()
        if context is None:
            return False

        def done(answer: tuple[tuple[str, ...], tuple[Shot, ...]]) -> None:
            messages, shots = answer
            self._read(context.folder, shots, messages)
            self._ended()

        title = tr("Checking the film {name}", name=video.name)
        self._run(partial(check_film, video, context), done, title)
        return True

    def _sorted(self, paths: tuple[Path, ...], panorama: bool) -> None:
        self._ended()
        if panorama:
            self._place_controller.open_as_place(paths)
            return
        for path in paths:
            self._measure(path)

    def _measure(self, path: Path) -> None:
        context = self._context()
        if context is None:
            return
        title = tr("Locating {name}", name=path.name)
        self._run(partial(check_photo, path, context), partial(self._store, context), title)

    def _context(self) -> ShotContext | None:
        return shot_context(self._services.model, self._index(), self._services.today())

    def _run(
        self, work: Callable[[Token, PhraseReport], T], done: Callable[[T], None], title: str = ""
    ) -> None:
        """Queue a job and show its progress."""
        self._busy += 1
        self._changed()
        failed, on_cancel = self._failed, self._ended
        self._work.submit(work, title=title, done=done, failed=failed, cancelled=on_cancel)

    def _ended(self) -> None:
        self._busy -= 1
        self._changed()

    def _failed(self, error: Exception) -> None:
        self._services.notify.tell_error(error)
        self._ended()

    def _store(self, context: ShotContext, shot: Shot) -> None:
        if context.folder == self._folder:
            self._shots = (*(one for one in self._shots if one.key != shot.key), shot)
            self._pictures.pop(shot.key, None)
            self._latest = shot.key
            self._want_pictures()
        self._ended()

    def prove(self, style: str | None, goal_facing_deg: float) -> bool:
        """Return whether any photo taken for this style and goal was in the light."""
        shots = (one for one in self._shots if one.style == style and one.facing_deg is not None)
        goals = (one.goal_facing_deg for one in shots if one.outside_deg == 0)
        return any(abs(difference(goal, goal_facing_deg)) < _SAME_GOAL_DEG for goal in goals)

    def filmed(self, style: str | None) -> ShotRow | None:
        """Return the row of the best video frame for a style, or None if there is no video."""
        frames = (shot for shot in self._shots if shot.style == style and is_frame(shot))
        return next((self._row(shot) for shot in frames), None)

    def last(self) -> Shot | None:
        """Return the last photo checked, or None once the guidance has resumed."""
        return next((one for one in self._shots if one.key == self._latest), None)

    def settle(self) -> None:
        """Stop showing the last photo, because its degrees would contradict the guidance."""
        self._latest = ""

    # -- a watched folder ----------------------------------------------------------------------

    def watch(self, folder: Path) -> None:
        """Check photos as they arrive in a folder, for example from a tethering program."""
        clock = self._services.clock
        folders: list[WatchedFolder] = []

        def work(token: Token, report: PhraseReport) -> list[Path]:
            report(0.0, tr("Waiting for photos in {name}", name=folder.name))
            folders[:] = folders or [WatchedFolder(folder, clock)]
            while not (arrivals := folders[0].poll()):
                wait(clock, _POLL_S, token)
            return [one.path for one in arrivals]

        def on_arrival(paths: list[Path]) -> None:
            if not self.take(paths[-_MOST_AT_ONCE:]):
                words = tr("{name} arrived, but there is no goal to check it against.")
                self._services.notify.tell(words.format(name=paths[-1].name))
            begin()

        def begin() -> None:
            title = tr("Watching {name}", name=folder.name)
            failed = self._services.notify.tell_error
            self._services.runner.submit(_WATCH, work, title=title, done=on_arrival, failed=failed)

        begin()

    # -- removing ------------------------------------------------------------------------------

    def remove(self, key: str) -> None:
        """Remove a photo from the list. The user can undo this."""
        shot = next((one for one in self._shots if one.key == key), None)
        folder = self._folder
        if shot is None or folder is None:
            return
        where = self._shots.index(shot)

        def mark(removed: bool) -> None:
            self._work.submit(lambda token, report: mark_shot(folder, key, removed=removed))
            if folder != self._folder:
                return
            others = [one for one in self._shots if one.key != key]
            if not removed:
                others.insert(min(where, len(others)), shot)
            self._shots = tuple(others)
            self._changed()

        mark(removed=True)
        step = Undoable(
            tr("remove {name}", name=shot.name),
            lambda: mark(removed=False),
            lambda: mark(removed=True),
            place=folder,
        )
        self._services.undo.push(step)
        self._services.notify.tell(
            REMOVED.format(name=shot.name),
            kind="done",
            actions=[(tr("Undo"), lambda: self._services.undo.take_back(step))],
        )

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> ShotsState:
        """Return the state of the list of photos."""
        shots = self._shots[::-1]
        rows = tuple(self._row(shot) for shot in shots)
        busy = tr("Locating the photo…") if self._busy else ""
        before = next((n for n, shot in enumerate(shots) if n and shot.style == shots[0].style), 0)
        first, last = (rows[before], rows[0]) if before else (None, None)
        return ShotsState(rows, busy, first, last, self._services.model.settings.mirrored)

    def _row(self, shot: Shot) -> ShotRow:
        has_facing = shot.found and shot.facing_deg is not None and shot.match is not None
        return ShotRow(
            key=shot.key,
            name=shot.name,
            sentence=self._sentence(shot),
            detail=self._detail(shot),
            face=_face_words(shot),
            icon=("check" if shot.outside_deg == 0 else "target") if has_facing else "help",
            inside=has_facing and shot.outside_deg == 0,
            new=shot.key == self._latest,
            again=has_facing and shot.outside_deg != 0,
            pictured=shot.key in self._pictures,
            thumbnail=self._pictures.get(shot.key),
        )

    def _sentence(self, shot: Shot) -> str:
        if shot.facing_deg is None or shot.match is None or shot.best is None:
            if shot.ratio_stops is None:
                return TURN_UNKNOWN
            return TURN_NOT_SHOWN
        front = self._services.model.front_deg
        turn, goal = whole(shot.facing_deg - front), whole(shot.goal_facing_deg - front)
        rough = shot.by_face or shot.sitter_deg is None
        return taken_words(turn, goal, shot.outside_deg, rough=rough)

    def _detail(self, shot: Shot) -> str:
        when = shot.taken_at or shot.added_at
        # A camera without a time zone records local time.
        moment = datetime.fromisoformat(when)
        today = self._services.today()
        local = moment if moment.tzinfo is not None else moment.replace(tzinfo=today.tzinfo)
        parts = [shot.title or shot.style, time_words(local, today), shot.name]
        if shot.match is not None and shot.best is not None:
            parts.append(likeness_words(shot.match, shot.best))
        if shot.by_face:
            parts.append(tr("turn estimated from the light on the face"))
        elif shot.found:
            parts.append(tr("heading {sureness}", sureness=sureness_words(shot.confidence)))
            if shot.sitter_deg is None:
                parts.append(tr("no sitter seen, assumed to be in the middle"))
        if shot.mirrored:
            parts.append(tr("mirrored"))
        return ", ".join(parts)


def _face_words(shot: Shot) -> str:
    """Describe how the face compares with the style's prediction, or return "" if unknown."""
    parts = []
    if shot.grade is not None:
        grade = grade_words(shot.grade, attainable=True)
        parts.append(tr("{style} in the photo: {grade}", style=shot.title, grade=grade))
    if shot.key_deg is not None and shot.key_promised_deg is not None:
        parts.append(key_words(shot.key_deg, shot.key_promised_deg))
    if shot.ratio_stops is not None and shot.ratio_promised_stops is not None:
        parts.append(ratio_words(shot.ratio_stops, shot.ratio_promised_stops))
    return ". ".join(part for part in parts if part)


def _panorama_among(paths: tuple[Path, ...]) -> bool:
    """Return whether the files include a panorama.

    Raises:
        CoreError: If a file cannot be read. The error is raised before any work starts.
    """
    shapes = [is_panorama(path) for path in paths]
    return any(shapes)
