"""Save and read the light of a place with every bit preserved.

The light of a new place is rounded to half floats before anything is computed from it (`storable`).
It can then be stored exactly in a third of the space. Other light, such as that of earlier places,
is saved as 32-bit OpenEXR. A file is read back and compared before it gets its final name. The name
contains the first digits of the checksum, so new light never replaces an existing file.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.arrays import Bytes, Float32
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.imaging.image_input import stated_scale
from app.core.base.imaging.images import write_exr, write_half_exr, write_png
from app.core.base.remarks import Remark
from app.core.base.sphere import bounded
from app.core.environment.environment import Environment, from_radiance
from app.core.environment.environment_file import MAX_WIDTH, MIN_WIDTH, read_panorama
from app.core.measure.finish.display import display_panorama
from app.core.places.files.originals import ORIGINALS
from app.core.places.place import Place, PlaceError
from app.core.places.place_folder import THUMBNAIL, capture_folders
from app.core.places.remarks import LightChanged
from app.core.places.saved.place_json import ENVIRONMENT_NAME
from app.core.text import tr

_THUMBNAIL_WIDTH: Final = 512
# Half floats end at 65504, which readers may interpret as sensor clipping.
_LARGEST: Final = 2.0**15
_COMPARED_BYTES: Final = 1 << 28  # bytes; larger arrays would exceed memory if compared as a copy


@dataclass(frozen=True, slots=True)
class StoredLight:
    """The saved environment of a place."""

    environment: str
    fingerprint: str
    # the thumbnail, or None if it could not be written, which only affects lists
    thumbnail: Path | None


def store_environment(
    folder: Path,
    radiance: FloatImage,
    display: Bytes | None = None,
    *,
    white_cd_m2: float | None = None,
    rough: bool = False,
    shares: Mapping[str, Float32] | None = None,
) -> StoredLight:
    """Save the light of a place. `read_light` will return exactly the same values.

    Afterwards, the file must be named in ``place.json`` (`write_place`). Until then, the place
    keeps its old light.

    Args:
        radiance: (H, 2 H, 3) float32. Linear Rec. 709 relative radiance, as in
            `environment.environment.Environment`: finite, non-negative and not zero everywhere. The
            array is not changed.
        display: (h, w, 3) uint8. The panorama in sRGB, for the thumbnail. By default, it is
            computed from the radiance.
        white_cd_m2: Luminance of radiance 1, in cd/m2, to record in the file.
        rough: Whether much of the light is estimated, to record in the file.
        shares: Clipped light and gaps (see `app.core.environment.environment.kept_shares`).

    Raises:
        PlaceError: If the radiance is not such an environment, or if the disk fails or returns data
            that differ from what was written. In that case, nothing has changed.
    """
    _check(radiance)
    fingerprint = fingerprint_of(radiance)
    name = f"environment-{fingerprint[:12]}.exr"

    def check(path: Path) -> None:
        _compare(path, radiance)

    scale = next((each for each in (1.0, _scale(radiance)) if _holds(radiance, each)), None)
    try:
        if scale is None or shares:
            write_exr(folder / name, radiance, white_cd_m2, check, rough=rough, shares=shares)
        else:
            write_half_exr(folder / name, radiance, scale, white_cd_m2, check, rough)
    except PlaceError:
        raise
    except CoreError as error:
        raise PlaceError(
            tr("The light was not saved. {message}", message=error.message),
            tr("It is still in memory. Free some space or choose another folder, then save again."),
        ) from error
    preview = display_panorama(radiance, width=_THUMBNAIL_WIDTH) if display is None else display
    return StoredLight(name, fingerprint, _write_thumbnail(folder, preview))


def storable(radiance: FloatImage) -> FloatImage:
    """Round radiance to half floats, to within 0.05% of each value.

    Values below 2**-14, which is 12 stops below a grey wall, are rounded more coarsely.

    Args:
        radiance: (H, W, 3) float32. Linear Rec. 709 radiance, finite and non-negative.
    """
    scale = 1.0 if 1.0 <= float(radiance.max()) <= _LARGEST else _scale(radiance)
    return _rounded(radiance, scale)


def _scale(radiance: FloatImage) -> float:
    """Return the power of two that brings the largest value just below `_LARGEST`."""
    largest = float(radiance.max())
    exponent = math.ceil(math.log2(largest)) if largest > 0.0 else 0
    return 2.0 ** (exponent - round(math.log2(_LARGEST)))


def _rounded(radiance: FloatImage, scale: float) -> FloatImage:
    factor = np.float32(scale)
    # Exact except for the rounding to half floats, since the factor is a power of two.
    halves = (radiance / factor).astype(np.float16).astype(np.float32)
    with np.errstate(over="ignore"):
        rounded: FloatImage = halves * factor
    # The largest float, rounded up, would be infinite.
    return np.minimum(rounded, np.finfo(np.float32).max, out=rounded)


def _holds(radiance: FloatImage, scale: float) -> bool:
    """Return whether half floats preserve every bit of the radiance."""
    if not np.finfo(np.float32).tiny <= scale or float(radiance.max()) > _LARGEST * scale:
        return False
    wide = np.ascontiguousarray(radiance)
    return np.array_equal(_rounded(wide, scale).view(np.uint32), wide.view(np.uint32))


def fingerprint_of(radiance: FloatImage) -> str:
    """Return the SHA-256 checksum of an environment's size and radiance.

    Args:
        radiance: (H, W, 3) float32. Linear Rec. 709 radiance.
    """
    little = np.ascontiguousarray(radiance, dtype="<f4")
    total = hashlib.sha256(f"{little.shape}".encode())
    total.update(little.data)
    return total.hexdigest()


def read_light(folder: Path, place: Place) -> tuple[Environment, tuple[Remark, ...]]:
    """Read the light of a place.

    Returns:
        The environment and the remarks. If the file is not the one from which the results were
        computed, a remark says so, and the results must be recomputed.

    Raises:
        PlaceError: If the place has no light, or if its file is missing or damaged. The hint says
            what to do.
    """
    if not place.environment:
        raise PlaceError(
            tr("No light has been measured at “{name}” yet.", name=place.name), _next_step(folder)
        )
    if re.fullmatch(ENVIRONMENT_NAME, place.environment) is None:
        raise PlaceError(
            tr("The light of “{name}” is stored under an invalid file name.", name=place.name),
            _next_step(folder),
        )
    path = folder / place.environment
    if not path.is_file():
        raise PlaceError(
            tr(
                "The light of “{name}” is missing: there is no {file} in {folder}.",
                name=place.name,
                file=place.environment,
                folder=folder,
            ),
            _next_step(folder),
        )
    try:
        panorama = read_panorama(path)
        environment = replace(
            from_radiance(_scaled(panorama.radiance, path), place.name),
            rough=panorama.rough,
            clipped=panorama.clipped,
            unseen=panorama.unseen,
        )
    except EnvironmentFileError as error:
        raise PlaceError(
            tr(
                "The light of “{name}” cannot be read. {message}",
                name=place.name,
                message=error.message,
            ),
            _next_step(folder),
        ) from error
    remarks = environment.repairs.remarks(place.name)
    if place.fingerprint and fingerprint_of(environment.radiance) != place.fingerprint:
        return environment, (*remarks, LightChanged(place.environment))
    return environment, remarks


def _next_step(folder: Path) -> str:
    originals = folder / ORIGINALS
    if any((each / ORIGINALS).is_dir() for each in capture_folders(folder)):
        return tr(
            "The camera’s files are still here. Merge them again, or capture the place again."
        )
    try:
        if any(not each.name.startswith(".") for each in originals.iterdir()):
            return tr(
                "The originals are in {originals}. Merge them again, or capture the place again.",
                originals=originals,
            )
    except OSError:
        pass
    return tr("Capture the place, or open a panorama or a bracket.")


def _check(radiance: FloatImage) -> None:
    shape = radiance.shape
    if radiance.dtype != np.float32 or radiance.ndim != 3 or shape[2] != 3:
        raise PlaceError(tr("The light was not saved: it is not a 32-bit RGB picture."))
    if shape[1] != 2 * shape[0] or not MIN_WIDTH <= shape[1] <= MAX_WIDTH:
        raise PlaceError(
            tr(
                "The light was not saved: {width} x {height} is not a full panorama.",
                width=shape[1],
                height=shape[0],
            )
        )
    # Computed from the extremes, which are NaN if any value is.
    least, largest = float(radiance.min()), float(radiance.max())
    if not (least >= 0.0 and 0.0 < largest < np.inf):
        raise PlaceError(
            tr("The light was not saved: it is black, or has negative or infinite values.")
        )


def _read(path: Path) -> FloatImage:
    return _scaled(read_panorama(path).radiance, path)


def _scaled(radiance: FloatImage, path: Path) -> FloatImage:
    scale = stated_scale(path)
    return radiance if scale == 1.0 else radiance * np.float32(scale)


def _compare(path: Path, radiance: FloatImage) -> None:
    if radiance.nbytes > _COMPARED_BYTES:
        return
    again = _read(path)
    # Compare bits, since 0.0 and -0.0 are equal as numbers.
    if not np.array_equal(again.view(np.uint32), np.ascontiguousarray(radiance).view(np.uint32)):
        raise PlaceError(
            tr("The light was not saved: the disk returned different data from what was written."),
            tr("This disk may be failing. Choose another places folder in Settings."),
        )


def _write_thumbnail(folder: Path, display: Bytes) -> Path | None:
    target = folder / THUMBNAIL
    try:
        write_png(target, bounded(display, _THUMBNAIL_WIDTH))
    except CoreError:
        return None
    return target
