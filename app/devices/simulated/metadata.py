"""What camera._getMetadata tells of a file."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from app.devices.simulated.replies import CommandRefused

if TYPE_CHECKING:
    from app.core.hdr.frame import Exposure
    from app.devices.simulated.personality import Personality
    from app.devices.simulated.replies import JsonValue
    from app.devices.simulated.storage import StoredFile


def metadata_of(person: Personality, file: StoredFile) -> dict[str, JsonValue]:
    """Describe a file.

    Raises
    ------
    CommandRefused
        invalidParameterValue for a file that the camera did not take.
    """
    take = file.take
    if take is None:
        raise CommandRefused("invalidParameterValue")
    rows, columns = file.shape
    wrong, no_size = person.metadata == "wrong", person.metadata == "no-size"
    exif: dict[str, JsonValue] = {
        "ExifVersion": "0231",
        "DateTime": take.taken,
        "Make": person.camera.make.strip(),
        "Model": person.camera.model.strip(),
        "Software": person.camera.software.strip(),
        "ExposureProgram": take.program,
        "ExposureTime": 0.004 if wrong else take.exposure.shutter_s,
        "PhotographicSensitivity": 0 if wrong else int(take.exposure.iso),
        "FNumber": take.exposure.aperture,
        "ExposureBiasValue": 0.0,
        # The X has the words and no values for them.
        "ApertureValue": 0 if no_size else round(2.0 * math.log2(take.exposure.aperture), 2),
        "BrightnessValue": 0 if no_size else _brightness(take.exposure),
        "Flash": 32,
        "Compression": 6,
        "ColorSpace": 1,
        "Orientation": 1,
        "WhiteBalance": int(take.fixed_balance),
    }
    if person.metadata == "full":
        exif |= {"ImageWidth": columns, "ImageLength": rows}
    xmp: dict[str, JsonValue] = {
        "ProjectionType": "equirectangular",
        "UsePanoramaViewer": True,
        "CroppedAreaImageHeightPixels": rows,
        "CroppedAreaImageWidthPixels": columns,
        "CroppedAreaLeftPixels": 0,
        "CroppedAreaTopPixels": 0,
        "FullPanoHeightPixels": rows,
        "FullPanoWidthPixels": columns,
    }
    return {"exif": exif, "xmp": xmp}


def _brightness(exposure: Exposure) -> float:
    """APEX: Av + Tv - Sv, as if the frame were rightly exposed."""
    speed = math.log2(exposure.iso / 3.125)
    return round(2.0 * math.log2(exposure.aperture) - math.log2(exposure.shutter_s) - speed, 2)
