"""`turnlight evaluate` as a user meets it: one page, its numbers, and what it says of bad input."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.cli import main
from app.core.base.imaging.images import write_exr
from app.core.base.paths import resources
from benchmarks.answers.evaluation.tables import load_tables, save_tables, tables_path

VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """Checks that tags are balanced, and collects what the page asks for."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.headings: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.sources += [v or "" for k, v in attrs if k in ("src", "href")]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Tags that close themselves, as in SVG."""

    def handle_endtag(self, tag: str) -> None:
        assert self.open
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("h1", "h2"):
            self.headings.append(data)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two of the bundled scenes."""
    folder = tmp_path_factory.mktemp("scenes")
    for name in ("studio", "sunset"):
        shutil.copy(resources() / "demo" / "scenes" / f"{name}.exr", folder)
    (folder / "notes.txt").write_text("no panorama")
    return folder


@pytest.fixture(scope="module")
def report(scenes: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("report")
    words = ["evaluate", "--scenes", str(scenes), "-o", str(folder / "r.html")]
    assert main([*words, "--json", str(folder / "r.json")]) == 0
    assert sorted(p.name for p in folder.iterdir()) == ["r.html", "r.json"]
    text = (folder / "r.html").read_text(encoding="utf-8")
    return text, json.loads((folder / "r.json").read_text(encoding="utf-8"))


def test_the_page_is_whole_and_needs_nothing_beside_it(
    report: tuple[str, dict[str, Any]],
) -> None:
    text, _ = report
    page = Page()
    page.feed(text)
    assert not page.open
    assert len(page.headings) >= 8
    assert page.sources
    assert all(source.startswith("data:image/jpeg;base64,") for source in page.sources)
    assert len(page.sources) == 16 * 3
    assert not re.search(r"url\(|@import|<script|<link", text)
    assert len(text) < 15e6


def test_the_paper_stands_beside_our_numbers(report: tuple[str, dict[str, Any]]) -> None:
    text, found = report
    for number in ("6.15°", "1.9°", "4.95°", "2.02°", "17.05°", "9.73°"):
        assert number in text
    assert found["pairs"] == 32
    assert [row["size"] for row in found["lighting"]] == ["32 × 16", "64 × 32", "128 × 64"]
    assert [row["size"] for row in found["pictures"]] == ["50 × 50", "100 × 100", "200 × 200"]
    for rows in (found["lighting"], found["pictures"]):
        assert rows[-1]["mean_of_all_deg"] == 0
        assert rows[-1]["mean_regret"] == 0
        assert f"{rows[1]['mean_deg']:.2f}°" in text
    heads = set(found["heads"]["paper"]["by_head_deg"])
    assert {"female", "male", "generic-light", "generic-dark", "older"} <= heads


def test_an_exposure_does_not_change_anything(
    report: tuple[str, dict[str, Any]], scenes: Path, tmp_path: Path
) -> None:
    from app.core.environment.environment import read_environment

    for file in scenes.glob("*.exr"):
        bright = read_environment(file).radiance * np.float32(16)
        write_exr(tmp_path / file.name, bright)
    out = tmp_path / "again.json"
    assert main(["evaluate", "--scenes", str(tmp_path), "--json", str(out)]) == 0
    again = json.loads(out.read_text(encoding="utf-8"))
    for one, two in zip(again["lighting"], report[1]["lighting"], strict=True):
        assert one["mean_of_all_deg"] == pytest.approx(two["mean_of_all_deg"])
        assert one["mean_regret"] == pytest.approx(two["mean_regret"], rel=1e-3, abs=1e-9)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["evaluate", *words]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return said


def test_bad_input_is_refused_with_a_sentence(
    scenes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "no folder" in refused(capsys, "--scenes", str(tmp_path / "none"))
    assert "no panorama" in refused(capsys, "--scenes", str(tmp_path))
    assert "folder" in refused(capsys, "--scenes", str(scenes), "-o", str(tmp_path / "a" / "b"))
    assert "--bake" in refused(capsys, "--scenes", str(scenes), "--head", "x.ply")
    said = refused(capsys, "--scenes", str(scenes), "--tables", str(tmp_path))
    assert "turnlight evaluate --bake" in said
    (tmp_path / "broken.exr").write_bytes(b"nothing")
    assert "broken.exr" in refused(capsys, "--scenes", str(tmp_path))


def test_tables_of_other_styles_are_refused(
    scenes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from dataclasses import replace

    other = replace(load_tables(tables_path()), styles_sha256="0" * 64)
    save_tables(tables_path(tmp_path), other)
    said = refused(capsys, "--scenes", str(scenes), "--tables", str(tmp_path))
    assert "other styles" in said
