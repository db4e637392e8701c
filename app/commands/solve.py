"""``turnlight solve``: find the best turn at a place for each style."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.commands.shared.arguments import (
    add_lens,
    add_questions,
    argument,
    asked_lens,
    asked_pack,
    check_drawing,
    check_ending,
    check_outputs,
    environment_facts,
    head_files,
    studio_facts,
)
from app.commands.shared.printing import (
    answer,
    fields,
    numbers,
    points,
    reach_facts,
    say,
    short,
)
from app.commands.shared.reasons import (
    diagnose_place,
    diagnosis_facts,
    diagnosis_lines,
    full_name,
)
from app.core.base.angles import whole, wrap
from app.core.base.arrays import Bytes, Floats
from app.core.base.errors import StyleError
from app.core.base.imaging.images import write_png
from app.core.base.paths import user_data
from app.core.cautions.caution import Caution, Hazard, hazards_of
from app.core.cautions.find_cautions import find_cautions
from app.core.environment.environment import Environment, read_environment, reduce
from app.core.environment.environment_file import is_linear
from app.core.measure.fisheye.circles import check_stitched
from app.core.measure.read.metadata import FRAME_ENDINGS
from app.core.painting.user_style import UserStyle
from app.core.painting.user_styles import list_user_styles
from app.core.places.place_verdict import PlaceVerdict, place_verdict
from app.core.places.solve_place import solve_styles
from app.core.portrait.gallery_portraits import LightSource
from app.core.portrait.head import Head
from app.core.portrait.head_views import has_views
from app.core.portrait.portrait_file import HAIRS
from app.core.solver.lens.lens_wish import STRAIGHT
from app.core.solver.lens.view_tables import ViewTables, views_of
from app.core.solver.place_light import Facing, picture_at, prepare
from app.core.solver.search import luminance_of
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_transport_of
from app.core.styles.styles import select
from app.core.text import tr
from app.words.measure.doubts import caution_lines
from app.words.phrases.directions import LIGHTINGS, SHORT_SIDES, aside_words
from app.words.phrases.place_verdict import light_sentence, place_verdict_words
from app.words.phrases.turns import direction_words, size_words
from app.words.remarks import sentences
from app.words.styles import caution_words
from app.words.why_out_of_reach import grade_words, reason_sentence


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``solve``."""
    parser.description = tr(
        "Find how far to turn for each lighting style in an HDR panorama, and whether "
        "the place can provide that style. Turns are in degrees, positive clockwise as "
        "seen from above; at turn 0 the sitter faces the centre column of the panorama."
    )
    add_questions(parser, run)
    add_lens(parser)
    argument(parser, "--sheet PNG", tr("also write a sheet with pictures"))


def run(args: argparse.Namespace) -> int:
    """Solve each style, and draw the result sheet if requested."""
    start = time.perf_counter()
    if args.sheet:
        check_ending(Path(args.sheet), (".png",), tr("sheets"))
        check_outputs([Path(args.sheet)], [args.environment, *head_files(args.head)])
        check_drawing()
    pack = asked_pack(args)
    style_names, own = set(args.style or ()), _own_styles(args.style, pack)
    others = style_names - {one.name for one in own}
    built_in = () if own and not others else select(pack.styles, others)
    if args.sheet and own:
        raise StyleError(
            tr("The sheet shows built-in styles only."),
            tr("Save the set sheet of your own style in the window."),
        )
    # Loading the views and looking for cautions take longer than all else together.
    with ThreadPoolExecutor(2) as pool:
        loading = pool.submit(_views_of, pack, args)
        environment = _light_of(args.environment, args.layer)
        looking = pool.submit(find_cautions, environment, pack, args.objective)
        views, cautions = loading.result(), looking.result()
    say(*sentences(environment.warnings))
    radiance = reduce(environment, pack.header.environment)
    light = luminance_of(radiance) if args.grey else radiance
    names = [style.name for style in built_in]
    # Packs contain everything needed for solving except for painted strokes and pictures.
    head = _head_of(pack, args) if own or args.sheet else None
    results = _solve(pack, views, light, names, own, head, args)
    verdict = place_verdict(results, light, args.front)
    sentence = "" if verdict is None else place_verdict_words(verdict, results)
    if args.sheet and head is not None:
        _write_sheet(Path(args.sheet), head, results, environment, args, sentence)
    seconds = time.perf_counter() - start
    facts = _as_json(results, args, pack, seconds)
    diagnoses = diagnose_place(pack, views, environment, light, results, args)
    facts["cautions"] = [asdict(each) for each in cautions]
    facts["verdict"] = None if verdict is None else _verdict_json(verdict, sentence)
    facts["styles"] = [
        each | diagnosis_facts(diagnoses.get(each["name"])) for each in facts["styles"]
    ]
    lines = diagnosis_lines(results, diagnoses)
    table = _table(results, args, environment.name, seconds, cautions, lines)
    if sentence:
        table = "\n".join((sentence, "", table))
    if cautions:
        advice = caution_lines(cautions, names)
        facts["advice"] = list(advice)
        table = "\n".join((table, "", *advice))
    return answer(
        args, facts | environment_facts(environment) | _with_doubt(facts, cautions, pack), table
    )


