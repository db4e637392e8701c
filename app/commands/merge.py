"""``turnlight merge``: a bracket of exposures in, an environment out.

`capture` describes its light probe in the same words: frames, lamps, and what to do about them.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.commands.arguments import (
    add_json,
    check_drawing,
    check_ending,
    check_outputs,
    mask_files,
)
from app.commands.printing import (
    ProgressPrinter,
    answer,
    fields,
    say,
)
from app.core.base.errors import ProbeError
from app.core.base.images import write_exr, write_hdr, write_png
from app.core.hdr.finish import MergeOptions
from app.core.hdr.frame import Frame
from app.core.hdr.masks import check_picture_mask, parse_mask
from app.core.hdr.metadata import ENDINGS
from app.core.hdr.pipeline import measure
from app.core.hdr.tripod_detection import suggest
from app.core.solver.style_pack import load_named_pack
from app.core.text import tr
from app.core.text.quantities import percent, shutter_words

if TYPE_CHECKING:
    from app.core.hdr.lights import Light
    from app.core.hdr.pipeline import Probe
    from app.core.hdr.tripod_detection import Clutter

PARTS: Final = {
    "metering": tr("metering"),
    "exposing": tr("exposing"),
    "download": tr("download"),
    "merge": tr("merge"),
}
"""Parts of a capture whose time is told."""

_NAME: Final = 28  # columns for a file's name
_FRAME_ROW: Final = f"{{:{_NAME}}}  {{:>10}}  {{:>5}}  {{:>4}}  {{:>6}}  {{}}"
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


def wrote(probe: Probe, target: Path, seconds: float | None = None) -> str:
    """Say where an environment is, its size, and how long it took."""
    rows, columns = probe.merged.radiance.shape[:2]
    size = f"{columns} x {rows}"
    if seconds is None:
        return tr("Wrote {target} ({size}).", target=target, size=size)
    return tr(
        "Wrote {target} ({size}, {seconds:.2f} s).", target=target, size=size, seconds=seconds
    )


def _frame_rows(probe: Probe) -> list[str]:
    heads = (tr("frame"), tr("shutter"), "ISO", "f/", "EV", tr("clipped"))
    lines = [_FRAME_ROW.format(*heads)]
    for frame, ev, part in _frames(probe):
        exposure = frame.exposure
        assert exposure is not None
        iso, aperture = (
            (f"{exposure.iso:g}", f"{exposure.aperture:g}") if exposure.known else ("", "")
        )
        name = frame.path.name[-_NAME:]  # sessions put the date first, the end tells frames apart
        shutter, share = shutter_words(exposure.shutter_s), f"{percent(part, 1):>7}"
        lines.append(_FRAME_ROW.format(name, shutter, iso, aperture, f"{ev:+.2f}", share))
    return lines


def _lamp_rows(probe: Probe) -> list[str]:
    lines: list[str] = []
    lamps = [light for light in probe.finished.lights if light.share >= _LEAST_SHARE]
    if lamps:
        lines += ["", tr("lamp  azimuth  elevation   size  light")]
        lines += [_lamp_row(light) for light in lamps]
    audit = probe.finished.audit
    if audit is not None:
        lines += ["", *audit.advice] if audit.advice else []
    return lines


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
    share = percent(light.share, 1)
    if light.clipped:
        share = tr("at least {share}, clipped", share=share)
    return (
        f"{light.id:4}  {light.azimuth_deg:+6.0f}°  {light.elevation_deg:+8.0f}°  "
        f"{light.diameter_deg:4.0f}°  {share}"
    )


_WRITERS: Final = (".exr", ".hdr")
_MOST_STOPS: Final = 30
_SUN_WORDS: Final = {
    "clear": "clear",
    "hazy": "hazy",
    "thin-cloud": "thin cloud",
    "leave": "leave",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``merge`` does and takes."""
    parser.description = tr(
        "Merge the exposures of a bracket, in any order, into an HDR "
        "environment; say what was clipped and what that means for the answer."
    )
    parser.add_argument(
        "images",
        metavar="IMAGE",
        nargs="+",
        type=Path,
        help=tr("the exposures, or one folder of them"),
    )
    parser.add_argument(
        "-o", "--output", metavar="ENV", type=Path, required=True, help=tr(".exr or .hdr to write")
    )
    _add_camera(parser)
    _add_corrections(parser)
    parser.add_argument(
        "--preview", metavar="PNG", type=Path, help=tr("also write a picture of it")
    )
    parser.add_argument(
        "--exposure", metavar="STOPS", type=_number, default=0.0, help=tr("exposure of the preview")
    )
    parser.add_argument(
        "--full", action="store_true", help=tr("keep the frames' own size instead of 2048 x 1024")
    )
    add_json(parser, run)


