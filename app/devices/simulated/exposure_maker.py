"""One frame from a simulated camera: its light, sensor, camera curve, JPEG and metadata.

1. The environment in cd/m2 is resampled to the frame's size (`optics.FrameView`) and multiplied by
   the gain of each lens.
2. It is divided by the luminance that saturates the exposure, 78 N^2 / (0.65 t S) cd/m2
   (ISO 12232:2019, saturation-based speed, q = 0.65), per channel.
3. The sensor counts electrons with shot noise and read noise, and clips each channel.
4. The camera curve and rounding produce bytes, which OpenCV encodes as a JPEG.

White of luminance L is (L, L, L) cd/m2 in linear Rec. 709. One unit of radiance in a relative
environment is `scale` cd/m2.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Final, Protocol, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import FloatImage
from app.core.measure.read.frame import Exposure, LensExposure, XmpPose
from app.devices.simulated.cameras import CameraModel
from app.devices.simulated.exif import Tags, exif_segment, pose_segment
from app.devices.simulated.optics import (
    add_sensor_noise,
    column_gains,
    saturation_cd_m2,
    view_of,
)

_BAND_ROWS: Final = 16
_STEPS: Final = 65536


class FrameSight(Protocol):
    """The light that falls on a frame (see `optics.FrameView`)."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the frame."""

    def band(self, start: int, stop: int) -> FloatImage:
        """Sample rows `start` to `stop` as a new (stop - start, W, 3) radiance array."""


Tables: TypeAlias = tuple[NDArray[np.uint8], ...]
"""The camera curves for red, green and blue, each (65536,).

Entry i is the byte for linear light (i / 65535)**2. The square root keeps the steps fine enough
near black, where curves are steep.
"""


@cache
def srgb_tables() -> Tables:
    """Return the tables of the sRGB curve (IEC 61966-2-1)."""
    linear = (np.arange(_STEPS) / (_STEPS - 1)) ** 2
    power = 1.055 * np.power(linear, 1.0 / 2.4) - 0.055
    coded = np.where(linear <= 0.0031308, 12.92 * linear, power)
    return (np.asarray(np.rint(coded * 255.0), dtype=np.uint8),) * 3


@dataclass(frozen=True, slots=True)
class ShotOptions:
    """The settings of a frame other than its exposure.

    Attributes:
        shape: tuple[int, int] or None. Rows and columns, or None for those of the environment.
            `CameraModel.shape` gives a full frame.
        scale: Luminance in cd/m2 of one unit of the environment.
        lens_gain: Sensitivity of the front lens (centre half of the columns) and of the back lens.
            The values are also recorded for each lens in the maker note, and are blended over 10
            degrees at the seam.
    """

    shape: tuple[int, int] | None = None
    scale: float = 1.0
    noise: bool = True
    lens_gain: tuple[float, float] = (1.0, 1.0)
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    date_time: str = "2026:06:21 12:00:00"


PLAIN: Final = ShotOptions()
"""Settings for a frame that has the environment's size and is otherwise left unchanged."""


def develop(
    environment: FloatImage,
    camera: CameraModel,
    exposure: Exposure,
    shot: ShotOptions = PLAIN,
    *,
    seed: int = 0,
) -> NDArray[np.uint8]:
    """Expose a frame and return the picture before JPEG compression.

    Returns:
        NDArray[np.uint8], (rows, columns, 3). Red, green and blue as encoded bytes.

    Raises:
        ValueError: If the sizes are incompatible (`optics.view_of`), or the gains are invalid.
    """
    shape = shot.shape or (environment.shape[0], environment.shape[1])
    return expose(view_of(environment, shape), camera, exposure, shot, srgb_tables(), seed=seed)


def expose(
    view: FrameSight,
    camera: CameraModel,
    exposure: Exposure,
    shot: ShotOptions,
    tables: Tables,
    *,
    seed: int,
) -> NDArray[np.uint8]:
    """Expose a frame from a prepared view, encoded with `tables` (see `develop`)."""
    if min(*shot.lens_gain, *shot.white_balance, shot.scale) <= 0.0:
        raise ValueError("gains and the scale must be greater than 0")
    shape = view.shape
    channels = np.asarray(shot.white_balance) * (shot.scale / saturation_cd_m2(exposure))
    gains = np.outer(column_gains(shape[1], shot.lens_gain), channels).astype(np.float32)
    picture = np.empty((*shape, 3), dtype=np.uint8)

    def fill(start: int) -> None:
        stop = min(start + _BAND_ROWS, shape[0])
        share = view.band(start, stop)
        share *= gains
        if shot.noise:
            # Each band has its own generator, so that the result does not depend on the order.
            generator = np.random.default_rng([seed, start // _BAND_ROWS])
            add_sensor_noise(share, camera, exposure.iso, generator)
        _code(share, tables, picture[start:stop])

    with ThreadPoolExecutor(max_workers=2) as pool:
        list(pool.map(fill, range(0, shape[0], _BAND_ROWS)))
    return picture


def jpeg(picture: NDArray[np.uint8], quality: int = 95) -> bytes:
    """Encode an (H, W, 3) RGB picture as a JPEG, without any metadata except JFIF.

    Raises:
        ValueError: If the quality is invalid, or the picture cannot be encoded.
    """
    if not 1 <= quality <= 100:
        raise ValueError(f"no JPEG has quality {quality}")
    how = [cv2.IMWRITE_JPEG_QUALITY, quality]
    how += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
    ok, data = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), how)
    if not ok:
        raise ValueError(f"a picture of {picture.shape} cannot be stored as JPEG")
    return data.tobytes()


def tags_of(
    camera: CameraModel, exposure: Exposure, shot: ShotOptions, shape: tuple[int, int]
) -> Tags:
    """Return the true metadata of a frame.

    Args:
        exposure: Exposure of the frame. Unknown ISO and aperture are omitted.
        shape: Rows and columns of the frame.
    """
    level = camera.levels_itself or camera.maker_note
    lenses = tuple(LensExposure(exposure.shutter_s, exposure.iso * g) for g in shot.lens_gain)
    return Tags(
        make=camera.make,
        model=camera.model,
        software=camera.software,
        date_time=shot.date_time,
        shutter_s=exposure.shutter_s,
        aperture=exposure.aperture if exposure.known else None,
        iso=exposure.iso if exposure.known else None,
        shape=shape,
        pose=XmpPose(0.0, 0.0, None) if level else None,
        panorama=shape[1] == 2 * shape[0],
        maker_note=camera.maker_note,
        zenith_corrected=camera.levels_itself,
        lenses=lenses if camera.maker_note else (),
        lens_words=camera.lens_words,
    )


def segments_of(tags: Tags) -> list[bytes]:
    """Return the segments of a file: EXIF, and XMP for panoramas."""
    segments = [exif_segment(tags)]
    return [*segments, pose_segment(tags)] if tags.panorama else segments


def _code(share: FloatImage, tables: Tables, into: NDArray[np.uint8]) -> None:
    """Apply the camera curve and store the rounded bytes in `into`, overwriting `share`."""
    top = np.float32(tables[0].size - 1)
    np.clip(share, 0.0, 1.0, out=share)
    np.sqrt(share, out=share)
    share *= top
    share += np.float32(0.5)
    steps = share.astype(np.uint16)
    if all(table is tables[0] or np.array_equal(table, tables[0]) for table in tables):
        np.take(tables[0], steps, out=into)
        return
    for channel, table in enumerate(tables):
        into[..., channel] = table[steps[..., channel]]
