"""What each Ricoh Theta accepts in its manual program, where the camera cannot be asked.

A camera states its own lists (`shutterSpeedSupport`, `isoSupport`, `apertureSupport`, in the
manual program), and these are better. The values here are those of Ricoh's Web API v2.1
(options/shutter_speed.md, iso.md, aperture.md); they are written as the camera expects them, digit
for digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.core.hdr.planner import CameraLimits

# fmt: off
_SHUTTERS: Final = (
    0.00004, 0.00005, 0.0000625, 0.00008, 0.0001, 0.000125, 0.00015625, 0.0002, 0.00025,
    0.0003125, 0.0004, 0.0005, 0.000625, 0.0008, 0.001, 0.00125, 0.0015625, 0.002, 0.0025,
    0.003125, 0.004, 0.005, 0.00625, 0.008, 0.01, 0.0125, 0.01666666, 0.02, 0.025, 0.03333333,
    0.04, 0.05, 0.06666666, 0.07692307, 0.1, 0.125, 0.16666666, 0.2, 0.25, 0.33333333, 0.4, 0.5,
    0.625, 0.76923076, 1.0, 1.3, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 15.0, 20.0,
    25.0, 30.0, 60.0,
)
_ISOS: Final = (
    50.0, 64.0, 80.0, 100.0, 125.0, 160.0, 200.0, 250.0, 320.0, 400.0, 500.0, 640.0, 800.0,
    1000.0, 1250.0, 1600.0, 2000.0, 2500.0, 3200.0, 4000.0, 5000.0, 6400.0,
)
# fmt: on


@dataclass(frozen=True, slots=True)
class ThetaLimits:
    """One model by its short name: "S", "SC", "SC2", "V", "Z1", "X" or "A1".

    `overhead_s` is the time a frame takes besides its exposure, in seconds.
    """

    model: str
    limits: CameraLimits
    max_shots: int
    native_bracket: bool
    overhead_s: float
    documented: bool = True


def _between(low: float, high: float, values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(value for value in values if low <= value <= high)


def _shutters_of_x() -> tuple[float, ...]:
    """1/12800 instead of 1/12500, and 40 and 50 s, which V and Z1 have by newer firmware only."""
    shared = [time for time in _between(0.0000625, 60.0, _SHUTTERS) if time != 0.00008]
    return tuple(sorted([*shared, 0.00007812, 40.0, 50.0]))


_X: Final = CameraLimits(_shutters_of_x(), _between(50.0, 3200.0, _ISOS), (2.4,))

# Overhead: a Z1 took 40 s for 11 frames of 13 s exposure in sum. For three indoor frames reports
# say 8 to 15 s (V, Z1, X) and 20 to 30 s (S, SC, SC2); single shots of an A1 are 3 s apart, to
# which the second that the camera wants after every change of options is added.
THETA_MODELS: Final = (
    ThetaLimits(
        "S",
        CameraLimits(_between(0.00015625, 60.0, _SHUTTERS), _between(100.0, 1600.0, _ISOS), (2.0,)),
        13,
        True,
        8.0,
    ),
    ThetaLimits(
        "SC",
        CameraLimits(_between(0.000125, 60.0, _SHUTTERS), _between(100.0, 1600.0, _ISOS), (2.0,)),
        13,
        True,
        8.0,
    ),
    # Its lists are not documented: files show ISO 64, client programs allow 3200, and exposures
    # shorter than those of the SC are not known.
    ThetaLimits(
        "SC2",
        CameraLimits(_between(0.000125, 60.0, _SHUTTERS), _between(64.0, 3200.0, _ISOS), (2.0,)),
        13,
        True,
        8.0,
        documented=False,
    ),
    ThetaLimits(
        "V",
        CameraLimits(_SHUTTERS, _between(64.0, 3200.0, _ISOS), (2.0,)),
        13,
        True,
        3.0,
    ),
    ThetaLimits(
        "Z1",
        CameraLimits(_SHUTTERS, _between(80.0, 6400.0, _ISOS), (2.1, 3.5, 5.6)),
        19,
        True,
        2.4,
    ),
    ThetaLimits("X", _X, 13, True, 3.0),
    # Ricoh's tables say "X or later".
    ThetaLimits("A1", _X, 13, False, 4.0, documented=False),
)
"""All models, oldest first."""


def theta_limits(model: str) -> ThetaLimits | None:
    """Find a model by the name that EXIF or the camera states; None for cameras not in the table.

    >>> theta_limits("RICOH THETA Z1 ").limits.apertures
    (2.1, 3.5, 5.6)
    """
    words = model.upper().replace("RICOH360", "").replace("RICOH", "").replace("THETA", "").split()
    if not words:
        return None
    name = "SC2" if words[0] == "SC2B" else words[0]  # SC2 for business.
    return next((each for each in THETA_MODELS if each.model == name), None)
