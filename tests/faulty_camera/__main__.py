"""``python -m tests.faulty_camera``: `turnlight simulate-camera` with faults and a password."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial

from app.commands import simulate_camera
from app.commands.shared.arguments import add_json, argument
from app.commands.shared.console import one_line
from app.core.base.errors import CoreError
from app.devices.clock import SystemClock
from tests.faulty_camera.camera import FaultyCamera
from tests.faulty_camera.faults import FAULTS, faults_named
from tests.faulty_camera.models import PERSONALITIES, personality_named, user_name
from tests.faulty_camera.server import FaultyServer


def make_parser() -> argparse.ArgumentParser:
    width = max(len(name) for name in FAULTS)
    parser = argparse.ArgumentParser(
        prog="python -m tests.faulty_camera",
        description="Serve a simulated 360 camera that fails as --fault says.",
        epilog="\n".join(["faults:", *(f"  {name:{width}}  {FAULTS[name]}" for name in FAULTS)]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    simulate_camera.add_camera(parser, [each.name for each in PERSONALITIES])
    add = partial(argument, parser)
    add("--user", "user name that it asks for", default="")
    add("--password", "password that it asks for", default="")
    add(
        "--fault NAME",
        "what goes wrong; several may be named, and the option repeated",
        action="extend",
        nargs="+",
        default=[],
    )
    add("--seed", "of the faults (default: 0)", type=int, default=0)
    add_json(parser, run)
    return parser


def run(args: argparse.Namespace) -> int:
    """Serve the camera until it is interrupted, see `simulate_camera.serve`."""
    check(args)
    clock = SystemClock()
    camera = FaultyCamera(
        simulate_camera.read_scene(args),
        args.model,
        clock,
        faults=args.fault,
        seed=args.seed,
        user=args.user,
        password=args.password,
        rate_mbit=args.rate,
    )
    serve = partial(simulate_camera.serve, server_class=FaultyServer)
    facts: dict[str, object] = {"model": args.model, "faults": list(faults_named(args.fault))}
    if not args.password:
        return serve(camera, args, clock, facts)
    user = args.user or user_name(camera.personality)
    note = f"It asks for the user name {user} and its password."
    return serve(camera, args, clock, facts | {"user": user}, note)


def check(args: argparse.Namespace) -> None:
    """Raise `CoreError` for an unknown fault, and for a password where there can be none."""
    for name in args.fault:
        try:
            faults_named([name])
        except ValueError:
            known = ", ".join(FAULTS)
            raise CoreError(f"There is no fault {name!r}.", f"There are: {known}.") from None
    if args.user and not args.password:
        raise CoreError("A camera with a user name needs a password.", "Add --password.")
    person = personality_named(args.model)
    if args.password and not person.digest:
        others = ", ".join(each.name for each in PERSONALITIES if each.digest)
        raise CoreError(f"A {person.model} cannot ask for a password.", f"These can: {others}.")


def main(words: Sequence[str] | None = None) -> int:
    """Run it. Returns the exit code: 0 done, 2 bad input, 130 interrupted."""
    args = make_parser().parse_args(words)
    try:
        return run(args)
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        return 130
    except CoreError as error:
        print(one_line(str(error)), file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
