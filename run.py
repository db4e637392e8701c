#!/usr/bin/env python3
"""Set Turnlight up in this folder and start it. Needs Python 3.11 or newer and nothing else.

python3 run.py                  the app; without a display a first look at a bundled courtyard
python3 run.py --demo           the app with a simulated camera and webcam at a demo place
python3 run.py test [ARGS]      all checks and tests but the long ones; ARGS go to pytest
python3 run.py test --coverage  and at least 92 % of the lines reached
python3 run.py test --slow      the long tests
python3 run.py ARGS             everything else goes to turnlight, e.g. solve my-place.exr

The first start makes an environment in .venv/ and installs into it; later ones start at once.
"""

import base64
import contextlib
import csv
import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

if sys.version_info < (3, 11):  # noqa: UP036 - older ones get this far and must be told
    sys.stderr.write(
        "Turnlight needs Python 3.11 or newer, and this is Python {}.{} ({}).\n"
        "Install a newer one, for example from https://www.python.org/downloads/, "
        "and start run.py with it.\n".format(*sys.version_info[:2], sys.executable)
    )
    sys.exit(2)

ROOT = Path(__file__).resolve().parent
SCENE = ROOT / "resources" / "demo" / "scenes" / "courtyard.exr"
UNUSABLE, OFFLINE, INTERRUPTED = 2, 3, 130
MOST_WORKERS = 8  # each process that runs tests holds up to a gigabyte
RAN = (0, 1)  # what pytest returns when it ran to its end: all passed, or some failed

# The oldest systems that every library has a wheel for.
GLIBC = {
    "x86_64": ((2, 34), "Ubuntu 22.04, Debian 12 and Fedora 35"),
    "aarch64": ((2, 39), "Ubuntu 24.04, Debian 13 and Fedora 40"),
}
MACOS = (13, 0)
NATIVE = (".so", ".pyd", ".dll", ".dylib")
CRASHES = ("SIGBUS", "SIGSEGV", "SIGILL", "SIGABRT", "SIGFPE")  # of damaged libraries

# The package asked for to see whether the index answers. Downloads have pip's own patience.
PROBE, PROBE_S, PROBE_CONNECT_S = "hatchling", 12, 5
WHEELS = Path("/usr/share/python-wheels")  # where Debian and Fedora keep pip
PIP = ["-m", "pip", "install", "--disable-pip-version-check", "--no-input"]

# Signs in pip's output, on the three systems.
NO_NETWORK = re.compile(
    "ConnectTimeoutError|Connection refused|Failed to establish a new connection|"
    "NameResolutionError|Network is unreachable|ProxyError|Read timed out|"
    "Temporary failure in name resolution|getaddrinfo failed|nodename nor servname"
)
NO_TRUST = re.compile("problem confirming the ssl certificate")
# What each says, and the exit code; the first match counts.
FAILURES = {
    NO_NETWORK: (
        "The libraries could not be downloaded: no connection to the package index. "
        "Go online once and run the same command again. ",
        OFFLINE,
    ),
    NO_TRUST: (
        "The libraries could not be downloaded: this computer does not trust the package index's "
        "certificate. Check the clock, and what your network's proxy asks for. ",
        OFFLINE,
    ),
    re.compile("No space left on device"): (
        "The disk is full; Turnlight and its libraries need about 1 GB. ",
        UNUSABLE,
    ),
    re.compile("No matching distribution"): (
        "A library is not available for this Python or system. Python 3.11 to 3.14 on 64-bit "
        "Linux, macOS and Windows are supported. ",
        UNUSABLE,
    ),
    re.compile(""): ("The installation failed. ", UNUSABLE),
}


class SetupError(Exception):
    """The environment cannot be made; carries a sentence for the user and an exit code."""

    def __init__(self, message: str, code: int = UNUSABLE) -> None:
        super().__init__(message)
        self.code = code


def say(text: str) -> None:
    """Print progress on stderr: stdout is turnlight's own."""
    print(text, file=sys.stderr, flush=True)


