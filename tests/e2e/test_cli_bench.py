"""`turnlight bench` on a small head: rows, table, JSON, what is kept, how cost grows."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import time
from functools import partial
from pathlib import Path

import pytest

from app.cli import main
from app.core.base.errors import Cancelled
from app.core.solver.transport import save_transport
from app.core.styles.style_pack_file import pack_path, save_pack
from benchmarks.speed.timing import command, growth, merge
from benchmarks.speed.timing.runner.bars import BARS
from benchmarks.speed.timing.runner.rows import Case, Peer, Row
from benchmarks.speed.timing.runner.run import Bench, run_all
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_pack

NAMES = [
    "solve.quality",
    "solve.match",
    "solve.match.product",
    "solve.paper",
    "answers.all",
    "preintegrate.full",
    "preintegrate.stroke",
    "render.rgb",
    "gallery.all",
    "paint.segment",
    "light.one",
    "light.all",
    "light.match",
    "environment.reduce",
    "environment.turn",
    "environment.rotate",
    "heading.search",
    "heading.track",
    "preview.decode",
    "start.solve",
    "merge.three",
]


@pytest.fixture
def head(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    path = tmp_path / "sphere.npz"
    digest = save_transport(path, lambert_sphere_transport())
    pack = synthetic_pack()
    header = dataclasses.replace(pack.header, transport_sha256=digest)
    save_pack(pack_path(path), dataclasses.replace(pack, header=header))
    # One call each: what is tested here is what is said, not how fast it is.
    monkeypatch.setattr("benchmarks.speed.timing.runner.rows.clock", _once)
    monkeypatch.setattr(growth, "clock", _once)
    monkeypatch.setattr(merge, "_ROUNDS", 1)
    monkeypatch.setattr(command, "run_all", partial(run_all, shape=(256, 512)))
    monkeypatch.setattr("benchmarks.speed.timing.runner.run.start_case", _nothing)
    return str(path)


def _once(work: object, *_: object, **__: object) -> list[float]:
    work()  # type: ignore[operator]
    return [0.001]


def _nothing() -> Case:
    return Case("start.solve", lambda: None, lambda: None, "nothing", lambda: None, "nothing")


@pytest.mark.slow
def test_json(capsys: pytest.CaptureFixture[str], head: str, tmp_path: Path) -> None:
    kept = tmp_path / "new" / "kept"
    assert main(["bench", "--head", head, "--no-peers", "--json", "-o", str(kept)]) == 0
    captured = capsys.readouterr()
    values = json.loads(captured.out)
    assert [row["name"] for row in values["rows"]] == NAMES
    # A head without views has no answers from aside.
    assert set(BARS) - {"solve.match.yaw", "answers.yaw"} < set(NAMES)
    assert all(name in captured.err for name in NAMES)
    for row in values["rows"]:
        assert {"name", "seconds", "baseline_seconds", "ratio", "limit_seconds"} <= row.keys()
        assert row["ratio"] == pytest.approx(row["baseline_seconds"] / row["seconds"])
    assert values["bandwidth_bytes_per_s"] > 0
    assert values["peers_not_there"] == ["colour-hdri", "skylibs", "Mitsuba"]
    assert values["machine"]["cores"] == values["processors"] > 0
    assert json.loads((kept / "speed.json").read_text(encoding="utf-8")) == values
    assert [path.name for path in kept.iterdir()] == ["speed.json"]


@pytest.mark.slow
def test_one_row_alone(capsys: pytest.CaptureFixture[str], head: str) -> None:
    assert main(["bench", "--head", head, "--no-peers", "--only", "render.rgb", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["name"] == "render.rgb"


def _found(*_: object, **__: object) -> Bench:
    rows = (
        Row("solve.quality", 0.001, 0.001, 0.001, 0.001, "loop"),
        Row("render.rgb", 0.001, 0.002, 0.1, 0.001, "loop", "SIFT", (Peer("other", 0.5, "so"),)),
    )
    return Bench(rows, 1e10, ("skylibs",), {"cores": 2})


def test_table(
    capsys: pytest.CaptureFixture[str], head: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "run_all", _found)
    assert main(["bench", "--head", head]) == 0
    lines = capsys.readouterr().out.splitlines()
    (line,) = (line for line in lines if line.startswith("render.rgb"))
    assert line.split()[1:6] == ["1.000", "2.000", "100.000", "100x", "1.000"]
    (line,) = (line for line in lines if line.startswith("  other"))
    assert line.split()[1:] == ["500.000", "500x;", "so"]
    assert any("10.0 GB/s" in line and "render.rgb: SIFT." in line for line in lines)
    assert any(line.endswith(": skylibs.") for line in lines)
    assert lines[-2:] == [
        "solve.quality: 1.0 times faster than plain, not 100; 1 ms, not 0.05",
        "Bars are missed.",
    ]


@pytest.mark.slow
def test_growth(
    capsys: pytest.CaptureFixture[str], head: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(growth, "_WIDTHS", (128, 256))
    monkeypatch.setattr(growth, "_STYLES", (1, 18))
    monkeypatch.setattr(growth, "_TURNS", (1, 4))
    monkeypatch.setattr(growth, "_ROWS", (16, 32))
    monkeypatch.setattr(growth, "_FRAMES", ((0.0, -2.0),))
    monkeypatch.setattr(growth, "_MANY", (0.0, 2.0, -2.0))
    monkeypatch.setattr(growth, "_FRAME_SHAPE", (128, 256))
    kept = tmp_path / "kept"
    assert main(["bench", "--head", head, "--growth", "-o", str(kept)]) == 0
    captured = capsys.readouterr()
    assert "styles, at 64 turns each" in captured.out
    assert "frames" in captured.err
    names = {"styles", "turns", "light", "panorama", "frames"}
    drawn = {f"growth-{name}.svg" for name in names}
    assert {path.name for path in kept.iterdir()} == {"growth.json", *drawn}
    values = json.loads((kept / "growth.json").read_text(encoding="utf-8"))
    assert {one["name"] for one in values["growth"]} == names


def test_unknown_heads(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--head", "nobody"]) == 2
    assert "no head 'nobody'" in capsys.readouterr().err


def test_folders_that_cannot_be(
    capsys: pytest.CaptureFixture[str], head: str, tmp_path: Path
) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file")
    assert main(["bench", "--head", head, "-o", str(taken)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("turnlight: Cannot make the folder")
    assert "Traceback" not in said


@pytest.mark.parametrize("words", [["--growht"], ["-o"], ["extra"]])
def test_bad_options(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", *words]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_stopping_leaves_nothing_half_written(
    capsys: pytest.CaptureFixture[str],
    head: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stopped(*_: object, **__: object) -> Bench:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)
        raise Cancelled

    monkeypatch.setattr(command, "run_all", stopped)
    kept = tmp_path / "kept"
    assert main(["bench", "--head", head, "--no-peers", "-o", str(kept)]) == 130
    assert "Stopped." in capsys.readouterr().err
    assert list(kept.iterdir()) == []
