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
SHEET = "turnlight-sheet.png"
UNUSABLE, OFFLINE, INTERRUPTED = 2, 3, 130

# Each process that runs tests holds up to a gigabyte.
MOST_WORKERS = 8
# What pytest ends with when it ran to its end: all passed, or some failed.
RAN = (0, 1)

# The oldest systems that every library has a wheel for.
GLIBC = {"x86_64": (2, 34), "aarch64": (2, 39)}
MACOS = (13, 0)
NATIVE = (".so", ".pyd", ".dll", ".dylib")
# How a program ends whose libraries are damaged.
CRASHES = ("SIGBUS", "SIGSEGV", "SIGILL", "SIGABRT", "SIGFPE")

# Any package that the installation needs shows whether the index can be reached, by whatever way
# pip was told to take. It must answer soon; downloads have pip's own patience.
PROBE = "hatchling"
PROBE_S, PROBE_CONNECT_S = 12, 5

WHEELS = Path("/usr/share/python-wheels")  # where Debian and Fedora keep it

# What pip says when it cannot reach the index, on the three systems.
NO_NETWORK = (
    "ConnectTimeoutError",
    "Connection refused",
    "Failed to establish a new connection",
    "NameResolutionError",
    "Network is unreachable",
    "ProxyError",
    "Read timed out",
    "Temporary failure in name resolution",
    "getaddrinfo failed",
    "nodename nor servname",
)


NO_TRUST = "problem confirming the ssl certificate"


class SetupError(Exception):
    """The environment cannot be made; carries a sentence for the user and an exit code."""

    def __init__(self, message: str, code: int = UNUSABLE) -> None:
        super().__init__(message)
        self.code = code


def say(text: str) -> None:
    """Tell the user what is going on, on stderr, so that stdout stays turnlight's own."""
    print(text, file=sys.stderr, flush=True)


