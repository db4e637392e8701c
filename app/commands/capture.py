"""``turnlight capture``: meter, bracket, download and merge with a camera on the network."""

from __future__ import annotations

import argparse
import contextlib
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.shared.arguments import add_json, argument, check_outputs
from app.commands.shared.console import stopping
from app.commands.shared.printing import ProgressPrinter, answer, fields, say
from app.commands.shared.probe_words import PARTS, probe_facts, probe_table, wrote
from app.core.base.atomic_files import check_target
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_exr
from app.core.base.paths import user_data
from app.core.base.progress import Token
from app.core.measure.bracket.incoming_frames import ArrivingFrames
from app.core.measure.read.metadata import ENDINGS
from app.core.measure.single.preview import answers_of
from app.core.places.journal import JOURNAL
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.core.text import tr
from app.devices.capture.capture_steps import ENVIRONMENT, Capture, CaptureResult
from app.devices.capture.session import Session
from app.devices.capture.status import Status
from app.devices.capture.unrestored_settings import FILE as OWED
from app.devices.capture.unrestored_settings import Debts
from app.devices.clock import Clock, SystemClock
from app.devices.errors import DeviceError, PasswordNeeded
from app.devices.mjpeg import decode
from app.devices.passwords import Credentials, Passwords, default_password_hint, read_password_file
from app.devices.theta.camera_identity import FoundCamera
from app.devices.theta.client import OscClient
from app.devices.theta.discovery import discover, look_at
from app.devices.theta.endpoint import ACCESS_POINT, Endpoint, check_address
from app.devices.theta.last_camera import remember
from app.devices.theta.link import Link
from app.devices.theta.messages import Info
from app.devices.watched_folder.incoming_bracket import IncomingBracket
from app.devices.watched_folder.watch import WatchedFolder
from app.words.measure.preview import rough_words
from app.words.progress import progress_words
from app.words.remarks import sentences

_STOPPING: Final = tr(
    "Stopping and restoring the camera’s settings. Press Ctrl-C again to quit at once."
)
_MOST_DELAY_S: Final = 10
_SAY_AGAIN_S: Final = 5.0

MAY_MOVE: Final = tr("You may move now.")
RESTORED: Final = tr("The camera’s own settings were restored.")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``capture``."""
    parser.description = tr(
        "Meter, shoot a bracket, download and merge it; or watch a folder for frames "
        "from any other camera. To resume an interrupted session, name its folder again."
    )
    source = parser.add_mutually_exclusive_group(required=True)
    argument(source, "--camera URL", tr("address of the camera, or “auto” to search for one"))
    argument(source, "--watch DIR", tr("merge the bracket that arrives in a folder"), type=Path)
    add = partial(argument, parser)
    add(
        "-o --output DIR",
        tr(
            "session folder: a new or empty folder, or one to resume (with --watch: "
            "environment file or folder)"
        ),
        type=Path,
    )
    add(
        "--plan",
        tr("three frames as in the paper, or enough for the full range of light (default: paper)"),
        choices=("paper", "full"),
    )
    add("--user NAME", tr("user name, for cameras in client mode"))
    add("--password-file FILE", tr("file with the password on its first line"), type=Path)
    add("--delay S", tr("self-timer in seconds, 0 to 10"), type=int, default=0)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Shoot a bracket, or wait for one to arrive in a watched folder.

    Raises:
        CoreError: If an argument, a folder or a file is unusable.
        DeviceError: If the camera or the connection to it fails.
        Cancelled: After Ctrl-C, once the camera's settings have been restored.
    """
    if args.watch is not None:
        return _watch_folder(args)
    _check(args)
    credentials = given_password(args.user, args.password_file)
    clock, token = SystemClock(), Token()
    with stopping(token, _STOPPING):
        session = _session(args.output)
        pack = load_named_pack("generic")
        camera, keys = _reach(args, session, credentials, clock, token)
        endpoint = ACCESS_POINT if camera is None else camera.endpoint
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
                untaken = capture.give_back()
                facts = {"session": str(session.folder), "warnings": [untaken] if untaken else []}
                return answer(args, facts, untaken or RESTORED)
            result = capture.run()
    say(*sentences((*result.warnings, *result.probe.notes)))
    times = ", ".join(
        f"{name} {result.seconds.get(part, 0.0):.1f} s" for part, name in PARTS.items()
    )
    words = probe_table(result.probe, "", f"{times}.", wrote(result.probe, result.environment))
    answer(args, _facts(result, session, camera), words)
    if camera is not None:
        keep(camera, result.info, credentials)
    return 0


