"""How many files it takes to add something; CONTRIBUTING.md says which."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from app.core.base.paths import resources
from app.core.styles import styles

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the program that can be changed and run, its tables of cameras as well."""
    ignored = shutil.ignore_patterns("__pycache__", "_resources")
    shutil.copytree(ROOT / "app", tmp_path / "app", ignore=ignored)
    for each in ("helpers", "faulty_camera"):
        shutil.copytree(ROOT / "tests" / each, tmp_path / "tests" / each, ignore=ignored)
    # Large ones are linked to; what a test writes into is copied, or it would change the original.
    (tmp_path / "resources").mkdir()
    for part in (ROOT / "resources").iterdir():
        if part.name != "cameras":
            (tmp_path / "resources" / part.name).symlink_to(part)
    shutil.copytree(ROOT / "resources" / "cameras", tmp_path / "resources" / "cameras")
    return tmp_path


def insert(file: Path, before: str, text: str) -> None:
    """Put a text before the only place where another one stands."""
    source = file.read_text(encoding="utf-8")
    assert source.count(before) == 1
    file.write_text(source.replace(before, text + before), encoding="utf-8")


def run(folder: Path, program: str) -> str:
    """Run a few lines of Python on a copy, and return what they print."""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(folder)!r})\n{program}"],
        cwd=folder,
        env={**os.environ, "PYTHONUTF8": "1"},
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


CAMERA = """
[Z9]
like = "X"
sensor = "X"
shortest_s = 0.000125
isos = [64, 3200]
apertures = [2.1, 4.0]
sizes = [[3000, 6000]]
user_prefix = "YZ"
"""
CAPTURE = """
from dataclasses import replace
from pathlib import Path

import app
from app.core.camera_catalogue import camera_facts
from app.devices.protocol_profiles import profile_for
from app.devices.simulated.cameras import personality_named
from app.devices.theta.client import Info
from tests.faulty_camera.models import user_name
from tests.helpers.cameras import Rig

assert Path(app.__file__).parent.parent == Path.cwd()
facts = camera_facts("RICOH THETA Z9")
profile = profile_for(Info("RICOH THETA Z9"))
person = personality_named("z9")
assert profile.fallback == facts.limits and profile.picture == (6000, 3000)
assert profile.user_name("123") == "THETAYZ123" and user_name(person).startswith("THETAYZ")
assert person.apertures == facts.limits.apertures and person.sizes == facts.sizes
rig = Rig(Path("session"), "Z9")
before = dict(rig.camera.options)
result = rig.shoot("paper")
assert rig.camera.options == before
assert result.profile == replace(profile, extra=())
assert all(shot.exposure.shutter_s in facts.limits.shutters_s for shot in result.plan.shots)
assert all(shot.exposure.iso in facts.limits.isos for shot in result.plan.shots)
print(result.info.model, len(result.frames) == len(result.plan.shots))
"""


@pytest.mark.slow
def test_a_camera_model_takes_one_row(copy: Path) -> None:
    """Planner, client and simulated camera know it, and a bracket of it is captured."""
    table = copy / "resources" / "cameras" / "theta.toml"
    table.write_text(table.read_text("utf-8") + CAMERA, "utf-8")
    assert run(copy, CAPTURE) == "RICOH THETA Z9 True\n"


