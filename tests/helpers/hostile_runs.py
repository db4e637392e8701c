"""Every command with every hostile file and option, each in a process of its own with a watchdog.

A process that has imported everything forks for each case, so that a case costs what the command
costs and not its imports. Nothing is run in the process that forks: threads of libraries would be
missing in its children.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import fcntl
import importlib
import json
import os
import re
import resource
import signal
import struct
import subprocess
import sys
import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.cli import COMMANDS, build_parser, command_module

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from tests.helpers.hostile_data import Hostile

__all__ = ["LIMIT_S", "MOST_RSS", "Case", "Outcome", "Zygote", "file_cases", "option_cases"]

LIMIT_S: Final = 120.0
"""Processor time after which a case counts as hanging, and a third of the wall time."""

MOST_RSS: Final = 2_500_000_000
"""Most memory a case may use, bytes."""

_ROOT: Final = Path(__file__).resolve().parents[2]
_CODES: Final = (0, 2, 3)
_STOPPED: Final = 130
_STOP_S: Final = 4.0
_PIPE_BYTES: Final = 1 << 20  # more than any answer
_NUMBERS: Final = (
    *("nan", "inf", "-1e300", "1e300", "1e308", "1e-300", "0", "-1", "9" * 30, "9" * 5000),
    *("", "1,2", "x", "--", "²", "²x4"),
)
_PATHS: Final = ("missing/a.png", ".", "/dev/full", "pipe.png", "loop.exr", "a\x1b[31m\n\udcff.png")
_STEERING: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_LIBRARY_LINES: Final = (
    "Warning:",
    "[ WARN",
    "[ERROR",
    "libpng",
    "Corrupt JPEG",
    "TIFF",
    "terminate",
    "OpenEXR",
)


@dataclass(frozen=True, slots=True)
class Case:
    """One call of the program.

    `reads` are files that must not change; `stop_s` asks a command that has no end of its own, or
    takes minutes, to stop after so many seconds. `plain` takes the rights away that root has over
    what others have protected.
    """

    words: tuple[str, ...]
    reads: tuple[Path, ...] = ()
    stop_s: float | None = None
    home: str = ""
    plain: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a case."""

    case: Case
    code: int
    seconds: float
    rss: int
    out: str
    err: str
    faults: tuple[str, ...]


# -- which cases there are -----------------------------------------------------------------------


def file_cases(hostile: Hostile, sound: Path) -> list[Case]:
    """Give a file to every command that takes one of its kind; `sound` holds good ones."""
    f = str(hostile.path)
    good = str(sound / "none.exr")
    photo, darker = str(sound / "eight.png"), str(sound / "darker-eight.png")
    sister = str(hostile.sister or darker)
    reads = tuple(path for path in (hostile.path, hostile.sister) if path is not None)
    archive: list[tuple[str, ...]] = [
        ("solve", good, "--head", f),
        ("light", good, "--head", f, "--lamp", "panel"),
        ("render", good, "--head", f, "--turn", "0", "-o", "out.png"),
        ("bench", "--head", f, "--no-peers"),
    ]
    mesh: list[tuple[str, ...]] = [
        ("bake", "--head", f, "--unit", "100", "--export-scene", "scene")
    ]
    picture: list[tuple[str, ...]] = [
        ("solve", f, "--json"),
        ("light", f, "--lamp", "panel", "--style", "butterfly"),
        ("light", good, "--lamp", f, "--style", "butterfly"),
        ("render", f, "--turn", "20", "-o", "out.exr"),
        ("merge", f, "-o", "out.exr", "--json"),
        ("merge", f, sister, "--times", "0.1,0.025", "-o", "out.exr", "--preview", "out.png"),
        ("merge", photo, darker, "--times", "0.1,0.025", "-o", "out.hdr", "--mask", f),
        ("lamp", "add", "mine", f),
        ("locate", f, photo),
        ("locate", good, f),
        ("align", f, photo, "-o", "out.png"),
        ("align", photo, f, "--json"),
        ("simulate-camera", "--scene", f, "--until-eof"),
    ]
    text: list[tuple[str, ...]] = [
        ("capture", "--camera", "http://127.0.0.1:9", "-o", "s", "--password-file", f)
    ]
    picture += [
        ("photo", f, "--json"),
        ("photo", photo, "--place", f),
        ("styles", "add", "--from", f),
        ("stitch", f, "-o", "out.exr"),
        ("stitch", f, darker, "--kind", "fisheye", "-o", "out.exr"),
        ("ball", f, "-o", "out.exr", "--json"),
    ]
    film: list[tuple[str, ...]] = [
        ("film", f),
        ("film", f, "--live", "--json"),
        ("film", f, "-o", "out.exr"),
        ("film", f, "--place", good),
        ("film", f, "--place", f),
        *picture[:5],
        *picture[-6:],
    ]
    style: list[tuple[str, ...]] = [
        ("styles", "--json"),
        ("solve", good, "--style", "mine"),
        ("photo", f),
        ("film", f),
    ]
    kinds: dict[str, list[tuple[str, ...]]] = {
        **{"archive": archive, "mesh": mesh, "text": text, "film": film, "style": style},
    }
    calls = kinds.get(hostile.kind, picture)
    if hostile.kind == "special":
        calls = [*archive, *mesh, *picture, *text[:0]]
    home = _home_with(hostile.path) if hostile.kind == "style" else ""
    cases = [Case(call, reads, home=home) for call in calls]
    return [replace(case, stop_s=_STOP_S) if case.words[0] == "bench" else case for case in cases]


