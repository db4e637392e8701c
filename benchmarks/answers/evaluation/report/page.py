"""The page: one section for each question, with the paper's numbers beside ours."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.angles import TURNS
from app.core.solver.lens.lens_search import NAMED_GAIN
from app.core.styles.certainty import TOLERANCE_DEG
from benchmarks.answers.evaluation.report.html import degrees, figure, paragraph, percent, table
from benchmarks.answers.evaluation.report.numbers import PAPER, bars_of, certainty_of, verdict
from benchmarks.answers.evaluation.report.style import CSS
from benchmarks.answers.evaluation.report.svg import Series, bars, histogram, lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.styles.certainty import Certainty
    from benchmarks.answers.evaluation.evaluate import Evaluation, Moved, Row, Widths
    from benchmarks.answers.evaluation.heads import Spread
    from benchmarks.answers.evaluation.report.pictures import Sheets
    from benchmarks.answers.evaluation.tables import Tables

_STEPS: Final = np.arange(0.0, 45.1, 360.0 / TURNS) - 180.0 / TURNS
_EXAMPLE: Final = "butterfly"
_HEADS: Final = {
    "generic-light": "generic, light skin",
    "generic-dark": "generic, dark skin",
}


def page(found: Evaluation, tables: Tables, sheets: Sheets) -> str:
    """Write the report."""
    parts = [
        _summary(found),
        _sizes(found),
        _peaks(found),
        _attainable(found),
        _lens(found),
        _heads(found),
        _places(found),
        _sheet(found, sheets),
        _differences(found),
        _method(found, tables),
    ]
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Turnlight: evaluation</title><style>{CSS}</style></head>"
        f"<body>{''.join(parts)}</body></html>\n"
    )


def _summary(found: Evaluation) -> str:
    wanted = bars_of(found)
    rows = []
    for bar in wanted:
        kind, word = ("met", "met") if bar.met else ("missed", "not met")
        rows.append(
            f'<tr><td>{escape(bar.name)}</td><td class="n paper">{bar.paper}</td>'
            f'<td class="n">{bar.found:.2f}{_unit(bar.unit)}</td>'
            f'<td class="n">≤ {bar.most:g}{_unit(bar.unit)}</td>'
            f'<td class="n {kind}">{word}</td></tr>'
        )
    count = len(found.scenes)
    return (
        "<h1>How well it works</h1>"
        f'<p class="lead">{count} scenes × {len(found.styles)} styles = {found.pairs} pairs, '
        "after the evaluation of E, Fried and Agrawala, "
        "<i>Optimizing Portrait Lighting at Capture-Time Using a 360 Camera as a Light Probe</i> "
        "(UIST 2019), whose numbers stand beside ours.</p>"
        "<table><thead><tr><th>What</th><th class='n'>Paper</th><th class='n'>Here</th>"
        "<th class='n'>Bar</th><th class='n'></th></tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table>" + paragraph(verdict(wanted))
    )


def _unit(unit: str) -> str:
    return " %" if unit == "%" else unit


def _sizes(found: Evaluation) -> str:
    return (
        "<h2>How large environment and picture must be</h2>"
        + paragraph(
            "By the paper’s objective: for every pair the best of 64 turns at each size, and its "
            "angle to the best turn at the largest size. Where the largest size itself has two "
            "peaks within 1 % of each other, the smallest change makes the best turn jump between "
            "them; those pairs count by what the other turn gives up, not by its angle."
        )
        + _size_table("Environment", found.lighting, PAPER["lighting"])
        + _size_table("Picture", found.pictures, PAPER["pictures"])
        + figure(
            histogram(
                [Series(row.name, _clear(row)) for row in found.lighting[:-1]],
                _STEPS,
                ("angle to the best turn at 128 × 64, deg", "pairs"),
            ),
            "Environment sizes: how often the best turn moves by how much. One step of the search "
            "is 5.625°; 45° stands for all above.",
        )
        + figure(
            histogram(
                [Series(row.name, _clear(row)) for row in found.pictures[:-1]],
                _STEPS,
                ("angle to the best turn at 200 × 200, deg", "pairs"),
            ),
            "The same for picture sizes.",
        )
        + _example(found)
    )


def _clear(row: Row) -> list[float]:
    return [float(x) for x in row.change.degrees[~row.change.tied]]


def _size_table(name: str, rows: Sequence[Row], paper: Sequence[float]) -> str:
    head = [name, "Paper", "Here", "All pairs", "Refined turns", "Same turn", "Given up", "Worst"]
    steps = rows[0].own_steps is not None
    if steps:
        head.insert(4, "Own steps")
    lines_ = []
    for row, theirs in zip(rows, paper, strict=True):
        change = row.change
        clear = change.degrees[~change.tied]
        cells = [
            row.name,
            f"{theirs:g}°",
            degrees(change.mean),
            degrees(float(change.degrees.mean())),
            degrees(change.mean_refined),
            f"{int((clear == 0).sum())} of {clear.size}",
            percent(change.mean_regret),
            percent(float(change.regret.max())),
        ]
        if steps:
            cells.insert(4, degrees(row.own_steps or 0.0))
        lines_.append(cells)
    tied = int(rows[-1].change.tied.sum())
    words = f"{tied} pairs are counted by what is given up only."
    return table(head, lines_) + f'<p class="dim">{words}</p>'


def _example(found: Evaluation) -> str:
    """Draw the curves of one pair at all sizes, like figure 9 of the paper."""
    names = [style.name for style in found.styles]
    column = names.index(_EXAMPLE) if _EXAMPLE in names else 0
    turns = np.arange(TURNS) * 360.0 / TURNS - 180.0
    parts = []
    for rows in (found.lighting, found.pictures):
        series = []
        for row in rows:
            curve = np.roll(row.curves[column], TURNS // 2)
            series.append(Series(row.name, list(curve / np.abs(curve).max())))
        parts.append(lines(turns, series, ("turn, deg", "quality, of its largest"), 200))
    return figure(
        "".join(parts),
        f"Quality by turn for {found.scenes[0]} and {found.styles[column].title.lower()}: the "
        "curves of all sizes lie nearly on top of each other, as in the paper’s figure 9.",
    )


def _peaks(found: Evaluation) -> str:
    paper, own = found.widths["paper"], found.widths["picture"]
    rows = [["Paper, by quality, 192 pairs", "17.05°", "9.73°"]]
    for name, width in (("quality", paper), ("match (the app’s own)", own)):
        for which, attainable in (("all pairs", False), ("attainable pairs", True)):
            mean, deviation = width.mean(attainable=attainable)
            rows.append([f"Here, by {name}, {which}", degrees(mean), degrees(deviation)])
    edges = np.arange(0.0, 91.0, 5.0)
    drawing = histogram(
        [Series("by quality", list(paper.all_deg)), Series("by match", list(own.all_deg))],
        edges,
        ("width of the best peak within 3 %, deg", "pairs"),
    )
    return (
        "<h2>How exactly one has to turn</h2>"
        + paragraph(
            "The range of turns around the best one in which the objective stays within 3 % of "
            "its maximum. Who stands within it has the picture, for all practical purposes."
        )
        + table(["", "Mean", "Deviation"], rows)
        + figure(drawing, _width_words(paper))
    )


def _width_words(paper: Widths) -> str:
    return (
        f"All pairs; the median by quality is {np.median(paper.all_deg):.1f}°. "
        "The last bin holds all that are wider."
    )


def _attainable(found: Evaluation) -> str:
    head = "".join(f"<th><div>{escape(_short(s.name))}</div></th>" for s in found.styles)
    body = []
    for scene, row in zip(found.scenes, found.results, strict=True):
        cells = "".join(
            f'<td class="n {"in" if one.attainable else "out"}">'
            f"{max(one.match, 0):.0f}<br>{max(one.strength, 0):.0f}</td>"
            for one in row
        )
        reach = sum(one.attainable for one in row)
        body.append(f'<tr><td>{escape(scene)}</td>{cells}<td class="n">{reach}</td></tr>')
    by_style = np.array([[one.attainable for one in row] for row in found.results]).sum(axis=0)
    foot = "".join(f'<td class="n">{count}</td>' for count in by_style)
    total = int(by_style.sum())
    return (
        "<h2>What is attainable where</h2>"
        + paragraph(
            "Match above, strength below; bold where the style is in reach (match at least 45 "
            f"and strength at least 20): {total} of {found.pairs} pairs, by the "
            f"{found.objective} objective. Negative numbers are shown as 0. The paper gives no "
            "such table; it finds butterfly, loop and split usually attainable, rim wherever "
            "light is strong enough, badger and light from below seldom."
        )
        + '<div class="wide"><table><thead><tr class="turned"><th></th>'
        + f"{head}<th><div>in reach</div></th></tr></thead><tbody>{''.join(body)}"
        + f'<tr><td>scenes</td>{foot}<td class="n">{total}</td></tr></tbody></table></div>'
    )


def _lens(found: Evaluation) -> str:
    lens = found.lens
    if lens is None:
        return ""
    rows = []
    for name, k in [("all", None), *((_short(s.name), k) for k, s in enumerate(found.styles))]:
        reach, free, straight, best, named = lens.of(k)
        matches = [f"{match:.1f}" if np.isfinite(match) else "" for match in (straight, best)]
        rows.append([name, str(reach), str(free), *matches, str(named)])
    return (
        "<h2>What the lens gains beside the nose</h2>"
        + paragraph(
            "The nose stays with the light, and the lens may stand up to 45° to either side. The "
            "grade is the nose’s and hardly changes; the match is of the picture from there. Mean "
            f"match over the scenes in reach; a gain is named from {NAMED_GAIN:g} points on."
        )
        + table(["", "In reach", "At any yaw", "Match", "At the best yaw", "Gains named"], rows)
    )


def _short(name: str) -> str:
    return name.replace("-", " ")


def _heads(found: Evaluation) -> str:
    own, paper = found.spreads["picture"], found.spreads["paper"]
    certainty = certainty_of(found)
    names = [_short(style.name) for style in found.styles]
    drawing = bars(
        names,
        [
            Series(_HEADS.get(name, name), list(_by_style(own, k)))
            for k, name in enumerate(own.names)
        ],
        "angle to the generic head’s turn, deg (line: 8.5°)",
        TOLERANCE_DEG,
    )
    return (
        "<h2>What the generic head costs</h2>"
        + paragraph(
            "The app computes with one head and one skin. Here every pair is solved for other "
            "heads and skins as well: the angle between their best turn and the generic head’s, "
            "and what the generic head’s turn gives up on them. Only pairs that are attainable "
            "count, because only there a turn is recommended; all pairs stand beside them."
        )
        + "<h3>By match, the app’s own objective</h3>"
        + _spread_table(own)
        + "<h3>By quality, the paper’s objective</h3>"
        + _spread_table(paper)
        + figure(drawing, "By match: mean over the scenes where a style is attainable.")
        + paragraph(_uncertain(found, certainty))
    )


def _by_style(spread: Spread, head: int) -> np.ndarray:
    counted = spread.counted
    sums = np.where(counted, spread.degrees[head], 0.0).sum(axis=0)
    count = counted.sum(axis=0)
    return np.where(count > 0, sums / np.maximum(count, 1), np.nan)


def _spread_table(spread: Spread) -> str:
    rows = []
    counted = spread.counted
    for name, one, lost in zip(spread.names, spread.degrees, spread.regret, strict=True):
        kept = one[counted]
        rows.append(
            [
                _HEADS.get(name, name),
                degrees(float(kept.mean()) if kept.size else 0.0),
                degrees(float(np.median(kept)) if kept.size else 0.0),
                percent(float((kept > TOLERANCE_DEG).mean()) if kept.size else 0.0, 0),
                percent(float(lost[counted].mean()) if kept.size else 0.0),
                degrees(float(one.mean())),
            ]
        )
    kept = spread.degrees[:, counted]
    rows.append(
        [
            "all of them",
            degrees(spread.mean),
            degrees(float(np.median(kept)) if kept.size else 0.0),
            percent(float((kept > TOLERANCE_DEG).mean()) if kept.size else 0.0, 0),
            percent(float(spread.regret[:, counted].mean()) if kept.size else 0.0),
            degrees(spread.mean_of_all),
        ]
    )
    return table(["Head", "Mean", "Median", "Beyond 8.5°", "Given up", "All pairs"], rows)


def _uncertain(found: Evaluation, certainty: Certainty) -> str:
    beyond = [style for style in found.styles if certainty.less_certain(style.name)]
    if not beyond:
        return "No style lies beyond the tolerance arc."
    named = ", ".join(
        f"{_short(style.name)} ({certainty.spread_deg[style.name]:.0f}°)" for style in beyond
    )
    return f"Beyond the tolerance arc, and named to the user as less certain: {named}."


def _places(found: Evaluation) -> str:
    moved = found.moved
    if moved is None:
        return ""
    rows = [["Paper, all places and styles", "6.43°", "", ""]]
    rows.append(_place_row("Here, all places and styles", moved, np.ones(len(moved.feet), bool)))
    for k, name in enumerate(moved.spots):
        for feet in sorted({float(f) for f in moved.feet}):
            chosen = (moved.spot == k) & (moved.feet == feet)
            rows.append(_place_row(f"{name}, {feet:g} ft", moved, chosen))
    return (
        "<h2>Where the probe stands</h2>"
        + paragraph(
            "The demo location is a model, so that the light 1 and 2 feet from each of its three "
            "spots can be rendered, in four directions. The angle between the best turn there and "
            "at the spot, by quality, and what turning as the other place says gives up at the "
            "spot."
        )
        + table(["", "Mean", "Without ties", "Given up"], rows)
    )


def _place_row(name: str, moved: Moved, chosen: np.ndarray) -> list[str]:
    values, clear = moved.degrees[chosen], ~moved.tied[chosen]
    return [
        name,
        degrees(float(values.mean())),
        degrees(float(values[clear].mean()) if clear.any() else 0.0),
        percent(float(moved.regret[chosen].mean())),
    ]


def _sheet(found: Evaluation, sheets: Sheets) -> str:
    count = len(found.styles)
    cells = ['<div class="name">target</div>']
    for style, picture in zip(found.styles, sheets.targets, strict=True):
        name = _short(style.name)
        cells.append(
            f'<div><img alt="{name}" src="{picture}"><div class="words">{name}</div></div>'
        )
    for scene, row, pictures in zip(found.scenes, found.results, sheets.found, strict=True):
        cells.append(f'<div class="name">{escape(scene)}</div>')
        for one, picture in zip(row, pictures, strict=True):
            turn = f"{one.turn_refined_deg:+.0f}°".replace("-", "−")
            cells.append(
                f'<div><img alt="{escape(scene)}, {_short(one.name)}" src="{picture}">'
                f'<div class="words">{turn}<br>{max(one.match, 0):.0f}</div></div>'
            )
    columns = f"grid-template-columns: 4.6rem repeat({count}, minmax(2.6rem, 1fr))"
    return (
        "<h2>Every style in every scene</h2>"
        + paragraph(
            "On top the studio picture of each style; below, the head at the turn offered, grey "
            "where the style is out of reach. Below each its turn (positive: clockwise) and match."
        )
        + f'<div class="sheet" style="{columns}">{"".join(cells)}</div>'
    )


def _differences(found: Evaluation) -> str:
    light, picture = found.lighting, found.pictures
    wide = found.widths["paper"].mean()
    items = [
        f"The scenes are others. The paper’s twelve are not public as far as we know; ours are "
        f"{len(found.scenes)} panoramas with their full range. Angles of a few degrees depend on "
        "which scenes there are more than on how large the picture is.",
        "The head, its skin and the lamps of the styles are ours, modelled after the paper’s "
        "figure 3 and lighting handbooks.",
        f"32 × 16 differs by {light[0].change.mean:.1f}° instead of 6.15° and 50 × 50 by "
        f"{picture[0].change.mean:.1f}° instead of 4.95°. Texels and pixels here are exact "
        "averages of the larger ones, for light, transport and targets alike, and turns that fall "
        "between two columns of 32 are interpolated. The paper does not say how it did either; "
        "sizes rendered each by itself bring noise of their own, and whole texels of 32 columns "
        "are steps of 11.25°. Counted by whole texels of each size, 32 × 16 differs by "
        f"{light[0].own_steps or 0:.1f}° here.",
        f"Peaks are {wide[0]:.1f}° wide instead of 17.05°, with a deviation of {wide[1]:.1f}° "
        "instead of 9.73°. Light that comes from everywhere makes broad peaks; which scenes are "
        "among the twelve decides.",
    ]
    listed = "".join(f"<li>{escape(words, quote=False)}</li>" for words in items)
    return f"<h2>Where we differ from the paper, and why</h2><ul>{listed}</ul>"


def _method(found: Evaluation, tables: Tables) -> str:
    note = tables.sizes_note
    rows = [[note.head, note.skin, note.settings, _noise(note.noise)]]
    rows += [[n.head, n.skin, n.settings, _noise(n.noise)] for n in tables.head_notes.values()]
    return (
        "<h2>How it was measured</h2>"
        + paragraph(
            "Sizes come from one bake at 200 × 200 pixels and 128 × 64 texels, whose blocks of "
            "pixels and texels make the smaller ones; targets and their weights (eq. 6) are made "
            "of the same blocks. Only the pre-integrated targets F (eq. 3) are kept. Noise is that "
            "of F, from the two mirrored halves of the head; it is the same in all sizes, which "
            "are sums of the same numbers, and so hardly counts in their differences. Light and "
            "transport are grey, as in the paper. What is attainable and the result sheets are the "
            "app’s own answers, in colour."
        )
        + table(["Head", "Skin", "How", "Noise of F"], rows, first=3)
        + "".join(paragraph(words) for words in found.notes)
    )


def _noise(noise: float) -> str:
    return percent(noise) if np.isfinite(noise) else "unknown"