class StatusTeller:
    """Prints the progress of a capture to stderr, one line per change."""

    def __init__(self, clock: Clock, pack: StylePack | None = None) -> None:
        self._clock = clock
        self._pack = pack
        self._last: tuple[object, ...] = ()
        self._time = -_SAY_AGAIN_S
        self._free = False

    def __call__(self, status: Status) -> None:
        """Print whatever has changed in `status`."""
        if status.may_move and not self._free:
            say(MAY_MOVE)
        self._free = status.may_move
        if status.metered and self._pack is not None:
            words = rough_words(answers_of(decode(status.metered), self._pack))
            self._pack = None
            say(*([words] if words else []))
        now = self._clock.now()
        what = (status.stage, status.message, status.shot)
        if not status.message or (what == self._last and now - self._time < _SAY_AGAIN_S):
            return
        self._last, self._time = what, now
        words = ", ".join(
            part for part in (progress_words(status.message), status.left_words) if part
        )
        say(f"{100 * status.fraction:3.0f}%  {words}")


def _check(args: argparse.Namespace) -> None:
    if args.output is None:
        raise CoreError(tr("Choose a folder for the captured files."), tr("Name it with -o DIR."))
    if args.output.is_dir():
        check_outputs([args.output / JOURNAL, args.output / ENVIRONMENT], [args.password_file])
    if not 0 <= args.delay <= _MOST_DELAY_S:
        raise CoreError(
            tr(
                "--delay must be from 0 to {most} seconds, not {delay}.",
                most=_MOST_DELAY_S,
                delay=args.delay,
            )
        )


def _reach(
    args: argparse.Namespace,
    session: Session,
    credentials: Credentials | None,
    clock: Clock,
    token: Token,
) -> tuple[FoundCamera | None, Credentials | None]:
    """Find the camera and its password if the session still needs the camera."""
    merges_only = session.complete and not session.journal.finished
    if merges_only and not session.owes:
        return None, credentials
    try:
        camera = find_camera(args.camera, clock, token)
        return camera, credentials or kept_password(camera)
    except DeviceError as error:
        if not merges_only:
            raise
        say(
            tr(
                "{message} All files of the session have been downloaded and are being merged, "
                "but the camera’s own settings have not been restored yet.",
                message=error.message,
            )
        )
        return None, credentials


def _session(folder: Path) -> Session:
    session = Session.open_or_create(folder)
    say(*session.notices)
    if session.journal.finished and session.owes:
        say(
            tr(
                "The session in {folder} is finished, but the camera’s own settings have "
                "not been restored yet.",
                folder=folder,
            )
        )
    elif session.journal.finished:
        raise CoreError(
            tr("The session in {folder} is already finished.", folder=folder),
            tr("Choose a new folder, or merge the session’s files again with turnlight merge."),
        )
    if session.unfinished:
        frames = session.journal.frames
        here = sum(frame.done for frame in frames)
        words = tr("Resuming the unfinished session in {folder}.", folder=folder)
        if here:
            words = tr(
                "Resuming the unfinished session in {folder}; {here} of {count} files downloaded.",
                folder=folder,
                here=here,
                count=len(frames),
            )
        say(words)
    return session


def find_camera(address: str, clock: Clock, token: Token) -> FoundCamera:
    """Search for a camera, or query the device at an address.

    Raises:
        CoreError: If the address is invalid.
        DeviceError: If no camera answers, if several cameras answer, or if the device that
            answers is not a camera.
    """
    if address != "auto":
        return look_at(_endpoint(address), clock, token=token)
    say(tr("Looking for cameras."))
    discovery = discover(clock, token=token)
    # If no camera is found, the error already contains these notes.
    camera = discovery.one()
    for note in discovery.notes:
        say(note)
    say(tr("Found {name} at {base}.", name=camera.name, base=camera.endpoint.base))
    return camera


def given_password(user: str | None, password_file: Path | None) -> Credentials | None:
    """Read the password supplied by the user.

    Raises:
        CoreError: If only one of the two options is given, or the file cannot be read.
    """
    if user is None and password_file is None:
        return None
    if user is None or password_file is None:
        raise CoreError(
            tr("--user and --password-file must be used together."), tr("Use both or neither.")
        )
    return Credentials(user, read_password_file(password_file, say))