class Environment:
    """The virtual environment in the clone, and the stamp that says it is complete.

    The stamp is written last and removed before anything is changed, so an environment without
    one is half made. It holds what the environment was made from, the extras in it, the names in
    its library folder and the sizes of the machine code there, so that a missing package and a
    file that was cut off show without starting Python.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.folder = root / ".venv"
        self.stamp = self.folder / "turnlight.json"
        self.log = root / "install.log"
        windows = os.name == "nt"
        self.python = self.folder / ("Scripts/python.exe" if windows else "bin/python")

    def ensure(self, extra: str = "") -> Path:
        """Make, complete or repair the environment where needed.

        Args:
            extra: Extra of the project that must be in it, "test" or none.

        Returns:
            The environment's Python.

        Raises:
            SetupError: When that is not possible here.
        """
        stamp = self.read_stamp()
        if stamp is None:
            reason = unsupported()
            if reason:
                raise SetupError(reason)
            self.check_venv()
            # Before anything is removed: without a network it could not be brought back.
            self.reach_index()
            if os.path.lexists(self.folder):
                say("The environment in .venv is incomplete or damaged; making it anew.")
                self.remove()
            self.create()
            extras = set()
        else:
            extras = set(stamp["extras"])
            if stamp["source"] == self.source() and (not extra or extra in extras):
                return self.python
            self.reach_index()
        self.install(extras | ({extra} if extra else set()))
        return self.python

    def read_stamp(self) -> dict | None:  # type: ignore[type-arg]
        """Read the stamp, or None when the environment is missing, moved or damaged."""
        try:
            stamp = json.loads(self.stamp.read_text(encoding="utf-8"))
            whole = (
                self.python.is_file()
                and stamp["place"] == self.place()
                and set(stamp["library"]) <= self.library()
                and all(size_of(self.folder / name) == size for name, size in self.sizes(stamp))
                and isinstance(stamp["source"], str)
                and isinstance(stamp["extras"], list)
            )
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return stamp if whole else None

    @staticmethod
    def sizes(stamp: dict) -> list[tuple[str, int]]:  # type: ignore[type-arg]
        """Return the machine code that a stamp knows; one of an older version knows none."""
        return list(stamp.get("sizes", {}).items())

    def native(self) -> dict[str, int]:
        """Return the sizes of all machine code in the library folder."""
        return {
            path.relative_to(self.folder).as_posix(): path.stat().st_size
            for folder in self.packages()
            for path in folder.rglob("*")
            if (path.suffix in NATIVE or ".so." in path.name) and path.is_file()
        }

    def damaged(self, thorough: bool = True) -> list[str]:
        """Return what is not as it was installed, by the records of the packages.

        Thorough: machine code is read, and not only measured.
        """
        found = []
        for folder in self.packages():
            for record in folder.glob("*.dist-info/RECORD"):
                rows = csv.reader(record.read_text(encoding="utf-8").splitlines())
                found += [
                    row[0]
                    for row in rows
                    # The rest is made or adapted where it is installed.
                    if len(row) == 3 and row[2] and row[0].endswith((*NATIVE, ".py"))
                    if not is_whole(folder / row[0], row[1] if thorough else "", int(row[2]))
                ]
        return sorted(found)

    def packages(self) -> list[Path]:
        """Return the library folder, in a list of one; empty where there is none."""
        pattern = "Lib/site-packages" if os.name == "nt" else "lib/python*/site-packages"
        return list(self.folder.glob(pattern))

    def place(self) -> list[str]:
        """Return the folder and the Python it belongs to; neither can change under it."""
        return [str(self.folder), sys.version]

    def source(self) -> str:
        """Return the checksum of the files that say what to install."""
        digest = hashlib.sha256()
        for name in ("pyproject.toml", "constraints.txt"):
            digest.update((self.root / name).read_bytes())
        return digest.hexdigest()

    def library(self) -> set[str]:
        """Return the names of what is installed, as they lie in the library folder."""
        names = (path.name for folder in self.packages() for path in folder.iterdir())
        return {name for name in names if name != "__pycache__"}

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
        made = subprocess.run(
            [base, "-m", "venv", str(self.folder)], stdout=sys.stderr.fileno(), check=False
        )
        if made.returncode:
            raise SetupError(f"Python could not make an environment in {self.folder} (see above).")

    @staticmethod
    def check_venv() -> None:
        """Make sure that this Python can make environments."""
        if not all(importlib.util.find_spec(name) for name in ("venv", "ensurepip")):
            raise SetupError(
                f"This Python ({sys.executable}) comes without venv, which Turnlight needs to "
                "install itself. On Debian and Ubuntu: sudo apt install python3-venv"
            )

    def install(self, extras: set[str]) -> None:
        """Install the project and what it needs, and write the stamp."""
        say("Installing Turnlight and its libraries; the first time this takes some minutes ...")
        self.stamp.unlink(missing_ok=True)
        names = ",".join(sorted(extras))
        code, output = follow(
            [
                str(self.python), "-m", "pip", "install", "--disable-pip-version-check",
                "--no-input", "--progress-bar", "off", "-c", "constraints.txt",
                "-e", f".[{names}]" if names else ".",
            ],
            self.root,
        )  # fmt: skip
        if code:
            raise explain(output, self.keep(output))
        stamp = {
            "place": self.place(),
            "source": self.source(),
            "extras": sorted(extras),
            "library": sorted(self.library()),
            "sizes": self.native(),
        }
        self.stamp.write_text(json.dumps(stamp, indent=1), encoding="utf-8")
        say("Installed.")

    def reach_index(self) -> None:
        """Find out soon whether there is a way to the package index; pip would try for minutes.

        By whatever way pip was told to take; by the pip that makes environments where there is
        none yet.
        """
        bundled = next(iter(bundled_pip()), None)
        if bundled is None:
            return
        command = [
            sys.executable, "-m", "pip", "install", "-vv", "--dry-run", "--no-deps",
            "--ignore-installed", "--disable-pip-version-check", "--no-input",
            "--retries", "0", "--timeout", str(PROBE_CONNECT_S), PROBE,
        ]  # fmt: skip
        try:
            done = subprocess.run(
                command,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                encoding="utf-8",
                errors="replace",
                env={**os.environ, "PYTHONPATH": str(bundled)},
                timeout=PROBE_S,
                check=False,
            )
        except subprocess.TimeoutExpired as late:
            raise explain(NO_NETWORK[0], self.keep(str(late))) from late
        if done.returncode and any(sign in done.stdout for sign in (*NO_NETWORK, NO_TRUST)):
            raise explain(done.stdout, self.keep(done.stdout))

    def keep(self, output: str) -> Path:
        """Keep what pip said, for those who can read it."""
        with contextlib.suppress(OSError):
            self.log.write_text(output, encoding="utf-8", errors="replace")
        return self.log


def bundled_pip() -> "list[Path]":
    """Return the pip that comes with Python, as a file that can be imported."""
    ensurepip = importlib.util.find_spec("ensurepip")
    folders = ensurepip.submodule_search_locations or [] if ensurepip else []
    places = [Path(folder) / "_bundled" for folder in folders]
    return [file for place in [*places, WHEELS] for file in sorted(place.glob("pip-*.whl"))]


def size_of(path: Path) -> int:
    """Return the size of a file, -1 where there is none."""
    try:
        return path.stat().st_size
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
    """Say why this computer's libraries cannot be had; None where nothing is known against it."""
    system = sysconfig.get_platform()
    if system == "win-arm64":
        return (
            "There are no libraries for Python on ARM Windows. Install the 64-bit (x64) Python "
            "from https://www.python.org/downloads/ and start run.py with it."
        )
    if system == "win32" or sys.maxsize < 2**32:
        return "This is a 32-bit Python; Turnlight needs a 64-bit one."
    if system.startswith("macosx"):
        return unsupported_mac(platform.mac_ver()[0], platform.machine())
    if system.startswith("linux"):
        return unsupported_linux(*platform.libc_ver(), platform.machine())
    return None