def _with_doubt(
    facts: dict[str, Any], cautions: Sequence[Caution], pack: StylePack
) -> dict[str, Any]:
    """Add to each style any doubts about its answer. Painted styles are not assessed."""
    built_in = {style.name for style in pack.styles}
    styles = []
    for style in facts["styles"]:
        assessed = style["name"] in built_in
        hazards = hazards_of(cautions, style["name"]) if assessed else ()
        # The estimated light of a photo was clipped.
        words = [Hazard.CLIPPED if each is Hazard.ROUGH else each for each in hazards]
        styles.append(
            {**style, "doubtful": bool(hazards) if assessed else None, "depends_on": words}
        )
    return {"styles": styles}


def _verdict_json(verdict: PlaceVerdict, sentence: str) -> dict[str, Any]:
    facts: dict[str, Any] = {"sentence": sentence}
    if flow := verdict.flow:
        facts |= {
            "light": light_sentence(flow),
            "flow": {
                "azimuth_deg": round(flow.azimuth_deg, 1),
                "elevation_deg": round(flow.elevation_deg, 1),
                "strength": round(flow.strength, 2),
                "hardness": flow.hardness.name.lower(),
            },
        }
    return facts | {
        "yes": list(verdict.yes),
        "soft": list(verdict.soft),
        "deep_shadows": verdict.deep_shadows,
    }


def _light_of(name: str, layer: str) -> Environment:
    """Read a panorama, or build a rough environment from a single photo."""
    file = Path(name)
    if file.suffix.lower() not in FRAME_ENDINGS or file.is_dir() or is_linear(file):
        environment = read_environment(file, layer)
        check_stitched(environment.radiance, file.name)
        return environment
    # A panorama needs no way of measuring, and loading them all takes longer than an answer.
    from app.core.measure.ways import measure

    probe = measure("single", [file])
    say(*sentences((*probe.warnings, *probe.notes)))
    return probe.environment(file.stem)


def _head_of(pack: StylePack, args: argparse.Namespace) -> Head:
    return Head(args.head, pack, load_transport_of(pack, args.head), HAIRS[0])


def _views_of(pack: StylePack, args: argparse.Namespace) -> list[ViewTables]:
    # Heads baked by earlier versions have no views, but solving straight in front needs none.
    needs_views = asked_lens(args) != STRAIGHT or has_views(args.head)
    return views_of(pack, args.head) if needs_views else []


def _solve(
    pack: StylePack,
    views: Sequence[ViewTables],
    light: Floats,
    names: Sequence[str],
    own: Sequence[UserStyle],
    head: Head | None,
    args: argparse.Namespace,
) -> tuple[StyleResult, ...]:
    """Solve with the requested lens position.

    If the lens is straight in front of the sitter, the results also show what other lens positions
    would gain.
    """
    return solve_styles(
        pack,
        views,
        light,
        asked_lens(args),
        args.objective,
        names=names,
        own=own,
        head=head,
        front_deg=args.front,
    )


def _as_json(
    results: Sequence[StyleResult], args: argparse.Namespace, pack: StylePack, seconds: float
) -> dict[str, Any]:
    values: dict[str, Any] = {
        "objective": args.objective,
        "head": args.head,
        "skin": pack.header.skin,
        "front_deg": args.front,
        "yaw": args.yaw,
        "background": args.background,
        **studio_facts(args),
        "styles": [
            {**_style_json(result), **_studio_json(pack, result.name)} for result in results
        ],
        "seconds": round(seconds, 4),
    }
    return values | ({"grey": True} if args.grey else {})


def _own_styles(style_names: Sequence[str] | None, pack: StylePack) -> list[UserStyle]:
    """Return the user's own styles that were requested by name."""
    own_names = {*(style_names or ())} - {style.name for style in pack.styles}
    user_styles = list_user_styles(user_data() / "styles")[0] if own_names else ()
    return [one for one in user_styles if one.name in own_names]


def _studio_json(pack: StylePack, name: str) -> dict[str, Any]:
    """Return the JSON entries for a style's lamps, or an empty dictionary for a painted style."""
    return asdict(pack.studio(name)) if any(one.name == name for one in pack.styles) else {}


