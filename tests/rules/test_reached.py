"""Nothing lies about: the program imports all of its modules, and every library it depends on."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from app.cli import COMMANDS
from app.commands.shared.instruments import INSTRUMENTS
from app.ui.overlays import OVERLAYS
from app.ui.screens.registry import SCREENS
from tests.helpers.import_graph import libraries, unreached

ROOT = Path(__file__).resolve().parents[2]
ENTRIES = (
    "app.__main__",
    "app.cli",
    "app.desktop",
    *(f"app.commands.{name.replace('-', '_')}" for name in COMMANDS if name not in INSTRUMENTS),
    *(f"app.ui.screens.{one.key}.{part}" for one in SCREENS for part in ("screen", "screen_view")),
    *(f"app.ui.overlays.{module}" for *_, module, _ in OVERLAYS.values()),
)
# Where a library is imported by another name than it is installed by.
MODULES = {"opencv-contrib-python-headless": "cv2", "PySide6_Essentials": "PySide6"}


def dependencies() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    names = [re.split(r"[<>=!~;\[ ]", line, maxsplit=1)[0] for line in project["dependencies"]]
    return [MODULES.get(name, name) for name in names]


def test_every_module_is_reached() -> None:
    assert sorted(unreached(ROOT / "app", ENTRIES)) == []


def test_every_dependency_is_imported() -> None:
    assert set(dependencies()) - libraries(ROOT / "app") == set()


def test_a_module_that_nothing_imports_is_found(tmp_path: Path) -> None:
    package = tmp_path / "app"
    package.mkdir()
    for name, text in {
        "__init__": "",
        "cli": "def main():\n    from app import lazily\n",
        "lazily": "import app.deep.down\n",
        "left": "import app.cli\n",
    }.items():
        (package / f"{name}.py").write_text(text)
    (package / "deep").mkdir()
    (package / "deep" / "__init__.py").write_text("import numpy.linalg\n")
    (package / "deep" / "down.py").write_text("")
    assert unreached(package, ["app.cli"]) == {"app.left"}
    assert libraries(package) == {"app", "numpy"}


@pytest.mark.parametrize("name", ENTRIES)
def test_entries_exist(name: str) -> None:
    assert (ROOT / f"{name.replace('.', '/')}.py").is_file()
