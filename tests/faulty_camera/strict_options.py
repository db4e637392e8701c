"""Options that accept exactly what each model documents, and refuse everything else."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused, JsonValue
from app.devices.simulated.options import MANUAL, OptionStore, member, whole

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
_DATE: Final = re.compile(r"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d([+-]\d\d:\d\d)?", re.ASCII)
_EXPOSURE: Final = ("iso", "shutterSpeed", "aperture", "exposureCompensation")


class StrictOptions(OptionStore):
    """The options of a model, with all of its lists and ranges."""

    def get(self, names: Sequence[str], live: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
        return {name: self._read(name, live) for name in names}

    def _read(self, name: str, live: Mapping[str, JsonValue]) -> JsonValue:
        option = name.removesuffix("Support")
        if name not in live and name != option and option in self.values:
            if option in _MENUS:
                menus = _X_MENUS if "_shootingMethod" in self.values else _MENUS
                return list(menus[option])
            if option in (ranges := _ranges(self._person)):
                return copy.deepcopy(ranges[option])
        return super().get([name], live)[name]

    def set(self, changes: Mapping[str, JsonValue]) -> None:
        self._check_company(changes)
        super().set(changes)

    def support(self, name: str, program: int | None = None) -> tuple[JsonValue, ...]:
        if name == "exposureCompensation":
            manual = (self.program if program is None else program) == MANUAL
            return (0.0,) if manual else _COMPENSATIONS
        more = _supports(self._person).get(name)
        return super().support(name, program) if more is None else more

    def _check_company(self, changes: Mapping[str, JsonValue]) -> None:
        if not self._person.ricoh:
            return
        if "_function" in changes and "exposureDelay" in changes:
            raise CommandRefused("invalidParameterValue", "Not with exposureDelay.")
        if "dateTimeZone" in changes and len(changes) > 1:
            raise CommandRefused("invalidParameterValue", "dateTimeZone must come alone.")

    def allows(self, name: str, value: JsonValue) -> bool:
        special: dict[str, Callable[[JsonValue], bool]] = {
            "_autoBracket": self.allows_bracket,
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
        return member(value, self.support(name))

    def _allowed_preview(self, value: JsonValue) -> bool:
        return bool(self._person.previews) and member(value, self.support("previewFormat"))

    def allows_bracket(self, value: JsonValue) -> bool:
        if not super().allows_bracket(value):
            return False
        shots = value["_bracketParameters"] if isinstance(value, dict) else []
        return isinstance(shots, list) and all(self._allowed_shot(shot) for shot in shots)

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
        if not member(program, rules.programs):
            return False
        exposures = {name: shot[name] for name in _EXPOSURE if name in shot}
        if not all(
            member(value, self.support(name, whole(program))) for name, value in exposures.items()
        ):
            return False
        others = {"whiteBalance", "_colorTemperature"} & keys
        return all(self.allows(name, shot[name]) for name in others)


def _supports(person: Personality) -> dict[str, tuple[JsonValue, ...]]:
    methods = ["normal", "interval", "continuous", "timeShift"]
    if person.bracket is not None:
        methods.insert(2, "bracket")
    functions = ["normal", "mySetting"]
    if person.camera.lens_words != 1:
        functions.insert(1, "selfTimer")
    kinds = ("jpeg", "raw+") if person.name == "Z1" else ("jpeg",)
    return {
        "whiteBalance": _BALANCES if person.ricoh else _PLAIN_BALANCES,
        "fileFormat": tuple(
            {"type": kind, "width": columns, "height": rows}
            for kind in kinds
            for rows, columns in person.sizes
        ),
        "isoAutoHighLimit": tuple(iso for iso in person.isos if iso >= 100),
        "hdr": ("off", "hdr"),
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
