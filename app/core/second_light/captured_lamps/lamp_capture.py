"""Measure a lamp in a dark room: from a bracket, or from a panorama with or without a mask."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.arrays import Float32
from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.imaging.image_input import clear_error, open_image
from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.base.remarks import Remark
from app.core.base.sphere import bounded
from app.core.environment.environment import from_radiance
from app.core.environment.environment_file import read_panorama
from app.core.measure.options import MeasureOptions
from app.core.measure.ways import measure
from app.core.second_light.captured_lamps.captured_lamp import (
    LARGEST,
    CapturedLamp,
    make_lamp,
)
from app.core.second_light.captured_lamps.lamp_mask import LampMask, find_mask
from app.core.second_light.place_brightness import stated_white
from app.core.text import tr

_FINEST: Final = 4 * LARGEST[1]  # columns


@dataclass(frozen=True, slots=True, eq=False)
class LampCapture:
    """A lamp that was read from files.

    Attributes:
        warnings: Warnings from merging the frames or from reading the panorama.
        mask: The detected mask, or None if the file contains a mask.
    """

    lamp: CapturedLamp
    warnings: tuple[Remark, ...] = ()
    mask: LampMask | None = None


def read_lamp_file(path: Path | str) -> LampCapture:
    """Read a lamp from a panorama of a dark room.

    Args:
        path: OpenEXR or Radiance file. If there is a channel A, it is the mask, and the light is
            premultiplied. Otherwise, the lamp is detected. The unit of the light is known if the
            file records ``whiteLuminance``.

    Raises:
        CoreError: If the file cannot be read, or if it contains no lamp.
    """
    # Ignore coverage: transparent texels are not the lamp, but they were captured.
    environment = from_radiance(read_panorama(path, coverage=False).radiance, Path(path).stem)
    name, warnings = environment.name, environment.warnings
    white, shape = stated_white(path), environment.shape
    radiance = bounded(environment.radiance, _FINEST)
    del environment  # It may be a gigabyte larger than `radiance`.
    alpha, mask = _alpha(Path(path), shape), None
    if alpha is None:
        mask = find_mask(radiance)
        alpha = mask.alpha
    return LampCapture(make_lamp(name, radiance, alpha, white_cd_m2=white), tuple(warnings), mask)


def _alpha(path: Path, shape: tuple[int, int]) -> Float32 | None:
    """Return channel A of the first part, (H, 2 H), reduced if large, or None if there is none."""
    source = open_image(path)
    if source is None:
        return None
    try:
        names = [str(name).lower() for name in source.spec().channelnames]
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
                "The mask in {name} cannot be read or has a different size from its light.",
                name=path.name,
            ),
            tr("Export the file again as a full RGBA panorama."),
        )
    return bounded(np.asarray(values, np.float32).reshape(shape), _FINEST)


_LINEAR: Final = (".exr", ".hdr")


def capture_lamp(
    paths: Sequence[Path],
    options: MeasureOptions | None = None,
    *,
    title: str = "lamp",
    distance_m: float | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> LampCapture:
    """Merge a bracket of a lamp in a dark room and find the lamp in it.

    Args:
        paths: Exposures, a folder of exposures, or one linear panorama (.exr, .hdr). If the
            panorama has a channel A, it is used as the mask.
        options: Options for merging. By default, the response is sRGB, because frames of a dark
            room are mostly noise, from which no response can be recovered.
        distance_m: Distance from the probe to the lamp, in metres, or None if unknown.

    Raises:
        CoreError: If the files are not panoramas, or if no lamp stands out.
    """
    if len(paths) == 1 and paths[0].suffix.lower() in _LINEAR:
        capture = read_lamp_file(paths[0])
        lamp = replace(capture.lamp, title=title, distance_m=distance_m)
        return replace(capture, lamp=lamp)
    options = options or MeasureOptions(response="srgb", sun="leave")
    probe = measure("bracket", paths, options, token, span(report, 0.0, 0.8))
    if not probe.bracket.panorama:
        raise CoreError(
            tr("These pictures are not full panoramas (2:1)."),
            tr("Capture the lamp with the 360 camera that you use for places."),
        )
    report(0.8, Progress(Task.FINDING_LAMP))
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
    return LampCapture(lamp, tuple(probe.warnings), mask)
