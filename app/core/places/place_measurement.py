"""Measure the light of a place from files, with data about the measurement."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Final, TypeAlias

from app.core.base.progress import Progress, Report, Task, Token
from app.core.cautions.caution import Caution, Hazard
from app.core.cautions.find_cautions import camera_cautions, find_cautions
from app.core.environment.environment import Environment, read_environment
from app.core.measure.film.film import Film
from app.core.measure.finish.findings import find
from app.core.measure.finish.lamp_detection import Light, light_grid
from app.core.measure.finish.sun import find_sun, sun_core
from app.core.measure.fisheye.circles import check_stitched
from app.core.measure.measurement import Measurement
from app.core.measure.options import HEAD, MeasureOptions
from app.core.measure.read.frame import Exposure
from app.core.measure.ways import measure
from app.core.places.files.light import storable
from app.core.places.intake import Intake
from app.core.places.place import CaptureFacts, FrameFacts, Kind, Location, Place
from app.core.places.place_folder import read_place
from app.core.places.place_list import list_places
from app.core.second_light.place_brightness import stated_white
from app.core.solver.place_light import PlaceLight, prepare
from app.core.storage.settings import Settings
from app.core.styles.style_pack_file import load_named_pack

NamePlace: TypeAlias = Callable[[datetime, str, Collection[str]], str]
"""Function that names a place, given its time, its light (`Findings.light`) and names in use."""

# Mean luminance of the whole sphere. Artificially lit rooms have about 20 to 300 cd/m2, overcast
# days 1,000 and more; in between, a bright window and a dull evening look alike.
_INDOOR_CD_M2: Final = 300.0
_OUTDOOR_CD_M2: Final = 1000.0


def capture_facts(probe: Measurement, camera_title: str, plan: str) -> CaptureFacts:
    """Describe how the light was measured.

    Args:
        plan: "paper", "full", "files", or "rough" for a single photo.

    Returns:
        The facts, with the frames in order of exposure, brightest first. EV is relative to the
        metered frame, which is the first shot in a planned bracket and otherwise the middle one.
    """
    merged, audit = probe.merged, probe.finished.audit
    return CaptureFacts(
        camera=camera_title or _camera_of(probe),
        plan=plan,
        frames=_frames(probe, plan),
        clipped_share=None if audit is None else probe.finished.measured_clipped,
        white_cd_m2=merged.cd_m2,
        warnings=tuple(dict.fromkeys(probe.warnings)),
        advice=() if audit is None else audit.advice,
        notes=probe.notes,
        cautions=(Caution(Hazard.ROUGH, probe.finished.measured_clipped, audit.in_doubt),)
        if audit is not None and plan == "rough"
        else (),
    )


def location_of(probe: Measurement) -> Location:
    """Estimate from the light whether a place is indoors and where the sun is.

    Returns:
        The location. Its kind follows from the mean luminance, if this is known in cd/m2. The sun
        is included if it was recognised.
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


def place_of_capture(
    folder: Path,
    places: Path,
    name: str,
    probe: Measurement,
    camera: str,
    plan: str,
    naming: NamePlace,
) -> tuple[Place, PlaceLight]:
    """Return the place and the prepared light of a capture.

    Args:
        places: Folder of places. The name of the new place must not be in use there.
        name: The user's name for the place, or "" to name the place after its light.
        camera, plan: Title of the camera, and plan, as in `capture_facts`.
        naming: Function that generates a name if the user has not chosen one.
    """
    before = read_place(folder)
    if before.name == naming(before.made_at, "", ()):
        lamps = find(probe.merged.radiance, cd_m2=probe.merged.cd_m2)
        others = list_places(places)
        name = naming(before.made_at, lamps.light, [each.name for each in others])
    light, facts = merged_light(probe, name), capture_facts(probe, camera, plan)
    # The audit has already assessed clipped light.
    more = camera_cautions(light.environment, load_named_pack(HEAD))
    place = replace(
        before,
        name=name,
        # Use the start of the capture for the header, the list and the frames alike.
        measured_at=before.made_at,
        location=location_of(probe),
        capture=replace(facts, cautions=(*facts.cautions, *more)),
    )
    return place, light


