"""Who may import whom: the contracts of pyproject.toml, and what an import really pulls in."""

from __future__ import annotations

import ast
import os
import pkgutil
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import app.commands
import app.core
from tests.helpers.import_graph import import_circles, libraries_by_module, reached_from

ROOT = Path(__file__).resolve().parents[2]

# (module, what is planted there, the contract that must notice)
LEAKS = [
    ("core/solver/search.py", "import PySide6.QtCore", "no Qt below the ui"),
    ("commands/solve.py", "import pyqtgraph", "no Qt below the ui"),
    ("core/environment/environment_file.py", "import requests", "no network in core"),
    ("devices/errors.py", "import PySide6.QtCore", "no Qt below the ui"),
    ("ui/presenters/window_model.py", "import PySide6.QtCore", "no Qt below the ui"),
    ("ui/presenters/undo_stack.py", "import app.ui.theme.theme", "presenters know no"),
    ("devices/simulated/exchange.py", "import app.devices.theta", "a simulated camera knows"),
    ("core/solver/solve.py", "import mitsuba", "the renderer is for baking only"),
    ("core/styles/styles.py", "import app.core.baking.scene", "the renderer is for baking only"),
    ("export/theme.py", "import PySide6.QtGui", "no Qt below the ui"),
    ("core/base/colour.py", "import app.commands.solve", "command line above ui and commands"),
    (
        "commands/solve.py",
        "import app.ui.presenters.window_model",
        "command line above ui and commands",
    ),
    ("export/theme.py", "import app.ui.theme.theme", "command line above ui and commands"),
    ("ui/shell/start.py", "import app.commands.solve", "command line above ui and commands"),
    (
        "core/solver/solve.py",
        "import app.words.why_out_of_reach",
        "command line above ui and commands",
    ),
    ("devices/errors.py", "import app.words.why_out_of_reach", "devices make no sentences"),
    (
        "words/why_out_of_reach.py",
        "import app.export.set_sheet",
        "command line above ui and commands",
    ),
    ("words/why_out_of_reach.py", "import numpy", "words compute and read nothing"),
    (
        "words/why_out_of_reach.py",
        "import app.core.storage.settings_file",
        "words compute and read nothing",
    ),
]


MOST_MODULES = 15

QT = {"PySide6", "shiboken6", "pyqtgraph", "superqt", "qtpy", "qtawesome"}

NETWORK_COMMANDS = (
    "app.commands.capture",
    "app.commands.simulate_camera",
)


