"""``turnlight capture``: meter, bracket, download and merge with a camera on the network."""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.commands.camera_args import find_camera, given_password, keep, kept_password
from app.commands.interrupt import stopping
from app.commands.outputs import check_outputs
from app.commands.probe_words import PARTS, frame_rows, lamp_rows, probe_facts
from app.core.base.errors import CoreError
from app.core.base.paths import user_data
from app.core.base.progress import Token
from app.core.solver.environment import reduce
from app.core.solver.solve import solve_all
from app.core.solver.style_pack import load_named_pack
from app.devices.capture.machine import ENVIRONMENT, Capture, CaptureResult
from app.devices.capture.session import FILE as OWED
from app.devices.capture.session import JOURNAL, Debts, Session
from app.devices.clock import SystemClock
from app.devices.errors import DeviceError
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import ACCESS_POINT
from app.devices.theta.link import Link

if TYPE_CHECKING:
    import argparse

    from app.core.hdr.arriving import Rough
    from app.core.solver.solve import StyleResult
    from app.core.solver.style_pack import StylePack
    from app.devices.capture.status import Status
    from app.devices.clock import Clock
    from app.devices.theta.found import FoundCamera
    from app.devices.theta.link import Credentials

_STOPPING: Final = "Stopping; the camera gets its settings back. Once more to end at once."
_MOST_DELAY_S: Final = 10
_SAY_AGAIN_S: Final = 5.0
_ROUGH_STYLES: Final = 3


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the ``capture`` command to the command line."""
    parser = subparsers.add_parser(
        "capture",
        help="take a bracket with a camera and make an environment of it",
        description="Meter, take a bracket of exposures, bring it over and merge it; or watch a "
        "folder for the frames of any other camera. A session that was interrupted is gone on "
        "with when its folder is named again.",
    )
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "--camera", metavar="URL", help='address of the camera, or "auto" to look for one'
    )
    source.add_argument(
        "--watch", metavar="DIR", type=Path, help="merge the bracket that comes into a folder"
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        type=Path,
        help="folder of the session: new, empty, or one to go on with (with --watch: the "
        "environment's file or folder)",
    )
    parser.add_argument(
        "--plan",
        choices=("paper", "full"),
        default="paper",
        help="three frames as in the paper, or as many as hold all the light (default: paper)",
    )
    parser.add_argument("--user", metavar="NAME", help="user name, for cameras in client mode")
    parser.add_argument(
        "--password-file", metavar="FILE", type=Path, help="file whose first line is the password"
    )
    parser.add_argument(
        "--delay", metavar="S", type=int, default=0, help="self-timer in seconds, 0 to 10"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Take a bracket, or wait for one.

    Raises
    ------
    CoreError
        When an argument, a folder or a file is of no use.
    DeviceError
        When the camera or the way to it fails.
    Cancelled
        After Ctrl-C, when the camera has its settings back.
    """
    if args.watch is not None:
        from app.commands.capture_watch import watch_folder

        return watch_folder(args)
    _check(args)
    given = given_password(args.user, args.password_file)
    clock, token = SystemClock(), Token()
    with stopping(token, _STOPPING):
        session = _session(args.output)
        pack = load_named_pack("generic")
        found, keys = _reach(args, session, given, clock, token)
        endpoint = ACCESS_POINT if found is None else found.endpoint
        with contextlib.closing(Link(endpoint, clock, keys)) as link:
            capture = Capture(
                OscClient(link, clock),
                session,
                clock,
                plan=args.plan,
                pack=pack,
                delay_s=args.delay,
                on_status=StatusTeller(clock, pack),
                token=token,
                debts=Debts(user_data() / OWED),
            )
            if session.journal.finished:
                _say_given_back(capture.give_back(), session, args.json)
                return 0
            result = capture.run()
    _say_result(result, session, found, args.json)
    if found is not None:
        keep(found, result.info, given)
    return 0


class StatusTeller:
    """Says on stderr how far a capture is: one line for each change."""

    def __init__(self, clock: Clock, pack: StylePack | None = None) -> None:
        self._clock = clock
        self._pack = pack
        self._last: tuple[object, ...] = ()
        self._time = -_SAY_AGAIN_S
        self._free = False

    def __call__(self, status: Status) -> None:
        """Say what is new."""
        if status.may_move and not self._free:
            print("You may move now.", file=sys.stderr, flush=True)
        self._free = status.may_move
        if status.rough is not None and self._pack is not None:
            pack, self._pack = self._pack, None
            with contextlib.suppress(CoreError):  # No answer yet is no reason to stop.
                print(rough_words(status.rough, pack), file=sys.stderr, flush=True)
        now = self._clock.now()
        what = (status.stage, status.message, status.shot)
        if not status.message or (what == self._last and now - self._time < _SAY_AGAIN_S):
            return
        self._last, self._time = what, now
        words = ", ".join(part for part in (status.message, status.left_words) if part)
        line = f"{100 * status.fraction:3.0f} %  {words}"
        print(line, file=sys.stderr, flush=True)


