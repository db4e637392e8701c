"""`turnlight bench` on a small head: rows, table, JSON."""

from __future__ import annotations

import dataclasses
import json
from functools import partial
from pathlib import Path

import pytest

from app.cli import main
from app.commands import bench as command
from app.core import bench, bench_merge
from app.core.pack import pack_path, save_pack
from app.core.transport import save_transport
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_pack


@pytest.fixture
def head(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    path = tmp_path / "sphere.npz"
    digest = save_transport(path, lambert_sphere_transport())
    pack = synthetic_pack()
    header = dataclasses.replace(pack.header, transport_sha256=digest)
    save_pack(pack_path(path), dataclasses.replace(pack, header=header))
    # One call each: what is tested here is what is said, not how fast it is.
    monkeypatch.setattr(bench, "_time", _once)
    monkeypatch.setattr(bench_merge, "_ROUNDS", 1)
    monkeypatch.setattr(command, "run_merge", partial(bench_merge.run_merge, shape=(256, 512)))
    return str(path)


def _once(call: object, budget_s: float, most: int) -> tuple[float, float]:
    call()  # type: ignore[operator]
    return 0.001, 0.002


def test_json(capsys: pytest.CaptureFixture[str], head: str) -> None:
    assert main(["bench", "--head", head, "--json"]) == 0
    captured = capsys.readouterr()
    values = json.loads(captured.out)
    names = [row["name"] for row in values["rows"]]
    assert names[:2] == ["solve.quality", "solve.match"]
    assert {"preintegrate.full", "preintegrate.stroke", "render.rgb", "merge.three"} < set(names)
    for row in values["rows"]:
        assert {"name", "seconds", "baseline_seconds", "ratio", "limit_seconds"} <= row.keys()
        assert row["ratio"] == pytest.approx(row["baseline_seconds"] / row["seconds"])
    assert values["bandwidth_bytes_per_s"] > 0
    assert "solve.quality" in captured.err


def test_table(capsys: pytest.CaptureFixture[str], head: str) -> None:
    assert main(["bench", "--head", head]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("render.rgb") for line in lines)
    assert lines[-1].startswith("Milliseconds.")


def test_unknown_heads(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--head", "nobody"]) == 2
    assert "no head called 'nobody'" in capsys.readouterr().err