def kept_password(camera: FoundCamera) -> Credentials | None:
    """Get the password from the system keyring if the camera requires one.

    Raises:
        PasswordNeeded: If the camera requires a password and none is stored.
    """
    if not camera.needs_password:
        return None
    password = Passwords(say).get(camera.user) if camera.user else None
    if password is None:
        hint = default_password_hint(camera.model, camera.serial)
        raise PasswordNeeded(
            tr("{name} requires a password.", name=camera.name),
            tr("Use --user and --password-file. {hint}", hint=hint),
        )
    return Credentials(camera.user, password)


def keep(camera: FoundCamera, info: Info | None, credentials: Credentials | None) -> None:
    """Save a camera that worked, along with a new password if it required one.

    Args:
        info: The camera's description of itself, or None. A camera that requires a password sends
            its description only after login.
        credentials: Credentials typed by the user for this camera, or None if they came from the
            keyring or there are none. They are not saved if the camera never asked for them, since
            they may be wrong.
    """
    needs_password = camera.needs_password
    if info is not None:
        camera = replace(camera, model=info.model, serial=info.serial_number)
    remember(camera)
    if credentials is not None and needs_password:
        Passwords(say).set(credentials.user, credentials.password)


def _endpoint(address: str) -> Endpoint:
    """Parse an address. A mistyped address is a usage error, not a device failure."""
    try:
        return check_address(address)
    except DeviceError as error:
        raise CoreError(error.message, error.hint) from error


def _facts(result: CaptureResult, session: Session, camera: FoundCamera | None) -> dict[str, Any]:
    journal = session.journal
    facts = probe_facts(result.probe)
    facts.update(
        camera={
            **fields(journal, "model", "serial", "firmware"),
            "url": None if camera is None else camera.endpoint.base,
        },
        session=str(session.folder),
        plan=result.plan.kind,
        originals=[str(path) for path in result.frames],
        environment=str(result.environment),
        seconds={part: round(result.seconds.get(part, 0.0), 3) for part in PARTS},
        warnings=list(sentences(result.warnings)),
    )
    return facts


def _watch_folder(args: argparse.Namespace) -> int:
    """Wait for one bracket in a folder and merge it into an environment."""
    _check_watch(args)
    token = Token()
    with stopping(token):
        bracket = _next_bracket(args.watch, token)
        began = time.perf_counter()
        target = _target(args.output, bracket)
        with ArrivingFrames(len(bracket.paths)) as frames:
            for path in bracket.paths:
                frames.add(path)
            probe = frames.measure(bracket.paths, token=token, report=ProgressPrinter())
    write_exr(target, probe.merged.radiance, probe.merged.cd_m2)
    seconds = time.perf_counter() - began
    say(*sentences((*probe.warnings, *probe.notes)))
    facts = probe_facts(probe) | {
        "camera": {"model": probe.bracket.frames[0].camera},
        "originals": [str(path) for path in bracket.paths],
        "environment": str(target),
        "seconds": dict.fromkeys(PARTS, 0.0) | {"merge": round(seconds, 3)},
    }
    last = wrote(probe, target, seconds)
    return answer(args, facts, probe_table(probe, "", last))


def _check_watch(args: argparse.Namespace) -> None:
    """Check, before waiting for photos, that the output can be written."""
    options = [name for name in ("user", "password_file") if getattr(args, name) is not None]
    if options or args.delay:
        raise CoreError(tr("--user and --delay cannot be used with --watch."))
    output: Path | None = args.output
    if output is None:
        check_target(Path.cwd() / ENVIRONMENT)
    elif _is_file(output):
        check_outputs([output], [args.watch], ENDINGS)
    else:
        output.mkdir(parents=True, exist_ok=True)
        check_target(output / ENVIRONMENT)


def _is_file(output: Path) -> bool:
    return output.suffix.lower() == ".exr" and not output.is_dir()


def _next_bracket(path: Path, token: Token) -> IncomingBracket:
    """Wait for the first complete bracket, reporting any files that are skipped."""
    folder = WatchedFolder(path, SystemClock(), say=say)
    say(tr("Waiting for photos in {folder}. Press Ctrl-C to stop.", folder=folder.folder))
    bracket = next(folder.brackets(token))
    say(*bracket.reasons)
    return bracket


def _target(output: Path | None, bracket: IncomingBracket) -> Path:
    """Return the path for the environment. A file is replaced only if the user chose its name."""
    if output is not None and _is_file(output):
        return output
    # Never default to the watched folder, where the result would be mistaken for the next photo.
    stem = f"{bracket.paths[0].stem}-environment" if output is None else Path(ENVIRONMENT).stem
    folder = Path.cwd() if output is None else output
    number, path = 1, folder / f"{stem}.exr"
    while path.exists():
        number += 1
        path = folder / f"{stem}-{number}.exr"
    return path
