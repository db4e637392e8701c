"""Brackets of a simulated camera: several frames of one place, in memory or as files."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write_bytes
from app.core.environment.environment import energy
from app.core.measure.bracket.alignment.levelling import tilt_rotation
from app.core.measure.read.frame import Exposure, XmpPose
from app.devices.simulated import exposure_maker
from app.devices.simulated.cameras import CameraModel
from app.devices.simulated.exif import Tags, with_segments
from app.devices.simulated.exposure_maker import segments_of
from benchmarks.light.camera_curves import SRGB, Curve
from benchmarks.light.shots.views import view_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    from app.core.base.colour import FloatImage

    TagEdit: TypeAlias = Callable[[Tags], Tags | None]
    """Changes what a file says of itself; None makes it say nothing."""

SUBSAMPLINGS: Final = {
    "4:2:0": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420,
    "4:2:2": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422,
    "4:4:4": cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
}
"""Colour subsampling of JPEG files by name."""

_STAMP: Final = "%Y:%m:%d %H:%M:%S"
_SECONDS_APART: Final = 3


@dataclass(frozen=True, slots=True)
class Shot(exposure_maker.ShotOptions):
    """Options of a frame besides its exposure.

    Attributes:
        smooth: Whether texels are interpolated linearly.
        curve: Tone curve, or one per channel.
        tilt: Pose that the camera states.
        levels: Whether it corrects the zenith; None for the model's own behaviour.
        shift: (3, 3) float64. A further small rotation that no file states: direction d of the
            frame shows the light at shift @ d; `sphere.remap_frame` with it undoes it.
    """

    smooth: bool = False
    curve: Curve | tuple[Curve, Curve, Curve] = SRGB
    tilt: XmpPose | None = None
    levels: bool | None = None
    shift: NDArray[np.float64] | None = None

    def rotation(self, camera: CameraModel) -> NDArray[np.float64] | None:
        """Return the rotation from the frame to the environment; None if there is none."""
        tilt = None
        if self.tilt is not None and not self.corrects(camera):
            # Thetas state their accelerometer's reading of each axis, others follow GPano.
            tilt = tilt_rotation(self.tilt, gravity="THETA" in camera.model.upper())
        if self.shift is None:
            return tilt
        shift = np.asarray(self.shift, dtype=np.float64)
        return shift if tilt is None else tilt @ shift

    def corrects(self, camera: CameraModel) -> bool:
        """Return whether the zenith is corrected."""
        return camera.levels_itself if self.levels is None else self.levels

    def tags(self, camera: CameraModel, exposure: Exposure, shape: tuple[int, int]) -> Tags:
        """Return the true tags of a camera for a frame of that size."""
        levels, pose = self.corrects(camera), self.tilt
        if levels or (pose is None and camera.maker_note):
            pose = XmpPose(0.0, 0.0, pose.heading_deg if pose else None)
        tags = exposure_maker.tags_of(camera, exposure, self, shape)
        return replace(tags, pose=pose, zenith_corrected=levels)


def jpeg(picture: NDArray[np.uint8], quality: int = 95, subsampling: str = "4:2:0") -> bytes:
    """Encode a picture as JPEG, without any metadata but JFIF.

    Raises:
        ValueError: If quality or subsampling are invalid.
    """
    if not 1 <= quality <= 100 or subsampling not in SUBSAMPLINGS:
        raise ValueError(f"no JPEG has quality {quality} and subsampling {subsampling!r}")
    how = [cv2.IMWRITE_JPEG_QUALITY, quality]
    how += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, SUBSAMPLINGS[subsampling]]
    return cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), how)[1].tobytes()


def enlarged(
    environment: FloatImage, shape: tuple[int, int], *, smooth: bool = False
) -> FloatImage:
    """Resize an environment as frames of another size see it.

    Args:
        environment: (H, W, 3) float32. Linear radiance, any scale.
        shape: Rows and columns of the result.
        smooth: Whether to interpolate linearly between texel centres, which looks like a photo.
            Otherwise every texel is constant over its area and each pixel is the mean over its own
            area by solid angle: reducing the result gives the environment again. Smaller sizes
            always use that mean.

    Returns:
        (rows, columns, 3) float32. Linear radiance in the same scale.
    """
    return view_of(environment, shape, smooth=smooth).band(0, shape[0])


def bloomed(environment: FloatImage, part: float, sigma_deg: float) -> FloatImage:
    """Spread a part of the light like a lens, by a Gaussian of constant angular width.

    Along rows, the width in columns grows as the texels narrow towards the poles; along columns,
    the spread crosses the poles. A uniform environment stays uniform, and the energy is preserved.

    Args:
        environment: (H, 2 H, 3) float32. Linear radiance.
        part: Share of the light that is spread, 0 to 1.
        sigma_deg: Standard deviation of the spread, deg.

    Raises:
        ValueError: If the share or the width is out of range.
    """
    if not 0.0 <= part <= 1.0 or sigma_deg <= 0.0:
        raise ValueError("bloom is a share from 0 to 1, its width greater than 0")
    height, width = environment.shape[:2]
    over = np.roll(environment[::-1], width // 2, axis=1)
    meridians = np.concatenate([environment, over]).astype(np.float32)
    waves = np.fft.rfftfreq(2 * height) * (sigma_deg * height / 180.0)
    down = np.fft.rfft(meridians, axis=0) * _gaussian(waves)[:, None, None]
    column_wise = np.fft.irfft(down, n=2 * height, axis=0)[:height]
    level = np.sin(np.pi * (np.arange(height) + 0.5) / height)
    waves = np.outer(1.0 / level, np.fft.rfftfreq(width) * (sigma_deg * width / 360.0))
    across = np.fft.rfft(column_wise, axis=1) * _gaussian(waves)[:, :, None]
    spread = np.maximum(np.fft.irfft(across, n=width, axis=1), 0.0).astype(np.float32)
    wanted, held = energy(environment), energy(spread)
    spread *= np.divide(wanted, held, out=np.ones_like(wanted), where=held > 0).astype(np.float32)
    return np.asarray(environment + np.float32(part) * (spread - environment), dtype=np.float32)


def _gaussian(waves: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Fourier transform of a Gaussian, for frequency times standard deviation."""
    return np.exp(-2.0 * (np.pi * np.minimum(waves, 4.0)) ** 2)


