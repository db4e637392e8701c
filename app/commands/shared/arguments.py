"""Arguments shared by several commands, and the checks on them.

A command may not overwrite its own inputs.
"""

from __future__ import annotations

import argparse
import math
import os
import stat
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias, cast, get_args

from app.commands.shared.printing import say
from app.core.base.atomic_files import check_target
from app.core.base.errors import CoreError, StyleError
from app.core.environment.environment import Environment
from app.core.portrait.head_views import MOST_YAW_DEG
from app.core.solver.head_shape import load_shape_of, shape_path
from app.core.solver.lens.lens_wish import LensWish, YawAsked, YawWord
from app.core.solver.turn_choice import OBJECTIVES
from app.core.styles.lamps import AS_PUBLISHED, Studio, parse_ratio, parse_softness
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_build import StudioPacks
from app.core.styles.style_pack_file import load_named_pack, load_transport_of, pack_path
from app.core.text import tr
from app.devices.screen_check import DesktopError, check_display
from app.words.styles import full_title

if TYPE_CHECKING:
    from app.core.measure.finish.masks import MaskSpec

MOST_DEG: Final = 36000.0
"""Largest accepted angle, in degrees. Larger values lose precision as floats."""

_Key: TypeAlias = tuple[int, int, str]


def argument(parser: argparse._ActionsContainer, names: str, words: str, **how: Any) -> None:
    """Add an argument. If it has choices, the first is the default unless another default is given.

    Args:
        names: Names of the argument followed by a placeholder for its value, such as
            "-o --output FILE" or "name NAME".
    """
    if "choices" in how:
        how.setdefault("default", how["choices"][0])
    flags = names.split()
    if len(flags) > 1 and not flags[-1].startswith("-"):
        how["metavar"] = flags.pop()
    parser.add_argument(*flags, help=words, **how)


def add_questions(
    parser: argparse.ArgumentParser, run: Callable[[argparse.Namespace], int]
) -> None:
    """Add the panorama argument and the options for solving: styles, head, objective and front."""
    add = partial(argument, parser)
    add("environment ENV", tr("panorama, OpenEXR or Radiance .hdr"))
    add_layer(parser)
    add("--style NAME", tr("styles to solve (default: all)"), nargs="+", action="extend")
    add(
        "--head NAME",
        tr("head: a name, or a transport file from “turnlight bake” (default: %(default)s)"),
        default="generic",
    )
    add(
        "--objective",
        tr(
            "how to choose the turn: best matching picture, or the paper’s quality C "
            "(default: %(default)s)"
        ),
        choices=OBJECTIVES,
    )
    add(
        "--grey",
        tr("ignore colour, as the paper’s search does"),
        action="store_true",
    )
    add(
        "--front DEG",
        tr("azimuth of the photographer in the panorama (default: 0)"),
        type=degrees,
        default=0.0,
    )
    add(
        "--softness SIZE",
        tr(
            "size of your studio lamps: degrees, hard, medium, large, a modifier and its "
            "distance such as octabox@1.5, or paper for each style’s own lamps (default)"
        ),
        type=_read(parse_softness),
    )
    add(
        "--ratio N:1",
        tr("lighting ratio of your studio, key plus fill to fill, or none (default)"),
        type=_read(parse_ratio),
    )
    add_json(parser, run)


def add_layer(parser: argparse.ArgumentParser) -> None:
    """Add ``--layer``."""
    words = tr(
        "layer of an OpenEXR panorama to read (default: the unnamed one, or else the beauty layer)"
    )
    argument(parser, "--layer NAME", words, default="")


def environment_facts(environment: Environment) -> dict[str, Any]:
    """Return an environment's JSON entries: its layer, gaps and clipping."""
    facts: dict[str, Any] = {"blind": round(environment.blind, 4)}
    if environment.layers:
        facts |= {"layer": environment.layer, "layers": list(environment.layers)}
    if environment.clipped is not None:
        facts["clipped_energy_fraction"] = round(environment.clipped_light, 4)
    return facts | ({"rough": True} if environment.rough else {})


def add_lens(parser: argparse.ArgumentParser) -> None:
    """Add ``--yaw`` and ``--background``."""
    add = partial(argument, parser)
    add(
        "--yaw DEG",
        tr(
            "how far the face turns towards the sitter’s own left, up to {most:.0f} "
            "degrees either way; or auto, short or broad for the best yaw (default: 0)",
            most=MOST_YAW_DEG,
        ),
        type=_yaw,
    )
    add(
        "--background FROM:TO",
        tr("range of azimuths, clockwise, for the middle of the background"),
        type=_arc,
    )


def asked_lens(args: argparse.Namespace) -> LensWish:
    """Return the requested lens position, or the one straight in front if none was requested."""
    yaw: YawAsked | None = args.yaw
    if yaw is None:
        yaw = 0.0 if args.background is None else "auto"
    return LensWish(yaw, args.background)


def _yaw(text: str) -> YawAsked:
    return cast("YawWord", text) if text in get_args(YawWord) else yaw_degrees(text)


def yaw_degrees(text: str) -> float:
    """Parse a yaw for argparse."""
    value = finite(text)
    if abs(value) > MOST_YAW_DEG:
        raise argparse.ArgumentTypeError(
            tr("{text} is not between -{most:.0f} and {most:.0f}", text=text, most=MOST_YAW_DEG)
        )
    return value + 0.0  # avoids -0


def _arc(text: str) -> tuple[float, float]:
    start, colon, end = text.partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(tr("{text} does not have the form FROM:TO", text=text))
    return degrees(start), degrees(end)


