"""From what a probe measured to what is kept of a place: facts, location and the light itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.core.hdr.lights import light_grid
from app.core.hdr.sun import find_sun, sun_core
from app.core.solver.place_light import PlaceLight, prepare
from app.core.storage.places.place import CaptureFacts, FrameFacts, Location

if TYPE_CHECKING:
    from app.core.hdr.lights import Light
    from app.core.hdr.pipeline import Probe
    from app.core.storage.places.place import Kind

# Mean luminance of the whole sphere. Rooms that lamps light have some 20 to 300 cd/m2, overcast
# days 1,000 and more; in between nobody can tell a bright window from a dull evening.
_INDOOR_CD_M2: Final = 300.0
_OUTDOOR_CD_M2: Final = 1000.0


def capture_facts(probe: Probe, camera_title: str, plan: str) -> CaptureFacts:
    """Say how a light was measured.

    Parameters
    ----------
    plan : str
        "paper", "full" or "files".

    Returns
    -------
    CaptureFacts
        With the frames in the order of exposure, the brightest first; EV is relative to the
        metered frame: the first that was shot of a planned bracket, else the middle one.
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
    )


def location_of(probe: Probe) -> Location:
    """Say what is over a place, as far as its light tells.

    Returns
    -------
    Location
        Indoors or outdoors by the mean luminance, where that is known absolutely; the sun where
        it was recognised.
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

    Raises
    ------
    EnvironmentFileError
        For pictures that are not panoramas, and when everything is black.
    """
    return prepare(probe.environment(name))


def _frames(probe: Probe, plan: str) -> tuple[FrameFacts, ...]:
    stops, frames = probe.bracket.stops, probe.bracket.frames
    shares = probe.merged.clipped_fractions or (0.0,) * len(frames)
    zero = _metered(probe, plan)
    found = []
    for frame, ev, share in zip(frames, stops, shares, strict=True):
        exposure = frame.exposure
        assert exposure is not None  # A bracket has no frame without one.
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
