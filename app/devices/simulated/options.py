"""The options of a simulated camera: their values, the values allowed, and the program's effect."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Final

from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused, JsonValue
from app.devices.simulated.scene import nearest

MANUAL: Final = 1
_AUTO_MOST_S: Final = 8.0
_READ_ONLY: Final = frozenset(
    {"remainingPictures", "remainingSpace", "remainingVideoSeconds", "totalSpace"}
)
_WHICH_PROGRAMS: Final = {"iso": (1, 9), "shutterSpeed": (1, 4), "aperture": (1, 3)}
"""Exposure programs in which the user sets each value. In others, the value is 0 (automatic)."""


class OptionStore:
    """All options of one camera.

    A subclass may override `support`, `allows` and `allows_bracket` to accept fewer values.
    """

    def __init__(self, personality: Personality) -> None:
        self._person = personality
        self._manual: dict[str, JsonValue] = {}
        self.values: dict[str, JsonValue] = {}
        self.reset()

    def reset(self) -> None:
        """Restore the settings that the camera has after power-on."""
        person = self._person
        self._manual = {
            "iso": nearest(400, person.isos),
            "shutterSpeed": nearest(0.004, person.shutters),
            "aperture": person.apertures[0],
        }
        self.values.clear()
        self.values.update(_defaults(person))
        self._follow_program()

    @property
    def program(self) -> int:
        """The current exposure program."""
        return whole(self.values["exposureProgram"])

    @property
    def method(self) -> str:
        """Shooting method of the X, or "normal" for other models."""
        return str(self.values.get("_shootingMethod", "normal"))

    def get(self, names: Sequence[str], live: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
        """Read options.

        Raises:
            CommandRefused: With the code invalidParameterName if this model lacks an option.
        """
        return {name: self._one(name, live) for name in names}

    def set(self, changes: Mapping[str, JsonValue]) -> None:
        """Change all of the given options, or none of them.

        Raises:
            CommandRefused: With the code invalidParameterName if an option does not exist or is
                read-only, or invalidParameterValue if a value is not allowed.
        """
        before = copy.deepcopy(self.values), dict(self._manual)
        try:
            self._apply(changes)
        except CommandRefused:
            self.values.clear()
            self.values.update(before[0])
            self._manual = before[1]
            raise

    def support(self, name: str, program: int | None = None) -> tuple[JsonValue, ...]:
        """Return the values that an option accepts, or an empty tuple if it has no list."""
        if name in _WHICH_PROGRAMS:
            return self._exposure_support(name, self.program if program is None else program)
        return _supports(self._person).get(name, ())

    def _one(self, name: str, live: Mapping[str, JsonValue]) -> JsonValue:
        if name in live:
            return live[name]
        if name in self.values and name not in {"_password", "_username"}:
            return copy.deepcopy(self.values[name])
        option = name.removesuffix("Support")
        if name != option and option in self.values and (values := self.support(option)):
            return copy.deepcopy(list(values))
        if name == "_shootingMethodSupport" and self._person.digest:
            return []
        if name == "_bracketNumberSupport" and self._person.bracket is not None:
            return {"minNumber": 2, "maxNumber": self._person.bracket.most, "stepSize": 1}
        raise CommandRefused("invalidParameterName")

    def _apply(self, changes: Mapping[str, JsonValue]) -> None:
        # Set the program first, since the lists of the other options depend on it.
        for name in sorted(changes, key=lambda key: key != "exposureProgram"):
            if name not in self.values or name in _READ_ONLY:
                raise CommandRefused("invalidParameterName", f"There is no option {name!r:.40}.")
            if not self.allows(name, changes[name]):
                value = changes[name]
                raise CommandRefused("invalidParameterValue", f"{name} cannot be {value!r:.60}.")
            self.values[name] = copy.deepcopy(changes[name])
            self._settle(name)

    def _settle(self, name: str) -> None:
        """Update the options that depend on the option just set."""
        if name == "exposureProgram":
            self._follow_program()
        elif name in self._manual and self.program in _WHICH_PROGRAMS[name]:
            self._manual[name] = self.values[name]
        elif name == "_function" and "_shootingMethod" in self.values:
            self.values["_shootingMethod"] = "normal"
        elif name == "_filter" and self.values[name] != "off":
            self.values["exposureProgram"] = 2
            self._follow_program()

    def _follow_program(self) -> None:
        for name, manual in self._manual.items():
            own = self.program in _WHICH_PROGRAMS[name] or (
                name == "aperture" and len(self._person.apertures) == 1
            )
            self.values[name] = manual if own else 0
        if self.program == MANUAL:
            self.values["exposureCompensation"] = 0.0

    def _exposure_support(self, name: str, program: int) -> tuple[JsonValue, ...]:
        person = self._person
        if name == "aperture" and len(person.apertures) == 1:
            return person.apertures
        if program not in _WHICH_PROGRAMS[name]:
            return (0,)
        if name == "shutterSpeed":
            limit = math.inf if program == MANUAL else _AUTO_MOST_S
            return tuple(time for time in person.shutters if time <= limit)
        return person.isos if name == "iso" else person.apertures

    def allows(self, name: str, value: JsonValue) -> bool:
        """Return whether an option accepts a value. An option without a list accepts any value."""
        if name == "_autoBracket":
            return self.allows_bracket(value)
        has_list = name in _WHICH_PROGRAMS or name in _supports(self._person)
        return not has_list or member(value, self.support(name))

    def allows_bracket(self, value: JsonValue) -> bool:
        """Return whether a value is a bracket whose number of shots the model accepts."""
        rules = self._person.bracket
        if rules is None or not isinstance(value, dict):
            return False
        number, shots = value.get("_bracketNumber"), value.get("_bracketParameters")
        if not isinstance(shots, list) or number != len(shots) or isinstance(number, bool):
            return False
        return 2 <= len(shots) <= rules.most and all(isinstance(shot, dict) for shot in shots)


def _defaults(person: Personality) -> dict[str, JsonValue]:
    rows, columns = person.sizes[0]
    values: dict[str, JsonValue] = {
        "captureMode": "image",
        "exposureProgram": 2,
        "exposureCompensation": 0.0,
        "iso": 0,
        "shutterSpeed": 0,
        "aperture": 0,
        "whiteBalance": "auto",
        "exposureDelay": 0,
        "sleepDelay": 180,
        "offDelay": 600,
        "dateTimeZone": "",
        "fileFormat": {"type": "jpeg", "width": columns, "height": rows},
        "previewFormat": _preview(*(person.previews or ((0, 0, 0),))[0]),
        "remainingPictures": 0,
        "remainingSpace": 0,
        "totalSpace": 0,
        "remainingVideoSeconds": 0,
        "gpsInfo": {"lat": 65535, "lng": 65535},
    }
    if person.ricoh:
        values.update(_ricoh_defaults(person))
    else:
        values["hdr"] = "off"
        values["exposureBracket"] = {"shots": 1, "increment": 0}
    return values


def _ricoh_defaults(person: Personality) -> dict[str, JsonValue]:
    values: dict[str, JsonValue] = {
        "clientVersion": 2,
        "_filter": "off",
        "_colorTemperature": 5000,
        "_shutterVolume": 100,
        "isoAutoHighLimit": nearest(1600, person.isos),
    }
    if person.bracket is not None:
        shot: dict[str, JsonValue] = {
            "shutterSpeed": 0.004, "iso": 400, "_colorTemperature": 5000,
        }  # fmt: skip
        if "exposureProgram" in person.bracket.required:
            shot["exposureProgram"] = MANUAL
        if "whiteBalance" in person.bracket.required:
            shot["whiteBalance"] = "auto"
        if "exposureCompensation" in person.bracket.optional:
            shot["exposureCompensation"] = 0.0
        if "aperture" in person.bracket.optional:
            shot["aperture"] = person.apertures[0]
        values["_autoBracket"] = {
            "_bracketNumber": 2, "_bracketParameters": [dict(shot), dict(shot)],
        }  # fmt: skip
    if person.camera.lens_words == 1:
        values["_shootingMethod"] = "normal"
        values["_function"] = "normal"
        values["offDelay"] = 43200
        # This option is read-only.
        values["previewFormat"] = _preview(1024, 512, 15)
    if 3 in person.programs:
        values["_function"] = "normal"
    if person.stitching:
        values["_imageStitching"] = "auto"
        values["_topBottomCorrection"] = "ApplyAuto"
    if person.digest:
        values.update({"_networkType": "AP", "_username": "", "_password": ""})
    return values


def _supports(person: Personality) -> dict[str, tuple[JsonValue, ...]]:
    methods = ["normal", "bracket"] if person.bracket is not None else ["normal"]
    return {
        "captureMode": ("image", "video"),
        "exposureProgram": person.programs,
        "exposureDelay": tuple(range(11)),
        "fileFormat": tuple(
            {"type": "jpeg", "width": columns, "height": rows} for rows, columns in person.sizes
        ),
        "previewFormat": tuple(_preview(*each) for each in person.previews),
        "_filter": person.filters,
        "_imageStitching": person.stitching,
        "_topBottomCorrection": person.levelling,
        "_shootingMethod": tuple(methods),
    }


def member(value: JsonValue, among: Sequence[JsonValue]) -> bool:
    """Return whether a list contains a value. Numbers must match exactly."""
    if isinstance(value, bool):
        return False
    if isinstance(value, int | float):
        return any(
            isinstance(each, int | float) and math.isclose(value, each, rel_tol=1e-12)
            for each in among
        )
    return value in among


def _preview(width: int, height: int, rate: int) -> dict[str, JsonValue]:
    return {"width": width, "height": height, "framerate": rate}


def whole(value: object) -> int:
    """Return a whole number, or 0 for anything else."""
    return int(value) if isinstance(value, int | float) else 0
