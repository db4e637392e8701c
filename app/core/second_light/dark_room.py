"""A captured lamp from files: a panorama with its mask or without, or a bracket of a dark room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.arrays import Float32
from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.image_input import clear_error, open_image
from app.core.base.progress import Report, Token, silent, span
from app.core.base.sphere import bounded
from app.core.hdr.finish import MergeOptions
from app.core.hdr.pipeline import measure
from app.core.second_light.captured import LARGEST, CapturedLamp, make_lamp
from app.core.second_light.mask import find_mask
from app.core.second_light.scale import stated_white
from app.core.solver.environment import read_environment
from app.core.text import tr

if TYPE_CHECKING:
    from app.core.solver.style_pack import StylePack


_FINEST: Final = 4 * LARGEST[1]  # columns; a lamp is kept in a quarter


def read_lamp_file(path: Path | str) -> tuple[CapturedLamp, tuple[str, ...]]:
    """Read a lamp from a panorama of it in a dark room.

    `path`: OpenEXR or Radiance. A channel A is the mask (the light premultiplied); without one the
    lamp is found.
    Its unit is known where the file states ``whiteLuminance``.
    Raises CoreError when the file cannot be read, or no lamp is in it.
    """
    environment = read_environment(path)
    name, said = environment.name, list(environment.warnings)
    white, shape = stated_white(path), environment.shape
    radiance = bounded(environment.radiance, _FINEST)
    del environment  # It may be a gigabyte larger than what is needed of it.
    alpha = _alpha(Path(path), shape)
    if alpha is None:
        mask = find_mask(radiance)
        alpha, said = mask.alpha, [*said, *mask.warnings]
    lamp = make_lamp(name, radiance, alpha, white_cd_m2=white)
    return lamp, tuple(said)


def _alpha(path: Path, shape: tuple[int, int]) -> Float32 | None:
    """(H, 2 H) channel A of the first part, bounded; None where there is none."""
    source = open_image(path)
    if source is None:
        return None
    try:
        spec = source.spec()
        names = [str(name).lower() for name in spec.channelnames]
        channel = next((k for k, name in enumerate(names) if name in ("a", "alpha")), None)
        if channel is None:
            return None
        values = source.read_image(0, 0, channel, channel + 1, "float")
        if values is None:
            clear_error(source)
    finally:
        source.close()
    if values is None or np.asarray(values).size != shape[0] * shape[1]:
        raise EnvironmentFileError(
            tr(
                "The mask in {name} cannot be read, or has another size than its light.",
                name=path.name,
            ),
            tr("Export it again as a whole RGBA panorama."),
        )
    return bounded(np.asarray(values, np.float32).reshape(shape), _FINEST)


GUIDE: Final = (
    tr("Make a room as dark as you can: curtains, other lamps, screens."),
    tr(
        "Put the 360 camera on a stand where the head would be, away from "
        "mirrors and glossy tables."
    ),
    tr(
        "Hold the lamp at the distance at which it will be used, facing the "
        "camera, and measure that distance from the camera."
    ),
    tr(
        "Take a bracket with fixed white balance; in its darkest frame the lamp "
        "must not be burnt out."
    ),
    tr("Give the files here. Use the same camera for places: then their brightness compares."),
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

    `paths`: exposures, or one folder of them, or one linear panorama (.exr, .hdr) with the mask as
    its channel A or without.
    `wishes`: how to merge. By default the camera's curve is taken as sRGB: what is in a dark room's
    frames is mostly noise, from which no curve can be recovered.
    `distance_m`: from the probe to the lamp, metres.
    Raises CoreError when the files are no panoramas, or no lamp stands out.
    """
    if len(paths) == 1 and paths[0].suffix.lower() in _LINEAR:
        lamp, said = read_lamp_file(paths[0])
        return Capture(replace(lamp, title=title, distance_m=distance_m), said)
    wanted = wishes or MergeOptions(response="srgb", sun="leave")
    probe = measure(paths, pack, wanted, token=token, report=span(report, 0.0, 0.8))
    if not probe.bracket.panorama:
        raise CoreError(
            tr("These pictures are not full panoramas (2:1)."),
            tr("Capture the lamp with the 360 camera that measures places."),
        )
    report(0.8, tr("Finding the lamp"))
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