def develop(
    environment: FloatImage,
    camera: CameraModel,
    exposure: Exposure,
    *,
    seed: int = 0,
    bloom: float = 0.0,
    bloom_deg: float = 1.0,
    **options: Any,
) -> NDArray[np.uint8]:
    """Take a frame without storing it.

    Args:
        environment: As in `shoot`.
        bloom: Share of the light that the lens spreads, 0 to 1; `bloom_deg` is its standard
            deviation.
        **options: The attributes of `ShotOptions`.

    Returns:
        (rows, columns, 3) uint8. Coded red, green and blue.
    """
    light = bloomed(environment, bloom, bloom_deg) if bloom else environment
    shot = Shot(**options)
    shape = shot.shape or (light.shape[0], light.shape[1])
    view = view_of(light, shape, smooth=shot.smooth, rotation=shot.rotation(camera))
    curves = shot.curve if isinstance(shot.curve, tuple) else (shot.curve,) * 3
    tables = tuple(curve.table() for curve in curves)
    return exposure_maker.expose(view, camera, exposure, shot, tables, seed=seed)


def shoot(
    environment: FloatImage,
    camera: CameraModel,
    exposure: Exposure,
    *,
    seed: int = 0,
    bloom: float = 0.0,
    bloom_deg: float = 1.0,
    quality: int = 95,
    subsampling: str = "4:2:0",
    edit_tags: TagEdit | None = None,
    **options: Any,
) -> bytes:
    """Take a frame and encode it like the camera.

    Args:
        environment: (H, 2 H, 3) float32. Linear Rec. 709 light, `ShotOptions.scale` cd/m2 per unit,
            finite and not negative.

    Raises:
        ValueError: If sizes do not fit (`optics.view_of`), or quality, subsampling or gains are
            invalid.
    """
    shot = Shot(**options)
    picture = develop(
        environment, camera, exposure, seed=seed, bloom=bloom, bloom_deg=bloom_deg, **options
    )
    data = jpeg(picture, quality, subsampling)
    shape = (picture.shape[0], picture.shape[1])
    truth = shot.tags(camera, exposure, shape)
    tags = truth if edit_tags is None else edit_tags(truth)
    return data if tags is None else with_segments(data, segments_of(tags))


def make_bracket(
    environment: FloatImage | Sequence[FloatImage],
    camera: CameraModel,
    exposures: Sequence[Exposure],
    *,
    seed: int = 0,
    shifts: Sequence[NDArray[np.float64] | None] | None = None,
    edits: Sequence[TagEdit | None] | None = None,
    **options: Any,
) -> list[bytes]:
    """Take a bracket.

    Args:
        environment: (H, 2 H, 3) float32, or one per frame if something moves between the frames.
        shifts: (3, 3) float64 or None each. `ShotOptions.shift` of each frame.
        **options: Options of `shoot`, the same for all frames. The time stamps start at `taken`, 3
            seconds apart plus the exposure times.

    Raises:
        ValueError: If a sequence has another length than `exposures`, or as in `shoot`.
    """
    count = len(exposures)
    places = [environment] * count if isinstance(environment, np.ndarray) else list(environment)
    turns = [options.get("shift")] * count if shifts is None else list(shifts)
    words = [options.get("edit_tags")] * count if edits is None else list(edits)
    if not len(places) == len(turns) == len(words) == count:
        raise ValueError(f"{count} exposures need as many environments, shifts and edits")
    frames = []
    taken = datetime.strptime(options.get("date_time", Shot().date_time), _STAMP)
    for index, exposure in enumerate(exposures):
        own = {
            **options,
            "shift": turns[index],
            "edit_tags": words[index],
            "date_time": taken.strftime(_STAMP),
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
    **options: Any,
) -> list[Path]:
    """Take a bracket and save it with a camera's file names: R0010001.JPG and so on.

    Raises:
        CoreError: If a file cannot be written; every file is written atomically.
        ValueError: As in `make_bracket`.
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
