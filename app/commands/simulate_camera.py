"""``turnlight simulate-camera``: run a simulated 360 camera on this computer.

Panoramas are relative, since no file reliably records its unit in cd/m2. The scene is therefore
scaled to a mean of 400 cd/m2 over the sphere, which lies between a brightly lit room and an
overcast sky, or to the value of ``--mean``. Every camera can expose for this mean with latitude to
spare in both directions.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
import threading
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from app.commands.shared.arguments import add_json, argument
from app.commands.shared.printing import answer, say
from app.core.base.atomic_files import os_errors_as
from app.core.base.colour import luminance
from app.core.base.errors import CoreError
from app.core.base.paths import resources
from app.core.environment.environment import Environment, energy, read_environment
from app.core.text import tr
from app.devices.clock import Clock, SystemClock
from app.devices.simulated.camera import SimulatedCamera
from app.devices.simulated.cameras import PERSONALITIES
from app.devices.simulated.exposure_maker import ShotOptions
from app.devices.simulated.scene import Scene
from app.devices.simulated.server import CameraServer
from app.words.remarks import sentences

MEAN_CD_M2: Final = 400.0
"""Default mean luminance of a scene, taken over the sphere, in cd/m2."""

_MODELS: Final = tuple(each.name for each in PERSONALITIES)
_TICK_S: Final = 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``simulate-camera``."""
    parser.description = tr(
        "Run a simulated 360 camera on this computer until you stop it. It sees the "
        "scene, meters it and shoots brackets."
    )
    add_camera(parser)
    add_json(parser, run)


def add_camera(parser: argparse.ArgumentParser, models: Sequence[str] = _MODELS) -> None:
    """Add the options for the camera (one of `models`), for its scene and for its server."""
    add = partial(argument, parser)
    add("--scene ENV", tr("the scene: .exr or .hdr (default: a courtyard)"), type=Path)
    add(
        "--mean CD/M2",
        tr("mean luminance of the scene (default: {mean:g})", mean=MEAN_CD_M2),
        type=_positive,
        default=MEAN_CD_M2,
    )
    add("--model", tr("camera model to simulate (default: V)"), choices=models, default="V")
    add("--port", tr("port to listen on (default: any free port)"), type=_port, default=0)
    add("--rate MBIT", tr("network speed in Mbit/s"), type=_positive)
    add("--log", tr("print every request to stderr"), action="store_true")
    add(
        "--until-eof",
        tr("stop when standard input is closed, for example when the parent program ends"),
        action="store_true",
    )


def run(args: argparse.Namespace) -> int:
    """Serve the camera until interrupted (see `serve`).

    Raises:
        CoreError: If the scene cannot be read or the port is in use.
    """
    clock = SystemClock()
    camera = SimulatedCamera(read_scene(args), args.model, clock, rate_mbit=args.rate)
    return serve(camera, args, clock, {"model": args.model})


def read_scene(args: argparse.Namespace) -> Scene:
    """Read ``--scene`` and scale its brightness.

    Raises:
        CoreError: If the scene cannot be read.
    """
    environment = read_environment(args.scene or resources() / "demo" / "scenes" / "courtyard.exr")
    say(*sentences(environment.warnings))
    return Scene(environment.radiance, ShotOptions(scale=scene_scale(environment, args.mean)))


def serve(
    camera: SimulatedCamera,
    args: argparse.Namespace,
    clock: Clock,
    facts: Mapping[str, object],
    *notes: str,
    server_class: type[CameraServer] = CameraServer,
) -> int:
    """Print a camera's address and serve the camera until interrupted.

    With ``--until-eof``, the server also stops when standard input is closed.

    Args:
        facts: Entries printed with ``--json`` in addition to the address.
        notes: Sentences to print to stderr.
        server_class: Class of the server.

    Raises:
        KeyboardInterrupt: If interrupted, once every connection is closed.
        CoreError: If the port is in use.
    """
    with contextlib.closing(camera), _server(server_class, camera, args, clock) as server:
        answer(args, {"url": server.url, **facts}, server.url)
        sys.stdout.flush()
        say(*notes)
        closed = _input_closed() if args.until_eof else threading.Event()
        while not closed.is_set():
            clock.sleep(_TICK_S)
    return 0


def _input_closed() -> threading.Event:
    """Return an event that is set when standard input ends."""
    closed = threading.Event()

    def read() -> None:
        with contextlib.suppress(OSError, ValueError):
            while sys.stdin.readline():
                pass
        closed.set()

    threading.Thread(target=read, name="standard input", daemon=True).start()
    return closed


def scene_scale(environment: Environment, mean_cd_m2: float = MEAN_CD_M2) -> float:
    """Return the luminance, in cd/m2, of one unit of an environment that has the given mean."""
    mean = float(luminance(energy(environment.radiance))) / (4.0 * math.pi)
    return mean_cd_m2 / mean


def _server(
    server_class: type[CameraServer],
    camera: SimulatedCamera,
    args: argparse.Namespace,
    clock: Clock,
) -> CameraServer:
    sentence = tr("Cannot listen on port {port}: {reason}.")
    hint = tr("Choose another port, or leave out --port.")
    with os_errors_as(CoreError, sentence, hint, port=args.port):
        return server_class(camera, args.port, clock=clock, log=say if args.log else None)


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(tr("{text} is not a number above 0", text=text))
    return value


def _port(text: str) -> int:
    value = int(text)
    if not 0 <= value <= 65535:
        raise argparse.ArgumentTypeError(tr("{text} is not a port", text=text))
    return value
