"""A wheel of the project is complete and works where the clone is not."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from app import __version__

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.slow


def call(
    *command: str | Path, cwd: Path, extra: dict[str, str] | None = None, code: int = 0
) -> subprocess.CompletedProcess[str]:
    # Nothing of this run's own paths may help the installed program.
    env = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env={**env, "PYTHONUTF8": "1", **(extra or {})},
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    # Through the source archive, so that this is tested too.
    call(sys.executable, "-m", "build", "--no-isolation", "-o", folder, ROOT, cwd=folder)
    assert len(list(folder.glob("*.tar.gz"))) == 1
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make an environment with the wheel in it, and return its folder of programs.

    The libraries are those of this run, by way of a path file. Such a file's own path files are
    not followed, so the project itself, which is installed here by one, stays out.
    """
    folder = tmp_path_factory.mktemp("far away") / "env"
    call(sys.executable, "-m", "venv", "--without-pip", folder, cwd=ROOT)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    python = programs / ("python.exe" if os.name == "nt" else "python")
    paths = call(
        python, "-c", "import sysconfig; print(sysconfig.get_paths()['purelib'])", cwd=folder
    )
    call(
        sys.executable, "-m", "pip", "--python", python, "install", "--disable-pip-version-check",
        "--no-deps", "--no-index", wheel, cwd=folder,
    )  # fmt: skip
    own = sysconfig.get_paths()
    (Path(paths.stdout.strip()) / "libraries.pth").write_text(
        "\n".join(dict.fromkeys([own["purelib"], own["platlib"]])), encoding="utf-8"
    )
    return programs