def unsupported_linux(name: str, number: str, machine: str) -> "str | None":
    """Say why a Linux's libraries cannot be had."""
    if name != "glibc":
        return "Turnlight needs a Linux with glibc; there are no libraries for this one."
    if machine not in GLIBC:
        return f"There are no libraries for this processor ({machine})."
    if numbers(number) >= GLIBC[machine]:
        return None
    wanted = ".".join(map(str, GLIBC[machine]))
    newer = (
        "Ubuntu 22.04, Debian 12 and Fedora 35"
        if machine == "x86_64"
        else ("Ubuntu 24.04, Debian 13 and Fedora 40")
    )
    return (
        f"This Linux is too old: Turnlight needs glibc {wanted} and this is {number}. "
        f"{newer} have it."
    )


def unsupported_mac(number: str, machine: str) -> "str | None":
    """Say why a Mac's libraries cannot be had."""
    if machine == "x86_64":
        return (
            "There are no libraries for Macs with an Intel processor, or for a Python made for "
            "them. On a newer Mac install Python from https://www.python.org/downloads/ and start "
            "run.py with it."
        )
    if numbers(number) < MACOS:
        return f"This macOS is too old: Turnlight needs macOS 13 and this is {number}."
    return None


def numbers(text: str) -> "tuple[int, ...]":
    """Return the numbers of a version; an empty one is newer than any."""
    return tuple(int(part) for part in text.split(".")[:2] if part.isdigit()) or (sys.maxsize,)


def follow(command: list[str], folder: Path) -> tuple[int, str]:
    """Run pip, showing what takes long on stderr; return its exit code and what it said."""
    said = []
    with subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
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
    if any(sign in output for sign in NO_NETWORK):
        return SetupError(
            "The libraries could not be downloaded: no connection to the package index. "
            f"Go online once and run the same command again. What pip said is in {log}",
            OFFLINE,
        )
    if NO_TRUST in output:
        return SetupError(
            "The libraries could not be downloaded: this computer does not trust the package "
            "index's certificate. Check the clock, and what your network's proxy asks for. "
            f"What pip said is in {log}",
            OFFLINE,
        )
    if "No space left on device" in output:
        return SetupError("The disk is full; Turnlight and its libraries need about 2 GB.")
    if "No matching distribution" in output:
        return SetupError(
            "A library is not available for this Python or system. Python 3.11 to 3.14 on 64-bit "
            f"Linux, macOS and Windows are supported. What pip said is in {log}"
        )
    return SetupError(f"The installation failed. What pip said is in {log}")


