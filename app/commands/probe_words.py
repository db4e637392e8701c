"""What the commands say of a light probe: its frames, its lamps and what to do about them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from app.commands.printing import fields

if TYPE_CHECKING:
    from pathlib import Path

    from app.core.hdr.frame import Frame
    from app.core.hdr.lights import Light
    from app.core.hdr.pipeline import Probe
    from app.core.hdr.tripod_detection import Clutter

PARTS: Final = ("metering", "exposing", "download", "merge")
"""Parts of a capture whose time is told."""

_NAME: Final = 28  # columns for a file's name
_LEAST_SHARE: Final = 0.0005  # of the light, for a row of its own in the table


def probe_facts(probe: Probe) -> dict[str, Any]:
    """Say for JSON what a probe found, whatever it was asked for."""
    finished, audit, response = probe.finished, probe.finished.audit, probe.response.response
    residual = response.residual_stops
    return {
        "size": [probe.merged.radiance.shape[1], probe.merged.radiance.shape[0]],
        "frames": [_frame(*row) for row in _frames(probe)],
        "response": response.name,
        "response_residual_stops": round(residual, 4) if math.isfinite(residual) else None,
        "cd_m2_per_unit": probe.merged.cd_m2,
        "clipped_energy_fraction": finished.measured_clipped,
        "clipped_energy_range": None if audit is None else list(audit.clipped_energy_range),
        "lamps": [_lamp(light) for light in finished.lights],
        "advice": [] if audit is None else list(audit.advice),
        "in_doubt": [] if audit is None else list(audit.in_doubt),
        "style_changes": [] if audit is None else [_change(c) for c in audit.style_changes],
        "sun": _sun(probe),
        "masked": [clutter_facts(each) for each in finished.clutter],
        "mask_changes": [
            {"name": change.style} | fields(change, "turn_before_deg", "turn_after_deg", "given_up")
            for change in finished.changes
        ],
        "moved_share": probe.moved.share,
        "levelled": fields(probe.levelling, "pitch_deg", "roll_deg"),
        "stitching": None if probe.stitching is None else probe.stitching.facts(),
        "warnings": list(probe.warnings),
        "notes": list(probe.notes),
    }


def probe_table(probe: Probe, *more: str) -> str:
    """Write tables of the frames and of the lamps that matter, and what to do about the lamps."""
    return "\n".join([*_frame_rows(probe), *_lamp_rows(probe), *more])


def wrote(probe: Probe, target: Path, more: str = "") -> str:
    """Say where an environment is, and its size."""
    rows, columns = probe.merged.radiance.shape[:2]
    return f"Wrote {target} ({columns} x {rows}{more})."


def _frame_rows(probe: Probe) -> list[str]:
    lines = [f"{'frame':{_NAME}}  {'shutter':>10}  {'ISO':>5}  {'f/':>4}  {'EV':>6}  clipped"]
    for frame, ev, part in _frames(probe):
        exposure = frame.exposure
        assert exposure is not None
        iso, aperture = (
            (f"{exposure.iso:g}", f"{exposure.aperture:g}") if exposure.known else ("", "")
        )
        name = frame.path.name[-_NAME:]  # sessions put the date first, the end tells frames apart
        lines.append(
            f"{name:{_NAME}}  {shutter_words(exposure.shutter_s):>10}  {iso:>5}  "
            f"{aperture:>4}  {ev:+6.2f}  {100 * part:5.1f} %"
        )
    return lines


def _lamp_rows(probe: Probe) -> list[str]:
    lines: list[str] = []
    lamps = [light for light in probe.finished.lights if light.share >= _LEAST_SHARE]
    if lamps:
        lines += ["", "lamp  azimuth  elevation   size  light"]
        lines += [_lamp_row(light) for light in lamps]
    audit = probe.finished.audit
    if audit is not None:
        lines += ["", *audit.advice] if audit.advice else []
    return lines


def shutter_words(seconds: float) -> str:
    """Write an exposure time as photographers do.

    Examples:
        >>> shutter_words(0.004), shutter_words(0.6), shutter_words(2.0)
        ('1/250 s', '0.6 s', '2 s')
    """
    return f"1/{round(1 / seconds)} s" if seconds < 0.3 else f"{seconds:g} s"


def clutter_facts(each: Clutter) -> dict[str, Any]:
    """Say for JSON what a mask covers."""
    return fields(each, "name", "solid_angle_sr", "confidence", "reason")


def _frames(probe: Probe) -> list[tuple[Frame, float, float]]:
    """Return each frame with its exposure in stops and the share of it that is clipped."""
    fractions = probe.merged.clipped_fractions
    return list(zip(probe.bracket.frames, probe.bracket.stops, fractions, strict=True))


def _frame(frame: Frame, ev: float, clipped: float) -> dict[str, Any]:
    exposure = frame.exposure
    assert exposure is not None
    known = exposure.known
    return {
        "file": str(frame.path),
        "shutter_s": exposure.shutter_s,
        "iso": exposure.iso if known else None,
        "aperture": exposure.aperture if known else None,
        "ev": round(ev, 4),
        "clipped_fraction": clipped,
    }


def _lamp(light: Light) -> dict[str, Any]:
    return {
        "id": light.id,
        "azimuth_deg": round(light.azimuth_deg, 2),
        "elevation_deg": round(light.elevation_deg, 2),
        "diameter_deg": round(light.diameter_deg, 2),
        "share": light.share,
        "clipped": light.clipped,
    }


def _change(change: Any) -> dict[str, Any]:
    return {
        **fields(change, "name", "turn_deg", "in_doubt", "in_reach", "reach_stops"),
        "worst_given_up": change.worst,
        "cases": [
            {"lamp": case.light} | fields(case, "stops", "turn_deg", "given_up")
            for case in change.cases
        ],
    }


def _sun(probe: Probe) -> dict[str, Any] | None:
    done = probe.finished.restoration
    if done is None:
        return None
    return {
        "lamp": done.light,
        "illuminance_lux": round(done.illuminance_lux),
        "range_lux": [round(value) for value in done.range_lux],
    }


def _lamp_row(light: Light) -> str:
    share = f"{100 * light.share:.1f} %"
    return (
        f"{light.id:4}  {light.azimuth_deg:+6.0f}°  {light.elevation_deg:+8.0f}°  "
        f"{light.diameter_deg:4.0f}°  {f'at least {share}, clipped' if light.clipped else share}"
    )
