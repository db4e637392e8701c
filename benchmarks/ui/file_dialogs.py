"""File dialogs opened and closed in the real program, by real keys on a real screen.

Xvfb provides a screen, openbox manages its windows, xdotool presses the keys: first those that lead
to a dialog, then Esc. Counted are the dialogs that opened and closed, unexpected ends of the
program, and lines on its stderr.

    python benchmarks/ui/file_dialogs.py [--times 50] [--only KIND] [--json RESULT]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT: Final = Path(__file__).resolve().parents[2]
TOOLS: Final = ("Xvfb", "openbox", "xdotool")
PATIENCE_S: Final = 180.0
WINDOW: Final = "Turnlight"
FIND: Final = "ctrl+k"


@dataclass(frozen=True, slots=True)
class Kind:
    """A dialog: its title, its screen, and the keys or words that open it."""

    title: str
    screen: str
    keys: str = ""
    words: str = ""


KINDS: Final = {
    "files": Kind("Open files", "ctrl+1", "ctrl+o"),
    "folder": Kind("Open a folder", "ctrl+1", "ctrl+shift+o"),
    "watch": Kind("Watch a folder", "ctrl+1", words="Watch a folder"),
    "sheet": Kind("Save set sheet", "ctrl+2", "ctrl+s"),
    "import": Kind("Import style", "ctrl+2", words="Import style"),
    "photo": Kind("Open the photo you took", "ctrl+3", "p"),
}


@dataclass(slots=True)
class Count:
    """Results of one kind."""

    shown: int = 0
    crashes: int = 0
    stderr: list[str] = field(default_factory=list)


class Screen:
    """A separate X server with a window manager."""

    def __init__(self, stack: ExitStack) -> None:
        read, write = os.pipe()
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1000x24"],
            pass_fds=(write,),
            stderr=subprocess.DEVNULL,
        )
        stack.callback(_end, server)
        os.close(write)
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        self.env = {**os.environ, "DISPLAY": f":{number}"}
        for name in ("WAYLAND_DISPLAY", "QT_QPA_PLATFORM", "XDG_CURRENT_DESKTOP"):
            self.env.pop(name, None)
        manager = subprocess.Popen(["openbox"], env=self.env, stderr=subprocess.DEVNULL)
        stack.callback(_end, manager)

    def _tool(self, *words: str) -> str:
        done = subprocess.run(
            ["xdotool", *words], env=self.env, capture_output=True, text=True, check=False
        )
        return done.stdout.strip()

    def press(self, keys: str) -> None:
        """Press keys in the focused window."""
        self._tool("key", "--clearmodifiers", keys)

    def write(self, words: str) -> None:
        """Type words in the focused window."""
        self._tool("type", "--delay", "5", words)

    def sees(self, title: str) -> bool:
        """Return whether a window of this title is visible."""
        return bool(self._tool("search", "--onlyvisible", "--name", f"^{title}$"))

    def wait(self, title: str, there: bool, seconds: float, alive: Callable[[], bool]) -> bool:
        """Wait until a window appears or disappears; return False if that takes too long."""
        until = time.monotonic() + seconds
        while time.monotonic() < until and alive():
            if self.sees(title) == there:
                return True
            time.sleep(0.02)
        return False


class Program:
    """Turnlight on that screen, with the demo place open and a style chosen."""

    def __init__(self, screen: Screen, folder: Path) -> None:
        self.screen = screen
        self._log = folder / "stderr"
        env = {**screen.env, "TURNLIGHT_HOME": str(folder / "home")}
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "app", "--demo"], cwd=ROOT, env=env, stderr=log
            )

    def alive(self) -> bool:
        """Return whether it runs."""
        return self.process.poll() is None

    def stderr(self) -> list[str]:
        """Return its output on stderr."""
        return self._log.read_text(errors="replace").splitlines()

    def prepare(self) -> None:
        """Open the demo place and choose a style, so that every dialog is available."""
        if not self.screen.wait(WINDOW, True, PATIENCE_S, self.alive):
            raise SystemExit("The window did not open.")
        time.sleep(2.0)
        self.find("Try the demo place")
        # Available once there are answers.
        self.open(KINDS["sheet"])
        self.close(KINDS["sheet"])
        self.screen.press("Return")
        self.open(KINDS["photo"])
        self.close(KINDS["photo"])

    def find(self, words: str) -> None:
        """Choose an action in Find anything."""
        self.screen.press(FIND)
        time.sleep(0.15)
        self.screen.write(words)
        time.sleep(0.1)
        self.screen.press("Return")

    def open(self, kind: Kind) -> None:
        """Open a dialog; try again if it is not available yet."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until and self.alive():
            if kind.words:
                self.find(kind.words)
            else:
                self.screen.press(kind.keys)
            if self.screen.wait(kind.title, True, 5.0, self.alive):
                return
            self.screen.press("Escape")
            self.screen.press(kind.screen)
            time.sleep(0.5)
        if self.alive():
            raise SystemExit(f"{kind.title!r} did not open.")

    def close(self, kind: Kind) -> None:
        """Close the open dialog with Esc."""
        for _ in range(5):
            self.screen.press("Escape")
            if self.screen.wait(kind.title, False, 3.0, self.alive) or not self.alive():
                return
        raise SystemExit(f"{kind.title!r} did not close.")


