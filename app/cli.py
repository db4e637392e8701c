"""The command line: its commands and how their errors are handled.

The exit code is 0 for success, 2 for bad usage, bad input or a full disk (with one sentence on
stderr), 3 for a camera or network failure, and 130 after an interruption (143 by SIGTERM, 129 by
SIGHUP). Answers go to stdout and everything else goes to stderr. With ``--json``, stdout therefore
contains exactly one JSON object.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Final, NoReturn

from app import __version__
from app.commands.shared.console import imports_whole, one_line, plain_streams, stop_code
from app.commands.shared.instruments import INSTRUMENTS, instrument
from app.core.base.errors import Cancelled, CoreError
from app.core.base.memory import MemoryShort, check_limit, is_memory_short
from app.core.storage.data_move import settle_data
from app.core.text import LANGUAGES, set_language, tr
from app.devices.errors import DISK, DeviceError

COMMANDS: Final = (
    "solve",
    "light",
    "lamp",
    "render",
    "merge",
    "stitch",
    "ball",
    "capture",
    "simulate-camera",
    "photo",
    "film",
    "locate",
    "align",
    "styles",
    "bake",
    "evaluate",
    "bench",
)
"""Commands, in the order in which ``--help`` lists them. Their code is in `app.commands`."""

_DONE = 0
_BAD_INPUT = 2
_DEVICE = 3
_USUAL_NEED: Final = 700 << 20
_WINDOW_NEED: Final = 1500 << 20
_NEEDS: Final = {"styles": 450 << 20, "film": 1000 << 20}
"""Minimum address space that each command's libraries need, in bytes."""
_WITH_VALUE: Final = ("--screenshots", "--theme", "--scale")


def command_lines() -> dict[str, str]:
    """Return a one-line summary of each command in the current language."""
    return {
        "solve": tr("find the best turn for each style in a panorama"),
        "light": tr("find the turn and the position of a second light"),
        "lamp": tr("manage lamps captured in a dark room"),
        "render": tr("render the head as lit by a panorama"),
        "merge": tr("merge a bracket of exposures into an environment"),
        "stitch": tr("stitch photos taken in all directions into an environment"),
        "ball": tr("measure the light of a place with a mirror ball"),
        "capture": tr("shoot a bracket with a 360 camera and merge it"),
        "simulate-camera": tr("run a simulated 360 camera on this computer"),
        "photo": tr("read the light on the faces in a photo"),
        "film": tr("find the styles shown in a film of a turning sitter"),
        "locate": tr("find the direction of a photo in a panorama"),
        "align": tr("align two views and show how far is left to turn"),
        "styles": tr("list the styles and their lamps"),
        "bake": tr("compute the light transport of a head"),
        "evaluate": tr("run the paper’s evaluation on a folder of environments"),
        "bench": tr("time the hot paths against plain implementations"),
    }


class _Parser(argparse.ArgumentParser):
    """A parser that reports errors in one sentence, without the usage text."""

    def error(self, message: str) -> NoReturn:
        words = tr("{what} (see {program} --help)", what=one_line(message), program=self.prog)
        self.exit(_BAD_INPUT, f"{self.prog}: {words}\n")


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """Build the parser for one command line.

    To define a command's options, its module has to be imported, along with the libraries that the
    module uses. Therefore only the selected command's module is imported. The other commands get
    only a name and a one-line help text.

    Returns:
        The parser. If `command` is given, the parsed arguments have the attribute ``run``, a
        callable that takes them and returns the exit code.
    """
    parser = _Parser(
        prog="turnlight",
        description=tr("Find how far to turn to get the light of a studio style in a given place."),
        epilog=tr(
            "Without a command, the window opens with the given files. For help on a "
            "command: turnlight COMMAND --help"
        ),
    )
    parser.add_argument("--version", action="version", version=f"turnlight {__version__}")
    parser.add_argument(
        "--language",
        metavar="LANGUAGE",
        help=tr("language of all text: {languages}", languages=", ".join(LANGUAGES)),
    )
    _add_window_options(parser)
    subparsers = parser.add_subparsers(metavar="COMMAND", dest="command")
    for name, line in command_lines().items():
        own = subparsers.add_parser(name, help=line, add_help=name == command)
        if name == command:
            command_module(name).add_arguments(own)
    return parser


