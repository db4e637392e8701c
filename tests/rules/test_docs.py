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


def test_architecture_names_files_and_functions_that_exist() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    journeys = text[text.index("## Five journeys") : text.index("## Who owns")]
    assert all(len(steps.split("\n1. ")) == 2 for steps in journeys.split("\n### ")[1:])
    named = [name for path, names in code_named_in(text) for name in missing(path, names)]
    assert named == []


def test_architecture_is_two_pages() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 160
    assert text.count("\n### ") == 5


def code_named_in(text: str) -> list[tuple[str, list[str]]]:
    """Pairs of a path and the names after its colon: `app/a.py`: `name`, `Class.name`."""
    pattern = r"`((?:app|tests)/[\w/]+(?:\.py)?)`(?::((?:,? `[A-Za-z_.]+`)+))?"
    return [(path, re.findall(r"`([^`]+)`", names)) for path, names in re.findall(pattern, text)]


def missing(path: str, names: list[str]) -> list[str]:
    file = ROOT / path
    if not file.exists():
        return [path]
    code = file.read_text(encoding="utf-8") if names else ""
    parts = [(name, part) for name in names for part in name.split(".")]
    pattern = r"^\s*(?:def|class) {}\b|^{}\b.* = "
    return [
        f"{path}: {name}"
        for name, part in parts
        if not re.search(pattern.format(part, part), code, re.M)
    ]


def test_a_name_that_is_gone_is_missing() -> None:
    text = "`app/cli.py`: `main`, `nothing`; `app/cli.py`; `app/no.py`: `main`"
    assert code_named_in(text)[0] == ("app/cli.py", ["main", "nothing"])
    assert [name for each in code_named_in(text) for name in missing(*each)] == [
        "app/cli.py: nothing",
        "app/no.py",
    ]
