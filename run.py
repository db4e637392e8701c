#!/usr/bin/env python3
"""Set up Turnlight in this folder and start it. It needs Python 3.11 or newer and nothing else.

python3 run.py                  the app; without a display, the answers for a bundled courtyard
python3 run.py --demo           the app with a simulated camera and webcam in a demo place
python3 run.py test [ARGS]      all checks and the quick tests; ARGS go to pytest
python3 run.py test --coverage  the same, and check that at least 92% of the lines are covered
python3 run.py test --slow      the long tests; with --sweeps, more cases of each
python3 run.py ARGS             everything else goes to turnlight, e.g. solve my-place.exr

The first start installs into .venv/ with uv or pip; later starts need no connection.
"""

import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

if sys.version_info < (3, 11):  # noqa: UP036 - an older Python still gets this sentence
    sys.stderr.write(
        "Turnlight needs Python 3.11 or newer; this is Python {}.{} ({}).\n"
        "Install a newer version, for example from https://www.python.org/downloads/, "
        "and start run.py with it.\n".format(*sys.version_info[:2], sys.executable)
    )
    sys.exit(2)

ROOT = Path(__file__).resolve().parent
SCENE = ROOT / "resources" / "demo" / "scenes" / "courtyard.exr"
FAILED, OFFLINE, INTERRUPTED = 2, 3, 130

UNSUPPORTED = "A library does not support this computer. README.md lists the supported systems."
# Pattern in pip's log, exit code and sentence; the first pattern that matches counts.
FAILURES = [
    (r"No space left|not enough space", FAILED, "The disk is full. Free 1.5 GB and try again."),
    (
        r"confirming the ssl certificate|CERTIFICATE_VERIFY_FAILED",
        OFFLINE,
        "This computer does not trust the certificate of the package index. Check the "
        "clock and the proxy, and try again.",
    ),
    (r"from versions: \d", FAILED, UNSUPPORTED),
    (
        r"(?i)connection broken|new connection|connection refused|connection reset|timed out|"
        r"ProxyError|name resolution|getaddrinfo|network is unreachable|IncompleteRead",
        OFFLINE,
        "The package index cannot be reached. Check the connection and try again.",
    ),
    (r"No matching distribution", FAILED, UNSUPPORTED),
    (r"", FAILED, "The installation failed."),
]


class SetupError(Exception):
    """Raised with a sentence and an exit code if the environment cannot be created."""


