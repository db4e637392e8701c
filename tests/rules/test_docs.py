"""The documentation points at what exists and speaks of this project alone."""

from __future__ import annotations

import doctest
import importlib
import re
from pathlib import Path

import pytest

from app.cli import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    [
        *ROOT.glob("*.md"),
        *(
            page
            for part in ("docs", "benchmarks", "resources")
            for page in (ROOT / part).rglob("*.md")
        ),
    ]
)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    targets = LINK.findall(page.read_text(encoding="utf-8"))
    local = [target for target in targets if "://" not in target and "mailto:" not in target]
    assert not [target for target in local if not (page.parent / target).exists()]


def test_how_it_works_names_code_that_is_there() -> None:
    text = (ROOT / "docs" / "how-it-works.md").read_text(encoding="utf-8")
    places = re.findall(r"`(app/[\w/]+(?:\.py)?/?)`(?:: `(\w+)`)?", text)
    assert len(places) > 20
    for path, name in places:
        assert (ROOT / path).exists(), path
        if name:
            code = (ROOT / path).read_text(encoding="utf-8")
            assert re.search(rf"^(def|class) {name}\b", code, re.M), (path, name)


def test_readme_opens_with_what_it_does() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    first = text.index("docs/images/app/film.webp")
    assert (ROOT / "docs" / "images" / "app" / "film.webp").stat().st_size <= 3_000_000
    assert text.index("how far to turn") < first < text.index("##")
    assert "\npython3 run.py\npython3 run.py test\n" in text
    assert len(text.splitlines()) <= 60


def test_every_command_is_shown() -> None:
    text = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    for name in COMMANDS:
        assert f"run.py {name}" in text


def test_scenes_have_credits() -> None:
    folder = ROOT / "resources" / "demo" / "scenes"
    scenes = sorted(path.name for path in folder.iterdir() if path.suffix in {".exr", ".hdr"})
    credited = re.findall(r"^\| `([^`]+)`", (folder / "CREDITS.md").read_text("utf-8"), re.M)
    assert scenes == credited
    assert len(scenes) == 8
    assert "CC0" in (folder / "CREDITS.md").read_text("utf-8")


EXAMPLES = [
    file.relative_to(ROOT).as_posix()
    for part in ("app/core", "app/devices", "app/export", "tests/faulty_camera")
    for file in sorted((ROOT / part).rglob("*.py"))
    if ">>> " in file.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("file", EXAMPLES)
def test_examples_in_docstrings_hold(file: str) -> None:
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    found = doctest.testmod(module)
    assert found.attempted > 0
    assert found.failed == 0


def test_the_architecture_names_modules_that_are_there() -> None:
    rooms = [*(ROOT / "app").rglob("*"), *(ROOT / "benchmarks").rglob("*")]
    there = {path.stem for path in rooms} | {"requests"}
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith(("| `", "Inside", "`"))]
    named = {name for row in rows for name in re.findall(r"`([a-z_]+)`", row)}
    assert len(named) > 80
    assert named - there == set()
