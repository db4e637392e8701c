"""A captured lamp from a file that is not in the library: a panorama, with its mask or without."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.environment import read_environment
from app.core.errors import EnvironmentFileError
from app.core.second_light.captured import CapturedLamp, make_lamp
from app.core.second_light.mask import find_mask
from app.core.second_light.scale import stated_white

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["read_lamp_file"]

Float32: TypeAlias = NDArray[np.float32]


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
    tuple of str
        What the user should know.

    Raises
    ------
    CoreError
        When the file cannot be read, or no lamp is in it.
    """
    environment = read_environment(path)
    said: Sequence[str] = environment.warnings
    alpha = _alpha(Path(path), environment.shape)
    if alpha is None:
        mask = find_mask(environment.radiance)
        alpha, said = mask.alpha, [*said, *mask.warnings]
    lamp = make_lamp(environment.name, environment.radiance, alpha, white_cd_m2=stated_white(path))
    return lamp, tuple(said)


def _alpha(path: Path, shape: tuple[int, int]) -> Float32 | None:
    """(H, 2 H) channel A of the first part; None where there is none."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        return None
    try:
        spec = source.spec()
        names = [str(name).lower() for name in spec.channelnames]
        channel = next((k for k, name in enumerate(names) if name in ("a", "alpha")), None)
        if channel is None:
            return None
        values = source.read_image(0, 0, channel, channel + 1, "float")
        if values is None:
            source.geterror()
    finally:
        source.close()
    if values is None or np.asarray(values).size != shape[0] * shape[1]:
        raise EnvironmentFileError(
            f"The mask in {path.name} cannot be read, or has another size than its light.",
            "Export it again as a whole RGBA panorama.",
        )
    return np.asarray(values, np.float32).reshape(shape)
