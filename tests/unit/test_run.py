"""What run.py does before Turnlight runs."""

from __future__ import annotations

import ast
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from types import ModuleType

FILE = Path(__file__).resolve().parents[2] / "run.py"


@pytest.fixture
def run() -> ModuleType:
    spec = importlib.util.spec_from_file_location("run_under_test", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Steps:
    """An environment whose slow steps only leave what they would leave."""

    def __init__(self, run: ModuleType, root: Path) -> None:
        self.done: list[str] = []
        for name in ("pyproject.toml", "constraints.txt"):
            (root / name).write_text(name, encoding="utf-8")
        self.environment = run.Environment(root)
        self.environment.create = self.create
        self.environment.reach_index = lambda: None
        self.run = run

    def create(self) -> None:
        self.done.append("create")
        self.environment.python.parent.mkdir(parents=True)
        self.environment.python.write_text("")
        library = "Lib" if os.name == "nt" else "lib/python3.11"
        self.library = self.environment.folder / library / "site-packages"
        self.library.mkdir(parents=True)

    def follow(self, command: list[str], folder: Path) -> tuple[int, str]:
        self.done.append(f"install {command[-1]}")
        assert not self.environment.stamp.exists()
        for name in ("numpy", "cv2", "__pycache__"):
            (self.library / name).mkdir(exist_ok=True)
        (self.library / "cv2" / "cv2.abi3.so").write_bytes(b"machine code")
        (self.library / "cv2" / "libcv.so.5").write_bytes(b"more of it")
        return 0, ""

    def ensure(self, extra: str = "") -> list[str]:
        self.done.clear()
        assert self.environment.ensure(extra) == self.environment.python
        return list(self.done)


@pytest.fixture
def steps(run: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Steps:
    made = Steps(run, tmp_path)
    monkeypatch.setattr(run, "follow", made.follow)
    return made


def test_first_start_installs_and_second_does_nothing(steps: Steps) -> None:
    assert steps.ensure() == ["create", "install ."]
    assert steps.ensure() == []


def test_tests_add_what_they_need_and_it_stays(steps: Steps) -> None:
    steps.ensure()
    assert steps.ensure("test") == ["install .[test]"]
    assert steps.ensure("test") == []
    assert steps.ensure() == []


@pytest.mark.parametrize("name", ["pyproject.toml", "constraints.txt"])
def test_changed_requirements_are_installed_with_the_same_extras(steps: Steps, name: str) -> None:
    steps.ensure("test")
    (steps.environment.root / name).write_text("numpy==99", encoding="utf-8")
    assert steps.ensure() == ["install .[test]"]
    assert steps.ensure() == []


@pytest.mark.parametrize(
    "damage",
    [
        "stamp missing",
        "stamp cut",
        "stamp odd",
        "no python",
        "no package",
        "moved",
        "a file",
        "library cut",
        "library gone",
    ],
)
def test_damaged_environment_is_rebuilt(
    steps: Steps, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    steps.ensure("test")
    environment = steps.environment
    stamp = environment.stamp.read_text(encoding="utf-8")
    left = environment.folder / "left-over"
    left.write_text("x")
    match damage:
        case "stamp missing":
            environment.stamp.unlink()
        case "stamp cut":
            environment.stamp.write_text(stamp[:40], encoding="utf-8")
        case "stamp odd":
            environment.stamp.write_text(json.dumps([1, 2]), encoding="utf-8")
        case "no python":
            environment.python.unlink()
        case "no package":
            (steps.library / "numpy").rmdir()
        case "moved":
            changed: dict[str, Any] = json.loads(stamp)
            changed["place"][0] += "-before"
            environment.stamp.write_text(json.dumps(changed), encoding="utf-8")
        case "library cut":
            os.truncate(steps.library / "cv2" / "cv2.abi3.so", 4)
        case "library gone":
            (steps.library / "cv2" / "libcv.so.5").unlink()
        case "a file":
            environment.folder.rename(environment.root / "aside")
            environment.folder.write_text("x")
    assert steps.ensure() == ["create", "install ."]
    assert not left.exists()
    assert "damaged" in capsys.readouterr().err
    assert steps.ensure() == []


def test_failed_installation_leaves_no_stamp(
    steps: Steps, monkeypatch: pytest.MonkeyPatch, run: ModuleType
) -> None:
    steps.ensure()
    monkeypatch.setattr(run, "follow", lambda command, folder: (1, "No matching distribution"))
    with pytest.raises(run.SetupError, match="not available"):
        steps.environment.ensure("test")
    assert not steps.environment.stamp.exists()


@pytest.mark.parametrize(
    ("output", "code", "words"),
    [
        ("... Failed to establish a new connection: [Errno -2]", 3, "Go online once"),
        ("... [Errno 11001] getaddrinfo failed", 3, "Go online once"),
        ("Temporary failure in name resolution\nNo matching distribution", 3, "Go online"),
        ("There was a problem confirming the ssl certificate: ...", 3, "certificate"),
        ("OSError: [Errno 28] No space left on device", 2, "disk is full"),
        ("ERROR: No matching distribution found for drjit", 2, "not available for this Python"),
        ("ERROR: something else", 2, "The installation failed"),
    ],
)
def test_failures_are_explained(run: ModuleType, output: str, code: int, words: str) -> None:
    error = run.explain(output, Path("/clone/.venv/install.log"))
    assert error.code == code
    assert words in str(error)
    assert output not in str(error)
    assert str(error).endswith("install.log")


def test_a_stamp_of_an_older_version_is_good(steps: Steps) -> None:
    steps.ensure()
    stamp: dict[str, Any] = json.loads(steps.environment.stamp.read_text(encoding="utf-8"))
    names = sorted(Path(name).name for name in stamp.pop("files"))
    assert names == ["cv2", "cv2.abi3.so", "libcv.so.5", "numpy"]
    steps.environment.stamp.write_text(json.dumps(stamp), encoding="utf-8")
    assert steps.ensure() == []


def test_what_pip_said_is_in_the_log_that_is_named(
    steps: Steps,
    monkeypatch: pytest.MonkeyPatch,
    run: ModuleType,
    capsys: pytest.CaptureFixture[str],
) -> None:
    steps.ensure()
    said = "ERROR: thirty lines of pip"
    monkeypatch.setattr(run, "follow", lambda command, folder: (1, said))
    with pytest.raises(run.SetupError, match=r"install\.log") as caught:
        steps.environment.ensure("test")
    assert said not in str(caught.value) + capsys.readouterr().err
    assert steps.environment.log.read_text(encoding="utf-8") == said


@pytest.mark.skipif(os.name != "posix", reason="a script as Python")
@pytest.mark.parametrize(
    ("script", "code"),
    [
        ("sleep 60", 3),
        ("echo 'Failed to establish a new connection: [Errno 101]'; exit 1", 3),
        # What is not about the network is left to the installation itself.
        ("echo 'No matching distribution found for hatchling'; exit 1", None),
        ("exit 0", None),
    ],
)
def test_an_index_out_of_reach_is_told_soon_and_nothing_is_removed(
    run: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, code: int | None
) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{script}\n")
    python.chmod(0o755)
    monkeypatch.setattr(run, "PROBE_S", 0.5)
    monkeypatch.setattr(run.sys, "executable", str(python))
    environment = run.Environment(tmp_path)
    environment.folder.mkdir()
    if code is None:
        environment.reach_index()
        return
    with pytest.raises(run.SetupError, match="no connection") as caught:
        environment.ensure()
    assert caught.value.code == code
    assert environment.log.is_file()
    assert environment.folder.is_dir()


@pytest.mark.slow
def test_the_pip_that_makes_environments_can_be_asked(run: ModuleType) -> None:
    wheel = run.bundled_pip()[0]
    done = subprocess.run(
        [sys.executable, "-m", "pip", "--version"],
        env={**os.environ, "PYTHONPATH": str(wheel)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0
    assert wheel.name in done.stdout


def installed(run: ModuleType, root: Path) -> Any:
    """An environment with one package and its record."""
    environment = run.Environment(root)
    library = "Lib" if os.name == "nt" else "lib/python3.11"
    package = environment.folder / library / "site-packages"
    (package / "cv2").mkdir(parents=True)
    (package / "cv2" / "cv2.abi3.so").write_bytes(b"machine code")
    (package / "cv2" / "data, all.xml").write_bytes(b"<x/>")
    (package / "cv2-5.dist-info").mkdir()
    (package / "cv2-5.dist-info" / "RECORD").write_text(
        "cv2/cv2.abi3.so,sha256=Ws4qKMb0CHXvK6rAJ9i5Gi9lcBJxx7Q-y9RnZk3KnvA,12\n"
        '"cv2/data, all.xml",sha256=x,4\n'
        "cv2-5.dist-info/RECORD,,\n"
    )
    environment.stamp.write_text("{}")
    return environment


def test_after_a_crash_a_damaged_library_is_found_and_marked_for_repair(
    run: ModuleType, tmp_path: Path
) -> None:
    environment = installed(run, tmp_path)
    machine_code = next(environment.folder.rglob("*.so"))
    assert environment.damaged() == []
    assert "undamaged" in run.after_crash(environment, 139)
    assert run.after_crash(environment, 1) is None
    for content in (b"machine", b"machine c0de"):
        machine_code.write_bytes(content)
        environment.stamp.write_text("{}")
        words = run.after_crash(environment, 135)
        assert "cv2/cv2.abi3.so" in words
        assert "same command again" in words
        assert not environment.stamp.exists()
    for code in (0, 2, 3, 130, 143):
        assert run.after_crash(environment, code) is None


@pytest.mark.parametrize(
    ("system", "version", "libc", "mac", "machine", "words"),
    [
        ("linux-x86_64", (3, 13), ("glibc", "2.36"), "", "x86_64", None),
        ("linux-x86_64", (3, 13), ("glibc", "2.31"), "", "x86_64", "glibc 2.34"),
        ("linux-x86_64", (3, 13), ("", ""), "", "x86_64", "with glibc"),
        ("macosx-13.0-arm64", (3, 14), ("", ""), "14.2", "arm64", None),
        ("linux-aarch64", (3, 13), ("glibc", "2.39"), "", "aarch64", None),
        ("linux-aarch64", (3, 13), ("glibc", "2.36"), "", "aarch64", "glibc 2.39"),
        ("linux-riscv64", (3, 13), ("glibc", "2.41"), "", "riscv64", "this processor"),
        ("macosx-13.0-x86_64", (3, 12), ("", ""), "13.6.1", "x86_64", "Intel"),
        ("macosx-12.0-arm64", (3, 12), ("", ""), "12.7", "arm64", "macOS 13"),
        ("win-amd64", (3, 14), ("", ""), "", "AMD64", None),
        ("win-arm64", (3, 13), ("", ""), "", "ARM64", "ARM Windows"),
        ("win32", (3, 13), ("", ""), "", "x86", "32-bit"),
    ],
)
def test_what_no_library_is_made_for_is_told_before_anything_is_installed(
    run: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    system: str,
    version: tuple[int, int],
    libc: tuple[str, str],
    mac: str,
    machine: str,
    words: str | None,
) -> None:
    names = {"linux": "linux", "macosx": "darwin", "win": "win32", "win32": "win32"}
    monkeypatch.setattr(run.sysconfig, "get_platform", lambda: system)
    monkeypatch.setattr(run.sys, "platform", names[system.split("-")[0]])
    monkeypatch.setattr(run.sys, "version_info", (*version, 0, "final", 0))
    monkeypatch.setattr(run.platform, "libc_ver", lambda: libc)
    monkeypatch.setattr(run.platform, "mac_ver", lambda: (mac, ("", "", ""), machine))
    monkeypatch.setattr(run.platform, "machine", lambda: machine)
    found = run.unsupported()
    assert (words is None) == (found is None)
    if words is not None:
        assert words in found
        with pytest.raises(run.SetupError, match=words):
            run.Environment(tmp_path).ensure()
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", ["venv", "ensurepip"])
def test_python_without_venv(
    run: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    missing: str,
) -> None:
    monkeypatch.setattr(run, "ROOT", tmp_path)
    monkeypatch.setattr(
        run.importlib.util, "find_spec", lambda name: None if name == missing else "there"
    )
    assert run.main(["styles"]) == 2
    assert "sudo apt install python3-venv" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_old_python_is_told_in_words() -> None:
    source = FILE.read_text(encoding="utf-8")
    # Syntax that an older Python cannot read would hide the sentence.
    ast.parse(source, feature_version=(3, 7))
    code = f"import sys; sys.version_info = (3, 9, 2); exec(open({str(FILE)!r}).read())"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert "needs Python 3.11 or newer, and this is Python 3.9" in done.stderr
    assert "Traceback" not in done.stderr


def test_standard_library_only() -> None:
    tree = ast.parse(FILE.read_text(encoding="utf-8"))
    names = {
        (node.module or "") if isinstance(node, ast.ImportFrom) else alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert {name.split(".")[0] for name in names} <= sys.stdlib_module_names


class Calls:
    """Records the commands that run.py starts, and gives the codes it is told to."""

    def __init__(self, codes: list[int] | None = None) -> None:
        self.commands: list[list[str]] = []
        self.codes = codes or []

    def __call__(self, command: list[str], folder: Path | None = None) -> int:
        self.commands.append(command[1:])
        return self.codes.pop(0) if self.codes else 0


@pytest.fixture
def ready(run: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setattr(run.Environment, "ensure", lambda self, extra: Path("py"))
    return run


DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")


@pytest.mark.parametrize("name", DISPLAYS)
def test_without_arguments_it_starts_the_app_where_there_is_a_display(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    calls = Calls()
    monkeypatch.setattr(ready, "call", calls)
    monkeypatch.setattr(ready.sys, "platform", "linux")
    for other in DISPLAYS:
        monkeypatch.delenv(other, raising=False)
    monkeypatch.setenv(name, "something")
    assert ready.main([]) == 0
    assert calls.commands == [["-P", "-m", "app"]]


def test_without_a_display_it_says_so_and_solves_the_bundled_scene(
    ready: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    calls = Calls()
    monkeypatch.setattr(ready, "call", calls)
    monkeypatch.setattr(ready.sys, "platform", "linux")
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    assert ready.main([]) == 0
    sheet = str(tmp_path / "turnlight-sheet.png")
    assert calls.commands == [["-P", "-m", "app", "solve", str(ready.SCENE), "--sheet", sheet]]
    printed = capsys.readouterr()
    assert "no display" in printed.err
    assert sheet in printed.out
    assert ready.SCENE.is_file()


def test_everything_else_goes_to_turnlight_with_its_code(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = Calls([130])
    monkeypatch.setattr(ready, "call", calls)
    assert ready.main(["solve", "my place.exr", "--json"]) == 130
    assert calls.commands == [["-P", "-m", "app", "solve", "my place.exr", "--json"]]


def test_test_runs_all_checks_and_pytest_last(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = Calls([0, 0, 1, 0])
    monkeypatch.setattr(ready, "call", calls)
    assert ready.main(["test"]) == 1
    assert [command[1] for command in calls.commands] == ["ruff", "ruff", "mypy", "pytest"]
    assert "--check" in calls.commands[1]
    assert "--cov" not in calls.commands[-1]
    assert calls.commands[-1][2:4] == ["-m", "not slow"]
    ready.main(["test", "--coverage"])
    assert "--cov" in calls.commands[-1]
    assert "--coverage" not in calls.commands[-1]


def test_all_tests_share_the_processors_and_some_of_them_do_not(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = Calls()
    monkeypatch.setattr(ready, "call", calls)
    monkeypatch.setattr(ready.os, "sched_getaffinity", lambda _: {0, 3, 5}, raising=False)
    shared = ["-n", "3", "--dist", "worksteal"]
    ready.main(["test"])
    assert calls.commands[-1][-4:] == shared
    ready.main(["test", "tests/unit/test_run.py"])
    assert "-n" not in calls.commands[-1]
    calls.commands.clear()
    ready.main(["test", "--slow"])
    assert calls.commands[0] == ["-m", "pytest", "-m", "slow and not alone", *shared]
    monkeypatch.setattr(ready.os, "sched_getaffinity", lambda _: set(range(64)))
    ready.main(["test"])
    assert calls.commands[-1][-4:-2] == ["-n", "8"]
    monkeypatch.setattr(ready.os, "sched_getaffinity", lambda _: {1})
    ready.main(["test"])
    assert "-n" not in calls.commands[-1]


@pytest.mark.parametrize(
    ("codes", "runs", "code"),
    [([0, 0], 2, 0), ([1, 0], 2, 1), ([0, 1], 2, 1), ([2], 1, 2), ([143], 1, 143)],
)
def test_those_that_measure_time_run_last_and_alone(
    ready: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    codes: list[int],
    runs: int,
    code: int,
) -> None:
    calls = Calls(codes)
    monkeypatch.setattr(ready, "call", calls)
    assert ready.main(["test", "--slow"]) == code
    assert len(calls.commands) == runs
    if runs == 2:
        assert calls.commands[-1] == ["-m", "pytest", "-m", "slow and alone"]


def test_slow_tests_alone_and_arguments_for_pytest(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = Calls()
    monkeypatch.setattr(ready, "call", calls)
    assert ready.main(["test", "--slow", "-x"]) == 0
    assert calls.commands == [["-m", "pytest", "-m", "slow", "-x"]]
    calls.commands.clear()
    ready.main(["test", "-k", "turn"])
    assert calls.commands[-1] == ["-m", "pytest", "-m", "not slow", "-k", "turn"]


def test_call_passes_codes_on(run: ModuleType) -> None:
    assert run.call([sys.executable, "-c", "raise SystemExit(3)"]) == 3


@pytest.mark.skipif(os.name != "posix", reason="signals as exit codes")
def test_call_counts_a_signal_as_a_shell_does(run: ModuleType) -> None:
    code = "import os, signal; os.kill(os.getpid(), signal.SIGTERM)"
    assert run.call([sys.executable, "-c", code]) == 143


def test_follow_shows_the_waits_and_hides_the_rest(
    run: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = "print('Collecting numpy'); print('  Downloading numpy (17 MB)'); raise SystemExit({})"
    assert run.follow([sys.executable, "-c", code.format(0)], tmp_path)[0] == 0
    assert capsys.readouterr().err == "  Downloading numpy (17 MB)\n"
    code_and_output = run.follow([sys.executable, "-c", code.format(7)], tmp_path)
    assert code_and_output == (7, "Collecting numpy\n  Downloading numpy (17 MB)\n")
    assert "Collecting numpy" not in capsys.readouterr().err
