"""From the exposures of a lamp in a dark room to a captured lamp."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token, silent, span
from app.core.hdr.finish import MergeOptions
from app.core.hdr.pipeline import measure
from app.core.second_light.captured import CapturedLamp, make_lamp
from app.core.second_light.lamp_file import read_lamp_file
from app.core.second_light.mask import find_mask

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.core.solver.style_pack import StylePack

GUIDE: Final = (
    "Make a room as dark as you can: curtains, other lamps, screens.",
    "Put the 360 camera on a stand where the head would be, away from mirrors and glossy tables.",
    "Hold the lamp at the distance at which it will be used, facing the camera, and measure that "
    "distance from the camera.",
    "Take a bracket with fixed white balance; in its darkest frame the lamp must not be burnt out.",
    "Give the files here. Use the same camera for places: then their brightness compares.",
)
"""What to do, step by step."""

_LINEAR: Final = (".exr", ".hdr")


@dataclass(frozen=True, slots=True, eq=False)
class Capture:
    """A lamp from files, and what there is to say about it."""

    lamp: CapturedLamp
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def capture_lamp(
    paths: Sequence[Path],
    pack: StylePack,
    wishes: MergeOptions | None = None,
    *,
    title: str = "lamp",
    distance_m: float | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Capture:
    """Merge a bracket of a lamp in a dark room, and find the lamp in it.

    Parameters
    ----------
    paths : sequence of Path
        Exposures, or one folder of them, or one linear panorama (.exr, .hdr) with the mask as
        its channel A or without.
    wishes : MergeOptions, optional
        How to merge. By default the camera's curve is taken as sRGB: what is in a dark room's
        frames is mostly noise, from which no curve can be recovered.
    distance_m : float, optional
        From the probe to the lamp, metres.
    token, report : Token, Report, optional
        To stop, and to say how far it is.

    Raises
    ------
    CoreError
        When the files are no panoramas, or no lamp stands out.
    Cancelled
        When the token was cancelled.
    """
    if len(paths) == 1 and paths[0].suffix.lower() in _LINEAR:
        lamp, said = read_lamp_file(paths[0])
        return Capture(replace(lamp, title=title, distance_m=distance_m), said)
    wanted = wishes or MergeOptions(response="srgb", sun="leave")
    probe = measure(paths, pack, wanted, token=token, report=span(report, 0.0, 0.8))
    if not probe.bracket.panorama:
        raise CoreError(
            "These pictures are not full panoramas (2:1).",
            "Capture the lamp with the 360 camera that measures places.",
        )
    report(0.8, "Finding the lamp")
    merged = probe.merged
    mask = find_mask(merged.radiance, merged.clipped)
    cameras = {frame.camera for frame in probe.bracket.frames if frame.camera}
    lamp = make_lamp(
        "lamp",
        merged.radiance,
        mask.alpha,
        title=title,
        white_cd_m2=merged.cd_m2,
        distance_m=distance_m,
        camera=cameras.pop() if len(cameras) == 1 else "",
    )
    return Capture(lamp, (*probe.warnings, *mask.warnings), mask.notes)
