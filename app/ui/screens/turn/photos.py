"""After the shot: photographs are opened, judged, listed, and kept with the place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.angles import difference, whole, wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import PhraseReport, Token
from app.core.base.remarks import Remark
from app.core.faces.finder import find_faces
from app.core.faces.shot_check import Check, Promise, check_face, graded_by, promise_of_place
from app.core.guidance.guide import Goal
from app.core.localization.features import HeadingIndex, build_index, read_index
from app.core.localization.photo_location import (
    PHOTO_ENDINGS,
    Photo,
    PhotoLocation,
    is_panorama,
    judge,
    lens_azimuth,
    locate_photo,
    read_photo,
)
from app.core.measure.film.comparison import (
    GLANCES,
    beside,
    looks_mirrored,
)
from app.core.measure.film.film import MOST_FRAMES, WIDTH, flipped, read_film
from app.core.measure.film.frames import film_frames
from app.core.measure.film.movie_header import VIDEO_ENDINGS
from app.core.places.files.shots import (
    Shot,
    add_shot,
    is_frame,
    keep_film_frames,
    mark_shot,
    purge_shots,
    read_shots,
    thumbnail_of,
)
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight
from app.core.solver.solve import StyleResult
from app.core.text import tr
from app.devices.clock import wait
from app.devices.watched_folder.watch import WatchedFolder
from app.ui.presenters.file_changes import SerialQueue, T
from app.ui.presenters.services import Services
from app.ui.presenters.undo_stack import Undoable
from app.ui.screens.turn.guidance import confidence_words
from app.ui.screens.turn.state import ShotRow, ShotsState, goal_of, own_style
from app.words.measure.ways import beside_words, mirror_words
from app.words.phrases.directions import key_words, ratio_words
from app.words.phrases.quantities import time_words
from app.words.phrases.turns import likeness_words, taken_words
from app.words.remarks import sentences
from app.words.shortfall import grade_words

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController


DROP_WORDS: Final = tr("Drop the photo you took, a film of the turn, or a panorama")
"""What may be dropped while the screen is in front."""

_MOST_AT_ONCE: Final = 20
_WATCH: Final = "turn-watch"
_POLL_S: Final = 0.5
_MOST_PICTURES: Final = 200
_SAME_GOAL_DEG: Final = 0.5
_READ: Final = 0.6  # of the way: what follows is copying


@dataclass(frozen=True, slots=True, eq=False)
class _ShotContext:
    """What a photograph is judged by: all as it was when it was opened."""

    folder: Path
    light: PlaceLight = field(repr=False)
    index: HeadingIndex | None = field(repr=False)
    result: StyleResult = field(repr=False)
    goal: Goal
    front_deg: float
    title: str
    now: datetime
    head: Head = field(repr=False)
    lamp: bool  # a second light is added to the place's
    mirrored: bool  # what is taken to be a mirror image where the place does not tell
    pack_style: str = ""  # the name under which the pack knows the style


class Shots:
    """The photographs of the open place."""

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

    # -- which place ---------------------------------------------------------------------------

    def follow(self) -> None:
        """Show the photographs of the place that is open now."""
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
        """Take photographs that were dropped or chosen; leave everything else.

        Returns whether it is being seen to: panoramas among them will be opened as a place all the
        same.
        """
        if len(paths) == 1 and paths[0].suffix.lower() in VIDEO_ENDINGS:
            return self._hold_film(paths[0])
        is_photo = all(path.suffix.lower() in PHOTO_ENDINGS for path in paths)
        if not paths or not is_photo or len(paths) > _MOST_AT_ONCE or self._context() is None:
            return False
        files = tuple(paths)
        self._run(lambda token, report: _panorama_among(files), partial(self._sorted, files))
        return True

    def _hold_film(self, video: Path) -> bool:
        """Hold a film of the turn against the place, and keep its frames as photographs."""
        context = self._context()
        if context is None:
            return False

        def work(token: Token, report: PhraseReport) -> tuple[tuple[str, ...], tuple[Shot, ...]]:
            index = context.index or build_index(context.light.display, token)
            fits = looks_mirrored(film_frames(video, GLANCES, WIDTH), index)
            mirrored = context.mirrored if fits is None else fits

            def frames(most: int) -> Iterator[tuple[float, float, Bytes]]:
                plain = film_frames(video, most, WIDTH)
                return flipped(plain) if mirrored else plain

            film = read_film(frames(MOST_FRAMES), token, report)
            results = film.results(context.head.pack)
            result = beside(film, results, frames(GLANCES), context.light, context.head.pack, index)
            keep_film_frames(context.folder, film, results, context.now, result.offset_deg)
            words = mirror_words(context.mirrored, fits), beside_words(result)
            return tuple(filter(None, words)), read_shots(context.folder)[0]

        def done(answer: tuple[tuple[str, ...], tuple[Shot, ...]]) -> None:
            self._read(context.folder, answer[1], answer[0])
            self._ended()

        self._run(work, done, tr("Looking at the film {name}", name=video.name))
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
        title = tr("Looking where the photo was taken: {name}", name=path.name)
        self._run(partial(_make_shot, path, context), partial(self._store, context), title)

    def _context(self) -> _ShotContext | None:
        model = self._services.model
        goal, result, plan = goal_of(model), model.goal_result, model.lamp_plan
        if model.place_folder is None or model.light is None or model.head is None:
            return None
        if goal is None or result is None:
            return None
        own = own_style(model)
        title = own.title if own is not None else result.title
        return _ShotContext(
            model.place_folder,
            model.light,
            self._index(),
            result,
            goal,
            model.front_deg,
            title if plan is None else tr("{style} with {lamp}", style=title, lamp=plan.lamp),
            self._services.today(),
            model.head,
            plan is not None,
            model.settings.mirrored,
            model.pack_style or result.name,
        )

    def _run(
        self, work: Callable[[Token, PhraseReport], T], done: Callable[[T], None], title: str = ""
    ) -> None:
        """Look at what was given, and say so meanwhile."""
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

    def _store(self, context: _ShotContext, shot: Shot) -> None:
        if context.folder == self._folder:
            self._shots = (*(one for one in self._shots if one.key != shot.key), shot)
            self._pictures.pop(shot.key, None)
            self._latest = shot.key
            self._want_pictures()
        self._ended()

    def prove(self, style: str | None, goal_facing_deg: float) -> bool:
        """Whether one of them was taken in the light of a style, at a goal."""
        shots = (one for one in self._shots if one.style == style and one.facing_deg is not None)
        goals = (one.goal_facing_deg for one in shots if one.outside_deg == 0)
        return any(abs(difference(goal, goal_facing_deg)) < _SAME_GOAL_DEG for goal in goals)

    def filmed(self, style: str | None) -> ShotRow | None:
        """Give the frame in which a film of the turn shows a style."""
        frames = (shot for shot in self._shots if shot.style == style and is_frame(shot))
        return next((self._row(shot) for shot in frames), None)

    def last(self) -> Shot | None:
        """Give the photograph that was checked last, until one turns again."""
        return next((one for one in self._shots if one.key == self._latest), None)

    def settle(self) -> None:
        """Tell of it no longer: its degrees would contradict those of the guidance."""
        self._latest = ""

    # -- a folder that photographs come into ---------------------------------------------------

    def watch(self, folder: Path) -> None:
        """Take photographs that come into a folder from now on, as from a tethering program."""
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
                words = tr("{name} came, but there is no goal here to check it against.")
                self._services.notify.tell(words.format(name=paths[-1].name))
            begin()

        def begin() -> None:
            title = tr("Watching {name}", name=folder.name)
            failed = self._services.notify.tell_error
            self._services.runner.submit(_WATCH, work, title=title, done=on_arrival, failed=failed)

        begin()

    # -- removing ------------------------------------------------------------------------------

    def remove(self, key: str) -> None:
        """Take a photograph off the list; can be undone."""
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
            tr("{name} removed from this place. Your own file is untouched.", name=shot.name),
            kind="done",
            actions=[(tr("Undo"), lambda: self._services.undo.take_back(step))],
        )

    # -- what is shown -------------------------------------------------------------------------

    def resolve(self) -> ShotsState:
        """Work out what is shown of them."""
        shots = self._shots[::-1]
        rows = tuple(self._row(shot) for shot in shots)
        busy = tr("Looking where the photo was taken…") if self._busy else ""
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
                return tr("Its background was not found here, so its turn is not known")
            return tr("Neither its background nor the light on the face tells its turn")
        front = self._services.model.front_deg
        turn, goal = whole(shot.facing_deg - front), whole(shot.goal_facing_deg - front)
        rough = shot.by_face or shot.sitter_deg is None
        return taken_words(turn, goal, shot.outside_deg, rough=rough)

    def _detail(self, shot: Shot) -> str:
        when = shot.taken_at or shot.added_at
        # A camera that states no zone means the clock on the wall.
        moment = datetime.fromisoformat(when)
        today = self._services.today()
        local = moment if moment.tzinfo is not None else moment.replace(tzinfo=today.tzinfo)
        parts = [shot.title or shot.style, time_words(local, today), shot.name]
        if shot.match is not None and shot.best is not None:
            parts.append(likeness_words(shot.match, shot.best))
        if shot.by_face:
            parts.append(tr("turn by the light on the face"))
        elif shot.found:
            parts.append(tr("heading {sureness}", sureness=confidence_words(shot.confidence)))
            if shot.sitter_deg is None:
                parts.append(tr("no sitter seen: taken to be in the middle"))
        if shot.mirrored:
            parts.append(tr("mirrored"))
        return ", ".join(parts)


def _face_words(shot: Shot) -> str:
    """Write what the face in a photograph shows beside what was promised; "" without one."""
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
    """Look at all of them: one that cannot be read is told before anything is done."""
    shapes = [is_panorama(path) for path in paths]
    return any(shapes)


def _make_shot(path: Path, context: _ShotContext, token: Token, report: PhraseReport) -> Shot:
    """Read, locate, judge and keep a photograph: work for another thread."""
    report(0.0, tr("Reading the photo"))
    photo = read_photo(path, token)
    location = _located(photo, context, token, lambda done, words: report(_READ * done, words))
    token.check()
    mirrored = location.mirrored if location.status == "found" else context.mirrored
    photo = photo.flipped if mirrored else photo
    shot = _judged(
        _shot_of(path, photo, location, context), _checked(photo, location, context), context
    )
    return add_shot(
        context.folder,
        path,
        shot,
        photo.picture,
        token,
        lambda done, words: report(_READ + (1.0 - _READ) * done, words),
    )


def _checked(
    photo: Photo, location: PhotoLocation, context: _ShotContext
) -> tuple[Check, Promise] | None:
    """Hold the largest face against what the style promised here."""
    faces = find_faces(photo.picture)
    if not faces or context.lamp:
        return None
    name, (goal, arc) = context.pack_style, context.goal.facing(context.front_deg)
    pack = graded_by(context.head.name, context.head.pack, name)
    promise = promise_of_place(context.light, goal, arc, pack, name, context.head.transport)
    lens = lens_azimuth(location, faces[0], photo.picture.shape[1])
    return check_face(photo.picture, faces[0], promise, photo.focal_px, lens), promise


def _located(
    photo: Photo, context: _ShotContext, token: Token, report: PhraseReport
) -> PhotoLocation:
    index = context.index
    try:
        display = context.light.display
        index = index or read_index(context.folder, display) or build_index(display, token)
    except CoreError:
        # A blank room all around: nothing is found in it.
        return PhotoLocation("unsure")
    return locate_photo(photo, index, token, report)


def _shot_of(path: Path, photo: Photo, location: PhotoLocation, context: _ShotContext) -> Shot:
    return Shot(
        name=path.name,
        added_at=context.now.isoformat(),
        found=location.status == "found",
        style=context.result.name,
        title=context.title,
        goal_facing_deg=wrap(context.goal.turn_deg + context.front_deg),
        taken_at=None if photo.taken_at is None else photo.taken_at.isoformat(),
        heading_deg=location.heading_deg,
        facing_deg=location.facing_deg,
        sitter_deg=location.sitter_deg,
        fov_deg=location.fov_deg,
        focal_mm=photo.focal_mm,
        confidence=location.confidence,
        mirrored=location.mirrored if location.status == "found" else context.mirrored,
    )


def _judged(
    shot: Shot, check_and_promise: tuple[Check, Promise] | None, context: _ShotContext
) -> Shot:
    """Add how far off the light it was, and what the face shows."""
    inside = False
    if check_and_promise is not None:
        check, promise = check_and_promise
        by_face = not shot.found and check.facing_deg is not None
        inside = by_face and check.standing == "inside"
        shot = replace(
            shot,
            found=shot.found or by_face,
            # Of the lens that would see this face as it is to be seen.
            facing_deg=shot.facing_deg
            if check.facing_deg is None
            else wrap(check.facing_deg + context.goal.yaw_deg),
            by_face=by_face,
            grade=check.grade,
            key_deg=check.light.azimuth_deg,
            key_promised_deg=promise.light.azimuth_deg,
            ratio_stops=check.light.ratio_stops,
            ratio_promised_stops=promise.ratio_stops,
        )
    if shot.facing_deg is None:
        return shot
    verdict = judge(wrap(shot.facing_deg - context.front_deg), context.goal, context.result)
    outside = 0 if inside else verdict.outside_deg
    return replace(shot, outside_deg=outside, match=verdict.match, best=verdict.best)
