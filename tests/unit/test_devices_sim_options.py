"""The options of the simulated camera: lists that follow the program, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from app.devices.simulated.cameras import Personality
from app.devices.simulated.exchange import CommandRefused
from tests.faulty_camera.models import PERSONALITIES, personality_named
from tests.faulty_camera.strict_options import StrictOptions
from tests.helpers.simulated import Talker, bracket

ALL = [pytest.param(person, id=person.name) for person in PERSONALITIES]
Z1 = personality_named("Z1")


def _refused(store: StrictOptions, **options: Any) -> str:
    with pytest.raises(CommandRefused) as caught:
        store.set(options)
    return caught.value.code


@pytest.mark.parametrize("person", ALL)
def test_lists_follow_the_program(person: Personality) -> None:
    store = StrictOptions(person)
    assert store.values["exposureProgram"] == 2
    assert store.values["iso"] == store.values["shutterSpeed"] == 0
    names = ["isoSupport", "shutterSpeedSupport", "exposureCompensationSupport"]
    assert store.get(names[:2], {}) == {"isoSupport": [0], "shutterSpeedSupport": [0]}
    assert _refused(store, iso=100) == "invalidParameterValue"
    assert _refused(store, shutterSpeed=0.01) == "invalidParameterValue"
    store.set({"exposureCompensation": -0.7})
    store.set({"exposureProgram": 1})
    lists = store.get(names, {})
    assert lists["isoSupport"] == list(person.isos)
    assert lists["shutterSpeedSupport"] == list(person.shutters)
    assert lists["exposureCompensationSupport"] == [0.0]
    assert store.values["exposureCompensation"] == 0.0
    assert _refused(store, iso=0) == "invalidParameterValue"
    assert _refused(store, exposureCompensation=0.3) == "invalidParameterValue"
    store.set({"iso": person.isos[2], "shutterSpeed": person.shutters[3]})
    store.set({"exposureProgram": 2})
    store.set({"exposureProgram": 1})
    assert store.values["iso"] == person.isos[2]


@pytest.mark.parametrize("person", ALL)
def test_whatever_was_read_can_be_written_back(person: Personality) -> None:
    store = StrictOptions(person)
    for program in person.programs:
        store.set({"exposureProgram": program})
        for name, value in list(store.values.items()):
            if name in {"remainingPictures", "remainingSpace", "remainingVideoSeconds"}:
                continue
            if name in {"totalSpace", "dateTimeZone", "_password", "_username"}:
                continue
            # Zeros, and 15 frames a second on an X: to be read, not to be set.
            if name == "previewFormat" and value not in store.support(name):
                continue
            store.set({name: value})
            assert store.values[name] == value


def test_program_and_values_in_one_call_in_any_order() -> None:
    store = StrictOptions(Z1)
    store.set({"iso": 100, "shutterSpeed": 0.00004, "aperture": 5.6, "exposureProgram": 1})
    assert store.values["aperture"] == 5.6
    store.set({"exposureProgram": 2})
    assert store.values["aperture"] == 0


def test_other_programs_leave_one_value_to_the_user() -> None:
    store = StrictOptions(Z1)
    store.set({"exposureProgram": 4, "shutterSpeed": 0.5})
    assert store.values["iso"] == 0
    assert max(store.support("shutterSpeed")) <= 8  # type: ignore[type-var, operator]
    store.set({"exposureProgram": 9, "iso": 6400})
    assert store.values["shutterSpeed"] == 0
    store.set({"exposureProgram": 3, "aperture": 3.5})
    assert store.values["iso"] == 0
    assert _refused(StrictOptions(personality_named("V")), exposureProgram=3) == (
        "invalidParameterValue"
    )


@pytest.mark.parametrize(
    "value", [0.016, 0.01666667, "0.01", True, None, [0.01], {"a": 1}, 1e400, -1, 70]
)
def test_shutter_values_off_the_list(value: Any) -> None:
    store = StrictOptions(Z1)
    store.set({"exposureProgram": 1})
    before = dict(store.values)
    assert _refused(store, iso=200, shutterSpeed=value) == "invalidParameterValue"
    assert store.values == before


def test_numbers_may_be_written_either_way() -> None:
    store = StrictOptions(Z1)
    store.set({"exposureProgram": 1, "iso": 100.0, "shutterSpeed": 1.0})
    assert store.values["iso"] == 100


def test_values_that_do_not_go_together() -> None:
    store = StrictOptions(Z1)
    assert _refused(store, _function="normal", exposureDelay=5) == "invalidParameterValue"
    assert _refused(store, dateTimeZone="2026:01:01 10:00:00+01:00", iso=0) == (
        "invalidParameterValue"
    )
    StrictOptions(personality_named("generic")).set(
        {"dateTimeZone": "2026:01:01 10:00:00+01:00", "iso": 0}
    )


def test_hdr_takes_the_program_away() -> None:
    store = StrictOptions(Z1)
    store.set({"exposureProgram": 1})
    store.set({"_filter": "hdr"})
    assert store.values["exposureProgram"] == 2


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("sleepDelay", [60, 65534, 65535], [0, 59, 65536, 60.5, "60", True]),
        ("offDelay", [0, 600, 65535], [1, 599]),
        ("_colorTemperature", [2500, 5000, 10000], [2400, 5050, 10100]),
        ("exposureDelay", [0, 10], [11, -1]),
        ("whiteBalance", ["auto", "_colorTemperature"], ["warm", 1]),
        ("fileFormat", [{"type": "jpeg", "width": 6720, "height": 3360}], [{"type": "png"}, []]),
        ("previewFormat", [{"width": 1024, "height": 512, "framerate": 8}], [{"width": 1024}]),
        ("_imageStitching", ["static"], ["dynamicSemiAuto"]),
        ("_shutterVolume", [0, 100], [101]),
    ],
)
def test_single_options_of_a_z1(name: str, good: list[Any], bad: list[Any]) -> None:
    store = StrictOptions(Z1)
    for value in good:
        store.set({name: value})
        assert store.values[name] == value
    for value in bad:
        assert _refused(store, **{name: value}) == "invalidParameterValue"


def test_options_that_only_some_models_have() -> None:
    have = {person.name: set(StrictOptions(person).values) for person in PERSONALITIES}
    assert {name for name, names in have.items() if "_shootingMethod" in names} == {
        "X", "X-old", "A1",
    }  # fmt: skip
    assert {name for name, names in have.items() if "_autoBracket" not in names} == {
        "A1", "generic", "insta360",
    }  # fmt: skip
    assert not any(key.startswith("_") for key in have["generic"])
    assert "_imageStitching" not in have["S"]
    assert _refused(StrictOptions(personality_named("SC2")), previewFormat={}) == (
        "invalidParameterValue"
    )


@pytest.mark.parametrize("person", [p for p in PERSONALITIES if p.bracket], ids=lambda p: p.name)
def test_what_a_bracket_must_hold(person: Personality) -> None:
    store = StrictOptions(person)
    assert person.bracket is not None
    good = bracket(person, 0.01, 0.04)
    store.set({"_autoBracket": good})
    assert store.values["_autoBracket"] == good
    times = [0.01] * (person.bracket.most + 1)
    assert _refused(store, _autoBracket=bracket(person, *times)) == "invalidParameterValue"
    assert _refused(store, _autoBracket=bracket(person, 0.01)) == "invalidParameterValue"
    assert _refused(store, _autoBracket=bracket(person, 0.01, 0.016)) == "invalidParameterValue"
    assert _refused(store, _autoBracket=bracket(person, 0.01, 0.04, iso=99)) == (
        "invalidParameterValue"
    )
    assert _refused(store, _autoBracket=good | {"_bracketNumber": 3}) == "invalidParameterValue"
    shots = [dict(shot) for shot in good["_bracketParameters"]]
    for key in person.bracket.required:
        without = [shots[0], {k: v for k, v in shots[1].items() if k != key}]
        assert _refused(store, _autoBracket=good | {"_bracketParameters": without}) == (
            "invalidParameterValue"
        )
    strange = [shots[0], shots[1] | {"contrast": 1}]
    assert _refused(store, _autoBracket=good | {"_bracketParameters": strange}) == (
        "invalidParameterName"
    )
    aperture = [shots[0], shots[1] | {"aperture": person.apertures[0]}]
    wanted = good | {"_bracketParameters": aperture}
    if person.name == "Z1":
        store.set({"_autoBracket": wanted})
    else:
        assert _refused(store, _autoBracket=wanted) == "invalidParameterName"
    assert store.get(["_bracketNumberSupport"], {})["_bracketNumberSupport"] == {
        "minNumber": 2,
        "maxNumber": person.bracket.most,
        "stepSize": 1,
    }


@pytest.mark.parametrize("value", [None, [], "x", {}, {"_bracketNumber": 2}])
def test_brackets_of_the_wrong_shape(value: Any) -> None:
    assert _refused(StrictOptions(Z1), _autoBracket=value) == "invalidParameterValue"


def test_passwords_can_be_set_and_not_read() -> None:
    store = StrictOptions(Z1)
    store.set({"_password": "12345678"})
    with pytest.raises(CommandRefused):
        store.get(["_password"], {})
    assert _refused(store, _password="short") == "invalidParameterValue"


def test_what_is_read_is_a_copy() -> None:
    talker = Talker("Z1")
    first = talker.camera.store.get(["fileFormat"], {})["fileFormat"]
    assert isinstance(first, dict)
    first["width"] = 1
    assert talker.options("fileFormat")["fileFormat"]["width"] == 6720
    live = talker.options("remainingPictures", "remainingSpace", "dateTimeZone")
    assert live["remainingPictures"] > 100
    assert live["dateTimeZone"] == "2026:06:21 12:00:00+02:00"