class Environment:
    """The virtual environment in the clone, and the stamp that says it is complete.

    The stamp is written last and removed before anything is changed, so an environment without
    one is half made. It holds what the environment was made from, the extras in it, and the names
    and sizes of packages and machine code, so that a missing package and a truncated file show
    without starting Python.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.folder = root / ".venv"
        self.stamp = self.folder / "turnlight.json"
        self.log = root / "install.log"
        self.python = self.folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")

    def ensure(self, extra: str = "") -> Path:
        """Make, complete or repair the environment, and return its Python.

        `extra` of the project ("test" or none) will be in it.
        """
        stamp = self.read_stamp()
        extras = set(stamp["extras"] if stamp else ()) | ({extra} if extra else set())
        if stamp is None:
            reason = unsupported() or without_venv()
            if reason:
                raise SetupError(reason)
            # Before anything is removed: without a network it could not be replaced.
            self.reach_index()
            if os.path.lexists(self.folder):
                say("The environment in .venv is incomplete or damaged; rebuilding it.")
                self.remove()
            self.create()
        elif stamp["source"] == self.source() and extras == set(stamp["extras"]):
            return self.python
        else:
            self.reach_index()
        self.install(extras)
        return self.python

    def read_stamp(self) -> "dict | None":  # type: ignore[type-arg]
        """Read the stamp; None when the environment is missing, moved or damaged."""
        try:
            stamp = json.loads(self.stamp.read_text(encoding="utf-8"))
            whole = (
                self.python.is_file()
                and stamp["place"] == self.place()
                # A stamp of an older version has none.
                and all(size_of(self.folder / n) == s for n, s in stamp.get("files", {}).items())
                and isinstance(stamp["source"], str)
                and isinstance(stamp["extras"], list)
            )
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None
        return stamp if whole else None

    def place(self) -> "list[str]":
        """Return the folder and the Python it belongs to; neither can change under it."""
        return [str(self.folder), sys.version]

    def source(self) -> str:
        """Return the checksum of the files that say what to install."""
        files = [self.root / name for name in ("pyproject.toml", "constraints.txt")]
        return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()

    def packages(self) -> "list[Path]":
        """Return the library folder, in a list of one; empty where there is none."""
        pattern = "Lib/site-packages" if os.name == "nt" else "lib/python*/site-packages"
        return list(self.folder.glob(pattern))

    def files(self) -> "dict[str, int]":
        """Return the sizes of what lies in the library folder, and of all machine code."""
        return {
            path.relative_to(self.folder).as_posix(): size_of(path)
            for folder in self.packages()
            for path in folder.rglob("*")
            if path.suffix in NATIVE or ".so." in path.name or path.parent == folder
            if path.name != "__pycache__"
        }

    def damaged(self, thorough: bool = True) -> "list[str]":
        """Return the files that differ from their packages' records.

        Thorough: machine code is read, and not only measured.
        """
        found = []
        for folder in self.packages():
            for record in folder.glob("*.dist-info/RECORD"):
                for row in csv.reader(record.read_text(encoding="utf-8").splitlines()):
                    # The rest is made or adapted where it is installed.
                    recorded = len(row) == 3 and row[2] and row[0].endswith((*NATIVE, ".py"))
                    checksum = row[1] if thorough else ""
                    if recorded and not is_whole(folder / row[0], checksum, int(row[2])):
                        found.append(row[0])
        return sorted(found)

    def remove(self) -> None:
        """Delete the environment, whatever is there in its place."""
        try:
            if self.folder.is_dir() and not self.folder.is_symlink():
                shutil.rmtree(self.folder)
            else:
                self.folder.unlink()
        except OSError as error:
            raise SetupError(
                f"Cannot delete {self.folder} ({error.strerror}). "
                "Close what uses it, delete it by hand, and run this again."
            ) from error

    def create(self) -> None:
        """Make an empty environment with pip in it."""
        say("Making an environment in .venv ...")
        # Inside another environment, or this very one, the Python behind it is wanted.
        base = getattr(sys, "_base_executable", None) or sys.executable
        command = [base, "-m", "venv", str(self.folder)]
        if subprocess.run(command, stdout=sys.stderr.fileno(), check=False).returncode:
            raise SetupError(f"Python could not make an environment in {self.folder} (see above).")

    def install(self, extras: "set[str]") -> None:
        """Install the project and what it needs, and write the stamp."""
        say("Installing Turnlight and its libraries; the first time this takes some minutes ...")
        self.stamp.unlink(missing_ok=True)
        project = f".[{','.join(sorted(extras))}]" if extras else "."
        quiet = ["--progress-bar", "off", "-c", "constraints.txt"]
        code, output = follow([str(self.python), *PIP, *quiet, "-e", project], self.root)
        if code:
            raise explain(output, self.keep(output))
        stamp = {
            "place": self.place(),
            "source": self.source(),
            "extras": sorted(extras),
            "files": self.files(),
        }
        self.stamp.write_text(json.dumps(stamp, indent=1), encoding="utf-8")
        say("Installed.")

    def reach_index(self) -> None:
        """Find out soon whether pip reaches the package index; pip itself would try for minutes.

        The pip that makes environments asks, configured as the user's is.
        """
        bundled = bundled_pip()
        if not bundled:
            return
        once = ["-vv", "--dry-run", "--no-deps", "--ignore-installed", "--retries", "0"]
        try:
            done = subprocess.run(
                [sys.executable, *PIP, *once, "--timeout", str(PROBE_CONNECT_S), PROBE],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                encoding="utf-8",
                errors="replace",
                env={**os.environ, "PYTHONPATH": str(bundled[0])},
                timeout=PROBE_S,
                check=False,
            )
        except subprocess.TimeoutExpired as late:
            raise explain("Read timed out", self.keep(str(late))) from late
        if done.returncode and (NO_NETWORK.search(done.stdout) or NO_TRUST.search(done.stdout)):
            raise explain(done.stdout, self.keep(done.stdout))

    def keep(self, output: str) -> Path:
        """Write pip's output to the log, and return its path."""
        with contextlib.suppress(OSError):
            self.log.write_text(output, encoding="utf-8", errors="replace")
        return self.log


