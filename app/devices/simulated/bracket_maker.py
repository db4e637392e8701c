"""Brackets of a simulated camera: several frames of one place, in memory or as files."""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Final, Unpack

import numpy as np

from app.core.base.colour import srgb_encode
from app.core.base.files import atomic_write_bytes
from app.core.hdr.frame import Exposure
from app.core.solver.environment import solid_angles
from app.devices.simulated.exposure_maker import Options, Shot, shoot
from app.devices.simulated.sensor import saturation_cd_m2

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from app.core.base.colour import FloatImage
    from app.devices.simulated.cameras import CameraModel
    from app.devices.simulated.exposure_maker import TagEdit

_STAMP: Final = "%Y:%m:%d %H:%M:%S"
_MIDDLE: Final = 0.46
_SECONDS_APART: Final = 3


def meter(
    environment: FloatImage,
    camera: CameraModel,
    *,
    scale: float = 1.0,
    target: float = _MIDDLE,
) -> Exposure:
    """Find the exposure that an automatic camera would choose: mean sRGB value at `target`.

    The mean is taken over the sphere, at base ISO and the widest aperture; the exposure time is
    whatever it takes and lies on no list of the camera's.

    Parameters
    ----------
    environment : NDArray[np.float32], (H, 2 H, 3)
        Linear Rec. 709 light, not all black.
    scale : float, optional
        Luminance in cd/m2 of one unit.
    target : float, optional
        Mean of the coded values, 0 to 1.

    Returns
    -------
    Exposure
        With that mean within 0.001, where the environment allows it.
    """
    height, width = environment.shape[:2]
    step = max(height // 256, 1)
    light = np.asarray(environment[::step, ::step], dtype=np.float64) * scale
    weights = solid_angles((height, width))[::step, None, None] + np.zeros(light.shape)
    low, high = -40.0, 40.0
    for _ in range(40):
        stops = 0.5 * (low + high)
        mean = np.average(srgb_encode(light * 2.0**stops), weights=weights)
        low, high = (stops, high) if mean < target else (low, stops)
    aperture = min(camera.apertures)
    unit = Exposure(1.0, camera.base_iso, aperture)
    return Exposure(saturation_cd_m2(unit) * 2.0**low, camera.base_iso, aperture)


def make_bracket(
    environment: FloatImage | Sequence[FloatImage],
    camera: CameraModel,
    exposures: Sequence[Exposure],
    *,
    seed: int = 0,
    shifts: Sequence[NDArray[np.float64] | None] | None = None,
    edits: Sequence[TagEdit | None] | None = None,
    **options: Unpack[Options],
) -> list[bytes]:
    """Take a bracket.

    Parameters
    ----------
    environment : (H, 2 H, 3) float32, or one of them for each frame
        The light; several where something moves between the frames (`people.with_person`).
    shifts : sequence of (3, 3) float64 or None, optional
        `Shot.shift` of each frame.
    **options
        The attributes of `exposure_maker.Shot`, the same for all frames. The time stamps count
        on from `taken`, 3 seconds apart and the exposures' length besides.

    Raises
    ------
    ValueError
        When a sequence is not as long as `exposures`, or as `shoot`.
    """
    count = len(exposures)
    places = [environment] * count if isinstance(environment, np.ndarray) else list(environment)
    turns = [options.get("shift")] * count if shifts is None else list(shifts)
    words = [options.get("edit_tags")] * count if edits is None else list(edits)
    if not len(places) == len(turns) == len(words) == count:
        raise ValueError(f"{count} exposures need as many environments, shifts and edits")
    frames = []
    taken = datetime.strptime(options.get("taken", Shot().taken), _STAMP)
    for index, exposure in enumerate(exposures):
        own: Options = {
            **options,
            "shift": turns[index],
            "edit_tags": words[index],
            "taken": taken.strftime(_STAMP),
        }
        seed_here = int(np.random.SeedSequence([seed, index]).generate_state(1)[0])
        frames.append(shoot(places[index], camera, exposure, seed=seed_here, **own))
        taken += timedelta(seconds=_SECONDS_APART + math.ceil(exposure.shutter_s))
    return frames


def write_bracket(
    folder: Path | str,
    environment: FloatImage | Sequence[FloatImage],
    camera: CameraModel,
    exposures: Sequence[Exposure],
    *,
    first: int = 1,
    seed: int = 0,
    shifts: Sequence[NDArray[np.float64] | None] | None = None,
    edits: Sequence[TagEdit | None] | None = None,
    **options: Unpack[Options],
) -> list[Path]:
    """Take a bracket and write it as a camera names its files: R0010001.JPG and so on.

    Raises
    ------
    CoreError
        When a file cannot be written; every file is written whole or not at all.
    ValueError
        As `make_bracket`.
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    frames = make_bracket(
        environment, camera, exposures, seed=seed, shifts=shifts, edits=edits, **options
    )
    paths = [place / f"R001{first + index:04d}.JPG" for index in range(len(frames))]
    for path, data in zip(paths, frames, strict=True):
        atomic_write_bytes(path, data)
    return paths
