"""``turnlight solve``: the best turn of a place for every style."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.commands.arguments import (
    add_questions,
    argument,
    asked_pack,
    check_drawing,
    check_ending,
    check_outputs,
    finite,
    head_files,
    studio_facts,
)
from app.commands.printing import (
    answer,
    fields,
    numbers,
    points,
    say,
    short,
)
from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.images import write_png
from app.core.portrait.head_file import HAIRS
from app.core.solver.environment import Environment, read_environment, reduce
from app.core.solver.place_light import Facing, picture_at, prepare
from app.core.solver.portraits import Lit
from app.core.solver.search import luminance_of
from app.core.solver.solve import StyleResult, solve_all
from app.core.solver.style_pack import StylePack, load_transport_of
from app.core.solver.styles import select
from app.core.solver.turn_choice import caution
from app.core.text import tr
from app.core.text.directions import SHORT_SIDES
from app.core.text.grades import grade_words
from app.core.text.turns import direction_words, size_words, whole
from app.ui.presenters.heads import Head


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``solve`` does and takes."""
    parser.description = tr(
        "Find how far to turn for each lighting style in an HDR panorama, and "
        "whether the place can give the style at all. Turns are degrees, "
        "positive clockwise seen from above; at turn 0 the sitter faces the "
        "panorama's centre column."
    )
    add_questions(parser, run)
    argument(parser, "--sheet PNG", tr("also write a sheet with pictures"))
    argument(
        parser,
        "--epsilon-c E",
        tr("also report the paper's own rule: unattainable when the largest quality is below E"),
        type=finite,
    )


def run(args: argparse.Namespace) -> int:
    """Answer for each style, and draw the sheet where one is asked for."""
    start = time.perf_counter()
    if args.sheet:
        check_ending(Path(args.sheet), (".png",), tr("sheets"))
        check_outputs([Path(args.sheet)], [args.environment, *head_files(args.head)])
        check_drawing()
    pack = asked_pack(args)
    names = [style.name for style in select(pack.styles, args.style)]
    environment = read_environment(args.environment)
    say(*environment.warnings)
    radiance = reduce(environment, pack.header.environment)
    light = luminance_of(radiance) if args.grey else radiance
    results = solve_all(pack, light, args.objective, styles=names, front_deg=args.front)
    if args.sheet:
        _write_sheet(Path(args.sheet), pack, results, environment, args)
    seconds = time.perf_counter() - start
    facts = _as_json(results, args, pack, seconds)
    return answer(args, facts, _table(results, args, environment.name, seconds))


def _as_json(
    results: Sequence[StyleResult], args: argparse.Namespace, pack: StylePack, seconds: float
) -> dict[str, Any]:
    values: dict[str, Any] = {
        "objective": args.objective,
        "head": args.head,
        "skin": pack.header.skin,
        "front_deg": args.front,
        **studio_facts(args),
        "styles": [
            {**_style_json(result, args.epsilon_c), **asdict(pack.studio(result.name))}
            for result in results
        ],
        "seconds": round(seconds, 4),
    }
    if args.epsilon_c is not None:
        values["epsilon_c"] = args.epsilon_c
    return values | ({"grey": True} if args.grey else {})


def _style_json(result: StyleResult, epsilon_c: float | None) -> dict[str, Any]:
    values: dict[str, Any] = {
        **fields(result, "name", "title", "side", "turn_deg"),
        "turn_refined_deg": round(result.turn_refined_deg, 6),
        "direction": result.direction,
        **{
            f"{curve}_curve": [short(value) for value in getattr(result, f"{curve}_curve").tolist()]
            for curve in ("quality", "match", "strength")
        },
        "quality": short(result.quality),
        "match": short(result.match),
        "strength": short(result.strength),
        **fields(
            result, "attainable", "reason", "grade", "shortfall", "looks_more_like", "neighbour"
        ),
        "same_picture": list(result.same_picture),
        "caution": _caution(result),
        "arc_deg": [round(end, 6) for end in result.arc_deg],
        "peaks": [
            {**numbers(peak), "arc_deg": [round(end, 6) for end in peak.arc_deg]}
            for peak in result.peaks
        ],
    }
    if epsilon_c is not None:
        largest = float(result.quality_curve.max())
        values["quality_max"] = short(largest)
        values["attainable_paper"] = largest >= epsilon_c
    return values


