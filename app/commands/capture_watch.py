"""``turnlight capture --watch``: the next bracket that comes into a folder, from any camera."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.commands.interrupt import stopping
from app.commands.outputs import check_outputs
from app.commands.probe_words import PARTS, frame_rows, lamp_rows, probe_facts
from app.commands.progress_printer import ProgressPrinter
from app.core.base.errors import CoreError
from app.core.base.files import check_target
from app.core.base.images import write_exr
from app.core.base.progress import Token
from app.core.hdr.arriving import ArrivingFrames
from app.core.hdr.metadata import ENDINGS
from app.core.solver.style_pack import load_named_pack
from app.devices.capture.watch import WatchedFolder
from app.devices.clock import SystemClock

if TYPE_CHECKING:
    import argparse

    from app.core.hdr.pipeline import Probe
    from app.devices.capture.watch import IncomingBracket

_NAME: Final = "environment.exr"


def watch_folder(args: argparse.Namespace) -> int:
    """Wait for one bracket and make an environment of it.

    Raises
    ------
    CoreError
        When the environment cannot be made or written.
    DeviceError
        When the folder cannot be read.
    Cancelled
        After Ctrl-C.
    """
    _check(args)
    pack = load_named_pack("generic")
    token = Token()
    with stopping(token):
        bracket = _next_bracket(args.watch, token)
        began = time.perf_counter()
        target = _target(args.output, bracket)
        with ArrivingFrames(len(bracket.paths)) as frames:
            for path in bracket.paths:
                frames.add(path)
            probe = frames.measure(bracket.paths, pack, token=token, report=ProgressPrinter())
    radiance, white = probe.merged.radiance, probe.merged.cd_m2
    write_exr(target, radiance, white)
    seconds = time.perf_counter() - began
    for line in (*probe.warnings, *probe.notes):
        _say(line)
    if args.json:
        print(json.dumps(_facts(probe, bracket, target, seconds), ensure_ascii=False))
    else:
        rows, columns = probe.merged.radiance.shape[:2]
        last = f"Wrote {target} ({columns} x {rows}, {seconds:.2f} s)."
        print("\n".join([*frame_rows(probe), *lamp_rows(probe), "", last]))
    return 0


def _check(args: argparse.Namespace) -> None:
    """Refuse what cannot be written before anybody waits for pictures."""
    given = [name for name in ("user", "password_file") if getattr(args, name) is not None]
    if given or args.delay:
        raise CoreError("--watch takes pictures as they come: --user and --delay are for a camera.")
    output: Path | None = args.output
    if output is None:
        check_target(Path.cwd() / "environment.exr")
    elif _is_file(output):
        check_outputs([output], [args.watch], ENDINGS)
    else:
        output.mkdir(parents=True, exist_ok=True)
        check_target(output / _NAME)


def _is_file(output: Path) -> bool:
    return output.suffix.lower() == ".exr" and not output.is_dir()


def _next_bracket(path: Path, token: Token) -> IncomingBracket:
    """Wait for the first bracket; says what is passed over meanwhile."""
    folder = WatchedFolder(path, SystemClock(), say=_say)
    _say(f"Waiting for pictures in {folder.folder}. Ctrl-C ends it.")
    bracket = next(folder.brackets(token))
    for line in bracket.reasons:
        _say(line)
    return bracket


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _target(output: Path | None, bracket: IncomingBracket) -> Path:
    """Where the environment goes; what is there already is replaced only if it was named."""
    if output is not None and _is_file(output):
        return output
    # Never into the watched folder by itself: it would be the next picture there.
    stem = f"{bracket.paths[0].stem}-environment" if output is None else Path(_NAME).stem
    folder = Path.cwd() if output is None else output
    number, path = 1, folder / f"{stem}.exr"
    while path.exists():
        number += 1
        path = folder / f"{stem}-{number}.exr"
    return path


def _facts(probe: Probe, bracket: IncomingBracket, target: Path, seconds: float) -> dict[str, Any]:
    facts = probe_facts(probe)
    facts.update(
        camera={"model": probe.bracket.frames[0].camera},
        originals=[str(path) for path in bracket.paths],
        environment=str(target),
        seconds=dict.fromkeys(PARTS, 0.0) | {"merge": round(seconds, 3)},
    )
    return facts