def contracts(folder: Path) -> subprocess.CompletedProcess[str]:
    command = "from importlinter.cli import lint_imports_command as main; main()"
    return subprocess.run(
        [sys.executable, "-c", command, "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONUTF8": "1", "NO_COLOR": "1", "COLUMNS": "200"},
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


def test_contracts_are_kept() -> None:
    done = contracts(ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


def test_faulty_camera_knows_nothing_of_its_client() -> None:
    """What it does wrong must not come from the code that has to cope with it."""
    modules = [*(ROOT / "tests" / "faulty_camera").glob("*.py")]
    assert len(modules) > 5
    client = re.compile(r"app\.devices\.(theta|capture|profiles)")
    assert not [path.name for path in modules if client.search(path.read_text(encoding="utf-8"))]


def test_benchmarks_and_scripts_are_independent() -> None:
    """What both need is in `scenes`, which knows neither."""
    scripts = {path.stem for path in (ROOT / "scripts").glob("*.py")} | {"scripts"}
    apart = {"benchmarks": scripts, "scripts": {"benchmarks"}, "scenes": scripts | {"benchmarks"}}
    for folder, others in apart.items():
        modules = [*(ROOT / folder).rglob("*.py")]
        assert len(modules) > 5
        wrong = [(path.name, names) for path in modules if (names := top_imports(path) & others)]
        assert not wrong, folder


def top_imports(path: Path) -> set[str]:
    """First parts of the names of all modules that a file imports, inside functions too."""
    nodes = [*ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    plain = [each.name for node in nodes if isinstance(node, ast.Import) for each in node.names]
    whence = [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    return {name.partition(".")[0] for name in (*plain, *whence)}


def test_app_has_no_import_circles() -> None:
    assert import_circles(ROOT / "app") == frozenset()


def test_import_circles_finds_a_circle(tmp_path: Path) -> None:
    package = tmp_path / "shop"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "till.py").write_text("from shop import stock\n")
    (package / "stock.py").write_text("def sell():\n    from shop.till import X\n")
    (package / "door.py").write_text("from .till import X\n")
    assert import_circles(package) == {frozenset({"shop.till", "shop.stock"})}


@pytest.mark.parametrize(("file", "leak", "contract"), LEAKS)
def test_contracts_notice_a_leak_inside_a_function(
    tmp_path: Path, file: str, leak: str, contract: str
) -> None:
    ignored = shutil.ignore_patterns("__pycache__", "_resources")
    shutil.copytree(ROOT / "app", tmp_path / "app", ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    assert (tmp_path / "app" / file).exists()
    with (tmp_path / "app" / file).open("a", encoding="utf-8") as stream:
        stream.write(f"\n\ndef leak() -> None:\n    {leak}\n")
    done = contracts(tmp_path)
    assert done.returncode == 1
    broken = [line for line in done.stdout.splitlines() if " BROKEN" in line]
    assert any(line.startswith(contract) for line in broken), done.stdout


def panels(package: Path) -> list[str]:
    """List the modules of screens that show nothing themselves."""
    return [
        f"app.ui.screens.{file.parent.name}.{file.stem}"
        for file in sorted((package / "ui/screens").glob("*/*.py"))
        if not file.stem.endswith(("_view", "__init__"))
    ]


def views_and_qt(package: Path) -> dict[str, list[str]]:
    """List what panels must not lead to, by panel; only those that do.

    Sheets are drawn with QtGui, for which a panel needs no window.
    """
    view = re.compile(r"app\.ui\.(overlays|shell|theme|widgets|plots)\b|app\.ui\..*_view$")
    painters = {
        name
        for name, libraries in libraries_by_module(package).items()
        if libraries & QT and not name.startswith("app.export.")
    }
    leaks = {
        name: sorted(one for one in reach if view.match(one) or one in painters)
        for name, reach in reached_from(package, panels(package)).items()
    }
    return {name: leak for name, leak in leaks.items() if leak}


def test_panels_import_neither_views_nor_qt() -> None:
    assert len(panels(ROOT / "app")) > 30
    assert views_and_qt(ROOT / "app") == {}


@pytest.mark.parametrize(
    "leak", ["import PySide6.QtCore", "from app.ui.screens.light.lamp_view import LampColumn"]
)
def test_panels_notice_a_leak_inside_a_function(tmp_path: Path, leak: str) -> None:
    shutil.copytree(ROOT / "app", tmp_path / "app", ignore=shutil.ignore_patterns("_resources"))
    with (tmp_path / "app/ui/screens/light/lamp.py").open("a", encoding="utf-8") as stream:
        stream.write(f"\n\ndef leak() -> None:\n    {leak}\n")
    assert "app.ui.screens.light.lamp" in views_and_qt(tmp_path / "app")


def modules() -> list[str]:
    found = [
        info.name
        for package in (app.core, app.commands)
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    ]
    assert len(found) > 20
    return found


def test_nothing_heavy_comes_with_core_or_commands() -> None:
    # A fresh interpreter: in this one other tests have imported what they need. Only the command
    # that runs is imported, so those that speak to cameras may bring the network with them.
    plain = [name for name in modules() if not name.startswith(NETWORK_COMMANDS)]
    code = (
        "import importlib, sys\n"
        "heavy = {'PySide6', 'shiboken6', 'pyqtgraph', 'mitsuba', 'drjit', 'requests', 'scipy'}\n"
        "for name in sys.argv[1:]:\n"
        "    importlib.import_module(name)\n"
        "    if found := heavy & set(sys.modules):\n"
        "        sys.exit(f'{name} imports {sorted(found)}')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *plain],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_sheets_are_drawn_without_widgets() -> None:
    code = (
        "import importlib, pkgutil, sys\n"
        "import app.export\n"
        "for info in pkgutil.iter_modules(app.export.__path__):\n"
        "    importlib.import_module(f'app.export.{info.name}')\n"
        "print(*(n for n in sys.modules if n.startswith('PySide6.Qt')))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    assert set(done.stdout.split()) == {"PySide6.QtCore", "PySide6.QtGui"}


def test_an_answer_without_a_sheet_needs_no_qt() -> None:
    scene = ROOT / "resources" / "demo" / "scenes" / "courtyard.exr"
    code = (
        "import sys\n"
        "from app.cli import main\n"
        f"code = main(['solve', {str(scene)!r}, '--style', 'butterfly', '--json'])\n"
        "sys.exit(code or 'PySide6' in sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_packages_hold_at_most_15_modules() -> None:
    folders = [path for part in ("app", "benchmarks") for path in (ROOT / part).rglob("*")]
    counts = {
        folder.relative_to(ROOT).as_posix(): len(
            [file for file in folder.glob("*.py") if file.name != "__init__.py"]
        )
        for folder in folders
        if folder.is_dir()
    }
    assert counts["app/core/measure/bracket"] > 5
    assert {name: count for name, count in counts.items() if count > MOST_MODULES} == {}
