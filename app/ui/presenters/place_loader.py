"""Sorting out what was dropped, reading a place that was kept, and making one of files."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.errors import Cancelled, CoreError
from app.core.base.progress import Report, Token
from app.core.film.film import MOST_FRAMES, WIDTH, Film, flipped, read_film
from app.core.film.in_place import keep_frames
from app.core.film.movie_header import VIDEO_ENDINGS, read_movie_header
from app.core.hdr.doubt import doubt_of
from app.core.hdr.dual_fisheye import check_stitched
from app.core.hdr.frame import Exposure
from app.core.hdr.lights import Light, light_grid
from app.core.hdr.metadata import FRAME_ENDINGS
from app.core.hdr.sun import find_sun, sun_core
from app.core.places.light import read_light, storable, store_environment
from app.core.places.originals import adopt_files
from app.core.places.place import (
    CaptureFacts,
    FrameFacts,
    Kind,
    Location,
    Place,
    PlaceError,
)
from app.core.places.resume import UnfinishedPlace, find_unfinished
from app.core.places.store import (
    PLACE,
    create_place,
    drop_merged,
    list_places,
    read_place,
    summarise,
    write_place,
)
from app.core.second_light.scale import stated_white
from app.core.solver.environment import Environment, from_radiance, read_environment
from app.core.solver.environment_file import is_linear
from app.core.solver.place_light import PlaceLight, prepare
from app.core.solver.style_pack import load_named_pack
from app.core.solver.turn_choice import Limits
from app.core.storage.settings import Settings
from app.core.text import tr
from app.devices.webcam.files import film_frames

if TYPE_CHECKING:
    from app.core.hdr.pipeline import Probe


_HDR: Final = frozenset({".exr", ".hdr", ".pic"})
_PLACE_FILE: Final = "place.json"
_MOST_LISTED: Final = 2000
_MOST_FRAMES: Final = 64
_MOST_PHOTOS: Final = 200
_FRONT_CAMERA: Final = tr(
    "A front camera took this film. If text in it reads backwards, switch on Mirrored and open it "
    "again."
)
_KINDS: Final = tr(
    "Drop an HDR panorama (.exr, .hdr), the photographs of a bracket, their folder, or one "
    "photograph of all directions."
)


@dataclass(frozen=True, slots=True)
class Intake:
    """What there is to be opened; exactly one of the four.

    `way`: what the frames are, as in the setting `measure_with`.
    `layer`: of an environment, where it has several. `second`: those of a mirror ball from another
    side. `read`: what the film tells, where it was read while it was taken.
    """

    name: str
    place: Path | None = None
    environment: Path | None = None
    film: Path | None = None
    frames: tuple[Path, ...] = ()
    way: str = "camera"
    layer: str = ""
    second: tuple[Path, ...] = ()
    read: Film | None = None

    @property
    def originals(self) -> tuple[Path, ...]:
        """What is copied into the place."""
        return (*self.frames, *self.second) if self.film is None else (self.film,)


def sort_out(paths: Sequence[Path], way: str = "camera") -> Intake:
    """Look at names, and at the kind of a single file; whoever reads them looks at the rest.

    Args:
        way: What photographs are taken for, as in the setting `measure_with`.

    Raises:
        CoreError: When there is nothing of use, or more than one thing.
    """
    for path in paths:
        if path.is_dir() and (path / _PLACE_FILE).is_file():
            return Intake(path.name, place=path)
        if path.name == _PLACE_FILE and path.is_file():
            return Intake(path.parent.name, place=path.parent)
    if way == "ball" and len(paths) == 2 and all(path.is_dir() for path in paths):
        first, second = (sort_out([path], way) for path in sorted(paths))
        return replace(first, second=second.frames)
    files = [file for path in paths for file in _files_of(path)]
    panoramas = _panoramas(files)
    films = [file for file in files if file.suffix.lower() in VIDEO_ENDINGS]
    frames = [file for file in files if file.suffix.lower() in FRAME_ENDINGS]
    if films and not panoramas and (way == "film" or not frames):
        return _film_of(paths, films)
    name = _name_of(paths, panoramas or frames)
    if len(panoramas) > 1:
        raise CoreError(
            tr("These are {number} panoramas, and a place has one.", number=len(panoramas)),
            tr("Open them one by one."),
        )
    if panoramas:
        return Intake(name, environment=panoramas[0])
    if not frames:
        raise CoreError(tr("There is nothing here that Turnlight can read."), _KINDS)
    if len(frames) > (_MOST_PHOTOS if way == "photos" else _MOST_FRAMES):
        raise CoreError(
            tr(
                "These are {number} photographs; a bracket has at most {most}.",
                number=len(frames),
                most=_MOST_FRAMES,
            ),
            tr("Drop the frames of one bracket only."),
        )
    return Intake(name, frames=tuple(frames), way=way)


def _panoramas(files: list[Path]) -> list[Path]:
    """Those by their name; a file alone by what is in it, as a TIFF of floating point."""
    if len(files) == 1 and is_linear(files[0]):
        return files
    return [file for file in files if file.suffix.lower() in _HDR]


def _film_of(paths: Sequence[Path], films: Sequence[Path]) -> Intake:
    if len(films) > 1:
        raise CoreError(
            tr("These are {number} films, and a place has one.", number=len(films)),
            tr("Choose the one that shows the whole turn."),
        )
    return Intake(_name_of(paths, films), film=films[0])


def _files_of(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = []
    for file in path.iterdir():
        if not file.name.startswith(".") and file.is_file():
            found.append(file)
        if len(found) >= _MOST_LISTED:
            break
    return sorted(found)


def _name_of(paths: Sequence[Path], used: Sequence[Path]) -> str:
    """Name a place after its file or folder, with spaces where file names have none."""
    name = used[0].parent.name if used else ""
    if len(paths) == 1:
        name = paths[0].name if paths[0].is_dir() else paths[0].stem
    return name.replace("_", " ").strip() or name


# Mean luminance of the whole sphere. Rooms that lamps light have some 20 to 300 cd/m2, overcast
# days 1,000 and more; in between a bright window and a dull evening look alike.
_INDOOR_CD_M2: Final = 300.0
_OUTDOOR_CD_M2: Final = 1000.0


def capture_facts(probe: Probe, camera_title: str, plan: str) -> CaptureFacts:
    """Say how a light was measured.

    Args:
        plan: "paper", "full", "files", or "rough" for one photograph.

    Returns:
        With the frames in the order of exposure, the brightest first; EV is relative to the metered
        frame: the first that was shot of a planned bracket, else the middle one.
    """
    merged, audit = probe.merged, probe.finished.audit
    return CaptureFacts(
        camera=camera_title or probe.bracket.frames[0].camera,
        plan=plan,
        frames=_frames(probe, plan),
        clipped_share=probe.finished.measured_clipped if probe.bracket.panorama else None,
        white_cd_m2=merged.cd_m2,
        warnings=tuple(dict.fromkeys(probe.warnings)),
        advice=() if audit is None else audit.advice,
        notes=probe.notes,
        doubtful=audit.in_doubt if audit is not None and plan == "rough" else (),
    )


def location_of(probe: Probe) -> Location:
    """Say what is over a place, as far as its light tells.

    Returns:
        Indoors or outdoors by the mean luminance, where that is known absolutely; the sun where it
        was recognised.
    """
    if not probe.bracket.panorama:
        return Location()
    measured = probe.finished.measured
    grid = light_grid(measured)
    sun = _sun(probe)
    kind = _kind(grid.total / 12.566 * measured.cd_m2 if measured.cd_m2 else None)
    if sun is None:
        return Location(kind, sun=False if kind != "unknown" else None)
    core = sun_core(sun, measured)
    return Location("outdoor", True, core.azimuth_deg, core.elevation_deg)


def merged_light(probe: Probe, name: str) -> PlaceLight:
    """Prepare the light of a probe for everything that is asked of it.

    Raises:
        EnvironmentFileError: For pictures that are not panoramas, and when everything is black.
    """
    return _prepared(probe.environment(name))


def _prepared(environment: Environment) -> PlaceLight:
    """Prepare light in the precision that a place is saved in: opened again, nothing differs."""
    radiance = storable(environment.radiance)
    radiance.flags.writeable = False
    return prepare(replace(environment, radiance=radiance))


def _frames(probe: Probe, plan: str) -> tuple[FrameFacts, ...]:
    stops, frames = probe.bracket.stops, probe.bracket.frames
    shares = probe.merged.clipped_fractions or (0.0,) * len(frames)
    zero = _metered(probe, plan)
    found = []
    for frame, ev, share in zip(frames, stops, shares, strict=True):
        exposure = frame.exposure or Exposure(0.0, known=False)
        found.append(
            FrameFacts(
                file=frame.path.name,
                shutter_s=exposure.shutter_s,
                iso=exposure.iso if exposure.known else 0.0,
                aperture=exposure.aperture if exposure.known else 0.0,
                ev=ev - zero,
                clipped_share=min(max(float(share), 0.0), 1.0),
            )
        )
    return tuple(found)


def _metered(probe: Probe, plan: str) -> float:
    """Exposure in stops of the frame that the others are told relative to."""
    stops = probe.bracket.stops
    # Both plans shoot the metered frame, then 2 EV more, then darker ones.
    if plan in ("paper", "full") and len(stops) > 1:
        return stops[1]
    return stops[(len(stops) - 1) // 2]


def _sun(probe: Probe) -> Light | None:
    finished = probe.finished
    if finished.restoration is not None:
        light = finished.restoration.light
        return next((each for each in finished.lights if each.id == light), None)
    return find_sun(finished.measured, finished.lights)


def _kind(cd_m2: float | None) -> Kind:
    if cd_m2 is None or _INDOOR_CD_M2 < cd_m2 < _OUTDOOR_CD_M2:
        return "unknown"
    return "indoor" if cd_m2 <= _INDOOR_CD_M2 else "outdoor"


_HEAD: Final = "generic"


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A place that has been read or made.

    `folder`: Of the place; None where it could not be kept.
    """

    folder: Path | None
    place: Place
    light: PlaceLight
    files: tuple[Path, ...] = ()
    trouble: Exception | None = None


