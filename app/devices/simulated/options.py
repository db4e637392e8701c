"""The options of a simulated camera: what it has, what it accepts, and what hangs together."""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused, JsonValue
from app.devices.simulated.scene import nearest

MANUAL: Final = 1
_AUTO_MOST_S: Final = 8.0
_COMPENSATIONS: Final = (
    -2.0, -1.7, -1.3, -1.0, -0.7, -0.3, 0.0, 0.3, 0.7, 1.0, 1.3, 1.7, 2.0,
)  # fmt: skip
_BALANCES: Final = (
    "auto", "daylight", "shade", "cloudy-daylight", "incandescent", "_warmWhiteFluorescent",
    "_dayLightFluorescent", "_dayWhiteFluorescent", "fluorescent", "_bulbFluorescent",
    "_colorTemperature",
)  # fmt: skip
_PLAIN_BALANCES: Final = ("auto", "daylight", "incandescent", "fluorescent")
_MENUS: Final[dict[str, tuple[JsonValue, ...]]] = {
    "sleepDelay": (60, 180, 300, 600, 65535),
    "offDelay": (600, 1800, 3600, 65535),
}
"""Lists that are shorter than what is accepted."""
_X_MENUS: Final[dict[str, tuple[JsonValue, ...]]] = {
    "sleepDelay": (180, 300, 420, 600, 65535),
    "offDelay": (0, 3600, 7200, 14400, 28800, 43200, 64800, 86400, 172800),
}
_READ_ONLY: Final = frozenset(
    {"remainingPictures", "remainingSpace", "remainingVideoSeconds", "totalSpace"}
)
_DATE: Final = re.compile(r"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d([+-]\d\d:\d\d)?", re.ASCII)
_EXPOSURE: Final = ("iso", "shutterSpeed", "aperture", "exposureCompensation")
_WHICH_PROGRAMS: Final = {"iso": (1, 9), "shutterSpeed": (1, 4), "aperture": (1, 3)}
"""In which exposure programs each value is the user's; elsewhere it is 0, the camera's."""