def test_wheel_holds_package_and_resources(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    tracked = subprocess.run(
        ["git", "ls-files", "app", "resources", "turnlight.py"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    files = tracked.stdout.split("\n")[:-1] if tracked.returncode == 0 else on_disk()
    assert len(files) > 50
    expected = {
        name.replace("resources/", "app/_resources/", 1) if name.startswith("res") else name
        for name in files
        if not name.startswith("resources/demo/location/")
    }
    assert expected <= names
    extra = {name for name in names - expected if not name.startswith("turnlight-")}
    # What is new and not yet under version control; no leavings of a run.
    assert not [name for name in extra if name.endswith((".pyc", ".part", ".tmp"))]
    elsewhere = ("tests/", "resources/", "docs/", "benchmarks/")
    assert not [name for name in names if name.startswith(elsewhere)]
    assert len([name for name in names if "/cafe/view-" in name]) == 2 * 72


def test_wheel_is_small(wheel: Path) -> None:
    # 60 MB and the picture data.
    assert wheel.stat().st_size <= 78e6


def on_disk() -> list[str]:
    found = [*(ROOT / "app").rglob("*"), *(ROOT / "resources").rglob("*")]
    plain = (path for path in found if path.is_file() and "__pycache__" not in path.parts)
    return [path.relative_to(ROOT).as_posix() for path in plain]


def test_metadata(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        info = f"turnlight-{__version__}.dist-info"
        text = archive.read(f"{info}/METADATA").decode()
        assert f"{info}/licenses/LICENSE" in archive.namelist()
    assert "License-Expression: MIT" in text
    assert "Requires-Python: >=3.11" in text
    needed = {
        line.split(":")[1].split(";")[0].strip()
        for line in text.splitlines()
        if line.startswith("Requires-Dist") and "extra ==" not in line
    }
    assert "pyside6-essentials<6.12,>=6.9" in needed
    assert len(needed) == 12


def test_installed_program_works_elsewhere(installed: Path, tmp_path: Path) -> None:
    python = installed / ("python.exe" if os.name == "nt" else "python")
    turnlight = installed / ("turnlight.exe" if os.name == "nt" else "turnlight")
    place = call(
        python, "-c", "from app.core.base.paths import resources; print(resources())", cwd=tmp_path
    )
    resources = Path(place.stdout.strip())
    assert resources.name == "_resources"
    assert resources.is_relative_to(installed.parent.resolve())

    styles = json.loads(call(turnlight, "styles", "--json", cwd=tmp_path).stdout)["styles"]
    assert len(styles) >= 18

    scene = shutil.copy(resources / "demo" / "scenes" / "studio.exr", tmp_path)
    done = call(turnlight, "solve", scene, "--sheet", "sheet.png", "--json", cwd=tmp_path)
    answers = {answer["name"]: answer for answer in json.loads(done.stdout)["styles"]}
    assert set(answers) == {style["name"] for style in styles}
    assert any(answer["attainable"] for answer in answers.values())
    assert (tmp_path / "sheet.png").read_bytes().startswith(b"\x89PNG")

    code = (
        "import turnlight\n"
        "place = turnlight.read_environment('studio.exr')\n"
        "print(*(result.name for result in turnlight.solve(place)))\n"
    )
    done = call(python, "-c", code, cwd=tmp_path, extra={"PYTHONPATH": f"lib{os.pathsep}"})
    assert done.stdout.split() == list(answers)


@pytest.mark.parametrize("words", [["bench"], ["bench", "--help"], ["evaluate", "-o", "a.html"]])
def test_instruments_need_a_clone(installed: Path, tmp_path: Path, words: list[str]) -> None:
    turnlight = installed / ("turnlight.exe" if os.name == "nt" else "turnlight")
    # Another package of that name, where Python would find it.
    (tmp_path / "benchmarks").mkdir()
    (tmp_path / "benchmarks" / "__init__.py").write_text("raise SystemExit('the wrong one')\n")
    done = call(turnlight, *words, cwd=tmp_path, extra={"PYTHONPATH": "."}, code=2)
    assert done.stdout == ""
    assert done.stderr == (
        f"turnlight: “{words[0]}” is not part of the installed program. "
        f"Clone Turnlight’s source and run “python3 run.py {words[0]}” in it.\n"
    )
    assert f"\n    {words[0]} " in call(turnlight, "--help", cwd=tmp_path).stdout


@pytest.mark.parametrize("path", [None, ".", "trailing"])
@pytest.mark.parametrize("shape", ["folder", "file", "namespace", "submodule"])
def test_installed_program_works_in_a_folder_with_an_app_of_its_own(
    installed: Path, tmp_path: Path, shape: str, path: str | None
) -> None:
    broken = "raise SystemExit('the wrong app')\n"
    match shape:
        case "folder":
            (tmp_path / "app").mkdir()
            (tmp_path / "app" / "__init__.py").write_text(broken)
        case "file":
            (tmp_path / "app.py").write_text(broken)
        case "namespace":
            (tmp_path / "app" / "core").mkdir(parents=True)
            (tmp_path / "app" / "cli.py").write_text(broken)
        case "submodule":
            # As a clone of Turnlight itself: an older one must not be mixed with this one.
            for name in ("__init__.py", "cli.py", "core/__init__.py", "core/errors.py"):
                file = tmp_path / "app" / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text("" if name.endswith("__init__.py") else broken)
    extra = {None: {}, ".": {"PYTHONPATH": "."}, "trailing": {"PYTHONPATH": f"lib{os.pathsep}"}}
    turnlight = installed / ("turnlight.exe" if os.name == "nt" else "turnlight")
    done = call(turnlight, "styles", "--json", cwd=tmp_path, extra=extra[path])
    assert len(json.loads(done.stdout)["styles"]) >= 18
    assert done.stderr == ""

    # The camera of the demo is a process of its own, started in the same folder.
    demo = (
        "import sys\n"
        "from app.devices.clock import SystemClock\n"
        "from app.devices.device_sets import DemoDevices\n"
        "from app.core.base.paths import resources\n"
        "from app.core.base.progress import Token\n"
        "devices = DemoDevices(SystemClock(), resources() / 'demo' / 'cafe')\n"
        "try:\n"
        "    print(len(devices.discover(Token()).cameras))\n"
        "finally:\n"
        "    devices.close()\n"
    )
    if path is None:
        python = installed / ("python.exe" if os.name == "nt" else "python")
        assert call(python, "-P", "-c", demo, cwd=tmp_path).stdout.strip() == "1"
