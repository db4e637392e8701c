"""`turnlight solve` as a user meets it: table, JSON, sheet, and what it says of bad input."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from app.cli import main
from app.core.base.angles import wrap
from app.core.base.colour import luminance, srgb_encode
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from app.core.cautions.caution import Hazard
from app.core.environment.environment import read_environment
from app.core.solver.shortfall import Cause, LightShortfall, Origin
from app.core.solver.transport import save_transport
from app.core.styles.style_pack_file import pack_path, save_pack
from app.core.styles.styles import NAMES
from app.words.lights import NAMES as NAMES_OF_LIGHTS
from app.words.phrases.directions import direction_words
from app.words.why_out_of_reach import reason_line
from tests.helpers.probes import place as lamps
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment, synthetic_pack

KEYS = {
    "name",
    "title",
    "turn_deg",
    "turn_refined_deg",
    "direction",
    "quality_curve",
    "match_curve",
    "strength_curve",
    "match",
    "strength",
    "attainable",
    "reason",
    "arc_deg",
    "peaks",
}

pytestmark = pytest.mark.usefixtures("qapp")


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A head of the user's own: transport and pack beside each other."""
    path = tmp_path_factory.mktemp("heads") / "sphere.npz"
    digest = save_transport(path, lambert_sphere_transport())
    pack = synthetic_pack()
    header = dataclasses.replace(pack.header, transport_sha256=digest)
    save_pack(pack_path(path), dataclasses.replace(pack, header=header))
    return str(path)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> str:
    """One lamp at azimuth 30, height 35, with a little fill."""
    path = tmp_path_factory.mktemp("places") / "yard.exr"
    light = lamp_environment(30.0, 35.0, 8.0, (64, 128), fill=0.02)
    write_exr(path, np.repeat(light[..., None], 3, axis=2).astype(np.float32))
    return str(path)