def run(screen: Screen, kinds: list[str], times: int) -> dict[str, Count]:
    """Open and close every kind of dialog repeatedly; restart the program if it ends."""
    counts = {name: Count() for name in kinds}
    program: Program | None = None
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        for name, count in counts.items():
            begun = time.monotonic()
            while count.shown + count.crashes < times:
                if program is None:
                    folder = Path(tempfile.mkdtemp(dir=place))
                    program = Program(screen, folder)
                    stack.callback(_end, program.process)
                    program.prepare()
                    screen.press(KINDS[name].screen)
                    time.sleep(0.5)
                program.open(KINDS[name])
                program.close(KINDS[name])
                if program.alive():
                    count.shown += 1
                    continue
                count.crashes += 1
                print(f"{name}: ended with {program.process.returncode}", program.stderr()[-3:])
                count.stderr += program.stderr()
                program = None
            if program is not None:
                new = [line for line in program.stderr() if line not in count.stderr]
                count.stderr += new
                following = kinds[kinds.index(name) + 1 :][:1]
                for other in following:
                    screen.press(KINDS[other].screen)
                    time.sleep(1.0)
            seconds = time.monotonic() - begun
            print(
                f"{name}: {count.shown} of {times} closed, {count.crashes} crashes, "
                f"{len(count.stderr)} lines on stderr, {seconds:.0f} s",
                flush=True,
            )
    return counts


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def main() -> int:
    """Run it and report the results; return 1 if anything ended or was printed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=50, help="each kind so many times")
    parser.add_argument("--only", choices=sorted(KINDS), action="append", help="these kinds")
    parser.add_argument("--json", type=Path, help="keep the result there")
    args = parser.parse_args()
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        print(f"Missing: {', '.join(missing)}. On Debian: sudo apt install xvfb openbox xdotool")
        return 2
    begun = time.monotonic()
    with ExitStack() as stack:
        counts = run(Screen(stack), args.only or list(KINDS), args.times)
    bad = sum(count.crashes + len(count.stderr) for count in counts.values())
    if args.json:
        asked = ["git", "rev-parse", "--short", "HEAD"]
        commit = subprocess.check_output(asked, cwd=ROOT, text=True).strip()
        result = {
            "commit": commit,
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors",
            "seconds": round(time.monotonic() - begun),
            "kinds": {
                name: {"closed": c.shown, "crashes": c.crashes, "stderr": c.stderr}
                for name, c in counts.items()
            },
        }
        args.json.write_text(json.dumps(result, indent=1) + "\n")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
