"""Model profiles: the right one for every camera, and complete enough to be used."""

from __future__ import annotations

import pytest

from app.core.measure.plan.planner import MAX_SHOTS
from app.devices.protocol_profiles import PROFILES, profile_for, profile_named
from app.devices.theta.messages import Info


def chosen(model: str, *firmware: int) -> str:
    return profile_for(Info(model, firmware=firmware)).name


@pytest.mark.parametrize(
    ("model", "firmware", "name"),
    [
        ("RICOH THETA S", (1, 82), "S"),
        ("RICOH THETA SC", (1, 20), "SC"),
        ("RICOH THETA SC2", (1, 82), "SC2"),
        ("RICOH THETA V", (3, 82, 1), "V"),
        ("RICOH THETA V", (3, 0, 1), "V"),
        ("RICOH THETA V", (3, 0, 0), "V-old"),
        ("RICOH THETA V", (2, 50, 1), "V-old"),
        ("RICOH THETA V", (), "V"),
        ("RICOH THETA Z1", (3, 50, 2), "Z1"),
        ("RICOH THETA X", (2, 80, 1), "X"),
        ("RICOH360 THETA A1", (1, 20, 0), "A1"),
        ("RICOH THETA Z2", (1, 0), "theta"),
        ("RICOH THETA X2", (1, 0), "theta"),
        ("Insta360 X3", (), "insta360"),
        ("Simulated 360", (1, 0), "generic"),
        ("", (), "generic"),
        ("X", (1,), "generic"),
    ],
)
def test_the_profile_follows_model_and_firmware(
    model: str, firmware: tuple[int, ...], name: str
) -> None:
    assert chosen(model, *firmware) == name


@pytest.mark.parametrize(
    ("model", "old", "new"),
    [("RICOH THETA S", (1, 81), (1, 82)), ("RICOH THETA SC", (1, 9), (1, 10))],
)
def test_old_firmware_takes_single_pictures(
    model: str, old: tuple[int, ...], new: tuple[int, ...]
) -> None:
    assert profile_for(Info(model, firmware=old)).bracket == "single"
    assert profile_for(Info(model, firmware=new)).bracket == "native"


def test_names_are_unique_and_findable() -> None:
    assert len({profile.name for profile in PROFILES}) == len(PROFILES)
    for profile in PROFILES:
        assert profile_named(profile.name) is profile
    assert profile_named("no such camera").name == "generic"


@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.name)
def test_every_profile_can_be_used(profile: object) -> None:
    found = next(each for each in PROFILES if each is profile)
    assert 2 <= found.max_shots <= MAX_SHOTS
    assert found.settle_s >= 1.0
    assert found.poll_s >= 1.0
    assert len(set(found.saved)) == len(found.saved)
    assert "captureMode" not in found.saved
    assert {"exposureProgram", "iso", "shutterSpeed", "sleepDelay"} <= set(found.saved)
    for name, _ in found.extra:
        assert name in found.saved
    if found.brackets_itself:
        assert {"shutterSpeed", "iso", "_colorTemperature"} <= set(found.shot_keys)
        assert ("aperture" in found.shot_keys) == (len(found.fallback.apertures) > 1)
    assert found.listed >= 10


def test_what_ricoh_documents_of_each_bracket() -> None:
    for name in ("S", "SC", "SC2", "V-old"):
        assert set(profile_named(name).shot_keys) == {"shutterSpeed", "iso", "_colorTemperature"}
    for name in ("V", "Z1", "X"):
        assert {"exposureProgram", "whiteBalance"} <= set(profile_named(name).shot_keys)
    most = {profile.name: profile.max_shots for profile in PROFILES}
    assert (most["S"], most["V-old"], most["V"], most["Z1"], most["X"]) == (13, 13, 19, 19, 13)
    assert [p.name for p in PROFILES if p.needs_method] == ["X"]
    assert [p.name for p in PROFILES if not p.sends_mode] == ["X"]
    assert [p.name for p in PROFILES if p.bracket == "watched"] == ["SC2"]
    assert [p.name for p in PROFILES if p.forgets] == ["SC2"]


def test_user_names() -> None:
    assert profile_named("V").user_name("00105377") == "THETAYL00105377"
    assert profile_named("A1").user_name("1") == ""