SCREEN = {
    "__init__.py": '"""The Notes screen."""\n',
    "screen.py": '''"""Notes on the open place."""

from app.ui.presenters.actions import Action


class NotesPresenter:
    def __init__(self, services, place_controller):
        self.services = services
        self.front = False

    def attach(self, view):
        view.setAccessibleName("Notes of this place")

    def detach(self):
        pass

    def enter(self):
        self.front = True

    def leave(self):
        self.front = False

    def actions(self):
        return (Action("clear-notes", "Clear the notes", lambda: None, shortcut="Ctrl+L"),)
''',
    "screen_view.py": '''"""The notes."""

from PySide6.QtWidgets import QWidget


class NotesScreen(QWidget):
    def __init__(self, presenter, compact):
        super().__init__()
        self.presenter = presenter
''',
}
ROW = """    ScreenSpec(
        "notes",
        title="Notes",
        tip="Write down what you saw",
        command="Notes: write them down",
        icon="edit",
        done=lambda model: model.place is not None and bool(model.place.notes),
    ),
"""
VISIT = """
import os
import sys
from pathlib import Path

os.environ["QT_QPA_PLATFORM"] = "offscreen"

import app
from app.ui.theme import apply, set_theme
from tests.helpers.whole_window import opened
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

assert Path(app.__file__).parent.parent == Path.cwd()
application = QApplication(sys.argv[:1])
set_theme("dark", 1.0)
apply(application)
with opened(Path("home")) as (shown, robot):
    robot.press(Qt.Key.Key_5, Qt.KeyboardModifier.ControlModifier)
    presenter = shown.window.front_presenter
    assert shown.window.front.presenter is presenter and presenter.front
    assert robot.find("Notes of this place") is shown.window.front
    print([one.words for one in shown.commands.all_actions() if "otes" in one.words])
    robot.click("Probe")
    assert not presenter.front
    robot.click("Notes")
    assert presenter.front
"""


@pytest.mark.slow
def test_a_screen_takes_its_folder_and_one_row(copy: Path) -> None:
    """The rail, its key, "Find anything" and the window know it."""
    screens = copy / "app" / "ui" / "screens"
    for name, text in SCREEN.items():
        (screens / "notes" / name).parent.mkdir(parents=True, exist_ok=True)
        (screens / "notes" / name).write_text(text, encoding="utf-8")
    insert(screens / "registry.py", ")\n\n\ndef screen(", ROW)
    assert run(copy, VISIT) == "['Clear the notes', 'Notes: write them down']\n"


MOST_FILES = 3


def files_with(pattern: str) -> list[str]:
    """Sources and pages that hold a pattern."""
    files = [*(ROOT / "app").rglob("*.py"), *(ROOT / "docs").glob("*.md")]
    return sorted(
        str(path.relative_to(ROOT))
        for path in files
        if re.search(pattern, path.read_text(encoding="utf-8"))
    )


# -- styles ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in styles.NAMES if name.startswith("left-")])
def test_a_style_is_named_in_few_files(name: str) -> None:
    # The files of packs and transports are baked from them, by a command.
    own = [path.name for path in (resources() / "styles").glob(f"{name}.toml")]
    sources = [file for file in files_with(f'"{name}"') if file.endswith(".py")]
    assert own
    assert "app/core/styles/styles.py" in sources
    assert len(own) + len(sources) <= MOST_FILES


def test_a_file_and_a_name_make_a_style_and_its_mirror_image(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(resources() / "styles", tmp_path / "styles")
    text = (tmp_path / "styles" / "left-loop.toml").read_text("utf-8")
    broad = text.replace("Loop", "Broad").replace("far cheek", "right cheek")
    (tmp_path / "styles" / "left-broad.toml").write_text(broad, "utf-8")
    monkeypatch.setattr(styles, "resources", lambda: tmp_path)
    monkeypatch.setattr(styles, "NAMES", (*styles.NAMES, "left-broad", "right-broad"))
    *others, left, right = styles.load_styles()
    assert len(others) == len(styles.NAMES) - 2
    assert (left.name, right.name, right.title, right.side) == (
        "left-broad",
        "right-broad",
        "Broad",
        "right",
    )
    assert right.lamps[0].azimuth_deg == -left.lamps[0].azimuth_deg
    assert "points to the left cheek" in right.note
    assert styles.mirror(right) == left


# -- settings ----------------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["reduce_motion", "sitter_name", "self_timer_s", "places_folder"])
def test_a_setting_is_named_in_few_files(key: str) -> None:
    # Its field, its words, its line on the page, and where it counts.
    files = files_with(rf"(?<!\w){key}(?!\w)")
    named = {"app/core/storage/settings.py", "app/words/settings.py", "docs/settings.md"}
    assert named <= set(files)
    assert len(files) <= MOST_FILES + 1, files
