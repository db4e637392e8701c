"""What each Ricoh Theta is and accepts: the one table of cameras.

The planner of brackets, the client (`app.devices.profiles`) and the simulated cameras
(`app.devices.simulated.cameras`) read it, each in its own way: a row here makes a model known
to all three. Exposure times, ISO and apertures are those of the manual program, digit for digit as
Ricoh's Web API v2.1 states them (options/shutter_speed.md, iso.md, aperture.md); where a camera
states its own lists (`shutterSpeedSupport` and so on), those are better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.core.hdr.planner import CameraLimits

Preview = tuple[int, int, int]
"""Width, height and frames per second of a live preview."""

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
class CameraFacts:
    """One model.

    * `name`: "S", "SC", "SC2", "V", "Z1", "X" or "A1".
    * `sizes`: rows and columns of its panoramas, the largest first.
    * `overhead_s`: time a frame takes besides its exposure, in seconds.
    * `native_bracket`: whether it takes a bracket by itself, of `max_shots` at most.
    * `by_method`: whether its bracket is chosen by `_shootingMethod`.
    * `old_bracket`: whether the frames of its bracket name neither program nor white balance.
    * `watched`: whether it never says that its bracket is done.
    * `switches_api`: whether it wakes up in API 2.0 and must be switched to 2.1.
    * `previews`: what it accepts, the best for looking first; none where the camera reports zeros.
    * `user_prefix`: letters before the serial number in its user name; "" where not known.
    * `stitching`: whether seam and level of one picture can be kept for the next.
    * `documented`: whether these values are the maker's.
    * `sensor`: the model whose sensor a simulated camera of this one has; its own where empty.
    """

    name: str
    limits: CameraLimits
    sizes: tuple[tuple[int, int], ...] = ((2688, 5376),)
    overhead_s: float = 3.0
    native_bracket: bool = True
    max_shots: int = 13
    by_method: bool = False
    old_bracket: bool = False
    watched: bool = False
    switches_api: bool = False
    previews: tuple[Preview, ...] = ((1024, 512, 30),)
    user_prefix: str = ""
    password: bool = False
    stitching: bool = False
    documented: bool = True
    model: str = ""
    sensor: str = ""

    @property
    def stated(self) -> str:
        """The model as the camera states it: "RICOH THETA V"."""
        return self.model or f"RICOH THETA {self.name}"


def _limits(
    shortest_s: float, isos: tuple[float, float], *apertures: float, times: tuple[float, ...] = ()
) -> CameraLimits:
    """Cut Ricoh's lists to what a model has of them; `times` is another list than Ricoh's."""
    return CameraLimits(
        tuple(time for time in times or _SHUTTERS if shortest_s <= time),
        tuple(iso for iso in _ISOS if isos[0] <= iso <= isos[1]),
        apertures,
    )


# 1/12800 instead of 1/12500, and 40 and 50 s, which V and Z1 have by newer firmware only.
_X_SHUTTERS: Final = tuple(sorted({*_SHUTTERS, 0.00007812, 40.0, 50.0} - {0.00008}))
_FAST_PREVIEWS: Final = ((1024, 512, 30), (1024, 512, 8), (1920, 960, 8), (640, 320, 30))

# Overhead: a Z1 took 40 s for 11 frames of 13 s exposure in sum. For three indoor frames reports
# say 8 to 15 s (V, Z1, X) and 20 to 30 s (S, SC, SC2); single shots of an A1 are 3 s apart, to
# which the second that the camera wants after every change of options is added.
_S: Final = CameraFacts(
    "S",
    _limits(0.00015625, (100, 1600), 2.0),
    sizes=((2688, 5376), (1024, 2048)),
    overhead_s=8.0,
    old_bracket=True,
    switches_api=True,
    previews=((640, 320, 10),),
)
_X: Final = CameraFacts(
    "X",
    _limits(0.0000625, (50, 3200), 2.4, times=_X_SHUTTERS),
    sizes=((5504, 11008), (2752, 5504)),
    by_method=True,
    previews=((1024, 512, 30), (1920, 960, 30), (512, 512, 30)),
    user_prefix="YR",
    password=True,
    stitching=True,
)
CAMERAS: Final = (
    _S,
    replace(_S, name="SC", limits=_limits(0.000125, (100, 1600), 2.0), sensor="S"),
    # Its lists are not documented: files show ISO 64, client programs allow 3200, and exposures
    # shorter than those of the SC are not known.
    CameraFacts(
        "SC2",
        _limits(0.000125, (64, 3200), 2.0),
        overhead_s=8.0,
        old_bracket=True,
        watched=True,
        previews=(),
        documented=False,
    ),
    CameraFacts(
        "V",
        _limits(0.0, (64, 3200), 2.0),
        previews=_FAST_PREVIEWS,
        user_prefix="YL",
        password=True,
        stitching=True,
    ),
    CameraFacts(
        "Z1",
        _limits(0.0, (80, 6400), 2.1, 3.5, 5.6),
        sizes=((3360, 6720),),
        overhead_s=2.4,
        max_shots=19,
        previews=_FAST_PREVIEWS,
        user_prefix="YN",
        password=True,
        stitching=True,
    ),
    _X,
    # Ricoh's tables say "X or later".
    replace(
        _X,
        name="A1",
        model="RICOH360 THETA A1",
        sensor="X",
        overhead_s=4.0,
        native_bracket=False,
        by_method=False,
        previews=((1024, 512, 30), (1024, 512, 10)),
        user_prefix="",
        documented=False,
    ),
)
"""All models, oldest first."""


def camera_facts(model: str) -> CameraFacts | None:
    """Find a model by the name that EXIF or the camera states, None where it is not in the table.

    `model` is for example "RICOH THETA SC2" or "Z1"; blanks around it and in it do not matter.

    Examples:
        >>> camera_facts("RICOH THETA Z1 ").limits.apertures
        (2.1, 3.5, 5.6)
    """
    words = model.upper().replace("RICOH360", "").replace("RICOH", "").replace("THETA", "").split()
    if not words:
        return None
    name = "SC2" if words[0] == "SC2B" else words[0]  # SC2 for business.
    return next((each for each in CAMERAS if each.name == name), None)
