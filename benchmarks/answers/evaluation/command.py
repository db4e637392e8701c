"""``turnlight evaluate``: the paper's evaluation on any folder of environments, as a report."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.commands.shared.arguments import check_ending, check_outputs
from app.commands.shared.printing import ProgressPrinter
from app.core.base.atomic_files import atomic_write_text
from app.core.base.errors import CoreError, HeadError
from app.core.base.paths import resources
from app.core.base.progress import Token, span
from app.core.solver.lens.view_tables import views_of
from app.core.solver.turn_choice import OBJECTIVES
from app.core.styles.style_pack_file import load_named_pack, load_transport_of, pack_names
from benchmarks.answers.evaluation.evaluate import GENERIC, evaluate
from benchmarks.answers.evaluation.offsets import load_offsets
from benchmarks.answers.evaluation.report.numbers import (
    as_json,
    bars_of,
    certainty_of,
    save_certainty,
    verdict,
)
from benchmarks.answers.evaluation.scenes import default_scenes, find_scenes, read_scenes
from benchmarks.answers.evaluation.tables import load_tables, save_tables, tables_path

if TYPE_CHECKING:
    import argparse

    from app.core.base.progress import PhraseReport
    from app.core.styles.style_pack import StylePack
    from benchmarks.answers.evaluation.bake_tables import HeadFiles
    from benchmarks.answers.evaluation.evaluate import Evaluation
    from benchmarks.answers.evaluation.scenes import Scene
    from benchmarks.answers.evaluation.tables import Tables

_OFFSETS: Final = "offsets.npz"
_CERTAINTY: Final = "certainty.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the help and arguments of ``evaluate``."""
    parser.description = (
        "Repeat the paper's evaluation: sizes of environment and picture, width of "
        "the best peak, what is attainable, other heads and skins, the probe beside its spot. "
        "Writes one HTML page that needs nothing beside it."
    )
    parser.add_argument(
        "--scenes", metavar="DIR", type=Path, help="folder of panoramas (default: those at hand)"
    )
    parser.add_argument("-o", "--output", metavar="REPORT.html", type=Path, help="page to write")
    parser.add_argument("--json", metavar="FILE", type=Path, help="also write all numbers as JSON")
    parser.add_argument(
        "--objective",
        choices=OBJECTIVES,
        default="picture",
        help="what chooses the turns of the sheets (default: %(default)s); sizes are always by "
        "the paper's quality",
    )
    parser.add_argument(
        "--bake", action="store_true", help="make the stored tables again first (minutes)"
    )
    parser.add_argument(
        "--head",
        metavar="FILE",
        type=Path,
        action="append",
        default=[],
        help="with --bake: another head to hold against the generic one, a closed PLY or OBJ "
        "mesh with its eyes, if any, in NAME-eyes.ply; may be given several times",
    )
    parser.add_argument(
        "--unit", metavar="MM", type=float, default=100.0, help="millimetres per unit of --head"
    )
    parser.add_argument(
        "--tables", metavar="DIR", type=Path, help="folder of the tables (default: the shipped)"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        CoreError: For anything that the user can correct.
    """
    started = time.monotonic()
    if args.head and not args.bake:
        raise HeadError("--head goes with --bake.")
    folder = default_scenes() if args.scenes is None else args.scenes
    files = find_scenes(folder)
    _check_targets(args, files)
    teller, token = ProgressPrinter(), Token()
    tables = _tables(args, teller, token)
    scenes, said = read_scenes(files, span(teller, 0.0, 0.4), token)
    for line in said:
        print(line, file=sys.stderr)
    packs = {name: load_named_pack(name) for name in _heads()}
    offsets = tables_path(args.tables).with_name(_OFFSETS)
    found = evaluate(
        scenes,
        packs,
        tables,
        load_offsets(offsets) if offsets.is_file() else None,
        objective=args.objective,
        views=views_of(packs[GENERIC], GENERIC),
        report=span(teller, 0.4, 0.6),
        token=token,
    )
    if args.output is not None:
        page = _page(found, tables, scenes, packs[GENERIC], span(teller, 0.6, 1.0), token)
        atomic_write_text(args.output, page)
    if args.json is not None:
        atomic_write_text(args.json, json.dumps(as_json(found), indent=1) + "\n")
    if args.bake:
        _keep_certainty(args, found)
    print(_words(found, time.monotonic() - started))
    return 0


def _check_targets(args: argparse.Namespace, scenes: tuple[Path, ...]) -> None:
    tables = tables_path(args.tables)
    offsets = tables.with_name(_OFFSETS)
    eyes = [_eyes_of(file) for file in args.head]
    made = []
    if args.bake:
        tables.parent.mkdir(parents=True, exist_ok=True)
        made = [tables, _certainty_path(args.tables)]
    # Tables that are made again are read first, to keep the data of other heads.
    kept = [offsets] if args.bake else [offsets, tables]
    check_outputs([args.output, args.json, *made], [*scenes, *kept, *args.head, *eyes])
    if args.output is not None:
        check_ending(args.output, (".html", ".htm"), "reports")
    if args.json is not None:
        check_ending(args.json, (".json",), "numbers")


def _heads() -> list[str]:
    """Return the heads and skins that ship, the generic one first."""
    names = pack_names()
    if GENERIC not in names:
        raise CoreError("The generic head is missing.", "Reinstall Turnlight.")
    return [GENERIC, *(name for name in names if name != GENERIC)]


def _tables(args: argparse.Namespace, report: PhraseReport, token: Token) -> Tables:
    path = tables_path(args.tables)
    if not args.bake:
        return load_tables(path)
    from app.core.baking.kernel_lanes import select_variant
    from app.core.styles.styles import load_styles
    from benchmarks.answers.evaluation.bake_tables import HeadFiles, bake_tables

    select_variant("llvm")
    heads = resources() / "heads"
    generic = HeadFiles(GENERIC, heads / f"{GENERIC}.ply", heads / f"{GENERIC}-eyes.ply")
    others = [_files_of(file, args.unit) for file in args.head]
    made = bake_tables(generic, others, load_styles(), report=report, token=token)
    made = _with_known(made, path)
    save_tables(path, made)
    return made


def _files_of(file: Path, unit: float) -> HeadFiles:
    from benchmarks.answers.evaluation.bake_tables import HeadFiles

    if not file.is_file():
        raise HeadError(f"There is no head file {file}.", "Check the name and the folder.")
    eyes = _eyes_of(file)
    return HeadFiles(file.stem, file, eyes if eyes.is_file() else None, unit)


def _eyes_of(file: Path) -> Path:
    return file.with_name(f"{file.stem}-eyes.ply")


def _with_known(made: Tables, path: Path) -> Tables:
    """Keep the tables of heads that were not made again, if their styles are the same."""
    try:
        known = load_tables(path)
    except CoreError:
        return made
    if known.styles_sha256 != made.styles_sha256:
        return made
    return replace(
        made,
        heads=known.heads | made.heads,
        head_notes=known.head_notes | made.head_notes,
    )


def _page(
    found: Evaluation,
    tables: Tables,
    scenes: tuple[Scene, ...],
    pack: StylePack,
    report: PhraseReport,
    token: Token,
) -> str:
    # Only a report needs the drawing code.
    from benchmarks.answers.evaluation.report.page import page
    from benchmarks.answers.evaluation.report.pictures import draw_sheets

    transport = load_transport_of(pack, GENERIC)
    sheets = draw_sheets(scenes, found.results, pack, transport, report=report, token=token)
    return page(found, tables, sheets)


def _keep_certainty(args: argparse.Namespace, found: Evaluation) -> None:
    save_certainty(_certainty_path(args.tables), certainty_of(found))


def _certainty_path(folder: Path | None) -> Path:
    """Return the path of the file for the app: beside the tables, or among its own files."""
    return (folder or resources() / "evaluation") / _CERTAINTY


def _words(found: Evaluation, seconds: float) -> str:
    bars = bars_of(found)
    width = max(len(bar.name) for bar in bars)
    lines = [f"{len(found.scenes)} scenes, {found.pairs} pairs", ""]
    for bar in bars:
        unit = " %" if bar.unit == "%" else bar.unit
        mark = "met" if bar.met else "NOT met"
        lines.append(
            f"{bar.name:<{width}}  {bar.found:6.2f}{unit:<2}  {bar.most:5.2f}{unit:<2}  {mark}"
        )
    certainty = certainty_of(found)
    beyond = [style.name for style in found.styles if certainty.less_certain(style.name)]
    lines += ["", verdict(bars), f"Less certain on other heads: {', '.join(beyond) or 'none'}."]
    return "\n".join([*lines, f"{seconds:.1f} s"])