def _home_with(style: Path) -> str:
    """Make a folder of the user's with a style file in it, beside the corpus."""
    home = style.parents[1] / "homes" / style.name
    target = home / "styles" / "mine.toml"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(style.read_bytes())
    return str(home)


def option_cases(sound: Path) -> list[Case]:
    """Every option of every command, found from its parser, with values that no one should give."""
    cases: list[Case] = []
    for command in COMMANDS:
        for words, parser in _leaves((command,), _parser_of(command)):
            base = _base(words, parser, sound)
            stop = _STOP_S if command in ("bench", "bake", "evaluate", "capture") else None
            reads = tuple(Path(word) for word in base if word.startswith(str(sound) + os.sep))
            own = str(reads[0]) if reads else str(sound / "none.exr")
            cases.append(Case(base, reads, stop))
            for action in parser._actions:
                option = action.option_strings[-1] if action.option_strings else ""
                if not option or isinstance(action, argparse._HelpAction):
                    continue
                if action.nargs == 0:
                    cases.append(Case((*base, option), reads, stop))
                    continue
                values: tuple[str, ...] = (*_NUMBERS, *_PATHS, own)
                if action.choices is not None:
                    values = ("", "\x1b[31m", *map(str, action.choices))
                cases += [Case((*base, f"{option}={value}"), reads, stop) for value in values]
    return cases


def _parser_of(command: str) -> argparse.ArgumentParser:
    parser = build_parser(command)
    action = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    found: argparse.ArgumentParser = action.choices[command]
    return found


def _leaves(
    words: tuple[str, ...], parser: argparse.ArgumentParser
) -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    nested = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    for action in nested:
        for name, each in action.choices.items():
            yield from _leaves((*words, name), each)
    if not nested:
        yield words, parser


def _base(words: tuple[str, ...], parser: argparse.ArgumentParser, sound: Path) -> tuple[str, ...]:
    """Words with which the command works, so that only the option under test can be wrong."""
    photo, darker = str(sound / "eight.png"), str(sound / "darker-eight.png")
    known: dict[str, tuple[str, ...]] = {
        "merge": (photo, darker, "--times", "0.1,0.025", "-o", "out.exr", "--preview", "p.png"),
        "solve": (str(sound / "none.exr"), "--style", "butterfly", "--sheet", "s.png"),
        "render": (str(sound / "none.exr"), "--turn", "0", "-o", "out.png"),
        "light": (str(sound / "none.exr"), "--lamp", "panel", "--style", "butterfly"),
        "align": (photo, darker),
        "locate": (str(sound / "none.exr"), photo),
        "bake": (
            "-o",
            "T.npz",
            "--front-only",
            "--quality",
            "draft",
            "--image",
            "8",
            "--env",
            "8x4",
        ),
        "capture": ("--camera", "http://127.0.0.1:9", "-o", "session"),
        "simulate-camera": ("--until-eof",),
        "bench": ("--no-peers",),
        "evaluate": ("--scenes", str(sound)),
    }
    if words[0] in known:
        return (*words, *known[words[0]])
    needed = [a for a in parser._actions if not a.option_strings]
    return (*words, *(str(sound / "none.exr") for _ in needed))