def without_venv() -> "str | None":
    """Say what to do where this Python cannot make environments."""
    if all(importlib.util.find_spec(name) for name in ("venv", "ensurepip")):
        return None
    return (
        f"This Python ({sys.executable}) comes without venv, which Turnlight needs to install "
        "itself. On Debian and Ubuntu: sudo apt install python3-venv"
    )


def bundled_pip() -> "list[Path]":
    """Return the pip that comes with Python, as a file that can be imported."""
    ensurepip = importlib.util.find_spec("ensurepip")
    folders = ensurepip.submodule_search_locations or [] if ensurepip else []
    places = [*(Path(folder) / "_bundled" for folder in folders), WHEELS]
    return [file for place in places for file in sorted(place.glob("pip-*.whl"))]


def size_of(path: Path) -> int:
    """Return the size of a file; 0 for a folder, -1 where there is nothing."""
    try:
        return 0 if path.is_dir() else path.stat().st_size
    except OSError:
        return -1


def is_whole(path: Path, checksum: str, size: int) -> bool:
    """Whether a file is as its package's record says; checksums only of machine code."""
    if size_of(path) != size:
        return False
    kind, _, wanted = checksum.partition("=")
    if kind != "sha256" or path.suffix not in NATIVE:
        return True
    digest = hashlib.sha256(path.read_bytes()).digest()
    return base64.urlsafe_b64encode(digest).rstrip(b"=").decode() == wanted


def unsupported() -> "str | None":
    """Say why nothing can be installed on this computer; None if no reason is known."""
    system, machine = sysconfig.get_platform(), platform.machine()
    download = "from https://www.python.org/downloads/ and start run.py with it."
    if system == "win-arm64":
        x64 = "Install the 64-bit (x64) Python"
        return f"There are no libraries for Python on ARM Windows. {x64} {download}"
    if system == "win32" or sys.maxsize < 2**32:
        return "This is a 32-bit Python; Turnlight needs a 64-bit one."
    if system.startswith("macosx") and machine == "x86_64":
        return (
            "There are no libraries for Macs with an Intel processor, or for a Python made for "
            f"them. On a newer Mac install Python {download}"
        )
    if system.startswith("macosx") and numbers(platform.mac_ver()[0]) < MACOS:
        mac = platform.mac_ver()[0]
        return f"This macOS is too old: Turnlight needs macOS 13 and this is {mac}."
    return unsupported_linux(*platform.libc_ver(), machine) if system.startswith("linux") else None


def unsupported_linux(name: str, number: str, machine: str) -> "str | None":
    """Say why a Linux's libraries cannot be had."""
    if name != "glibc":
        return "Turnlight needs a Linux with glibc; there are no libraries for this one."
    if machine not in GLIBC:
        return f"There are no libraries for this processor ({machine})."
    least, newer = GLIBC[machine]
    if numbers(number) >= least:
        return None
    return (
        f"This Linux is too old: Turnlight needs glibc {'.'.join(map(str, least))} and this is "
        f"{number}. {newer} have it."
    )


def numbers(text: str) -> "tuple[int, ...]":
    """Return the numbers of a version; an empty one is newer than any."""
    return tuple(int(part) for part in text.split(".")[:2] if part.isdigit()) or (sys.maxsize,)


def follow(command: "list[str]", folder: Path) -> "tuple[int, str]":
    """Run pip, showing what takes long on stderr; return its exit code and its output."""
    said = []
    with subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            # The long waits; of the rest only a failure is of interest.
            if line.lstrip().startswith(("Downloading ", "Installing ")):
                say("  " + line.strip())
            said.append(line)
    return process.returncode, "".join(said)


def explain(output: str, log: Path) -> SetupError:
    """Turn pip's output into a sentence; the output itself is in the log."""
    sentence, code = next(told for signs, told in FAILURES.items() if signs.search(output))
    return SetupError(f"{sentence}pip's output is in {log}", code)