class OptionStore:
    """All options of one camera."""

    def __init__(self, personality: Personality) -> None:
        self._person = personality
        self._manual: dict[str, JsonValue] = {}
        self.values: dict[str, JsonValue] = {}
        self.reset()

    def reset(self) -> None:
        """Go back to the settings that the camera wakes up with."""
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
        """Exposure program."""
        return whole(self.values["exposureProgram"])

    @property
    def method(self) -> str:
        """Shooting method of the X; "normal" elsewhere."""
        return str(self.values.get("_shootingMethod", "normal"))

    def get(self, names: Sequence[str], live: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
        """Read options.

        Raises `CommandRefused`: invalidParameterName for one that this model does not have.
        """
        return {name: self._one(name, live) for name in names}

    def set(self, changes: Mapping[str, JsonValue]) -> None:
        """Change options, all or none.

        Raises `CommandRefused`: invalidParameterName for an option that does not exist or cannot be
        set, invalidParameterValue for a value that is not allowed.
        """
        self._check_company(changes)
        before = copy.deepcopy(self.values), dict(self._manual)
        try:
            self._apply(changes)
        except CommandRefused:
            self.values.clear()
            self.values.update(before[0])
            self._manual = before[1]
            raise

    def support(self, name: str, program: int | None = None) -> tuple[JsonValue, ...]:
        """List what an option accepts."""
        if name in _EXPOSURE:
            return self._exposure_support(name, self.program if program is None else program)
        return _supports(self._person).get(name, ())

    def _one(self, name: str, live: Mapping[str, JsonValue]) -> JsonValue:
        if name in live:
            return live[name]
        if name in self.values and name not in {"_password", "_username"}:
            return copy.deepcopy(self.values[name])
        option = name.removesuffix("Support")
        if name != option and option in self.values:
            if option in _MENUS:
                menus = _X_MENUS if "_shootingMethod" in self.values else _MENUS
                return list(menus[option])
            if option in (ranges := _ranges(self._person)):
                return copy.deepcopy(ranges[option])
            if values := self.support(option):
                return copy.deepcopy(list(values))
        if name == "_shootingMethodSupport" and self._person.digest:
            return []
        if name == "_bracketNumberSupport" and self._person.bracket is not None:
            return {"minNumber": 2, "maxNumber": self._person.bracket.most, "stepSize": 1}
        raise CommandRefused("invalidParameterName")

    def _check_company(self, changes: Mapping[str, JsonValue]) -> None:
        if not self._person.ricoh:
            return
        if "_function" in changes and "exposureDelay" in changes:
            raise CommandRefused("invalidParameterValue", "Not with exposureDelay.")
        if "dateTimeZone" in changes and len(changes) > 1:
            raise CommandRefused("invalidParameterValue", "dateTimeZone must come alone.")

    def _apply(self, changes: Mapping[str, JsonValue]) -> None:
        # The program comes first, since the lists of the others follow it.
        for name in sorted(changes, key=lambda key: key != "exposureProgram"):
            if name not in self.values or name in _READ_ONLY:
                raise CommandRefused("invalidParameterName", f"There is no option {name!r:.40}.")
            self._check_value(name, changes[name])
            self.values[name] = copy.deepcopy(changes[name])
            self._settle(name)

    def _settle(self, name: str) -> None:
        """Let other options follow the one that was set."""
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
        if name == "exposureCompensation":
            return (0.0,) if program == MANUAL else _COMPENSATIONS
        if name == "aperture" and len(person.apertures) == 1:
            return person.apertures
        if program not in _WHICH_PROGRAMS[name]:
            return (0,)
        if name == "shutterSpeed":
            limit = math.inf if program == MANUAL else _AUTO_MOST_S
            return tuple(time for time in person.shutters if time <= limit)
        return person.isos if name == "iso" else person.apertures

    def _check_value(self, name: str, value: JsonValue) -> None:
        if not self._allows(name, value):
            raise CommandRefused("invalidParameterValue", f"{name} cannot be {value!r:.60}.")

    def _allows(self, name: str, value: JsonValue) -> bool:
        special: dict[str, Callable[[JsonValue], bool]] = {
            "_autoBracket": self._allowed_bracket,
            "dateTimeZone": lambda v: isinstance(v, str) and bool(_DATE.fullmatch(v)),
            "previewFormat": self._allowed_preview,
            "clientVersion": lambda v: v in (1, 2),
            "_username": lambda v: isinstance(v, str),
            "_password": lambda v: isinstance(v, str) and 8 <= len(v) <= 63 and v.isascii(),
            "gpsInfo": lambda v: isinstance(v, dict),
            "exposureBracket": lambda v: isinstance(v, dict),
        }
        if name in special:
            return special[name](value)
        numbers = _ranges(self._person).get(name)
        if numbers is not None:
            return _in_range(value, numbers)
        return _member(value, self.support(name))

    def _allowed_preview(self, value: JsonValue) -> bool:
        return bool(self._person.previews) and _member(value, self.support("previewFormat"))

    def _allowed_bracket(self, value: JsonValue) -> bool:
        rules = self._person.bracket
        if rules is None or not isinstance(value, dict):
            return False
        number, shots = value.get("_bracketNumber"), value.get("_bracketParameters")
        if not isinstance(shots, list) or number != len(shots) or isinstance(number, bool):
            return False
        return 2 <= len(shots) <= rules.most and all(self._allowed_shot(shot) for shot in shots)

    def _allowed_shot(self, shot: JsonValue) -> bool:
        rules = self._person.bracket
        if rules is None or not isinstance(shot, dict):
            return False
        keys = set(shot)
        if keys - rules.required - rules.optional:
            raise CommandRefused("invalidParameterName")
        if not rules.required <= keys:
            return False
        program = shot.get("exposureProgram", MANUAL)
        if not _member(program, rules.programs):
            return False
        exposures = {name: shot[name] for name in _EXPOSURE if name in shot}
        if not all(
            _member(value, self.support(name, whole(program))) for name, value in exposures.items()
        ):
            return False
        others = {"whiteBalance", "_colorTemperature"} & keys
        return all(self._allows(name, shot[name]) for name in others)


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
        # It can be read, and not be set.
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
    methods = ["normal", "interval", "continuous", "timeShift"]
    if person.bracket is not None:
        methods.insert(2, "bracket")
    functions = ["normal", "mySetting"]
    if "_shootingMethod" not in _ricoh_defaults(person):
        functions.insert(1, "selfTimer")
    kinds = ("jpeg", "raw+") if person.name == "Z1" else ("jpeg",)
    return {
        "captureMode": ("image", "video"),
        "exposureProgram": person.programs,
        "whiteBalance": _BALANCES if person.ricoh else _PLAIN_BALANCES,
        "exposureDelay": tuple(range(11)),
        "fileFormat": tuple(
            {"type": kind, "width": columns, "height": rows}
            for kind in kinds
            for rows, columns in person.sizes
        ),
        "previewFormat": tuple(_preview(*each) for each in person.previews),
        "isoAutoHighLimit": tuple(iso for iso in person.isos if iso >= 100),
        "hdr": ("off", "hdr"),
        "_filter": person.filters,
        "_imageStitching": person.stitching,
        "_topBottomCorrection": person.levelling,
        "_shootingMethod": tuple(methods),
        "_function": tuple(functions),
        "_networkType": ("AP", "CL"),
    }


def _ranges(person: Personality) -> dict[str, JsonValue]:
    least, most, *single = person.sleep_delays
    offs: list[JsonValue] = [0, 65535] if person.digest else [65535]
    return {
        "_colorTemperature": {
            "minTemperature": 2500, "maxTemperature": 10000, "stepSize": 100,
        },
        "_shutterVolume": {"minShutterVolume": 0, "maxShutterVolume": 100},
        "captureInterval": {"minInterval": 8, "maxInterval": 3600},
        "sleepDelay": {"least": least, "most": most, "also": list(single)},
        "offDelay": {"least": 30 if person.switches_api else 600, "most": 65534, "also": offs},
    }  # fmt: skip


def _in_range(value: JsonValue, numbers: JsonValue) -> bool:
    if isinstance(value, bool) or not isinstance(value, int) or not isinstance(numbers, dict):
        return False
    also = numbers.get("also")
    if isinstance(also, list) and value in also:
        return True
    bounds = [whole(each) for key, each in numbers.items() if key not in {"also", "stepSize"}]
    step = whole(numbers.get("stepSize", 1))
    return min(bounds) <= value <= max(bounds) and (value - min(bounds)) % step == 0


def _member(value: JsonValue, among: Sequence[JsonValue]) -> bool:
    """Whether a value is on a list; numbers must be numbers, and agree to the last digit sent."""
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
    """Read a whole number; 0 where there is none."""
    return int(value) if isinstance(value, int | float) else 0
