"""Read the table of Ricoh Theta cameras and their settings, `resources/cameras/theta.toml`.

The bracket planner, the client (`app.devices.protocol_profiles`) and the simulated cameras
(`app.devices.simulated.cameras`) each use the table in their own way, so a new row adds a model to
all three. Exposure times, ISO values and apertures are those of the manual program, exactly as in
Ricoh's Web API v2.1 (options/shutter_speed.md, iso.md, aperture.md). If a camera reports its own
lists (`shutterSpeedSupport` and so on), those lists take precedence.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from app.core.base.errors import ProbeError
from app.core.base.paths import resources
from app.core.text import tr

Preview = tuple[int, int, int]
"""Width and height of a live preview, in pixels, and its number of frames per second."""


@dataclass(frozen=True, slots=True)
class CameraLimits:
    """Exposure settings that a camera accepts in its manual program.

    Exposure times are in seconds, exactly as they must be sent to the camera. The values may be in
    any order.

    Raises:
        ProbeError: If a list is empty or contains an invalid value.
    """

    shutters_s: tuple[float, ...]
    isos: tuple[float, ...]
    apertures: tuple[float, ...]

    def __post_init__(self) -> None:
        if not _valid(self.shutters_s):
            raise ProbeError(tr("The camera sent an empty or invalid list of shutter speeds."))
        if not _valid(self.isos):
            raise ProbeError(tr("The camera sent an empty or invalid list of ISO values."))
        if not _valid(self.apertures):
            raise ProbeError(tr("The camera sent an empty or invalid list of apertures."))


def _valid(values: Sequence[float]) -> bool:
    return bool(values) and all(0.0 < value < math.inf for value in values)


@dataclass(frozen=True, slots=True)
class CameraFacts:
    """Facts about one camera model.

    Attributes:
        name: "S", "SC", "SC2", "V", "Z1", "X" or "A1".
        sizes: Rows and columns of the camera's panoramas, largest first.
        overhead_s: Time that each frame takes in addition to its exposure, in seconds.
        native_bracket: Whether a single command makes the camera shoot a bracket of at most
            `max_shots` frames.
        by_method: Whether the bracket must be selected with `_shootingMethod`.
        old_bracket: Whether the frames in a bracket are requested without a program or a white
            balance.
        watched: Whether the camera must be watched because it never reports the end of a bracket.
        switches_api: Whether the camera starts in API 2.0 and must be switched to 2.1.
        previews: Accepted preview formats, the best for viewing first, or an empty tuple if the
            camera reports only zeros.
        user_prefix: Letters before the serial number in the camera's user name, or "" if they are
            unknown.
        stitching: Whether the seam and the levelling of one picture can be kept for the next one.
        sensor: Model whose sensor the simulated camera uses, or "" for the camera's own sensor.
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
    model: str = ""
    sensor: str = ""

    @property
    def model_text(self) -> str:
        """The model as the camera reports it, for example "RICOH THETA V"."""
        return self.model or f"RICOH THETA {self.name}"


def tuples(value: Any) -> Any:
    """Convert all lists in a value to tuples."""
    return tuple(map(tuples, value)) if isinstance(value, list) else value


def _read() -> tuple[CameraFacts, ...]:
    table = tomllib.loads((resources() / "cameras" / "theta.toml").read_text(encoding="utf-8"))
    shutters, isos = table.pop("shutters_s"), table.pop("isos")
    cameras: dict[str, CameraFacts] = {}
    for name, row in table.items():
        like = cameras.get(row.pop("like", ""))
        facts: dict[str, Any] = {}
        if "isos" in row:
            least, most = row.pop("isos")
            # A time in `other_shutters_s` is removed if it is in the list, and added if it is not.
            times = {*shutters} ^ {*row.pop("other_shutters_s", ())}
            shortest = row.pop("shortest_s", 0.0)
            facts["limits"] = CameraLimits(
                tuple(sorted(time for time in times if shortest <= time)),
                tuple(iso for iso in isos if least <= iso <= most),
                tuple(row.pop("apertures")),
            )
        facts |= {"name": name} | {field: tuples(value) for field, value in row.items()}
        cameras[name] = CameraFacts(**facts) if like is None else replace(like, **facts)
    return tuple(cameras.values())


CAMERAS: Final = _read()
"""All camera models, oldest first."""


def camera_facts(model: str) -> CameraFacts | None:
    """Return a model by the name that EXIF or the camera reports, or None if it is unknown.

    Args:
        model: Name such as "RICOH THETA SC2" or "Z1". Extra spaces do not matter.

    Examples:
        >>> camera_facts("RICOH THETA Z1 ").limits.apertures
        (2.1, 3.5, 5.6)
    """
    words = model.upper().replace("RICOH360", "").replace("RICOH", "").replace("THETA", "").split()
    if not words:
        return None
    name = "SC2" if words[0] == "SC2B" else words[0]  # The SC2B is the SC2 for business.
    return next((each for each in CAMERAS if each.name == name), None)
