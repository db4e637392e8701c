"""benchmarks/speed.md says what was measured, and what was measured is of the bench as it is."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from benchmarks.speed.timing.runner.bars import BARS

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"


@pytest.fixture
def script() -> ModuleType:
    path = ROOT / "benchmarks" / "speed" / "page.py"
    spec = importlib.util.spec_from_file_location("speed_page", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_the_page_has_the_kept_numbers(script: ModuleType) -> None:
    text = script.PAGE.read_text(encoding="utf-8")
    assert script.filled(text) == text


def test_plots_that_are_kept_are_shown(script: ModuleType) -> None:
    for name in script.GROWN:
        file = f"growth-{name}.svg"
        shown = (RESULTS / file).read_text(encoding="utf-8")
        assert ElementTree.fromstring(shown).tag.endswith("svg")
        assert f"results/{file}" in script.PAGE.read_text(encoding="utf-8")


def test_results_have_every_row_with_a_bar() -> None:
    values = json.loads((RESULTS / "speed.json").read_text(encoding="utf-8"))
    bars = {row["name"]: row["bar"] for row in values["rows"] if row["bar"]}
    assert bars == {name: bar.words for name, bar in BARS.items()}
    assert {peer["name"] for row in values["rows"] for peer in row["peers"]} == {
        "OpenCV",
        "colour-hdri",
        "skylibs",
        "Mitsuba",
    }


@pytest.mark.parametrize("name", ["speed", "growth", "before-after"])
def test_results_say_on_what_and_when_and_not_whose(name: str) -> None:
    text = (RESULTS / f"{name}.json").read_text(encoding="utf-8")
    machine = json.loads(text)["machine"]
    assert machine["processor"]
    assert machine["date"] >= "2026"
    assert "/home" not in text
    assert "/tmp" not in text
    assert "/work" not in text
