"""The 360 cameras that can be simulated: their files' words and their sensors.

What a camera writes (maker, padded model, software, sizes, apertures) is what public sample
files of that model hold. The sensor numbers are typical of sensors of that pitch, since Ricoh
publishes none: they set the scale of the noise and nothing else. Which shutter and ISO values
a model accepts is not repeated here (`app.core.hdr.camera_table`); exposures are taken as given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class CameraModel:
    """One model of camera.

    Attributes:
        shape: Rows and columns of its full-sized panorama.
        base_iso: Lowest sensitivity, at which `full_well` electrons saturate a pixel.
        full_well: Electrons of one panorama pixel at saturation and base ISO. Twice the ISO: half
            of them.
        channel_gains: By how much red, green and blue are amplified more than green for a neutral
            picture; they make red and blue noisier.
        lens_words: 16-bit words per lens in maker note tag 0x0101: 2 up to the V, 1 in the X.
    """

    name: str
    make: str
    model: str
    software: str
    shape: tuple[int, int]
    apertures: tuple[float, ...]
    base_iso: float
    full_well: float
    read_noise: float
    channel_gains: tuple[float, float, float] = (1.8, 1.0, 1.6)
    levels_itself: bool = True
    maker_note: bool = True
    lens_words: int = 2


THETA_S: Final = CameraModel(
    name="S",
    make="RICOH".ljust(21),
    model="RICOH THETA S".ljust(63),
    software="RICOH THETA S Ver 1.82".ljust(31),
    shape=(2688, 5376),
    apertures=(2.0,),
    base_iso=100.0,
    full_well=6000.0,
    read_noise=4.0,
    levels_itself=False,
)
THETA_SC2: Final = CameraModel(
    name="SC2",
    make="RICOH",
    model="RICOH THETA SC2".ljust(16),
    software="RICOH THETA SC2 Ver 01.42",
    shape=(2688, 5376),
    apertures=(2.0,),
    base_iso=64.0,
    full_well=7500.0,
    read_noise=3.5,
)
THETA_V: Final = CameraModel(
    name="V",
    make="RICOH",
    model="RICOH THETA V".ljust(16),
    software="RICOH THETA V Ver 3.30.1",
    shape=(2688, 5376),
    apertures=(2.0,),
    base_iso=64.0,
    full_well=7500.0,
    read_noise=3.5,
)
THETA_Z1: Final = CameraModel(
    name="Z1",
    make="RICOH",
    model="RICOH THETA Z1".ljust(16),
    software="RICOH THETA Z1 Ver 2.10.3",
    shape=(3360, 6720),
    apertures=(2.1, 3.5, 5.6),
    base_iso=80.0,
    full_well=15000.0,
    read_noise=3.0,
)
THETA_X: Final = CameraModel(
    name="X",
    make="RICOH",
    model="RICOH THETA X".ljust(14),
    software="RICOH THETA X Ver 2.80.1",
    shape=(5504, 11008),
    apertures=(2.4,),
    base_iso=50.0,
    full_well=5000.0,
    read_noise=2.5,
    lens_words=1,
)
GENERIC: Final = CameraModel(
    name="generic",
    make="Turnlight",
    model="Simulated 360",
    software="Simulated 360 1.0",
    shape=(2048, 4096),
    apertures=(2.0, 2.8, 4.0, 5.6, 8.0),
    base_iso=100.0,
    full_well=20000.0,
    read_noise=3.0,
    levels_itself=False,
    maker_note=False,
)
CAMERAS: Final = (THETA_S, THETA_SC2, THETA_V, THETA_Z1, THETA_X, GENERIC)
"""All simulated models."""


def camera_named(name: str) -> CameraModel:
    """Find a camera by its short name.

    Args:
        name: "S", "SC2", "V", "Z1", "X" or "generic", in any case.

    Raises:
        ValueError: When there is none of that name.

    Examples:
        >>> camera_named("z1").model
        'RICOH THETA Z1  '
    """
    for camera in CAMERAS:
        if camera.name.casefold() == name.strip().casefold():
            return camera
    known = ", ".join(camera.name for camera in CAMERAS)
    raise ValueError(f"there is no camera {name!r}; known: {known}")
