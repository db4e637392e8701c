"""``turnlight bake``: compute the light transport of a head."""

from __future__ import annotations

import argparse
import re
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.shared.arguments import add_json, argument, check_outputs, yaw_degrees
from app.commands.shared.printing import ProgressPrinter, answer
from app.core.baking.scene import HeadMesh
from app.core.base.errors import BakeError
from app.core.base.paths import resources
from app.core.base.progress import Token
from app.core.portrait.head_views import YAWS, save_views, views_path
from app.core.solver.head_shape import save_shape, shape_path
from app.core.styles.style_pack_file import pack_path, save_pack
from app.core.text import tr

if TYPE_CHECKING:
    from app.core.baking.quality import Quality

_LARGEST_PICTURE = 400
_LARGEST_ENVIRONMENT = 256


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``bake``."""
    parser.description = tr(
        "Compute how light from every direction falls on a head, and render the studio pictures "
        "of all styles on it, from the front and with the head turned. An interrupted bake "
        "resumes where it left off. Writes T.npz, T.styles.npz, T.shape.npz and T.views.npz."
    )
    add = partial(argument, parser)
    add("-o --output T.npz", tr("file to write"), type=Path)
    add(
        "--head FILE",
        tr("generic, female, male, or a closed PLY or OBJ mesh with +Y up and +Z out of the face"),
        default="generic",
    )
    add("--eyes FILE", tr("file that contains the eyes of the head"), type=Path)
    add("--unit MM", tr("millimetres per unit of the head file"), type=float, default=100.0)
    add("--skin NAME", tr("skin tone: light, medium or dark"), default="medium")
    add("--env WxH", tr("resolution of the environment in texels"), default="64x32")
    add("--image N", tr("width and height of the pictures in pixels"), type=int, default=100)
    add(
        "--quality", tr("default: good"), default="good", choices=("draft", "quick", "good", "best")
    )
    add("--variant V", tr("Mitsuba variant: auto, llvm, cuda or scalar"), default="auto")
    add(
        "--front-only",
        tr("skip the views of the turned head"),
        action="store_true",
    )
    add("--seed", tr("random seed"), type=int, default=1)
    add("--export-scene DIR", tr("export the scene for stock Mitsuba"), type=Path)
    add("--yaw DEG", tr("yaw of the head in the exported scene"), type=yaw_degrees, default=0.0)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Bake a head's light transport, export its scene, or both.

    Raises:
        CoreError: If an argument or a file is unusable, or Mitsuba cannot run on this computer.
    """
    if args.output is None and args.export_scene is None:
        raise BakeError(tr("Choose what to write: -o T.npz or --export-scene DIR."))
    environment = _environment(args.env)
    if not 8 <= args.image <= _LARGEST_PICTURE:
        raise BakeError(
            tr(
                "--image must be from 8 to {largest}, not {image}.",
                largest=_LARGEST_PICTURE,
                image=args.image,
            )
        )
    if not 0 <= args.seed < 2**31:
        raise BakeError(tr("--seed must be a whole number from 0 to 2,147,483,647."))
    _check_targets(args)

    from app.core.baking.kernel_lanes import select_variant
    from app.core.baking.quality import QUALITIES
    from app.core.baking.scene import export_scene, frame_head
    from app.core.baking.skin import find_skin

    skin = find_skin(args.skin)
    select_variant(args.variant)
    head = _head(args)
    facts: dict[str, object] = {}
    if args.export_scene is not None:
        camera = frame_head(head, args.image, args.yaw)
        scene = export_scene(args.export_scene, head, skin, camera)
        facts["scene"] = str(scene)
    if args.output is not None:
        facts |= _bake(args, head, environment, QUALITIES[args.quality])
    return answer(args, facts, "\n".join(f"{key}: {value}" for key, value in facts.items()))


def _check_targets(args: argparse.Namespace) -> None:
    targets: list[Path] = []
    if args.output is not None:
        if args.output.suffix != ".npz":
            raise BakeError(
                tr("A transport must be an .npz file, not {name}.", name=args.output.name)
            )
        beside = (pack_path, shape_path, views_path)
        targets = [args.output, *(path(args.output) for path in beside)]
    if args.export_scene is not None:
        from app.core.baking.scene import scene_files

        targets += scene_files(args.export_scene)
    check_outputs(targets, [args.head, args.eyes])


def _environment(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"([0-9]{1,4})[xX]([0-9]{1,4})", text)
    if match is None:
        raise BakeError(tr("--env must have the form 64x32, not {text}.", text=text))
    columns, rows = (int(number) for number in match.groups())
    if columns != 2 * rows or not 8 <= columns <= _LARGEST_ENVIRONMENT or columns % 4:
        raise BakeError(
            tr(
                "--env must be twice as wide as it is high, from 8x4 to {largest}x{largest}, "
                "not {text}.",
                largest=_LARGEST_ENVIRONMENT,
                text=text,
            )
        )
    return rows, columns


def _head(args: argparse.Namespace) -> HeadMesh:
    from app.core.baking.scene import load_head

    folder = resources() / "heads"
    shipped = folder / f"{args.head}.ply"
    if Path(args.head).name == args.head and shipped.is_file() and not args.head.endswith("-eyes"):
        return load_head(args.head, shipped, folder / f"{args.head}-eyes.ply")
    file = Path(args.head)
    return load_head(file.stem, file, args.eyes, unit_mm=args.unit)


def _bake(
    args: argparse.Namespace, head: HeadMesh, environment: tuple[int, int], quality: Quality
) -> dict[str, object]:
    from app.core.baking.bake import bake
    from app.core.baking.baked_view import packed_views
    from app.core.baking.skin import find_skin
    from app.core.solver.transport import load_transport, save_transport
    from app.core.styles.style_pack_build import build_pack
    from app.core.styles.styles import load_styles

    styles, yaws = load_styles(), () if args.front_only else YAWS
    if not head.symmetric:
        yaws = (*(-yaw for yaw in yaws), *yaws)
    start_s, report = time.monotonic(), ProgressPrinter()
    baked = bake(
        head,
        find_skin(args.skin),
        styles,
        environment=environment,
        picture=args.image,
        quality=quality,
        seed=args.seed,
        work=args.output.with_name(args.output.stem + ".bake"),
        report=report,
        token=Token(),
        yaws=yaws,
    )
    report(0.95, tr("Writing the head"))
    # Build the pack from the rounded transport in the file, since the pack records its checksum.
    save_transport(args.output, baked.transport)
    transport = load_transport(args.output)
    save_pack(pack_path(args.output), build_pack(transport, styles, baked.targets, baked.shape))
    save_shape(shape_path(args.output), baked.shape)
    if baked.views:
        save_views(views_path(args.output), transport, *packed_views(baked.views, transport))
    report(1.0, tr("Writing the head"))
    header = transport.header
    return {
        "transport": str(args.output),
        "styles": str(pack_path(args.output)),
        "shape": str(shape_path(args.output)),
        "views": str(views_path(args.output)) if baked.views else None,
        "seconds": round(time.monotonic() - start_s, 1),
        "noise": None if header.noise != header.noise else round(header.noise, 4),
        "truncation": round(header.truncation, 4),
        "sha256": transport.digest,
    }
