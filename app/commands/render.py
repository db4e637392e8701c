"""``turnlight render``: a picture of the head under an environment, at any turn."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.commands.outputs import check_ending, check_outputs, head_files
from app.commands.solver_args import MOST_DEG
from app.core.base import colour
from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.base.images import write_exr, write_png
from app.core.solver.environment import read_environment, reduce
from app.core.solver.transport import load_named, render, to_image

if TYPE_CHECKING:
    import argparse

    from app.core.base.colour import FloatImage
    from app.core.solver.transport import Transport

_WRITERS: Final = (".png", ".exr")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the ``render`` command to the command line."""
    parser = subparsers.add_parser(
        "render",
        help="picture of the head under an environment",
        description="Render the head under an HDR panorama at any turn.",
    )
    parser.add_argument("env", metavar="ENV", type=Path, help="HDR panorama (.exr or .hdr)")
    parser.add_argument(
        "--turn",
        metavar="DEG",
        type=float,
        required=True,
        help="turn in degrees, positive = clockwise seen from above",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help="picture to write: .png for looking at, .exr with linear light",
    )
    parser.add_argument(
        "--head",
        metavar="NAME",
        default="generic",
        help="head or baked T.npz (default: generic)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Render one picture and write it whole or not at all.

    Raises
    ------
    CoreError
        When an argument, the panorama or the head is of no use; nothing is written then.
    """
    started = time.perf_counter()
    output = Path(args.output)
    # Everything that can be wrong with the words is said before anything is computed.
    check_ending(output, _WRITERS, "pictures")
    if not abs(args.turn) <= MOST_DEG:
        raise CoreError(f"The turn must be a number of degrees, not {args.turn:g}.")
    check_outputs([output], [args.env, *head_files(args.head)])
    transport = load_named(args.head)
    environment = read_environment(args.env)
    for warning in environment.warnings:
        print(warning, file=sys.stderr)
    light = reduce(environment, transport.environment_shape, wrap(args.turn))
    linear = picture_at(transport, light)
    if output.suffix.lower() == ".exr":
        write_exr(output, linear)
    else:
        gain = colour.face_exposure(_face_luminance(transport, linear))
        display = colour.to_bytes(colour.tone_map(linear, gain))
        write_png(output, display)
    _say(args, output, transport.size, time.perf_counter() - started)
    return 0


def picture_at(transport: Transport, radiance: FloatImage) -> FloatImage:
    """Render the head under an environment that has been turned and reduced already.

    Parameters
    ----------
    radiance : NDArray[np.float32], (H, W, 3)
        Linear Rec. 709 radiance in the transport's size.

    Returns
    -------
    NDArray[np.float32], (N, N, 3)
        Linear Rec. 709 picture on black, in the scale of `radiance`.
    """
    return to_image(transport, render(transport, radiance))


def _face_luminance(transport: Transport, picture: FloatImage) -> FloatImage:
    values: FloatImage = colour.luminance(picture.reshape(-1, 3)[transport.pixels])[transport.face]
    return values


def _say(args: argparse.Namespace, output: Path, size: int, seconds: float) -> None:
    if args.json:
        facts = {
            "file": str(output),
            "turn_deg": args.turn,
            "head": args.head,
            "size": [size, size],
            "seconds": round(seconds, 3),
        }
        print(json.dumps(facts, ensure_ascii=False))
    else:
        print(f"Wrote {output} ({size} x {size}, turn {args.turn:g}°, {seconds:.2f} s).")
