"""A captured lamp from a file that is not in the library: a panorama, with its mask or without."""

from __future__ import annotations

from pathlib import Path
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.errors import EnvironmentFileError
from app.core.base.image_input import clear_error, open_image
from app.core.second_light.captured import LARGEST, CapturedLamp, make_lamp
from app.core.second_light.mask import find_mask
from app.core.second_light.scale import stated_white
from app.core.solver.environment import read_environment

Float32: TypeAlias = NDArray[np.float32]
_FINE: Final = 4


def read_lamp_file(path: Path | str) -> tuple[CapturedLamp, tuple[str, ...]]:
    """Read a lamp from a panorama of it in a dark room.

    Parameters
    ----------
    path : Path or str
        OpenEXR or Radiance. A channel A is the mask (the light premultiplied); without one the
        lamp is found.

    Returns
    -------
    CapturedLamp
        Its unit is known where the file states ``whiteLuminance``.

    Raises
    ------
    CoreError
        When the file cannot be read, or no lamp is in it.
    """
    environment = read_environment(path)
    name, said = environment.name, list(environment.warnings)
    white, shape, radiance = stated_white(path), environment.shape, _bounded(environment.radiance)
    del environment  # It may be a gigabyte larger than what is needed of it.
    alpha = _alpha(Path(path), shape)
    if alpha is None:
        mask = find_mask(radiance)
        alpha, said = mask.alpha, [*said, *mask.warnings]
    lamp = make_lamp(name, radiance, alpha, white_cd_m2=white)
    return lamp, tuple(said)


def _bounded(values: Float32) -> Float32:
    """Average what is several times as fine as a lamp is kept, (H, 2 H) or (H, 2 H, 3)."""
    if len(values) <= _FINE * LARGEST[0]:
        return values
    size = (_FINE * LARGEST[1], _FINE * LARGEST[0])
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)


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
            f"The mask in {path.name} cannot be read, or has another size than its light.",
            "Export it again as a whole RGBA panorama.",
        )
    return _bounded(np.asarray(values, np.float32).reshape(shape))
