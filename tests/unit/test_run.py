"""run.py: setting up the environment and starting Turnlight."""

from __future__ import annotations

import ast
import http.server
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator
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


class Calls:
    """Records the commands that run.py starts, and answers with the exit codes it was given."""

    def __init__(self, *codes: int) -> None:
        self.commands: list[list[str]] = []
        self.codes = list(codes)

    def __call__(
        self, command: list[str], folder: Path | None = None, to_stderr: bool = False
    ) -> int:
        self.commands.append(command)
        return self.codes.pop(0) if self.codes else 0

    def arguments(self) -> list[list[str]]:
        return [command[1:] for command in self.commands]


class Steps(Calls):
    """An environment whose slow steps only leave the files that they would leave."""

    def __init__(self, run: ModuleType, root: Path) -> None:
        super().__init__()
        for name in ("pyproject.toml", "constraints.txt"):
            (root / name).write_text(name, encoding="utf-8")
        self.environment = run.Environment(root)
        library = "Lib" if os.name == "nt" else "lib/python3.11"
        self.library = self.environment.folder / library / "site-packages"

    def __call__(
        self, command: list[str], folder: Path | None = None, to_stderr: bool = False
    ) -> int:
        if "venv" in command:
            shutil.rmtree(self.environment.folder, ignore_errors=True)
            self.environment.python.parent.mkdir(parents=True)
            self.environment.python.write_text("")
        elif "install" in command:
            for name in ("numpy", "cv2", "__pycache__"):
                (self.library / name).mkdir(parents=True, exist_ok=True)
            (self.library / "cv2" / "cv2.abi3.so").write_bytes(b"machine code")
            (self.library / "cv2" / "libcv.so.5").write_bytes(b"more of it")
        return super().__call__(command)

    def ensure(self, extra: str = "") -> list[str]:
        """Return the steps that `Environment.ensure` took, by one word each."""
        self.commands.clear()
        assert self.environment.ensure(extra) == self.environment.python
        words = {"venv": "create", "ensurepip": "pip", "-e": "install"}
        return [
            word + (f" {command[-1]}" if word == "install" else "")
            for command in self.commands
            for key, word in words.items()
            if key in command
        ]


