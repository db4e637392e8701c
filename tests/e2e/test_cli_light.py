"""`turnlight light` as a user meets it: table, JSON, scale, reach, and what bad input gives."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.cli import main
from app.core.base.angles import wrap
from app.core.base.colour import luminance
from app.core.base.imaging.images import write_exr
from app.core.second_light.captured_lamps.captured_lamp import make_lamp
from app.core.second_light.captured_lamps.lamp_capture import read_lamp_file
from app.core.second_light.captured_lamps.lamp_library import add_lamp, lamps_folder
from app.core.solver.head_shape import save_shape, shape_path
from app.core.solver.transport import save_transport
from app.core.styles.style_pack_file import pack_path, save_pack
from app.core.styles.styles import NAMES
from app.words.lamps import HARDLY_CHANGES
from app.words.phrases.quantities import lower_first
from tests.helpers.synthetic import (
    lambert_sphere_transport,
    lamp_environment,
    synthetic_pack,
    synthetic_shape,
)

KEYS = {
    "turn_deg",
    "turn_refined_deg",
    "lamp_azimuth_deg",
    "lamp_altitude_deg",
    "quality",
    "match",
    "strength",
    "attainable",
    "reason",
    "evaluated",
    "seconds",
    "words",
    "illuminance_lux",
    "assumed",
    "before",
    "visible_change",
    "hardly_changed",
}


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A head of the user's own: transport, pack and shape beside each other."""
    path = tmp_path_factory.mktemp("heads") / "sphere.npz"
    digest = save_transport(path, lambert_sphere_transport())
    pack = synthetic_pack()
    header = dataclasses.replace(pack.header, transport_sha256=digest)
    save_pack(pack_path(path), dataclasses.replace(pack, header=header))
    save_shape(shape_path(path), synthetic_shape())
    return str(path)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> str:
    """One light at azimuth 30, height 35, with a little fill; its brightness is not stated."""
    path = tmp_path_factory.mktemp("places") / "yard.exr"
    light = lamp_environment(30.0, 35.0, 8.0, (128, 256), fill=0.02)
    write_exr(path, np.repeat(light[..., None], 3, axis=2).astype(np.float32))
    return str(path)