# -- running them --------------------------------------------------------------------------------


class Zygote:
    """The process that forks; use it as a context manager."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._count = 0
        # Through the module's name, so that it works in any checkout.
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-c",
                f"import sys; sys.path.insert(0, {str(_ROOT)!r}); "
                "from tests.helpers.hostile_runs import serve; serve()",
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OPENCV_LOG_LEVEL": "SILENT"},
            text=True,
        )

    def __enter__(self) -> Zygote:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(600)
        assert self._process.stdout is not None
        self._process.stdout.close()

    def run(
        self, case: Case, limits: dict[str, int] | None = None, work: Path | None = None
    ) -> Outcome:
        """Run a case, by default in a new folder with odd things in it, and look at what it left.

        `limits` are resource limits by name, e.g. RLIMIT_FSIZE.
        """
        self._count += 1
        place = self._folder / f"run{self._count}"
        if work is None:
            work = place / "work"
            work.mkdir(parents=True)
            os.mkfifo(work / "pipe.png")
            (work / "loop.exr").symlink_to("loop.exr")
        place.mkdir(parents=True, exist_ok=True)
        before = [_state(path) for path in case.reads]
        order = {
            "words": case.words,
            "work": str(work),
            "place": str(place),
            "home": case.home or str(work / "home"),
            "stop_s": case.stop_s,
            "limits": limits or {},
            "plain": case.plain,
        }
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(order) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._process.stdout.readline())
        out = (place / "out").read_text("utf-8", "replace")
        err = (place / "err").read_text("utf-8", "replace")
        faults = list(_faults(case, answer, out, err))
        if [_state(path) for path in case.reads] != before:
            faults.append("an input was changed")
        faults += _incomplete(work)
        return Outcome(
            case, answer["code"], answer["seconds"], answer["rss"], out, err, tuple(faults)
        )


def _state(path: Path) -> object:
    try:
        about = path.lstat()
    except OSError:
        return None
    return about.st_ino, about.st_size, about.st_mtime_ns


def _faults(case: Case, answer: dict[str, Any], out: str, err: str) -> Iterator[str]:
    code = answer["code"]
    allowed = (*_CODES, _STOPPED) if case.stop_s else _CODES
    json_asked = code == 0 and "--json" in case.words and case.words[0] != "evaluate"
    found = {
        "hang": answer["hung"],
        f"exit code {code}": code not in allowed,
        "traceback": "Traceback" in err or "Exception ignored" in err,
        f"{answer['rss'] / 1e9:.1f} GB": answer["rss"] > MOST_RSS,
        "refused without a word": code in (2, 3) and not err.strip(),
        "control characters": _STEERING.search(out + err) is not None,
        # Only the command line keeps libraries from writing to the terminal.
        "a library's line": case.words[0] != "call"
        and any(
            word in line and not line.startswith("turnlight")
            for line in err.splitlines()
            for word in _LIBRARY_LINES
        ),
        "no JSON": json_asked and not _is_json(out),
    }
    yield from (words for words, there in found.items() if there)


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except ValueError:
        return False
    return True


def _incomplete(work: Path) -> Iterator[str]:
    """Read everything that was written again."""
    import numpy as np
    import OpenImageIO as oiio

    for path in sorted(work.rglob("*")):
        if path.is_symlink() or not path.is_file() or path.suffix == ".lock":
            continue
        name = path.name.encode("utf-8", "replace").decode()
        # The library that reads it again takes no other names.
        path = path.rename(path.with_name(name)) if name != path.name else path
        if name.startswith("."):
            yield f"{name} was left"
            continue
        try:
            if path.suffix in (".png", ".exr", ".hdr"):
                source = oiio.ImageInput.open(str(path))
                whole = source is not None and source.read_image("float") is not None
                whole = not (source or oiio).geterror() and whole
            elif path.suffix == ".npz":
                with np.load(path, allow_pickle=False) as stored:
                    whole = all(stored[each] is not None for each in stored.files)
            elif path.suffix == ".json":
                whole = json.loads(path.read_text()) is not None
            else:
                whole = path.stat().st_size > 0
        except Exception:  # noqa: BLE001
            whole = False
        if not whole:
            yield f"{name} is incomplete"


def serve() -> None:
    """Fork for each order on standard input, and say what became of it on standard output."""
    for name in COMMANDS:
        command_module(name)
    for name in (
        "cv2",
        "app.core.painting.user_styles",
        "app.devices.webcam.files",
        "app.export.result_sheet",
        "app.core.measure.bracket.measure",
        "benchmarks.answers.evaluation.command",
        "benchmarks.answers.evaluation.report.page",
        "benchmarks.speed.timing.command",
    ):
        importlib.import_module(name)
    answers = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        order = json.loads(line)
        begun = time.monotonic()
        # Pipes, since a limit on the size of files would hold for standard error, too.
        pipes = {name: os.pipe() for name in ("out", "err")}
        child = os.fork()
        if child == 0:
            _child(order, pipes["out"][1], pipes["err"][1])
        code, usage, hung = _waited(child, order["stop_s"], begun)
        facts = {
            "code": code,
            "hung": hung,
            "seconds": round(time.monotonic() - begun, 3),
            "rss": usage.ru_maxrss * 1024,
        }
        for name, (reading, writing) in pipes.items():
            os.close(writing)
            Path(order["place"], name).write_bytes(_drained(reading))
        answers.write(json.dumps(facts) + "\n")
        answers.flush()


def _drained(descriptor: int) -> bytes:
    os.set_blocking(descriptor, False)
    parts = []
    with contextlib.suppress(BlockingIOError):
        while part := os.read(descriptor, 1 << 20):
            parts.append(part)
    os.close(descriptor)
    return b"".join(parts)


def _waited(
    child: int, stop_s: float | None, begun: float
) -> tuple[int, resource.struct_rusage, bool]:
    asked = hung = False
    pause = 0.002
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status), usage, hung
        waited = time.monotonic() - begun
        if stop_s is not None and waited > stop_s and not asked:
            asked = True
            os.kill(child, signal.SIGINT)
        if waited > 3 * LIMIT_S:
            hung = True
            os.kill(child, signal.SIGKILL)
        time.sleep(pause)
        pause = min(2 * pause, 0.05)


def _called(words: list[str]) -> int:
    """Run a command, or with "call" a function of a module with the words as its arguments."""
    if words[0] == "call":
        code: int = getattr(importlib.import_module(words[1]), words[2])(*words[3:])
        return code
    from app.cli import main

    # As from a shell, where the program also sees to what libraries remark.
    sys.argv = ["turnlight", *words]
    return main()


def _child(order: dict[str, Any], out: int, err: int) -> None:
    """Be the program: never returns."""
    code = 1
    try:
        os.chdir(order["work"])
        os.environ["TURNLIGHT_HOME"] = order["home"]
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        for pipe, number in ((out, 1), (err, 2)):
            fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
            os.dup2(pipe, number)
            os.close(pipe)
        # What was opened on another kind of file does not do for a pipe.
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", closefd=False)  # noqa: SIM115
        signal.signal(signal.SIGINT, signal.default_int_handler)
        for name, value in order["limits"].items():
            resource.setrlimit(getattr(resource, name), (value, value))
        resource.setrlimit(resource.RLIMIT_CPU, (int(LIMIT_S), int(LIMIT_S)))
        resource.setrlimit(resource.RLIMIT_AS, (16 << 30, 16 << 30))
        if order["plain"] and sys.platform == "linux":
            # capset(2), version 3 of its header; no capability is left.
            ctypes.CDLL(None).capset(struct.pack("Ii", 0x20080522, 0), bytes(24))
        try:
            code = _called(order["words"])
        except BaseException:  # noqa: BLE001
            traceback.print_exc()
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
    finally:
        os._exit(code)