class NotFinished(PlaceError):
    """A place has no light yet, and can be finished."""

    def __init__(self, error: CoreError, left: UnfinishedPlace) -> None:
        super().__init__(error.message, error.hint)
        self.left = left


def read_kept(folder: Path, unkept: Place | None) -> Opened:
    """Read a place.

    Raises:
        NotFinished: When it has no light, and something to make it of.
        PlaceError: When it or its light cannot be read.
    """
    place = unkept or read_place(folder)
    try:
        environment, remarks = read_light(folder, place)
    except CoreError as error:
        summary = summarise(folder)
        left = None if summary is None else find_unfinished(summary)
        if left is None or not left.can_finish:
            raise
        raise NotFinished(error, left) from error
    place = replace(place, remarks=(*place.remarks, *remarks))
    return Opened(folder, place, prepare(environment))


def kept_anew(opened: Opened, *, open_since: bool = False) -> Opened:
    """Keep the light of a place that has a folder, and what is known of it.

    Raises:
        PlaceError: When the disk refuses.
    """
    folder, place, light = opened.folder, opened.place, opened.light
    assert folder is not None
    white = place.capture.white_cd_m2 if place.capture else None
    radiance, display = light.environment.radiance, light.display
    rough = place.capture is not None and place.capture.plan == "rough"
    shares = light.environment.shares
    stored = store_environment(
        folder, radiance, display, white_cd_m2=white, rough=rough, shares=shares
    )
    if open_since:
        found = read_place(folder)
        place = found if found.measured_at == place.measured_at else place
    whole = replace(place, environment=stored.environment, fingerprint=stored.fingerprint)
    write_place(folder, whole)
    drop_merged(folder)
    return Opened(folder, whole, light)