def _solve(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    assert main(["solve", *words, "--json"]) == 0
    out = capsys.readouterr().out
    values: dict[str, Any] = json.loads(out)
    return values


def test_json_has_the_documented_keys(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    values = _solve(capsys, place, "--head", head)
    assert values["objective"] == "picture"
    assert values["head"] == head
    assert 0 < values["seconds"] < 60
    assert len(values["styles"]) == len(NAMES)
    for style in values["styles"]:
        assert style.keys() >= KEYS
        for curve in ("quality_curve", "match_curve", "strength_curve"):
            assert len(style[curve]) == 64
        index = round(style["turn_deg"] / 5.625) % 64
        assert style["match"] == style["match_curve"][index]
        assert style["strength"] == style["strength_curve"][index]
        assert style["attainable"] == (style["match"] >= 45 and style["strength"] >= 20)
        assert (style["reason"] is None) == style["attainable"]
        assert len(style["arc_deg"]) == 2
        assert {"turn_deg", "quality", "arc_deg"} <= style["peaks"][0].keys()
        assert style["peaks"][0]["turn_deg"] == style["turn_deg"]


def test_the_turn_of_a_lamp(capsys: pytest.CaptureFixture[str], head: str, place: str) -> None:
    values = _solve(capsys, place, "--head", head, "--style", "left-loop", "right-loop")
    left, right = values["styles"]
    assert left["turn_refined_deg"] == pytest.approx(65.0, abs=2.0)
    assert left["direction"] == "clockwise"
    assert right["turn_refined_deg"] == pytest.approx(-5.0, abs=2.0)
    assert right["direction"] == "counter-clockwise"


def test_the_front_moves_turns_and_curves(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    words = (place, "--head", head, "--style", "left-split")
    (plain,) = _solve(capsys, *words)["styles"]
    (moved,) = _solve(capsys, *words, "--front", "90")["styles"]
    assert moved["turn_deg"] == wrap(plain["turn_deg"] - 90)
    assert moved["match_curve"] == plain["match_curve"][16:] + plain["match_curve"][:16]


def test_the_paper_objective_takes_the_largest_quality(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    values = _solve(capsys, place, "--head", head, "--objective", "paper")
    assert values["objective"] == "paper"
    for style in values["styles"]:
        assert style["quality"] == max(style["quality_curve"])


def test_grey_light_is_light_without_its_colours(
    capsys: pytest.CaptureFixture[str], head: str, tmp_path: Path
) -> None:
    light = lamp_environment(30.0, 35.0, 8.0, (64, 128), fill=0.02)[..., None] * (1.0, 0.6, 0.2)
    light[:, :40] *= (0.1, 1.0, 3.0)
    grey = np.repeat(luminance(light)[..., None], 3, axis=2)
    found = []
    for name, values, words in (("c", light, ["--grey"]), ("g", grey, [])):
        path = tmp_path / f"{name}.exr"
        write_exr(path, values.astype(np.float32))
        found.append(_solve(capsys, str(path), "--head", head, "--objective", "paper", *words))
    assert found[0].pop("grey") is True
    assert "grey" not in found[1]
    for one, other in zip(found[0]["styles"], found[1]["styles"], strict=True):
        assert one["turn_deg"] == other["turn_deg"]
        assert one["quality_curve"] == pytest.approx(other["quality_curve"], rel=1e-4, abs=1e-5)


def test_the_table_is_aligned_and_says_why(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    assert main(["solve", place, "--head", head]) == 0
    lines = capsys.readouterr().out.splitlines()
    (top,) = [line for line in lines if line.startswith("style")]
    assert top.split()[:6] == [
        "style",
        "side",
        "turn",
        "direction",
        "match",
        "contrast",
    ]
    rows = lines[lines.index(top) + 1 :][: len(NAMES)]
    column = top.index("direction")
    assert all(row[column - 1] == " " for row in rows)
    below = next(row for row in rows if row.startswith("Below "))
    assert reason_line(LightShortfall(Cause.NO_LIGHT, "match", 0.0, 45.0, Origin.BELOW)) in below
    reached = sum(len(row.rstrip()) < top.index("reason") for row in rows)
    assert any(line.startswith(f"{reached} of {len(NAMES)}") for line in lines)


@pytest.mark.slow
def test_the_sheet_is_a_picture(
    capsys: pytest.CaptureFixture[str], head: str, place: str, tmp_path: Path
) -> None:
    sheet = tmp_path / "sheet.png"
    assert main(["solve", place, "--head", head, "--sheet", str(sheet)]) == 0
    capsys.readouterr()
    assert sheet.read_bytes().startswith(b"\x89PNG")
    assert [p.name for p in tmp_path.iterdir()] == ["sheet.png"]


def test_solving_needs_the_pack_only(
    capsys: pytest.CaptureFixture[str], place: str, tmp_path: Path
) -> None:
    save_pack(tmp_path / "alone.styles.npz", synthetic_pack())
    values = _solve(capsys, place, "--head", str(tmp_path / "alone.npz"))
    assert len(values["styles"]) == len(NAMES)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["{place}", "--style", "disco"], "no style"),
        (["{place}", "--head", "nobody"], "no head"),
        (["{place}", "--head", "nowhere.npz"], "no style pack"),
        (["{folder}/nothing.exr"], "nothing.exr"),
        (["{folder}/text.hdr"], "text.hdr"),
        (["{place}", "--front", "nan"], "finite"),
        (["{place}", "--objective", "best"], "invalid choice"),
        (["{place}", "--sheet", "{folder}/none/sheet.png"], "does not exist"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    capsys: pytest.CaptureFixture[str],
    head: str,
    place: str,
    tmp_path: Path,
    words: list[str],
    sentence: str,
) -> None:
    (tmp_path / "text.hdr").write_text("this is no picture")
    before = sorted(tmp_path.rglob("*"))
    filled = [word.format(place=place, folder=tmp_path) for word in words]
    chosen = [] if "--head" in filled else ["--head", head]
    try:
        code = main(["solve", *filled, *chosen])
    except SystemExit as stop:
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert sentence in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert "Traceback" not in captured.err
    assert sorted(tmp_path.rglob("*")) == before


def test_a_pack_of_another_transport_gives_no_sheet(
    capsys: pytest.CaptureFixture[str], place: str, tmp_path: Path
) -> None:
    path = tmp_path / "mixed.npz"
    save_transport(path, lambert_sphere_transport())
    save_pack(pack_path(path), synthetic_pack())
    sheet = tmp_path / "sheet.png"
    assert main(["solve", place, "--head", str(path), "--sheet", str(sheet)]) == 2
    assert "a different transport" in capsys.readouterr().err
    assert not sheet.exists()


def test_one_photograph_gets_a_rough_answer(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Two clipped lamps: which is the brighter is not known, so some turns are doubtful."""
    light = lamps([(-70.0, 15.0, 30.0, 8.0), (80.0, 40.0, 30.0, 8.0)], (64, 128))
    file = tmp_path / "sphere.png"
    codes = np.rint(255.0 * srgb_encode(np.minimum(light, 1.0))).astype(np.uint8)
    assert cv2.imwrite(str(file), codes)
    values = _solve(capsys, str(file))
    assert values["rough"]
    assert values["advice"][0].startswith("Rough answer")
    doubtful = [style["name"] for style in values["styles"] if style["doubtful"]]
    assert 0 < len(doubtful) < len(NAMES)
    (rough,) = values["cautions"]
    assert (rough["hazard"], rough["styles"]) == (Hazard.ROUGH, doubtful)
    assert 0.0 < rough["amount"] < 1.0
    assert main(["solve", str(file)]) == 0
    table = capsys.readouterr().out
    assert table.count(", doubtful") == len(doubtful)
    # The same light as `merge` makes of it.
    assert main(["merge", str(file), "-o", str(tmp_path / "rough.exr"), "--json"]) == 0
    merged = json.loads(capsys.readouterr().out)
    assert merged["rough"]
    assert merged["in_doubt"] == doubtful
    assert merged["frames"][0]["shutter_s"] is None
    assert not np.any(read_environment(tmp_path / "rough.exr").radiance > 16.01)
    # What was kept of it still says so.
    assert main(["solve", str(tmp_path / "rough.exr")]) == 0
    assert "rough was made from one photo" in capsys.readouterr().err


def test_a_photograph_that_is_no_sphere_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert cv2.imwrite(str(tmp_path / "wall.png"), np.full((300, 400, 3), 99, np.uint8))
    assert main(["solve", str(tmp_path / "wall.png")]) == 2
    error = capsys.readouterr().err
    assert "twice as wide as it is high" in error
    assert "Traceback" not in error


def test_verdict_is_in_table_and_json_for_all_styles_only(
    capsys: pytest.CaptureFixture[str], head: str, place: str
) -> None:
    verdict = _solve(capsys, place, "--head", head)["verdict"]
    # The lamp is at 30 degrees clockwise, which is towards the sitter's right.
    assert verdict["flow"]["azimuth_deg"] == pytest.approx(-30.0, abs=3.0)
    assert verdict["flow"]["hardness"] == "hard"
    assert direction_words(30.0, verdict["flow"]["elevation_deg"]) in verdict["light"]
    assert verdict["sentence"].startswith(f"{verdict['light']} ")
    assert set(verdict["yes"] + verdict["soft"]) <= set(NAMES)
    assert _solve(capsys, place, "--head", head, "--style", "top")["verdict"] is None
    assert main(["solve", place, "--head", head]) == 0
    assert capsys.readouterr().out.startswith(verdict["sentence"])


def test_json_names_the_light_in_the_way_and_what_would_help(
    capsys: pytest.CaptureFixture[str],
) -> None:
    studio = str(resources() / "demo" / "scenes" / "studio.exr")
    styles = {style["name"]: style for style in _solve(capsys, studio)["styles"]}
    loop = styles["left-loop"]
    assert loop["grade"] == "no"
    way = loop["in_the_way"]
    assert way.keys() == {
        *("lamp", "name", "azimuth_deg", "elevation_deg", "area", "share"),
        *("stops_without", "grade_without", "turn_without_deg"),
    }
    # The scene has four lamps; the second stands on the sitter's right.
    assert (way["lamp"], way["name"]) == ("B", NAMES_OF_LIGHTS["lamp"])
    assert -180.0 < way["azimuth_deg"] < 0.0
    assert 0.0 < way["share"] < 1.0
    assert way["stops_without"] > loop["cause"]["value_stops"]
    (mend,) = loop["mends"]
    assert (mend["how"], mend["grade"]) == ("block", way["grade_without"]) == ("block", "yes")
    assert mend["turn_deg"] == way["turn_without_deg"]
    assert (styles["flat"]["grade"], styles["flat"]["in_the_way"]) == ("yes", None)
    assert styles["flat"]["mends"] == []


def test_the_table_lists_only_what_would_help(capsys: pytest.CaptureFixture[str]) -> None:
    studio = str(resources() / "demo" / "scenes" / "studio.exr")
    helps = {}
    for style in ("left-loop", "left-rembrandt"):
        values = _solve(capsys, studio, "--style", style)["styles"][0]
        assert values["in_the_way"] is not None
        assert main(["solve", studio, "--style", style]) == 0
        helps[style] = "would give" in capsys.readouterr().out
        assert helps[style] == bool(values["mends"])
    assert helps == {"left-loop": True, "left-rembrandt": False}