def _style_json(result: StyleResult) -> dict[str, Any]:
    return {
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
        **reach_facts(result),
        "neighbour": result.neighbour,
        "same_picture": list(result.same_picture),
        "caution": _caution(result),
        "arc_deg": [round(end, 6) for end in result.arc_deg],
        "nose_deg": round(result.nose_deg, 6),
        "background_deg": round(result.background_deg, 6),
        **fields(result, "yaw_deg", "yaw_arc_deg", "lighting"),
        "gains": [{**asdict(gain), "match": short(gain.match)} for gain in result.gains],
        "peaks": [
            {**numbers(peak), "arc_deg": [round(end, 6) for end in peak.arc_deg]}
            for peak in result.peaks
        ],
    }


def _table(
    results: Sequence[StyleResult],
    args: argparse.Namespace,
    place: str,
    seconds: float,
    cautions: Sequence[Caution],
    more: Sequence[str],
) -> str:
    head = [tr("style"), tr("side"), tr("turn"), tr("direction"), tr("match"), tr("contrast")]
    head += [tr("grade"), tr("reason")]
    rows = [_row(result) for result in results]
    for result, row in zip(results, rows, strict=True):
        if hazards_of(cautions, result.name):
            row[-2] = tr("{grade}, doubtful", grade=row[-2])
    if any(result.yaw_deg for result in results):
        head[4:4] = [tr("nose"), tr("light")]
        for row, result in zip(rows, results, strict=True):
            row[4:4] = [aside_words(result.yaw_deg), LIGHTINGS[result.lighting]]
    widths = [max(len(row[column]) for row in [head, *rows]) for column in range(len(head))]
    right = {head.index(name) for name in (tr("turn"), tr("match"), tr("contrast"))}
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
    unsure = [full_name(result) for result in results if _caution(result)]
    if unsure:
        words = tr(
            "Less certain, because the turn varies with the sitter’s head and skin: {styles}.",
            styles=", ".join(unsure),
        )
        lines += ["", words]
    lines += [*_gain_lines(results), *more]
    lines += ["", tr("Match is out of 100; contrast is a percentage of the studio’s.")]
    count = sum(result.attainable for result in results)
    lines += [
        "",
        tr(
            "{count} of {all} within reach, {seconds:.2f} s",
            count=count,
            all=len(results),
            seconds=seconds,
        ),
    ]
    return "\n".join(lines)


def _gain_lines(results: Sequence[StyleResult]) -> list[str]:
    """Describe the gain from turning the face away from the lens."""
    lines = [
        tr(
            "{style}: {light} {match} instead of {now}, {aside}",
            style=full_name(result),
            light=LIGHTINGS[gain.lighting],
            match=points(gain.match),
            now=points(result.match),
            aside=aside_words(gain.yaw_deg),
        )
        for result in results
        for gain in result.gains
    ]
    if lines:
        return [
            "",
            tr("Better with the face turned (--yaw short, --yaw broad):"),
            *lines,
        ]
    return []


def _row(result: StyleResult) -> list[str]:
    return [
        result.title,
        SHORT_SIDES.get(result.side, ""),
        size_words(result.turn_refined_deg),
        direction_words(result.turn_refined_deg) if whole(result.turn_refined_deg) else "",
        points(result.match),
        f"{points(result.strength)}%",
        grade_words(result.grade, result.attainable),
        reason_sentence(result.shortfall),
    ]


def _caution(result: StyleResult) -> str | None:
    """Return a warning if an attainable turn depends on the sitter's own head, or None if not."""
    return caution_words(result.name) if result.attainable else None


def _write_sheet(
    path: Path,
    head: Head,
    results: Sequence[StyleResult],
    environment: Environment,
    args: argparse.Namespace,
    verdict: str,
) -> None:
    # Import here, as only a sheet needs Qt.
    from app.export.result_sheet import draw_sheet

    pack, light = head.pack, prepare(environment)
    styles = {style.name: style for style in pack.styles}
    turns = {result.name: wrap(result.turn_refined_deg + args.front) for result in results}

    def pictures(name: str, size: tuple[int, int]) -> list[Bytes]:
        here = picture_at(head.transport, light, turns[name])
        lights: list[LightSource] = [styles[name], Facing(light, turns[name], styles[name].expose)]
        return head.portraits([pack.target(name), here], size, lights)

    sheet = draw_sheet(
        results,
        pictures,
        environment,
        environment.name,
        args.head,
        objective=args.objective,
        front_deg=args.front,
        places={style.name: style.place for style in pack.styles},
        verdict=verdict,
    )
    write_png(path, sheet)