def kept_in(
    places: Path, place: Place, light: PlaceLight, files: Sequence[Path], token: Token
) -> Opened:
    """Keep a place in a new folder; one that cannot be finished leaves nothing.

    Raises:
        CoreError: When the disk refuses.
    """
    folder = create_place(places, place.name, place.made_at, spot=place.spot)
    try:
        if files:
            adopt_files(folder, files, token)
        kept = read_place(folder)
        return kept_anew(Opened(folder, replace(place, spot=kept.spot, source=kept.source), light))
    except BaseException:
        # All that is in it are copies; without its light it could not be opened.
        shutil.rmtree(folder, ignore_errors=True)
        raise


def take_anew(
    intake: Intake, places: Path, now: datetime, settings: Settings, token: Token, report: Report
) -> Opened:
    """Make a place of a panorama or a bracket; where it cannot be kept it is there all the same.

    Raises:
        CoreError: When the files cannot be read or measured.
        Cancelled: When the token was cancelled.
    """
    if intake.film is not None and intake.read is None:
        intake = replace(intake, read=_read(intake.film, settings, token, report))
    light, location, facts = _measured(intake, settings.limits, token, report)
    if intake.film is not None and not settings.mirrored:
        front = read_movie_header(intake.film).front_camera
        facts = replace(facts, warnings=(*facts.warnings, *[_FRONT_CAMERA] * front))
    token.check()
    report(0.9, tr("Saving the place"))
    # It is unknown when the light of files was measured: their place has no age.
    place = Place(intake.name, now, head=settings.head, location=location, capture=facts)
    place = replace(place, studios=settings.studios)
    try:
        opened = kept_in(places, place, light, intake.originals, token)
    except Cancelled:
        raise
    except (CoreError, OSError) as error:
        return Opened(None, place, light, intake.originals, error)
    if opened.folder is not None and intake.read is not None:
        results = intake.read.results(load_named_pack(_HEAD))
        keep_frames(opened.folder, intake.read, results, now)
    return opened


