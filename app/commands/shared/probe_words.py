"""Output of the light-probe commands: the frames, the lamps, and advice about the lamps."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

from app.commands.shared.printing import fields
from app.core.base.phrases import percent, shutter_words
from app.core.measure.finish.lamp_detection import Light
from app.core.measure.finish.tripod_detection import Clutter
from app.core.measure.measurement import Measurement
from app.core.measure.read.frame import Exposure, Frame
from app.core.places.saved.saved_remarks import facts_of
from app.core.text import tr
from app.words.measure.masks import clutter_name, clutter_reason
from app.words.remarks import sentences

PARTS: Final = {
    "metering": tr("metering"),
    "exposing": tr("exposing"),
    "download": tr("download"),
    "merge": tr("merge"),
}
"""Steps of a capture whose durations are printed."""

_UNSTATED: Final = Exposure(0.0, known=False)  # placeholder for a photo that records no exposure
_NAME: Final = 28  # columns for a file's name
_FRAME_ROW: Final = f"{{:{_NAME}}}  {{:>10}}  {{:>5}}  {{:>4}}  {{:>6}}  {{}}"
_LEAST_SHARE: Final = 0.0005  # minimum fraction of all light for a separate row in the table


def probe_facts(probe: Measurement) -> dict[str, Any]:
    """Return the JSON entries that every probe has, whichever options were chosen."""
    finished, audit, response = probe.finished, probe.finished.audit, probe.response.response
    residual = response.residual_stops
    advice = () if audit is None else audit.advice
    return {
        "size": [probe.merged.radiance.shape[1], probe.merged.radiance.shape[0]],
        "frames": [_frame(*row) for row in _frames(probe)],
        "response": response.name,
        "response_residual_stops": round(residual, 4) if math.isfinite(residual) else None,
        "cd_m2_per_unit": probe.merged.cd_m2,
        "clipped_energy_fraction": finished.measured_clipped,
        "clipped_energy_range": None if audit is None else list(audit.clipped_energy_range),
        "lamps": [_lamp(light) for light in finished.lights],
        "rough": probe.rough,
        "advice": list(sentences(advice)),
        "in_doubt": [] if audit is None else list(audit.in_doubt),
        "style_changes": [] if audit is None else [_change(c) for c in audit.style_changes],
        "sun": _sun(probe),
        "masked": [clutter_facts(each) for each in finished.clutter],
        "mask_changes": [
            {"name": change.style} | fields(change, "turn_before_deg", "turn_after_deg", "given_up")
            for change in finished.changes
        ],
        "moved_share": probe.motion.share,
        "levelled": fields(probe.levelling, "pitch_deg", "roll_deg"),
        "stitching": own_facts(probe).get("stitching"),
        "left_out": [
            {"file": str(each.path), "reason": each.reason.value} for each in probe.left_out
        ],
        "warnings": list(sentences(probe.warnings)),
        "notes": list(sentences(probe.notes)),
        "remarks": {
            "advice": facts_of(advice),
            "warnings": facts_of(probe.warnings),
            "notes": facts_of(probe.notes),
        },
    }


def own_facts(probe: Measurement) -> dict[str, Any]:
    """Return the JSON entries specific to one way of measuring."""
    return {} if probe.own is None else probe.own.facts()


def probe_table(probe: Measurement, *more: str) -> str:
    """Format tables of the frames and of the important lamps, with advice about the lamps."""
    return "\n".join([*_frame_rows(probe), *_lamp_rows(probe), *more])


def wrote(probe: Measurement, target: Path, seconds: float | None = None) -> str:
    """Report where an environment was written, its size, and the time it took."""
    rows, columns = probe.merged.radiance.shape[:2]
    size = f"{columns} x {rows}"
    if seconds is None:
        return tr("Wrote {target} ({size}).", target=target, size=size)
    return tr(
        "Wrote {target} ({size}, {seconds:.2f} s).", target=target, size=size, seconds=seconds
    )


def _frame_rows(probe: Measurement) -> list[str]:
    heads = (tr("frame"), tr("shutter"), "ISO", "f/", "EV", tr("clipped"))
    lines = [_FRAME_ROW.format(*heads)]
    for frame, ev, part in _frames(probe):
        exposure = frame.exposure or _UNSTATED
        iso, aperture = (
            (f"{exposure.iso:g}", f"{exposure.aperture:g}") if exposure.known else ("", "")
        )
        # Names often begin with a date, so only the end distinguishes frames.
        name = frame.path.name[-_NAME:]
        time, share = exposure.shutter_s, f"{percent(part, 1):>7}"
        shutter = shutter_words(time) if time else ""
        lines.append(_FRAME_ROW.format(name, shutter, iso, aperture, f"{ev:+.2f}", share))
    return lines


def _lamp_rows(probe: Measurement) -> list[str]:
    lines: list[str] = []
    lamps = [light for light in probe.finished.lights if light.share >= _LEAST_SHARE]
    if lamps:
        lines += ["", tr("lamp  azimuth  elevation   size  light")]
        lines += [_lamp_row(light) for light in lamps]
    audit = probe.finished.audit
    if audit is not None:
        lines += ["", *sentences(audit.advice)] if audit.advice else []
    return lines


def clutter_facts(each: Clutter) -> dict[str, Any]:
    """Return the JSON entries for a mask."""
    return {
        "name": clutter_name(each),
        **fields(each, "solid_angle_sr", "confidence"),
        "reason": clutter_reason(each),
    }


def _frames(probe: Measurement) -> list[tuple[Frame, float, float]]:
    """Return each frame with its exposure in stops and the fraction of it that is clipped."""
    fractions = probe.merged.clipped_fractions
    return list(zip(probe.bracket.frames, probe.bracket.stops, fractions, strict=True))


def _frame(frame: Frame, ev: float, clipped: float) -> dict[str, Any]:
    exposure = frame.exposure or _UNSTATED
    absolute = exposure.known
    return {
        "file": str(frame.path),
        "shutter_s": exposure.shutter_s or None,
        "iso": exposure.iso if absolute else None,
        "aperture": exposure.aperture if absolute else None,
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


def _sun(probe: Measurement) -> dict[str, Any] | None:
    restoration = probe.finished.restoration
    if restoration is None:
        return None
    return {
        "lamp": restoration.light,
        "illuminance_lux": round(restoration.illuminance_lux),
        "range_lux": [round(value) for value in restoration.range_lux],
    }


def _lamp_row(light: Light) -> str:
    share = percent(light.share, 1)
    if light.clipped:
        share = tr("at least {share}, clipped", share=share)
    return (
        f"{light.id:4}  {light.azimuth_deg:+6.0f}°  {light.elevation_deg:+8.0f}°  "
        f"{light.diameter_deg:4.0f}°  {share}"
    )