def rough_words(rough: Rough, pack: StylePack) -> str:
    """Say how to turn for the styles that match best, as small pictures tell it."""
    light = reduce(rough.environment("small pictures"), pack.header.environment)
    results = [each for each in solve_all(pack, light) if each.attainable]
    best = sorted(results, key=lambda each: -each.match)[:_ROUGH_STYLES]
    answer = ", ".join(_turn_words(each) for each in best) or "no style can be reached here"
    return f"A rough first answer: {answer}."


def _turn_words(result: StyleResult) -> str:
    side = f" (sitter's {result.side})" if result.side != "none" else ""
    way = "" if result.direction == "none" else f" {result.direction}"
    return f"{result.title}{side} {abs(result.turn_refined_deg):.0f}°{way}"


def _check(args: argparse.Namespace) -> None:
    if args.output is None:
        raise CoreError("A capture needs a folder for its files.", "Name one with -o DIR.")
    if args.output.is_dir():
        check_outputs([args.output / JOURNAL, args.output / ENVIRONMENT], [args.password_file])
    if not 0 <= args.delay <= _MOST_DELAY_S:
        raise CoreError(f"--delay is 0 to {_MOST_DELAY_S} seconds, not {args.delay}.")


def _reach(
    args: argparse.Namespace,
    session: Session,
    given: Credentials | None,
    clock: Clock,
    token: Token,
) -> tuple[FoundCamera | None, Credentials | None]:
    """Find the camera and its password, where a session still needs or owes it something."""
    merges_only = session.complete and not session.journal.finished
    if merges_only and not session.owes:
        return None, given
    try:
        found = find_camera(args.camera, clock, token)
        return found, given or kept_password(found)
    except DeviceError as error:
        if not merges_only:
            raise
        print(
            f"{error.message} Its files are all here and are merged; the camera is still owed its"
            " own settings.",
            file=sys.stderr,
        )
        return None, given


def _say_result(
    result: CaptureResult, session: Session, found: FoundCamera | None, as_json: bool
) -> None:
    for line in (*result.warnings, *result.probe.notes):
        print(line, file=sys.stderr)
    if as_json:
        print(json.dumps(_facts(result, session, found), ensure_ascii=False))
    else:
        print(_table(result))


def _say_given_back(untaken: str, session: Session, as_json: bool) -> None:
    warnings = [untaken] if untaken else []
    if as_json:
        print(json.dumps({"session": str(session.folder), "warnings": warnings}))
    else:
        print(untaken or "The camera has its own settings back.")


def _session(folder: Path) -> Session:
    session = Session.open_or_create(folder)
    for notice in session.notices:
        print(notice, file=sys.stderr)
    if session.journal.finished and session.owes:
        print(
            f"The session in {folder} is finished, but its camera is still owed its own settings.",
            file=sys.stderr,
        )
    elif session.journal.finished:
        raise CoreError(
            f"The session in {folder} is finished already.",
            "Name a new folder, or merge its files again with turnlight merge.",
        )
    if session.unfinished:
        here = sum(frame.done for frame in session.journal.frames)
        files = f"; {here} of {len(session.journal.frames)} files are here" if here else ""
        print(f"Going on with the unfinished session in {folder}{files}.", file=sys.stderr)
    return session


def _facts(result: CaptureResult, session: Session, found: FoundCamera | None) -> dict[str, Any]:
    journal = session.journal
    facts = probe_facts(result.probe)
    facts.update(
        camera={
            "model": journal.model,
            "serial": journal.serial,
            "firmware": journal.firmware,
            "url": None if found is None else found.endpoint.base,
        },
        session=str(session.folder),
        plan=result.plan.kind,
        originals=[str(path) for path in result.frames],
        environment=str(result.environment),
        seconds={part: round(result.seconds.get(part, 0.0), 3) for part in PARTS},
        warnings=list(result.warnings),
    )
    return facts


def _table(result: CaptureResult) -> str:
    times = [f"{part} {result.seconds.get(part, 0.0):.1f} s" for part in PARTS]
    rows, columns = result.probe.merged.radiance.shape[:2]
    lines = [*frame_rows(result.probe), *lamp_rows(result.probe), "", ", ".join(times) + "."]
    lines.append(f"Wrote {result.environment} ({columns} x {rows}).")
    return "\n".join(lines)