@pytest.fixture
def steps(run: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Steps:
    steps = Steps(run, tmp_path)
    monkeypatch.setattr(run, "call", steps)
    monkeypatch.setattr(run.shutil, "which", lambda name: None)
    return steps


def test_setup_installs_at_the_first_start_only(steps: Steps) -> None:
    assert steps.ensure() == ["create", "pip", "install ."]
    assert steps.ensure() == []


def test_setup_adds_an_extra_and_keeps_it(steps: Steps) -> None:
    steps.ensure()
    assert steps.ensure("test") == ["pip", "install .[test]"]
    assert steps.ensure("test") == []
    assert steps.ensure() == []


@pytest.mark.parametrize("name", ["pyproject.toml", "constraints.txt"])
def test_setup_installs_changed_requirements_with_the_same_extras(steps: Steps, name: str) -> None:
    steps.ensure("test")
    (steps.environment.root / name).write_text("numpy==99", encoding="utf-8")
    assert steps.ensure() == ["pip", "install .[test]"]
    assert steps.ensure() == []


def test_setup_keeps_packages_that_somebody_added(steps: Steps) -> None:
    steps.ensure()
    (steps.library / "ipython").mkdir()
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
def test_setup_rebuilds_a_damaged_environment(
    steps: Steps, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    steps.ensure("test")
    environment = steps.environment
    stamp = environment.stamp.read_text(encoding="utf-8")
    leftover = environment.folder / "leftover"
    leftover.write_text("x")
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
            changed["python"][0] += "-before"
            environment.stamp.write_text(json.dumps(changed), encoding="utf-8")
        case "library cut":
            os.truncate(steps.library / "cv2" / "cv2.abi3.so", 4)
        case "library gone":
            (steps.library / "cv2" / "libcv.so.5").unlink()
        case "a file":
            environment.folder.rename(environment.root / "aside")
            environment.folder.write_text("x")
    assert steps.ensure() == ["create", "pip", "install ."]
    assert not leftover.exists()
    assert "damaged" in capsys.readouterr().err
    assert steps.ensure() == []


def test_setup_leaves_a_linked_environment_alone(steps: Steps, tmp_path: Path) -> None:
    steps.ensure()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    steps.environment.folder.rename(elsewhere / "venv")
    steps.environment.folder.symlink_to(elsewhere / "venv")
    (elsewhere / "venv" / "turnlight.json").unlink()
    steps.ensure()
    assert (elsewhere / "venv" / "lib").exists() or (elsewhere / "venv" / "Lib").exists()
    assert not steps.environment.folder.is_symlink()


def test_failed_update_keeps_the_environment(
    steps: Steps, run: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps.ensure()
    listed = steps.environment.root / "pyproject.toml"
    listed.write_text("numpy==99", encoding="utf-8")
    monkeypatch.setattr(run, "call", Calls(0, 1))
    with pytest.raises(run.SetupError):
        steps.environment.ensure()
    listed.write_text("pyproject.toml", encoding="utf-8")
    assert steps.ensure() == []


@pytest.mark.parametrize(
    ("log", "code", "words"),
    [
        ("... Failed to establish a new connection: [Errno -2]", 3, "connection"),
        ("... [Errno 11001] getaddrinfo failed", 3, "connection"),
        (
            "connection broken by 'ReadTimeoutError'\nNo matching distribution found",
            3,
            "connection",
        ),
        ("Temporary failure in name resolution\nNo matching distribution", 3, "connection"),
        ("There was a problem confirming the ssl certificate: ...", 3, "certificate"),
        ("OSError: [Errno 28] No space left on device", 2, "disk is full"),
        ("(from versions: none)\nERROR: No matching distribution found for drjit", 2, "supported"),
        ("Read timed out.\n(from versions: 0.4.6, 1.0)\nNo matching distribution", 2, "supported"),
        ("ERROR: something else", 2, "The installation failed"),
    ],
)
def test_setup_explains_a_failed_installation(
    run: ModuleType,
    steps: Steps,
    monkeypatch: pytest.MonkeyPatch,
    log: str,
    code: int,
    words: str,
) -> None:
    def pip(command: list[str], folder: Path | None = None, to_stderr: bool = False) -> int:
        if "install" not in command:
            return steps(command)
        steps.environment.log.write_text(log, encoding="utf-8")
        return 1

    monkeypatch.setattr(run, "call", pip)
    with pytest.raises(run.SetupError, match=words) as caught:
        steps.environment.ensure()
    sentence, exit_code = caught.value.args
    assert exit_code == code
    assert log not in sentence
    assert sentence.endswith("install.log")
    assert not steps.environment.stamp.exists()


def test_setup_uses_uv_where_there_is_one(
    steps: Steps, run: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run.shutil, "which", {"uv": "/opt/uv"}.get)
    assert steps.ensure() == ["create", "install ."]
    assert {command[0] for command in steps.commands} == {"/opt/uv"}


def test_setup_falls_back_to_pip_where_uv_fails(
    steps: Steps, run: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run.shutil, "which", {"uv": "/opt/uv"}.get)
    steps.codes = [0, 1]
    assert steps.ensure() == ["create", "install .", "create", "pip", "install ."]


LIBRARY = "lamp-1.0-py3-none-any.whl"


class Index(http.server.BaseHTTPRequestHandler):
    """A package index with one small library; `delay_s` before each reply."""

    delay_s = 0.0

    def do_GET(self) -> None:
        time.sleep(self.delay_s)
        if self.path == "/simple/lamp/":
            body = f'<a href="/{LIBRARY}">{LIBRARY}</a>'.encode()
        elif self.path == f"/{LIBRARY}":
            body = wheel("lamp", {"lamp.py": "WATTS = 60\n"})
        else:
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html" if self.path.endswith("/") else "x/y")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *arguments: object) -> None:
        pass


def wheel(name: str, files: dict[str, str], requires: str = "") -> bytes:
    buffer = io.BytesIO()
    folder = f"{name}-1.0.dist-info"
    requirement = f"Requires-Dist: {requires}\n" if requires else ""
    contents = {
        **files,
        f"{folder}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n{requirement}",
        f"{folder}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    with zipfile.ZipFile(buffer, "w") as archive:
        for path, text in contents.items():
            archive.writestr(path, text)
        record = "".join(f"{path},,\n" for path in [*contents, f"{folder}/RECORD"])
        archive.writestr(f"{folder}/RECORD", record)
    return buffer.getvalue()


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a folder with run.py and a program that needs one library and nothing else."""
    shutil.copy(FILE, tmp_path)
    (tmp_path / "constraints.txt").write_text("lamp==1.0\n")
    (tmp_path / "pyproject.toml").write_text(
        '[build-system]\nrequires = []\nbuild-backend = "backend"\nbackend-path = ["."]\n'
    )
    program = wheel("turnlight", {"turnlight.pth": f"{tmp_path}\n"}, "lamp")
    (tmp_path / "program.whl").write_bytes(program)
    (tmp_path / "backend.py").write_text(
        "import pathlib, shutil\n"
        "def build_editable(folder, config_settings=None, metadata_directory=None):\n"
        "    source = pathlib.Path(__file__).with_name('program.whl')\n"
        "    name = 'turnlight-1.0-py3-none-any.whl'\n"
        "    shutil.copy(source, pathlib.Path(folder, name))\n"
        "    return name\n"
    )
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "__main__.py").write_text("import lamp\nprint(lamp.WATTS)\n")
    return tmp_path


def start(clone: Path, index: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run `run.py watts` as a user would, with pip on an index of the test's own."""
    inherited = {
        k: v for k, v in os.environ.items() if not k.upper().startswith(("PIP_", "PYTHON"))
    }
    own = {"PIP_CONFIG_FILE": os.devnull, "PIP_INDEX_URL": index, "NO_PROXY": "*"}
    return subprocess.run(
        [sys.executable, str(clone / "run.py"), "watts"],
        env={**inherited, **own, "PATH": os.defpath, **environment},
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


@pytest.fixture
def index() -> Iterator[str]:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Index) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/simple"
        server.shutdown()
        thread.join()


@pytest.mark.slow
def test_slow_index_is_not_offline(
    clone: Path, index: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each reply takes longer than the 12 s after which setup once gave up."""
    monkeypatch.setattr(Index, "delay_s", 13.0)
    first = start(clone, index)
    assert (first.returncode, first.stdout) == (0, "60\n"), first.stderr
    assert LIBRARY in first.stderr  # pip's own progress
    assert (clone / ".venv" / "turnlight.json").is_file()


@pytest.mark.slow
def test_intact_environment_starts_offline(clone: Path, index: str) -> None:
    assert start(clone, index).returncode == 0
    offline = start(clone, "http://127.0.0.1:9/simple")
    assert (offline.returncode, offline.stdout, offline.stderr) == (0, "60\n", "")


@pytest.mark.slow
def test_unreachable_index_is_one_sentence_and_exit_code_3(clone: Path) -> None:
    done = start(clone, "http://127.0.0.1:9/simple", PIP_RETRIES="0")
    assert done.returncode == 3
    sentence = done.stderr.splitlines()[-1]
    assert sentence.startswith("The package index cannot be reached.")
    assert sentence.endswith(str(clone / "install.log"))
    assert "Connection refused" in (clone / "install.log").read_text()


def test_run_py_stays_small() -> None:
    assert len(FILE.read_text(encoding="utf-8").splitlines()) < 200


def test_old_python_gets_a_sentence() -> None:
    source = FILE.read_text(encoding="utf-8")
    # Syntax that an older Python cannot read would hide the sentence.
    ast.parse(source, feature_version=(3, 7))
    code = f"import sys; sys.version_info = (3, 9, 2); exec(open({str(FILE)!r}).read())"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 2
    assert "needs Python 3.11 or newer; this is Python 3.9" in done.stderr
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


@pytest.fixture
def ready(run: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setattr(run.Environment, "ensure", lambda self, extra: Path("py"))
    return run


DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")


@pytest.mark.parametrize("name", DISPLAYS)
def test_no_arguments_start_the_app_where_there_is_a_display(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    calls = Calls()
    monkeypatch.setattr(ready, "call", calls)
    monkeypatch.setattr(ready.sys, "platform", "linux")
    for other in DISPLAYS:
        monkeypatch.delenv(other, raising=False)
    monkeypatch.setenv(name, "something")
    assert ready.main([]) == 0
    assert calls.arguments() == [["-P", "-m", "app"]]


def test_no_display_solves_the_bundled_scene(
    ready: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    calls = Calls()
    monkeypatch.setattr(ready, "call", calls)
    monkeypatch.setattr(ready.sys, "platform", "linux")
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    assert ready.main([]) == 0
    sheet = ["--sheet", "turnlight-sheet.png"]
    assert calls.arguments() == [["-P", "-m", "app", "solve", str(ready.SCENE), *sheet]]
    assert "No display" in capsys.readouterr().err
    assert ready.SCENE.is_file()


def test_other_arguments_go_to_turnlight_with_its_code(
    ready: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = Calls(130)
    monkeypatch.setattr(ready, "call", calls)
    assert ready.main(["solve", "my place.exr", "--json"]) == 130
    assert calls.arguments() == [["-P", "-m", "app", "solve", "my place.exr", "--json"]]


def test_call_passes_codes_on(run: ModuleType) -> None:
    assert run.call([sys.executable, "-c", "raise SystemExit(3)"]) == 3


@pytest.mark.skipif(os.name != "posix", reason="signals as exit codes")
def test_call_counts_a_signal_as_a_shell_does(run: ModuleType) -> None:
    code = "import os, signal; os.kill(os.getpid(), signal.SIGTERM)"
    assert run.call([sys.executable, "-c", code]) == 143