def _read(video: Path, settings: Settings, token: Token, report: Report) -> Film:
    frames = film_frames(video, MOST_FRAMES, WIDTH)
    return read_film(flipped(frames) if settings.mirrored else frames, token, report)


def last_opened(last: str, places: Path) -> Path | None:
    """Find the place that was open last; where that is not known, the newest that has light."""
    if last and (Path(last) / PLACE).is_file():
        return Path(last)
    whole = (one for one in list_places(places) if one.has_light and one.state == "whole")
    return next((one.folder for one in whole), None)


def finish_files(left: UnfinishedPlace, settings: Settings, token: Token, report: Report) -> Opened:
    """Merge the photographs that are in the folder of an unfinished place.

    Raises:
        CoreError: When they cannot be merged, or the disk refuses.
        Cancelled: When the token was cancelled.
    """
    intake = Intake(left.name, frames=left.files)
    light, location, facts = _measured(intake, settings.limits, token, report)
    place = replace(read_place(left.folder), location=location, capture=facts)
    place = replace(place, studios=settings.studios)
    return kept_anew(Opened(left.folder, place, light))


def _measured(
    intake: Intake, limits: Limits, token: Token, report: Report
) -> tuple[PlaceLight, Location, CaptureFacts]:
    if intake.environment is not None:
        report(0.1, tr("Reading {name}", name=intake.environment.name))
        environment = read_environment(intake.environment, intake.layer)
        check_stitched(environment.radiance, intake.environment.name)
        light = _prepared(environment)
        white, warnings = stated_white(intake.environment), light.environment.warnings
        facts = CaptureFacts(plan="panorama", white_cd_m2=white, warnings=warnings)
        return light, Location(), _doubted(facts, light.environment, limits)
    if intake.read is not None:
        light = _prepared(from_radiance(intake.read.radiance.copy(), intake.name))
        return light, Location(), CaptureFacts(plan="film", warnings=intake.read.notes)
    probe = _probe(intake, limits, token, report)
    plan = intake.way if intake.way in ("photos", "ball") else "files"
    facts = capture_facts(probe, "", "rough" if probe.rough else plan)
    light = merged_light(probe, intake.name)
    return light, location_of(probe), _doubted(facts, light.environment, limits)


def _doubted(facts: CaptureFacts, environment: Environment, limits: Limits) -> CaptureFacts:
    """Add what was not seen, and the styles that depend on missing light."""
    doubt = doubt_of(environment, load_named_pack(_HEAD), limits=limits)
    if doubt is None:
        return facts
    return replace(
        facts,
        doubtful=doubt.clipped,
        blind=environment.blind,
        doubtful_unseen=doubt.unseen,
    )


def _probe(intake: Intake, limits: Limits, token: Token, report: Report) -> Probe:
    """Make light of photographs, in the way that they were taken."""
    from app.core.hdr.finish import MergeOptions
    from app.core.hdr.mirror_ball import BallOptions
    from app.core.hdr.photographs import stitch
    from app.core.hdr.pipeline import measure, measure_ball

    pack, wishes = load_named_pack(_HEAD), MergeOptions(limits=limits, alone=True)
    if intake.way == "ball":
        wishes = replace(wishes, alone=False)
        ball = BallOptions(intake.second)
        return measure_ball(intake.frames, ball, pack, wishes, token=token, report=report)
    if intake.way == "photos":
        return stitch(intake.frames, pack, wishes, token, report).probe
    wishes = replace(wishes, sort_out=True)  # A folder that was dropped comes as its files.
    return measure(intake.frames, pack, wishes, token=token, report=report)