class Environment:
    """The virtual environment in the clone. A stamp that is written last marks it as complete."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.folder = root / ".venv"
        self.stamp = self.folder / "turnlight.json"
        self.log = root / "install.log"
        self.python = self.folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")

    def ensure(self, extra: str = "") -> Path:
        """Create, complete or repair the environment with one more extra, and return its Python."""
        stamp = self.read_stamp()
        extras = sorted({*(stamp["extras"] if stamp else ()), extra} - {""})
        if stamp and stamp["source"] == self.source() and stamp["extras"] == extras:
            return self.python
        if stamp is None and os.path.lexists(self.folder):
            print_status("The environment in .venv is incomplete or damaged; rebuilding it.")
            if self.folder.is_file() or self.folder.is_symlink():
                self.folder.unlink()
        print_status("Installing Turnlight and its libraries. The first time takes a few minutes.")
        # Wheels alone: building a library here would take hours.
        project = f".[{','.join(extras)}]" if extras else "."
        request = ["--only-binary", ":all:", "-c", "constraints.txt", "-e", project]
        self.install(request, fresh=stamp is None)
        stamp = {"python": self.links(), "source": self.source(), "extras": extras}
        text = json.dumps({**stamp, "sizes": self.sizes()}, indent=1)
        self.stamp.write_text(text, encoding="utf-8")
        print_status("Installed.")
        return self.python

    def read_stamp(self) -> "dict | None":  # type: ignore[type-arg]
        """Return the stamp, or None if the environment is missing, moved or damaged."""
        try:
            stamp = json.loads(self.stamp.read_text(encoding="utf-8"))
            intact = all(size_of(self.folder / name) == n for name, n in stamp["sizes"].items())
            return stamp if intact and stamp["python"] == self.links() else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def source(self) -> str:
        """Return the checksum of the files that list the libraries."""
        files = [self.root / name for name in ("pyproject.toml", "constraints.txt")]
        return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()

    def links(self) -> "list[str]":
        """Return the environment's Python and the Python behind it."""
        return [str(self.python), str(self.python.resolve(strict=True))]

    def sizes(self) -> "dict[str, int]":
        """Return the sizes of packages and machine code, by their paths in the environment."""
        pattern = "Lib/site-packages" if os.name == "nt" else "lib/python*/site-packages"
        return {
            path.relative_to(self.folder).as_posix(): size_of(path)
            for packages in self.folder.glob(pattern)
            for path in packages.rglob("*")
            if (path.parent == packages and path.name != "__pycache__")
            or {".so", ".pyd", ".dll", ".dylib"} & set(path.suffixes)
        }

    def install(self, request: "list[str]", fresh: bool) -> None:
        """Install with uv, or else with pip. Both retry and show their progress."""
        uv, folder, python = shutil.which("uv"), str(self.folder), str(self.python)
        if uv:
            create = [uv, "venv", "--clear", "--python", sys.executable, folder]
            steps = [create] * fresh + [[uv, "pip", "install", "--python", python, *request]]
            if not any(call(step, self.root, to_stderr=True) for step in steps):
                return
            print_status("uv could not install the libraries; trying pip.")
        # A Python that is itself in an environment would link to that environment.
        base = getattr(sys, "_base_executable", None) or sys.executable
        create = [base, "-m", "venv", "--clear", "--without-pip", folder]
        steps = [create] * fresh + [[python, "-m", "ensurepip"]]
        if any(call(step, self.root, to_stderr=True) for step in steps):
            raise SetupError(
                f"Cannot create {folder}. Close the programs that use it; on Debian and Ubuntu, "
                "run 'sudo apt install python3-venv' first.",
                FAILED,
            )
        self.log.unlink(missing_ok=True)
        options = ["--disable-pip-version-check", "--no-input", "--log", str(self.log)]
        pip = [python, "-m", "pip", *options, "install", *request]
        if call(pip, self.root, to_stderr=True):
            log = self.log.read_text(errors="replace") if self.log.exists() else ""
            code, sentence = next((c, s) for signs, c, s in FAILURES if re.search(signs, log))
            raise SetupError(f"{sentence} pip's log: {self.log}", code)


def size_of(path: Path) -> int:
    """Return the size of a file in bytes, or 0 for a folder."""
    return 0 if path.is_dir() else path.stat().st_size


def print_status(text: str) -> None:
    """Print progress on stderr, since stdout is reserved for turnlight's answers."""
    print(text, file=sys.stderr, flush=True)


def call(command: "list[str]", folder: "Path | None" = None, to_stderr: bool = False) -> int:
    """Run a command to completion and return its exit code as a shell would report it."""
    with subprocess.Popen(command, cwd=folder, stdout=sys.stderr if to_stderr else None) as process:
        # SIGTERM for this script is meant for the command.
        previous = signal.signal(signal.SIGTERM, lambda *_: process.terminate())
        try:
            while True:
                # Ctrl-C reaches the command too, which then ends in its own way.
                with contextlib.suppress(KeyboardInterrupt):
                    code = process.wait()
                    return code if code >= 0 else 128 - code
        finally:
            signal.signal(signal.SIGTERM, previous)


def main(arguments: "list[str]") -> int:
    """Set up the environment, run what the arguments request, and return the exit code."""
    testing = arguments[:1] == ["test"]
    try:
        python = str(Environment(ROOT).ensure("test" if testing else ""))
    except SetupError as error:
        print_status(error.args[0])
        return int(error.args[1])
    except KeyboardInterrupt:
        print_status("Stopped. Run the same command again to continue.")
        return INTERRUPTED
    if testing:
        return call([python, "-m", "tests", *arguments[1:]], ROOT)
    displays = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    if not (arguments or sys.platform in ("win32", "darwin") or any(map(os.getenv, displays))):
        print_status("No display was found. Here are Turnlight's answers for a built-in courtyard:")
        arguments = ["solve", str(SCENE), "--sheet", "turnlight-sheet.png"]
    # -P: a folder of the user's that is called "app" must not be imported.
    return call([python, "-P", "-m", "app", *arguments])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