def command_module(name: str) -> ModuleType:
    """Import the module that contains a command's options and code."""
    if name in INSTRUMENTS:
        return instrument(name)
    return importlib.import_module(f"app.commands.{name.replace('-', '_')}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command, turning any error into a one-sentence message and an exit code.

    Returns:
        The exit code: 0 for success, 2 for bad usage or input, 3 for a device or network failure,
        130 after an interruption, 143 after SIGTERM or 129 after SIGHUP.
    """
    if argv is None and not sys.warnoptions:
        # Library warnings about unusual numbers are meant for developers.
        warnings.simplefilter("ignore")
    language, arguments = _language_in(list(sys.argv[1:] if argv is None else argv))
    try:
        with imports_whole(), plain_streams(quiet=_command_in(arguments) is not None):
            return _run(language, arguments)
    except KeyboardInterrupt:  # Interrupted before the command started, or after it ended.
        return _stopped()


def _run(language: str, arguments: list[str]) -> int:
    try:
        # The language must be set before any module with a table of sentences is imported.
        set_language(language)
        if sys.platform == "win32":
            settle_data()
        code = _dispatch(arguments)
        # Flush now, so that a closed pipe is noticed here and not at interpreter exit.
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _stopped()
    except Cancelled as error:
        print(tr("Stopped."), error.hint, sep=" " if error.hint else "", file=sys.stderr)
        return stop_code()
    except CoreError as error:
        return _report_error(str(error), _BAD_INPUT)
    except DeviceError as error:
        return _report_error(str(error), _BAD_INPUT if error.code in DISK else _DEVICE)
    except BrokenPipeError:
        return _DONE
    except Exception as error:
        answer = _of_system(error)
        if answer is None:
            raise
        return answer
    return code


def _of_system(error: Exception) -> int | None:
    """Report a system error and return its exit code, or return None for any other error."""
    if is_memory_short(error):
        return _report_error(str(MemoryShort()), _BAD_INPUT)
    if isinstance(error, OSError):
        return _report_error(_sentence(error), _BAD_INPUT)
    # Ctrl-C during the import of a C library surfaces as an error of that library.
    return _stopped() if _was_interrupted(error) else None


def _was_interrupted(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _stopped() -> int:
    print(tr("Stopped."), file=sys.stderr)
    return stop_code()


def _report_error(sentence: str, code: int) -> int:
    print(f"turnlight: {one_line(sentence)}", file=sys.stderr)
    return code


def _dispatch(arguments: list[str]) -> int:
    try:
        return _obey(arguments)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else _BAD_INPUT


def _obey(arguments: list[str]) -> int:
    command = _command_in(arguments)
    if command != "bake":
        # The matrix products here are small, so waking a second BLAS thread costs more than it
        # gains, far more on a busy machine. This must be set before numpy is imported.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Otherwise warnings about damaged files would appear before Turnlight's own message.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    files, arguments = _files_in(arguments, command)
    if not {"-h", "--help", "--version"} & set(arguments):
        check_limit(_WINDOW_NEED if files or command is None else _NEEDS.get(command, _USUAL_NEED))
    parser = build_parser(None if files else command)
    empty = next((word[:-3] for word in arguments if re.fullmatch(r"--[^=]+=--", word)), None)
    if empty is not None:
        # Python 3.11 turns such a value into an empty list.
        parser.error(tr("argument {empty}: expected a value", empty=empty))
    args = parser.parse_args(arguments)
    if args.command is None:
        return _open_window(parser, args, files)
    code: int = args.run(args)
    return code


def _add_window_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group(tr("the window"))
    group.add_argument(
        "--demo", action="store_true", help=tr("use a simulated camera and webcam in a demo place")
    )
    group.add_argument(
        "--screenshots",
        metavar="DIR",
        type=Path,
        help=tr("with --demo: walk through every screen, save pictures in DIR, then quit"),
    )
    group.add_argument("--theme", choices=("dark", "light", "contrast"), help=tr("colours"))
    group.add_argument("--scale", type=int, choices=(1, 2), help=tr("pixels per point"))


def _language_in(arguments: list[str]) -> tuple[str, list[str]]:
    """Return the language chosen on the command line ("en" by default) and the other arguments."""
    for at, word in enumerate(arguments):
        option, equals, value = word.partition("=")
        if option == "--language" and (equals or arguments[at + 1 :]):
            after = at + 1 if equals else at + 2
            return value if equals else arguments[at + 1], arguments[:at] + arguments[after:]
        if word == "--":
            break
    return "en", arguments


def _command_in(arguments: list[str]) -> str | None:
    """Return the first argument that is neither an option nor the value of a window option."""
    before = ""
    for word in arguments:
        if _is_plain(before, word):
            return word
        before = word
    return None


def _files_in(arguments: list[str], command: str | None) -> tuple[tuple[Path, ...], list[str]]:
    """Split off the files to open in the window. There are none if the line contains a command."""
    if command is None or command in COMMANDS or not os.path.exists(command):
        return (), arguments
    words = list(zip(["", *arguments], arguments, strict=False))
    plain = [word for before, word in words if _is_plain(before, word)]
    others = [word for before, word in words if not _is_plain(before, word)]
    return tuple(Path(word) for word in plain), others


def _is_plain(before: str, word: str) -> bool:
    return not word.startswith("-") and before not in _WITH_VALUE


def _open_window(
    parser: argparse.ArgumentParser, args: argparse.Namespace, files: tuple[Path, ...]
) -> int:
    if args.screenshots is not None and not args.demo:
        parser.error(tr("--screenshots requires --demo"))
    from app.desktop import LaunchOptions, start

    missing = next((each for each in files if not each.exists()), None)
    if missing is not None:
        parser.error(tr("there is no file {name}", name=missing))
    options = LaunchOptions(args.demo, args.screenshots, args.theme, args.scale, files)
    return start(options, lambda: instrument("--screenshots"))


def _sentence(error: OSError) -> str:
    reason = (error.strerror or str(error) or type(error).__name__).rstrip(".")
    return f"{error.filename}: {reason}." if error.filename else f"{reason}."