def _light(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    assert main(["light", *words, "--json"]) == 0
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    return values


def test_json_of_one_style(capsys: pytest.CaptureFixture[str], head: str, place: str) -> None:
    words = (place, "--head", head, "--lamp", "phone@0.3", "--lux", "60", "--style", "badger")
    values = _light(capsys, *words)
    assert values.keys() >= KEYS
    assert values["illuminance_lux"] == 60.0
    assert values["assumed"] is False
    assert values["evaluated"] == 36864
    assert values["distance_m"] == 0.3
    assert "30 cm from the middle of the head, about" in values["words"]
    assert values["match"] > values["before"]["match"]
    assert values["attainable"] == (values["match"] >= 45 and values["strength"] >= 20)
    assert values["styles"][0]["match"] == values["match"]


def test_grey_light_is_light_without_its_colours(
    capsys: pytest.CaptureFixture[str], head: str, tmp_path: Path
) -> None:
    light = lamp_environment(30.0, 35.0, 8.0, (128, 256), fill=0.02)[..., None] * (1.0, 0.6, 0.2)
    light[:, :40] *= (0.1, 1.0, 3.0)
    grey = np.repeat(luminance(light)[..., None], 3, axis=2)
    words = ("--head", head, "--lamp", "panel@0.4", "--style", "left-rim", "--lux", "80")
    found = []
    for name, values, more in (("c", light, ["--grey"]), ("g", grey, [])):
        path = tmp_path / f"{name}.exr"
        write_exr(path, values.astype(np.float32))
        found.append(_light(capsys, str(path), *words, "--objective", "paper", *more))
    assert found[0]["grey"] is True
    assert "grey" not in found[1]
    for key in ("turn_deg", "lamp_azimuth_deg", "lamp_altitude_deg"):
        assert found[0][key] == found[1][key]
    assert found[0]["quality"] == pytest.approx(found[1]["quality"], rel=1e-4)


def test_all_styles_and_the_rescued(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    values = _light(capsys, place, "--head", head, "--lamp", "panel@0.4", "--lux", "100")
    assert len(values["styles"]) == len(NAMES)
    rescued = [
        one["name"]
        for one in values["styles"]
        if one["attainable"] and not one["before"]["attainable"] and one["visible_change"] >= 4.6
    ]
    assert values["rescues"] == rescued
    assert "below" in rescued


def test_a_lamp_that_changes_nothing_is_not_said_to_help(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    words = (place, "--head", head, "--lamp", "torch@2", "--lux", "5000")
    values = _light(capsys, *words)
    assert values["rescues"] == []
    for one in values["styles"]:
        assert one["hardly_changed"] == (one["visible_change"] < 4.6)
    same = [one["name"] for one in values["styles"] if one["hardly_changed"] and one["attainable"]]
    assert same
    assert main(["light", *words, "--style", same[0]]) == 0
    table = capsys.readouterr().out
    (row,) = (line for line in table.splitlines() if line.startswith(same[0]))
    assert row.endswith(lower_first(HARDLY_CHANGES))


def test_the_side_that_the_lamp_fills(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    words = (place, "--head", head, "--lamp", "panel@0.4", "--lux", "100", "--style", "badger")
    values = _light(capsys, *words)
    # The place's own light, from where the sitter sees it; the lamp goes to the other side.
    own_side = -(30.0 - values["turn_deg"])
    assert np.sign(wrap(own_side)) == -np.sign(values["lamp_azimuth_deg"])
    side = "left (camera right)" if values["lamp_azimuth_deg"] > 0 else "right (camera left)"
    assert side in values["words"]


@pytest.mark.slow
def test_the_scale_is_assumed_stated_by_the_file_or_by_the_user(
    capsys: pytest.CaptureFixture[str], head: str, place: str, tmp_path: Path
) -> None:
    words = ("--head", head, "--lamp", "phone@0.3", "--style", "below")
    assert main(["light", place, *words, "--json"]) == 0
    captured = capsys.readouterr()
    values = json.loads(captured.out)
    assert values["assumed"] is True
    assert values["illuminance_lux"] == pytest.approx(200.0)
    assert "--lux" in captured.err
    light = lamp_environment(30.0, 35.0, 8.0, (128, 256), fill=0.02)
    stated = tmp_path / "stated.exr"
    write_exr(stated, np.repeat(light[..., None], 3, axis=2).astype(np.float32), 40.0)
    known = _light(capsys, str(stated), *words)
    assert known["assumed"] is False
    assert known["cd_m2_per_unit"] == pytest.approx(40.0)
    told = _light(capsys, str(stated), *words, "--lux", str(known["illuminance_lux"]))
    assert told["match"] == pytest.approx(known["match"], rel=1e-4)
    bright = _light(capsys, str(stated), *words, "--lux", "60000")
    assert "too weak" in bright["reason"]


@pytest.mark.slow
def test_greedy_front_power_and_reach(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    words = (place, "--head", head, "--lamp", "panel@0.4", "--style", "left-rim")
    scale = ("--lux", "80")
    plain = _light(capsys, *words, *scale, "--objective", "paper")
    assert plain["power"] == 1.0
    greedy = _light(capsys, *words, *scale, "--objective", "paper", "--greedy")
    assert greedy["evaluated"] == 640
    assert greedy["turn_deg"] == greedy["before"]["turn_deg"]
    assert greedy["quality"] <= plain["quality"] * (1 + 1e-9)
    full = _light(capsys, *words, *scale, "--power", "full")
    best = _light(capsys, *words, *scale)
    assert full["power"] == 1.0
    assert best["match"] >= full["match"] - 0.5
    arm = _light(capsys, *words, *scale, "--reach", "arm")
    assert arm["evaluated"] < 36864
    assert abs(arm["lamp_azimuth_deg"]) < 160


@pytest.mark.slow
def test_a_captured_lamp_from_a_file(
    capsys: pytest.CaptureFixture[str], head: str, place: str, tmp_path: Path
) -> None:
    room = np.full((128, 256, 3), 0.02, np.float32)
    room[56:72, 118:138] = 30.0
    file = tmp_path / "my-lamp.exr"
    write_exr(file, room, 10.0)
    words = (place, "--head", head, "--lamp", str(file), "--lux", "100", "--style", "badger")
    values = _light(capsys, *words)
    assert values["lamp"] == "my-lamp"
    assert values["distance_m"] is None
    assert values["power"] == 1.0
    assert "cm" not in values["words"]
    unknown = tmp_path / "unknown.exr"
    write_exr(unknown, room)
    assert main(["light", place, "--head", head, "--lamp", str(unknown), "--lux", "9"]) == 0
    said = capsys.readouterr().err
    assert "do not record the exposure" in said
    assert "--lamp-lux" in said
    assert "assumed to be cd/m²" in said
    unknown_words = (place, "--head", head, "--lamp", str(unknown), "--style", "badger")
    values = _light(capsys, *unknown_words, "--lux", "100")
    assert values["comparable"] is False
    assert "Enter the lamp’s illuminance" in values["comparison"]


@pytest.mark.slow
def test_what_a_meter_reads_makes_a_lamp_comparable(
    capsys: pytest.CaptureFixture[str], head: str, place: str, tmp_path: Path
) -> None:
    room = np.full((128, 256, 3), 0.02, np.float32)
    room[56:72, 118:138] = 30.0
    known, unknown = tmp_path / "known.exr", tmp_path / "unknown.exr"
    write_exr(known, room, 10.0)
    write_exr(unknown, room)
    words = (place, "--head", head, "--style", "badger", "--lux", "100", "--lamp")
    right = _light(capsys, *words, str(known))
    assert right["comparable"] is True
    assert right["comparison"] == ""
    lux = read_lamp_file(known).lamp.lux
    told = _light(capsys, *words, str(unknown), "--lamp-lux", f"{lux}")
    assert told["comparable"] is True
    assert told["match"] == pytest.approx(right["match"], abs=1e-3)
    assert main(["light", *words, "phone", "--lamp-lux", "9"]) == 2
    assert "is already known" in capsys.readouterr().err


def test_captures_of_unknown_exposure_are_taken_alike_and_that_is_said(
    capsys: pytest.CaptureFixture[str], head: str, place: str, tmp_path: Path
) -> None:
    room = np.full((128, 256, 3), 0.02, np.float32)
    room[56:72, 118:138] = 30.0
    unknown = tmp_path / "unknown.exr"
    write_exr(unknown, room)
    words = ["light", place, "--head", head, "--lamp", str(unknown), "--style", "badger"]
    assert main([*words, "--json"]) == 0
    captured = capsys.readouterr()
    values = json.loads(captured.out)
    assert values["cd_m2_per_unit"] == 1.0
    assert values["assumed"] is True
    assert values["comparable"] is False
    assert "and of the place is unknown" in captured.err
    assert "as if captured in the same way" in captured.err


def test_a_lamp_of_the_library(
    capsys: pytest.CaptureFixture[str],
    head: str,
    place: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    light = np.full((128, 256, 3), 0.02, np.float32)
    alpha = np.zeros((128, 256), np.float32)
    alpha[56:72, 118:138] = 1.0
    light[alpha > 0] = 300.0
    lamp = make_lamp("desk", light, alpha, white_cd_m2=1.0, distance_m=0.45)
    add_lamp(lamps_folder(), lamp, "Desk lamp")
    words = (place, "--head", head, "--lux", "100", "--style", "badger")
    values = _light(capsys, *words, "--lamp", "Desk lamp")
    assert values["lamp_title"] == "Desk lamp"
    assert values["distance_m"] == 0.45
    assert "45 cm" in values["words"]
    assert main(["light", *words, "--lamp", "candle"]) == 2
    assert "candle" in capsys.readouterr().err


@pytest.mark.slow
def test_the_table(capsys: pytest.CaptureFixture[str], head: str, place: str) -> None:
    words = ("light", place, "--head", head, "--lamp", "panel@0.4", "--lux", "100")
    assert main([*words]) == 0
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert "100 lux" in lines[0]
    sided = ("left-", "right-")
    wanted = sum(name.startswith(sided) for name in NAMES)
    assert sum(line.startswith(sided) for line in lines) == wanted
    assert lines[-1].startswith("Now possible with the lamp: ")
    assert "below" in lines[-1]
    assert main([*words, "--style", "badger"]) == 0
    assert "Hold the lamp " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["{place}", "--lamp", "candle@0.3"], "no lamp “"),
        (["{place}", "--lamp", "candle"], "nor a lamp in your library"),
        (["{place}", "--lamp", "phone@soon"], "not a distance"),
        (["{place}", "--lamp", "phone@90"], "cannot be used"),
        (["{place}", "--lamp", "{folder}/none.exr"], "none.exr"),
        (["{place}", "--lamp", "{folder}/text.hdr"], "text.hdr"),
        (["{place}"], "--lamp"),
        (["{place}", "--lamp", "phone", "--style", "disco"], "no style"),
        (["{place}", "--lamp", "phone", "--lux", "-3"], "not a plausible light level"),
        (["{place}", "--lamp", "phone", "--lux", "nan"], "finite"),
        (["{place}", "--lamp", "panel@2", "--reach", "arm", "--lux", "9"], "within reach"),
        (["{folder}/nothing.exr", "--lamp", "phone"], "nothing.exr"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    capsys: pytest.CaptureFixture[str],
    head: str,
    place: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    sentence: str,
) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    (tmp_path / "text.hdr").write_text("this is no picture")
    filled = [word.format(place=place, folder=tmp_path) for word in words]
    try:
        code = main(["light", *filled, "--head", head])
    except SystemExit as stop:
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert sentence in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert "Traceback" not in captured.err
