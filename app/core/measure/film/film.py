"""Read the lens azimuth in each frame, and the light on the face, from a video of a turn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import cv2
import numpy as np

from app.core.base.angles import TURNS, wrap
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.colour import FloatImage, luminance
from app.core.base.errors import ProbeError
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.base.remarks import Remark
from app.core.environment.environment import reduce_radiance
from app.core.faces.face_on_head import head_map, on_head
from app.core.faces.finder import Face, find_faces
from app.core.faces.light_from_face import FRONTAL_DEG
from app.core.faces.pose import HeadPose, head_pose
from app.core.measure.film.deconvolution import MOST, FilmedLight, find_light, gather
from app.core.measure.film.headings import (
    Background,
    FramePair,
    Headings,
    background,
    find_headings,
    step,
)
from app.core.measure.film.remarks import FilmBlank, FilmOpen, FilmPart, FilmRough, FilmStill
from app.core.measure.film.surroundings import surroundings, with_detail
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.text import tr

MOST_FRAMES: Final = 96
"""Maximum number of frames used from a turn, which is one every 4 degrees."""
WIDTH: Final = 1280
"""Maximum width of a frame, in pixels."""

_SURE: Final = 0.5
_FEWEST: Final = 6  # minimum frames with a face
_ASIDE_DEG: Final = 50.0  # a face turned farther from the lens is not read
_STILL_DEG: Final = 45.0  # a lens that moved around by less counts as still
_LEAST_DEG: Final = 40.0  # minimum range of turns, so that there is a choice
_WHOLE: Final = 60  # minimum number of the 64 turns in a whole turn
_MOST_ASSUMED: Final = 0.5
_UNSURE: Final = 0.15
_FACELESS: Final = 12  # frames without a face after which the video is rejected
_IDLE: Final = 30  # frames without motion after which the video is rejected
_UNMOVED: Final = 0.03  # maximum motion that counts as none, relative to a frame's longer side
# Margin around a face, relative to its size, for the next search and for display.
_ROOM: Final = 0.8
_THUMB: Final = 256  # longer side of a frame's saved picture, in pixels
_QUEUE: Final = 6  # frames in memory at once
_MISFIT: Final = 0.75
_WHOLLY: Final = 0.9  # minimum visible and unclipped fraction of a texel of the light


@dataclass(frozen=True, slots=True, eq=False)
class Glimpse:
    """The face and the background of one frame.

    Attributes:
        grey, visible: (N * N,) float32 and bool. The face mapped to the head's pixels, or empty
            arrays if there is no face.
        picture: (h, w, 3) uint8 sRGB. The face with a narrow margin around it, or None if there is
            no face.
    """

    time_s: float
    face: Face | None
    pose: HeadPose | None
    grey: Float32 = field(repr=False)
    visible: Bools = field(repr=False)
    picture: Bytes | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """The result of reading a video of a turn.

    Attributes:
        times_s, trust: (n,) float64. The time of each frame in seconds, and its weight.
        noses_deg: (n,) float64. Direction of the nose in each frame, in degrees clockwise as seen
            from above, relative to the lens's position in the first frame.
        headings: Azimuth of the lens in each frame.
        light: Light estimated from the face.
        radiance: (H, 2 H, 3) float32. The light as a panorama, with the lens of the first frame in
            the middle.
        still: Whether the lens stayed still and only the face turned.
        visible: (64,) bool. The grid turns at which a face is visible.
        pictures: The picture from each frame, as in `Glimpse`.
    """

    times_s: Float64
    trust: Float64
    noses_deg: Float64
    headings: Headings
    light: FilmedLight
    radiance: FloatImage = field(repr=False)
    still: bool
    visible: Bools
    pictures: tuple[Bytes | None, ...] = field(default=(), repr=False)

    def results(self, pack: StylePack) -> tuple[StyleResult, ...]:
        """Solve all styles for the turns that the video shows."""
        return solve_all(
            pack,
            reduce_radiance(self.radiance),
            is_open=None if self.visible.all() else self.visible,
        )

    def frame_at(self, turn_deg: float) -> int:
        """Return the index of the frame nearest to a turn."""
        away = np.abs((self.noses_deg - turn_deg + 180) % 360 - 180)
        return int(np.argmin(away + 10 * (1 - self.trust)))

    def clock_at(self, turn_deg: float) -> str:
        """Return the time of a turn in the video, in minutes and seconds."""
        seconds = round(float(self.times_s[self.frame_at(turn_deg)]))
        return f"{seconds // 60}:{seconds % 60:02}"

    def facts(self) -> dict[str, Any]:
        """Return the facts as a dictionary for JSON."""
        visible_share = round(float(self.visible.mean()), 3)
        return {"frames": len(self.times_s), "seen": visible_share, "still": self.still}

    @property
    def notes(self) -> tuple[Remark, ...]:
        """Remarks on missing turns and on the reliability of the others."""
        notes: list[Remark] = []
        count, heads = int(self.visible.sum()), self.headings
        if count < _WHOLE:
            notes.append(FilmPart(round(count * 360 / TURNS)))
        if self.still:
            notes.append(FilmStill())
        elif not heads.closed:
            notes.append(FilmOpen())
        if heads.assumed > _UNSURE:
            notes.append(FilmBlank(heads.assumed))
        if self.light.misfit > _MISFIT:
            notes.append(FilmRough())
        return tuple(notes)


class _FrameReading(NamedTuple):
    glimpse: Glimpse
    background: Background
    step: FramePair | None
    pause_s: float  # since the previous frame


class FilmReader:
    """Reads frames in order and can return a result at any time.

    One thread searches for the face, and another follows the background.
    """

    def __init__(self) -> None:
        self._looking, self._following = ThreadPoolExecutor(1), ThreadPoolExecutor(1)
        self._face: Face | None = None
        self._last: _FrameReading | None = None
        self._frames: list[Future[_FrameReading]] = []

    def __enter__(self) -> FilmReader:
        """Return the reader."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the threads."""
        for executor in (self._looking, self._following):
            executor.shutdown(cancel_futures=True)

    def add(self, time_s: float, picture: Bytes) -> None:
        """Add an upright frame, (H, W, 3) uint8 sRGB. This blocks while the queue is full."""
        if len(self._frames) >= _QUEUE:
            self._frames[-_QUEUE].result()
        glimpse = self._looking.submit(self._look, time_s, picture)
        self._frames.append(self._following.submit(self._follow, glimpse, picture))

    def check_begin(self) -> None:
        """Give up early on a hopeless video by raising one of the errors that `film` raises."""
        if len(self._frames) not in (_FACELESS, _IDLE):
            return
        readings = [one.result() for one in self._frames]
        if all(one.glimpse.face is None for one in readings):
            raise _no_face()
        steps = [one.step.after - one.step.before for one in readings if one.step is not None]
        travel = np.abs(np.cumsum([step.mean(axis=0) for step in steps], axis=0)).max()
        yaws = [one.glimpse.pose.yaw_deg for one in readings if one.glimpse.pose is not None]
        if len(readings) == _IDLE and travel < _UNMOVED and np.ptp(yaws) < FRONTAL_DEG:
            raise _no_turn()

    def film(self) -> Film:
        """Return the result for the frames added so far.

        Raises:
            ProbeError: If no face is visible or nothing turns.
        """
        readings = [one.result() for one in self._frames]
        return read_turn(
            [one.glimpse for one in readings],
            [one.background for one in readings],
            [one.step for one in readings if one.step is not None],
        )

    def _look(self, time_s: float, picture: Bytes) -> Glimpse:
        self._face = _face_in(picture, self._face)
        if self._face is None:
            nothing = np.zeros(head_map().side ** 2, np.float32)
            return Glimpse(time_s, None, None, nothing, nothing > 0)
        pose = head_pose(self._face, (picture.shape[0], picture.shape[1]))
        part, _ = _around(picture, self._face)
        share = min(_THUMB / max(part.shape[:2]), 1.0)
        thumb = cv2.resize(part, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
        return Glimpse(
            time_s, self._face, pose, *on_head(picture, self._face), np.asarray(thumb, np.uint8)
        )

    def _follow(self, future: Future[Glimpse], picture: Bytes) -> _FrameReading:
        glimpse, last = future.result(), self._last
        behind = background(picture, glimpse.face)
        way, pause = None, 0.0
        if last is not None:
            pause = glimpse.time_s - last.glimpse.time_s
            pace = pause / last.pause_s if pause > 0 and last.pause_s > 0 else 1.0
            way = step(last.background, behind, last.step, pace)
        self._last = _FrameReading(glimpse, behind, way, pause)
        return self._last


def read_film(
    frames: Iterable[tuple[float, float, Bytes]],
    token: Token | None = None,
    report: Report = silent,
) -> Film:
    """Read a video of a turn and the light on the sitter's face.

    Args:
        frames: For each frame, its time in seconds, the fraction of the video played so far, 0 to
            1, and its picture, (H, W, 3) uint8 sRGB.

    Raises:
        ProbeError: If no face is visible or nothing turns.
        Cancelled: If the token is cancelled.
    """
    token = token or Token()
    with FilmReader() as reader:
        for time_s, share, picture in frames:
            token.check()
            report(0.95 * share, Progress(Task.WATCHING_FILM))
            reader.add(time_s, picture)
            reader.check_begin()
        report(0.95, Progress(Task.FINDING_LIGHT))
        film = reader.film()
    report(1.0, Progress(Task.DONE))
    return film


def flipped(
    frames: Iterable[tuple[float, float, Bytes]],
) -> Iterator[tuple[float, float, Bytes]]:
    """Yield the frames mirrored, for use with `read_film`."""
    for time_s, share, picture in frames:
        yield time_s, share, flip(picture)


def flip(picture: Bytes) -> Bytes:
    """Mirror a picture, (H, W, 3) uint8."""
    return np.ascontiguousarray(picture[:, ::-1])


def read_turn(
    glimpses: Sequence[Glimpse], backgrounds: Sequence[Background], steps: Sequence[FramePair]
) -> Film:
    """Combine the frames of a video into a result."""
    trust = np.array([_trust(one) for one in glimpses])
    if (trust > 0).sum() < _FEWEST:
        raise _no_face()
    headings = find_headings(backgrounds, steps)
    still = float(np.ptp(headings.turns_deg)) < _STILL_DEG
    if not still and headings.assumed > _MOST_ASSUMED:
        raise ProbeError(
            tr("The turn cannot be measured: the background is blank or blurred."),
            tr("Film again, more slowly, with more background in view."),
        )
    aside = np.array([0.0 if one.pose is None else one.pose.yaw_deg for one in glimpses])
    if not still:
        # A face that is barely turned counts as facing the lens.
        aside[np.abs(aside) < FRONTAL_DEG] = 0.0
    noses = headings.turns_deg - aside
    rows = trust > 0
    turns = gather(
        noses[rows],
        np.stack([one.grey for one in glimpses])[rows],
        np.stack([one.visible for one in glimpses])[rows],
        trust[rows],
    )
    if turns.turns.sum() * 360 / TURNS < _LEAST_DEG:
        raise _no_turn()
    light, gains = find_light(turns), np.full(len(glimpses), np.nan)
    nearest = np.round(noses[rows] * TURNS / 360).astype(int) % TURNS
    gains[rows] = light.exposures[nearest] / np.maximum(turns.levels, 1e-9)
    around = surroundings(backgrounds, headings, gains)
    if around is None:
        radiance = np.repeat(light.luminance[:, :, None], 3, axis=2).astype(np.float32)
    else:
        panorama, sure = (reduce_radiance(each) for each in (around[0], around[1][..., None]))
        likely = luminance(panorama).astype(np.float64)
        most = np.where(sure[..., 0] > _WHOLLY, MOST * likely, np.inf)
        light = find_light(turns, replace(light, luminance=likely), most)
        radiance = with_detail(light.luminance, around[0])
    times = np.array([one.time_s for one in glimpses])
    pictures = tuple(one.picture for one in glimpses)
    return Film(times, trust, noses, headings, light, radiance, still, turns.turns, pictures)


def _no_face() -> ProbeError:
    return ProbeError(
        tr("No face could be read in this film."),
        tr("Film the sitter’s whole face from about a metre away, in focus and not too dark."),
    )


def _no_turn() -> ProbeError:
    return ProbeError(
        tr("The sitter does not turn in this film."),
        tr("Turn once on the spot in 20 to 60 seconds while the camera moves around with you."),
    )


def _trust(glimpse: Glimpse) -> float:
    """Return a frame's weight, based on the face's confidence and its angle to the lens."""
    if glimpse.face is None or glimpse.pose is None or glimpse.face.confidence < _SURE:
        return 0.0
    return glimpse.face.confidence * max(1 - abs(wrap(glimpse.pose.yaw_deg)) / _ASIDE_DEG, 0.0)


def _face_in(picture: Bytes, near: Face | None) -> Face | None:
    """Find the sitter, looking first at the previous position, then around it, then everywhere."""
    if near is not None:
        part, corner = _around(picture, near)
        faces = find_faces(part, small=False) if part.size else ()
        if faces and faces[0].confidence >= _SURE:
            return Face(faces[0].landmarks + corner, faces[0].confidence)
    everywhere = find_faces(picture)
    return everywhere[0] if everywhere else None


def _around(picture: Bytes, face: Face) -> tuple[Bytes, Float32]:
    """Crop a face with a margin, and return the crop and the shift of the landmarks, (3,)."""
    left, top, right, bottom = face.box
    room = _ROOM * face.side
    x, y = max(round(left - room), 0), max(round(top - room), 0)
    part = np.ascontiguousarray(picture[y : round(bottom + room), x : round(right + room)])
    return part, np.array([x, y, 0], np.float32)