def _read(parse: Callable[[str], float | None]) -> Callable[[str], float | None]:
    """Wrap a parser so that argparse shows the parser's own error message."""

    def read(text: str) -> float | None:
        try:
            return parse(text)
        except StyleError as error:
            raise argparse.ArgumentTypeError(f"{error.message} {error.hint}") from error

    return read


def asked_pack(args: argparse.Namespace) -> StylePack:
    """Load the styles for ``--head`` with the chosen lamps.

    Raises:
        TransportError: If the head cannot be read.
        StyleError: If no studio has such lamps.
    """
    pack, studio = load_named_pack(args.head), Studio(args.softness, args.ratio)
    if studio == AS_PUBLISHED:
        return pack
    transport = load_transport_of(pack, args.head)
    studio_pack = StudioPacks(pack, transport, load_shape_of(transport, args.head)).pack_for(studio)
    own = [
        full_title(style)
        for style, each in zip(studio_pack.styles, studio_pack.studios, strict=True)
        if each == AS_PUBLISHED
    ]
    if own:
        say(
            tr(
                "These styles keep their own lamps, because your studio lamps would not show "
                "them: {styles}.",
                styles="; ".join(own),
            )
        )
    return studio_pack


def studio_facts(args: argparse.Namespace) -> dict[str, object]:
    """Return the JSON entries for the chosen lamps."""
    return {"softness_deg": args.softness, "ratio": args.ratio}


def add_json(parser: argparse.ArgumentParser, run: Callable[[argparse.Namespace], int]) -> None:
    """Add ``--json``, and set the function that runs the command."""
    argument(parser, "--json", tr("print a JSON object"), action="store_true")
    parser.set_defaults(run=run)


def finite(text: str) -> float:
    """Parse a finite number for argparse.

    Raises:
        argparse.ArgumentTypeError: If the text is not a finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(tr("{text} is not a finite number", text=text))
    return value


def degrees(text: str) -> float:
    """Parse an angle for argparse."""
    value = finite(text)
    if abs(value) > MOST_DEG:
        raise argparse.ArgumentTypeError(tr("{text} is not an angle in degrees", text=text))
    return value


def check_ending(path: Path, endings: Sequence[str], noun: str) -> None:
    """Check that a path has one of the suffixes allowed for its kind of file."""
    if path.suffix.lower() not in endings:
        raise CoreError(
            tr(
                "Cannot write {name}: {noun} are {endings}.",
                name=path.name,
                noun=noun,
                endings=tr("{first} or {second}", first=endings[0], second=endings[-1])
                if len(endings) == 2
                else endings[0],
            ),
            tr("Change the file extension."),
        )


def check_outputs(
    outputs: Iterable[Path | None],
    inputs: Iterable[Path | str | None],
    members: Sequence[str] = (),
) -> None:
    """Check that outputs are writable, distinct and not among the inputs.

    Args:
        outputs: Files to write. None entries are skipped.

    Raises:
        CoreError: If an output is unusable. Nothing has been read or written at that point.
    """
    read = {key: path for path in _list_inputs(inputs, members) for key in _keys(path)}
    output_keys: set[_Key] = set()
    for target in outputs:
        if target is None:
            continue
        check_target(target)
        keys = _keys(target)
        source = next((read[key] for key in keys if key in read), None)
        if source is not None:
            words = tr("Cannot write {target}: it is one of the input files.", target=target)
            if source.name != target.name:
                words = tr(
                    "Cannot write {target}: it is one of the input files ({name}).",
                    target=target,
                    name=source.name,
                )
            raise CoreError(words, tr("Choose another name."))
        if output_keys & keys:
            raise CoreError(
                tr(
                    "Cannot write {target} twice: two outputs have the same name.",
                    target=target,
                ),
                tr("Choose another name for one of them."),
            )
        output_keys |= keys


def check_drawing() -> None:
    """Check that Qt can draw. Drawing needs system libraries but no display.

    Raises:
        DesktopError: If Qt would abort the process.
    """
    try:
        check_display({"QT_QPA_PLATFORM": "offscreen"})
    except DesktopError as error:
        raise DesktopError(error.message, " ".join(error.hint.split())) from error


def head_files(head: str) -> tuple[Path, ...]:
    """Return the files read for ``--head``, or an empty tuple for a built-in head."""
    if not head.endswith(".npz"):
        return ()
    path = Path(head)
    return path, pack_path(path), shape_path(path)


def mask_files(masks: Iterable[MaskSpec]) -> list[Path]:
    """Return the image files among the masks."""
    return [mask.path for mask in masks if mask.path is not None]


def _list_inputs(inputs: Iterable[Path | str | None], members: Sequence[str]) -> Iterator[Path]:
    for item in inputs:
        if item is None:
            continue
        path = Path(item)
        yield path
        try:
            entries = list(path.iterdir()) if path.is_dir() else []
        except (OSError, ValueError):
            continue  # The reader reports the cause.
        yield from (each for each in entries if each.suffix.lower() in members)


def _keys(path: Path) -> set[_Key]:
    """Return keys that all names of the same file have in common.

    One key is the file's inode, and the other combines its folder's inode with its name. Names are
    compared without regard to case or Unicode composition, since some file systems ignore both.
    Pipes and devices among the inputs need no keys, because they cannot be outputs.
    """
    keys: set[_Key] = set()
    try:
        about = path.stat()
        if stat.S_ISREG(about.st_mode):
            keys.add((about.st_dev, about.st_ino, ""))
    except (OSError, ValueError):
        pass
    try:
        real = Path(os.path.realpath(path))
        folder = real.parent.stat()
    except (OSError, ValueError):
        return keys
    name = unicodedata.normalize("NFC", real.name).casefold()
    return keys | {(folder.st_dev, folder.st_ino, name)}