def merged_light(probe: Measurement, name: str) -> PlaceLight:
    """Prepare measured light for pictures and for the search.

    Raises:
        EnvironmentFileError: If the picture is not a panorama or is entirely black.
    """
    return _in_stored_precision(probe.environment(name))


def _in_stored_precision(environment: Environment) -> PlaceLight:
    """Prepare light at the precision of a saved place, so reopening the place changes nothing."""
    radiance = storable(environment.radiance)
    radiance.flags.writeable = False
    return prepare(replace(environment, radiance=radiance))


def _frames(probe: Measurement, plan: str) -> tuple[FrameFacts, ...]:
    stops, frames = probe.bracket.stops, probe.bracket.frames
    shares = probe.merged.clipped_fractions or (0.0,) * len(frames)
    zero = _metered_ev(probe, plan)
    facts = []
    for frame, ev, share in zip(frames, stops, shares, strict=True):
        exposure = frame.exposure or Exposure(0.0, known=False)
        facts.append(
            FrameFacts(
                file=frame.path.name,
                shutter_s=exposure.shutter_s,
                iso=exposure.iso if exposure.known else 0.0,
                aperture=exposure.aperture if exposure.known else 0.0,
                ev=ev - zero,
                clipped_share=min(max(float(share), 0.0), 1.0),
            )
        )
    return tuple(facts)


def _camera_of(probe: Measurement) -> str:
    return probe.bracket.frames[0].camera if probe.bracket.frames else ""


def _metered_ev(probe: Measurement, plan: str) -> float:
    """Return the exposure, in stops, of the frame from which the other exposures are counted."""
    stops = probe.bracket.stops or (0.0,)
    # Both plans shoot the metered frame, then 2 EV more, then darker ones.
    if plan in ("paper", "full") and len(stops) > 1:
        return stops[1]
    return stops[(len(stops) - 1) // 2]


def _sun(probe: Measurement) -> Light | None:
    finished = probe.finished
    if finished.restoration is not None:
        light = finished.restoration.light
        return next((each for each in finished.lights if each.id == light), None)
    return find_sun(finished.measured, finished.lights)


def _kind(cd_m2: float | None) -> Kind:
    if cd_m2 is None or _INDOOR_CD_M2 < cd_m2 < _OUTDOOR_CD_M2:
        return "unknown"
    return "indoor" if cd_m2 <= _INDOOR_CD_M2 else "outdoor"


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredLight:
    """The light of a place, with facts about its measurement.

    Attributes:
        film: Result from a video of the sitter, or None if the light was measured another way.
    """

    light: PlaceLight
    location: Location
    facts: CaptureFacts
    film: Film | None = None


def measure_intake(
    intake: Intake, settings: Settings, token: Token, report: Report
) -> MeasuredLight:
    """Read the light from a panorama, or measure it from other files in the appropriate way.

    Raises:
        CoreError: If the files cannot be read or measured.
        Cancelled: If the token is cancelled.
    """
    if intake.environment is not None:
        report(0.1, Progress(Task.READING, intake.environment.name))
        environment = read_environment(intake.environment, intake.layer)
        check_stitched(environment.radiance, intake.environment.name)
        light = _in_stored_precision(environment)
        white, warnings = stated_white(intake.environment), light.environment.warnings
        facts = CaptureFacts(plan="panorama", white_cd_m2=white, warnings=warnings)
        return MeasuredLight(light, Location(), _with_cautions(facts, light.environment))
    # A dropped folder arrives as a list of its files.
    options = MeasureOptions(alone=True, sort_out=True, mirrored=settings.mirrored, own=intake.own)
    measured = measure(intake.way, intake.files, options, token, report)
    facts = capture_facts(measured, "", _plan_of(measured))
    light = merged_light(measured, intake.name)
    facts = _with_cautions(facts, light.environment)
    return MeasuredLight(light, location_of(measured), facts, measured.of(Film))


def _plan_of(measured: Measurement) -> str:
    """Return the name of the measuring method, as saved with a place."""
    if measured.rough:
        return "rough"
    return "files" if measured.way in ("bracket", "fisheye") else measured.way


def _with_cautions(facts: CaptureFacts, environment: Environment) -> CaptureFacts:
    """Add the gaps and the cautions about the light to the facts."""
    cautions = find_cautions(environment, load_named_pack(HEAD))
    return replace(facts, blind=environment.blind, cautions=cautions)