def _add_camera(parser: argparse.ArgumentParser) -> None:
    """Add what is known of the exposures, and how they are weighed."""
    parser.add_argument(
        "--times", metavar="T,...", help=tr("exposure times in seconds, in the order of the files")
    )
    parser.add_argument(
        "--response",
        choices=("auto", "srgb", "recover"),
        default="auto",
        help=tr(
            "camera curve: sRGB, recovered from the bracket, or recovered only where "
            "the measured steps disagree (default: auto)"
        ),
    )
    parser.add_argument(
        "--weights",
        choices=("noise", "reinhard"),
        default="noise",
        help=tr("how frames are weighed: by their noise, or as in the paper (default: noise)"),
    )


def _add_corrections(parser: argparse.ArgumentParser) -> None:
    """Add what the user knows better than the picture: lamps, the sun, what should not be there."""
    parser.add_argument(
        "--lamp-gain",
        metavar="ID=STOPS",
        action="append",
        default=[],
        help=tr("make a lamp brighter or darker, e.g. A=3; may be repeated"),
    )
    parser.add_argument(
        "--lamp-lux",
        metavar="ID=LUX",
        action="append",
        default=[],
        help=tr("illuminance of a lamp as a light meter read it, facing the lamp; may be repeated"),
    )
    parser.add_argument(
        "--sun",
        choices=tuple(_SUN_WORDS),
        default="clear",
        help=tr(
            "how the sky is where the sun was clipped, or leave the sun as it is (default: clear)"
        ),
    )
    parser.add_argument(
        "--mask",
        metavar="WHAT",
        action="append",
        default=[],
        help=tr(
            "fill what should not be there from around it: nadir:-65, "
            'box:-20,20,-90,-40, "az,el;az,el;az,el", a PNG (white = fill), or '
            "suggested; may be repeated"
        ),
    )


def run(args: argparse.Namespace) -> int:
    """Merge a bracket and write the environment whole or not at all.

    Raises:
        CoreError: When an argument or a file is of no use; nothing is written then.
    """
    started = time.perf_counter()
    wishes = _wishes(args)
    _check_targets(args, wishes)
    probe = measure(args.images, load_named_pack("generic"), wishes, report=ProgressPrinter())
    say(*probe.warnings, *probe.notes)
    known = bool(args.mask) or not probe.bracket.panorama
    suggested = () if known else suggest(probe.finished.measured)
    radiance, white = probe.merged.radiance, probe.merged.cd_m2
    if args.output.suffix.lower() == ".exr":
        write_exr(args.output, radiance, white)
    else:
        write_hdr(args.output, radiance)
    if args.preview is not None:
        marks = (*probe.finished.clutter, *suggested)
        # Only a preview needs Qt.
        from app.export.merge_preview import preview

        picture = preview(probe.finished.measured, probe.finished.lights, marks, args.exposure)
        write_png(args.preview, picture)
    seconds = time.perf_counter() - started
    facts = {
        "file": str(args.output),
        **probe_facts(probe),
        "suggested_masks": [clutter_facts(each) for each in suggested],
        "seconds": round(seconds, 3),
    }
    lines = [
        tr("Suggested: {name}. {reason}", name=each.name, reason=each.reason) for each in suggested
    ]
    last = wrote(probe, args.output, seconds)
    return answer(args, facts, probe_table(probe, *lines, "", last))


def _check_targets(args: argparse.Namespace, wishes: MergeOptions) -> None:
    """Refuse what cannot be written, and masks that cannot be read, before anything is merged."""
    if abs(args.exposure) > _MOST_STOPS:
        raise ProbeError(tr("--exposure is from -{most} to {most} stops.", most=_MOST_STOPS))
    check_ending(args.output, _WRITERS, tr("environments"))
    if args.preview is not None:
        check_ending(args.preview, (".png",), tr("previews"))
    masks = mask_files(wishes.masks)
    check_outputs([args.output, args.preview], [*args.images, *masks], ENDINGS)
    if args.preview is not None:
        check_drawing()
    for mask in masks:
        check_picture_mask(mask)


def _wishes(args: argparse.Namespace) -> MergeOptions:
    return MergeOptions(
        times=None if args.times is None else tuple(_number(t) for t in args.times.split(",")),
        response=args.response,
        weights=args.weights,
        full=args.full,
        sun=_SUN_WORDS[args.sun],  # type: ignore[arg-type]
        gains=dict(_pair(text, "--lamp-gain") for text in args.lamp_gain),
        lux=dict(_pair(text, "--lamp-lux") for text in args.lamp_lux),
        masks=tuple(parse_mask(text) for text in args.mask),
    )


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ProbeError(tr("{text!r} is not a number.", text=text.strip()))
    return value


def _pair(text: str, option: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not (name.strip() and equals):
        raise ProbeError(
            tr(
                "{option} takes a lamp and a number, like A=3, not {text!r}.",
                option=option,
                text=text,
            )
        )
    return name, _number(value)