def call(command: list[str], folder: Path | None = None) -> int:
    """Run a command to its end and return its exit code, as a shell would count it."""
    with subprocess.Popen(command, cwd=folder) as process:
        # Who stops this script means what it runs.
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


def turnlight(python: Path, arguments: list[str]) -> int:
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
            "Run the same command again: Turnlight's libraries are then installed again."
        )
    if crashed:
        return (
            f"Turnlight ended unexpectedly ({ended.get(code, hex(code))}). Its libraries are whole."
        )
    return None


def has_display() -> bool:
    """Whether a window can be shown: always on Windows and macOS, else where the system says so."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    return sys.platform in ("win32", "darwin") or any(os.environ.get(name) for name in names)


def first_look(python: Path) -> int:
    """Solve the bundled courtyard and write the sheet where the user will find it."""
    say("There is no display here, so the window stays closed; this is what Turnlight answers:")
    folder = Path.cwd()
    if not os.access(folder, os.W_OK):
        folder = Path(tempfile.gettempdir())
    sheet = folder / SHEET
    code = turnlight(python, ["solve", str(SCENE), "--sheet", str(sheet)])
    if code == 0:
        print(f"\nThe pictures are in {sheet}")
        print("Your own place: python3 run.py solve PANORAMA.exr --sheet sheet.png")
    return code


def workers() -> list[str]:
    """Return what has pytest share the tests out over the processors; nothing where there is one.

    Only for all of them: each worker first reads every test file, which takes longer than most
    single files of tests.
    """
    # Fewer than the machine has where this process may not use them all.
    allowed = getattr(os, "sched_getaffinity", None)
    count = min(len(allowed(0)) if allowed else os.cpu_count() or 1, MOST_WORKERS)
    return ["-n", str(count), "--dist", "worksteal"] if count > 1 else []


def test(python: Path, arguments: list[str]) -> int:
    """Run the checks and tests; pytest comes last, so its closing line is the last line."""
    if "--slow" in arguments:
        return slow_tests(python, [word for word in arguments if word != "--slow"])
    run = [str(python), "-m"]
    # Counting which lines are reached takes a quarter of the time again: not each time.
    counted = ["--cov", "--cov-report=term"] if "--coverage" in arguments else []
    arguments = [word for word in arguments if word != "--coverage"]
    checks = {
        "lint": ["ruff", "check", "."],
        "format": ["ruff", "format", "--check", "."],
        "types": ["mypy"],
    }
    codes = []
    for name, command in checks.items():
        print(f"{name}: {' '.join(command)}", flush=True)
        codes.append(call([*run, *command], ROOT))
        if codes[-1]:
            print(f"{name}: FAILED", flush=True)
    rest = arguments or workers()
    codes.append(call([*run, "pytest", "-m", "not slow", *counted, *rest], ROOT))
    return next((code for code in codes if code), 0)


def slow_tests(python: Path, arguments: list[str]) -> int:
    """Run the long tests; those that measure time come last, with nothing beside them."""
    run = [str(python), "-m", "pytest", "-m"]
    if arguments:
        return call([*run, "slow", *arguments], ROOT)
    code = call([*run, "slow and not alone", *workers()], ROOT)
    if code not in RAN:
        return code
    return call([*run, "slow and alone"], ROOT) or code


def main(arguments: list[str]) -> int:
    """Set up, then do what was asked; return the exit code."""
    testing = arguments[:1] == ["test"]
    try:
        python = Environment(ROOT).ensure("test" if testing else "")
    except SetupError as error:
        say(str(error))
        return error.code
    except KeyboardInterrupt:
        say("Stopped. Run the same command again to go on.")
        return INTERRUPTED
    if testing:
        return test(python, arguments[1:])
    return turnlight(python, arguments) if arguments or has_display() else first_look(python)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