def call(command: "list[str]", folder: "Path | None" = None) -> int:
    """Run a command to its end and return its exit code, as a shell would count it."""
    with subprocess.Popen(command, cwd=folder) as process:
        # SIGTERM for this script is meant for what it runs.
        previous = signal.signal(signal.SIGTERM, lambda *_: process.terminate())
        try:
            while True:
                # Ctrl-C reaches the command too, which then ends in its own way.
                with contextlib.suppress(KeyboardInterrupt):
                    code = process.wait()
                    break
        finally:
            signal.signal(signal.SIGTERM, previous)
    return code if code >= 0 else 128 - code


def turnlight(python: Path, arguments: "list[str]") -> int:
    """Run turnlight in the user's own folder."""
    # -P: a folder called "app" that the user happens to stand in is not ours.
    code = call([str(python), "-P", "-m", "app", *arguments])
    words = after_crash(Environment(ROOT), code)
    if words:
        say(words)
    return code


def after_crash(environment: Environment, code: int) -> "str | None":
    """Say why the program ended as no program should; damaged libraries are marked for repair."""
    ended = {128 + getattr(signal, name): name for name in CRASHES if hasattr(signal, name)}
    crashed = code in ended or code >= 0xC0000000  # Windows tells exceptions by such numbers
    if not crashed and code != 1:
        return None
    damaged = environment.damaged(thorough=crashed)
    if damaged:
        environment.stamp.unlink(missing_ok=True)
        more = f" and {len(damaged) - 1} more" if len(damaged) > 1 else ""
        return (
            f"Files in .venv are damaged: {damaged[0]}{more}. "
            "Run the same command again to reinstall Turnlight's libraries."
        )
    if not crashed:
        return None
    return (
        f"Turnlight ended unexpectedly ({ended.get(code, hex(code))}). Its libraries are undamaged."
    )


def has_display() -> bool:
    """Whether a window can be shown: always on Windows and macOS, else where the system says so."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    return sys.platform in ("win32", "darwin") or any(os.environ.get(name) for name in names)


def first_look(python: Path) -> int:
    """Solve the bundled courtyard and write the sheet where the user will find it."""
    say("There is no display here, so the window stays closed; this is what Turnlight answers:")
    folder = Path.cwd() if os.access(Path.cwd(), os.W_OK) else Path(tempfile.gettempdir())
    sheet = folder / "turnlight-sheet.png"
    code = turnlight(python, ["solve", str(SCENE), "--sheet", str(sheet)])
    if code == 0:
        print(f"\nThe pictures are in {sheet}")
        print("Your own place: python3 run.py solve PANORAMA.exr --sheet sheet.png")
    return code


def workers() -> "list[str]":
    """Return what makes pytest share all tests out over the processors; nothing for one processor.

    Some tests run in one process: each worker first reads every test file, which takes longer
    than most single files of tests.
    """
    # Fewer than the machine has where this process may not use them all.
    allowed = getattr(os, "sched_getaffinity", None)
    count = min(len(allowed(0)) if allowed else os.cpu_count() or 1, MOST_WORKERS)
    return ["-n", str(count), "--dist", "worksteal"] if count > 1 else []


def test(python: Path, arguments: "list[str]") -> int:
    """Run the checks and tests; pytest comes last, so its closing line is the last line."""
    if "--slow" in arguments:
        return slow_tests(python, [word for word in arguments if word != "--slow"])
    # Coverage takes a quarter of the time again: not each time.
    counted = ["--cov", "--cov-report=term"] if "--coverage" in arguments else []
    chosen = [word for word in arguments if word != "--coverage"] or workers()
    codes = []
    for name, command in {
        "lint": ["ruff", "check", "."],
        "format": ["ruff", "format", "--check", "."],
        "types": ["mypy"],
    }.items():
        print(f"{name}: {' '.join(command)}", flush=True)
        codes.append(call([str(python), "-m", *command], ROOT))
        if codes[-1]:
            print(f"{name}: FAILED", flush=True)
    pytest = [str(python), "-m", "pytest", "-m", "not slow"]
    codes.append(call([*pytest, *counted, *chosen], ROOT))
    return next((code for code in codes if code), 0)


def slow_tests(python: Path, arguments: "list[str]") -> int:
    """Run the long tests; those that measure time come last, with nothing beside them."""
    run = [str(python), "-m", "pytest", "-m"]
    if arguments:
        return call([*run, "slow", *arguments], ROOT)
    code = call([*run, "slow and not alone", *workers()], ROOT)
    return code if code not in RAN else call([*run, "slow and alone"], ROOT) or code


def main(arguments: "list[str]") -> int:
    """Set up, then do what was asked; return the exit code."""
    testing = arguments[:1] == ["test"]
    try:
        python = Environment(ROOT).ensure("test" if testing else "")
    except SetupError as error:
        say(str(error))
        return error.code
    except KeyboardInterrupt:
        say("Stopped. Run the same command again to continue.")
        return INTERRUPTED
    if testing:
        return test(python, arguments[1:])
    return turnlight(python, arguments) if arguments or has_display() else first_look(python)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