def _table(
    results: Sequence[StyleResult], args: argparse.Namespace, place: str, seconds: float
) -> str:
    head = [tr("style"), tr("side"), tr("turn"), tr("direction"), tr("match"), tr("contrast")]
    head += [tr("grade"), tr("reason")]
    if args.epsilon_c is not None:
        head.insert(6, f"C >= {args.epsilon_c:g}")
    rows = [_row(result, args.epsilon_c) for result in results]
    widths = [max(len(row[column]) for row in [head, *rows]) for column in range(len(head))]
    right = {2, 4, 5}
    lines = [
        tr(
            "{place}: {objective} objective, head {head}",
            place=place,
            objective=args.objective,
            head=args.head,
        ),
        "",
    ]
    for row in [head, *rows]:
        cells = [
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    unsure = [_full(result) for result in results if _caution(result)]
    if unsure:
        words = tr(
            "Less certain, since the turn depends on the sitter’s own head and skin: {styles}.",
            styles=", ".join(unsure),
        )
        lines += ["", words]
    lines += ["", tr("Match of 100; contrast as a share of the studio’s.")]
    count = sum(result.attainable for result in results)
    lines += [
        "",
        tr(
            "{count} of {all} attainable, {seconds:.2f} s",
            count=count,
            all=len(results),
            seconds=seconds,
        ),
    ]
    return "\n".join(lines)


def _row(result: StyleResult, epsilon_c: float | None) -> list[str]:
    cells = [
        result.title,
        SHORT_SIDES.get(result.side, ""),
        size_words(result.turn_refined_deg),
        direction_words(result.turn_refined_deg) if whole(result.turn_refined_deg) else "",
        points(result.match),
        f"{points(result.strength)} %",
        grade_words(result.grade, result.attainable),
        result.reason or result.shortfall or "",
    ]
    if epsilon_c is not None:
        reached = float(result.quality_curve.max()) >= epsilon_c
        cells.insert(6, tr("yes") if reached else tr("no"))
    return cells


def _full(result: StyleResult) -> str:
    if result.side == "none":
        return result.title
    left, right = (
        tr("{style} (left)", style=result.title),
        tr("{style} (right)", style=result.title),
    )
    return left if result.side == "left" else right


def _caution(result: StyleResult) -> str | None:
    """Say where the turn depends on the sitter's own head; only attainable turns are relied on."""
    return caution(result.name) if result.attainable else None


def _write_sheet(
    path: Path,
    pack: StylePack,
    results: Sequence[StyleResult],
    environment: Environment,
    args: argparse.Namespace,
) -> None:
    # Only a sheet needs Qt.
    from app.export.result_sheet import draw_sheet

    head = Head(args.head, args.head, pack, load_transport_of(pack, args.head), HAIRS[0])
    light, styles = prepare(environment), {style.name: style for style in pack.styles}
    turns = {result.name: wrap(result.turn_refined_deg + args.front) for result in results}

    def drawn(name: str, size: tuple[int, int]) -> list[Bytes]:
        here = picture_at(head.transport, light, turns[name])
        lit: list[Lit] = [styles[name], Facing(light, turns[name])]
        return head.portraits([pack.target(name), here], size, lit)

    sheet = draw_sheet(
        results,
        drawn,
        environment,
        environment.name,
        args.head,
        objective=args.objective,
        front_deg=args.front,
        places={style.name: style.place for style in pack.styles},
    )
    write_png(path, sheet)
