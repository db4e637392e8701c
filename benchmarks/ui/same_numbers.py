"""Every number and name that screen, set sheet and command line state for the same thing.

    python -m benchmarks.ui.same_numbers PANORAMA... [--heads generic female] [--eyes 3]

Prints each difference, and at the end the number of compared values. `--eyes`: number of styles of
a panorama whose catchlights are drawn and looked up in the list of lamps.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from app.commands.solve import add_arguments
from app.core.base.angles import whole, wrap
from app.core.environment.environment import read_environment
from app.core.places.solve_place import solve_place
from app.core.portrait.head import Head, load_head
from app.core.solver.place_light import Facing, PlaceLight, prepare
from app.core.storage.settings import Settings
from app.export.set_sheet import SetSheet, assemble
from app.ui.presenters.lamps_here import lamps_here
from app.ui.screens.probe.lamps import lamp_rows
from app.ui.screens.styles.cards import card_of
from app.ui.screens.styles.detail import DetailState
from app.ui.screens.styles.detail_pictures import DetailResolver
from app.ui.screens.styles.gallery import GalleryQuestion, Sizes, Snapshot
from app.words.lights import share_words
from app.words.phrases.quantities import contrast_words
from app.words.phrases.turns import arc_words, direction_words, size_words
from app.words.portrait.face_light import glare_sentence, stops_words
from app.words.verdict import grade_on_card
from app.words.why_out_of_reach import grade_words

Values = Mapping[str, object]
_SMALL: Final = Sizes(card=(24, 20), portrait=(24, 20), background=(24, 20))


def snapshot_of(head: Head, light: PlaceLight) -> Snapshot:
    """Solve a place like the window, without pictures."""
    results = solve_place(head, light, (), Settings(), 0.0)
    question = GalleryQuestion(head, light, results=results)
    styles = {style.name: style for style in head.pack.styles}
    found = {one.name: one for one in results}
    nothing = dict.fromkeys(styles, (None, None))
    return Snapshot(question, styles, found, {}, {}, nothing)


def screen_values(snapshot: Snapshot, state: DetailState) -> Values:
    """Return the values of the Styles screen for a style."""
    return {
        "turn": state.turn,
        "direction": state.direction,
        "arc": state.good_from.removesuffix(", less certain"),
        "match": state.match,
        "contrast": state.contrast,
        "ratio": state.ratio,
        "glare": state.glare_tip,
        "reason": state.reason if not state.in_reach else "",
    }


def sheet_of(snapshot: Snapshot, name: str) -> SetSheet:
    """Assemble the set sheet of a style, without drawing it."""
    question, result = snapshot.question, snapshot.results[name]
    light, seen = question.light, snapshot.head_for(name)
    assert light is not None
    facing = Facing(light, wrap(result.turn_refined_deg - seen.yaw_deg))
    return assemble(
        result,
        question.head.transport,
        light.environment.radiance,
        place=light.name,
        face_picture=facing(),
        draw=lambda here, size: ([], []),  # type: ignore[arg-type,return-value]
        findings=question.findings(),
    )


def sheet_values(sheet: SetSheet) -> Values:
    """Return the values of the same style on the set sheet."""
    assert sheet.ratio is not None
    assert sheet.glare is not None
    within = sheet.reason is None
    match = str(max(math.floor(sheet.match), 0))
    return {
        "turn": size_words(sheet.turn_deg),
        "direction": direction_words(sheet.turn_deg),
        "arc": arc_words(sheet.arc_deg) if within else "",
        "match": match,
        "contrast": contrast_words(sheet.strength),
        "ratio": stops_words(sheet.ratio),
        "glare": glare_sentence(sheet.glare) if sheet.glare.warns else "",
        "reason": "" if sheet.reason is None else f"{sheet.reason}.",
    }


def file_values(facts: Mapping[str, Any]) -> Values:
    """Return the values of the same style in ``solve --json``."""
    within, match = facts["attainable"], str(max(math.floor(facts["match"]), 0))
    first, last = facts["arc_deg"]
    return {
        "turn": size_words(facts["turn_refined_deg"]),
        "direction": direction_words(facts["turn_refined_deg"]),
        "arc": arc_words((first, last)) if within else "",
        "match": match,
        "contrast": contrast_words(facts["strength"]),
        "reason": "" if facts["reason"] is None else f"{facts['reason']}.",
    }


def solved(file: Path, head: str) -> dict[str, dict[str, Any]]:
    """Return the output of ``solve --json`` for a panorama, by style."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    args = parser.parse_args([str(file), "--head", head, "--json"])
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        args.run(args)
    return {one["name"]: one for one in json.loads(printed.getvalue())["styles"]}


def compare(
    file: Path, head: Head, styles: Sequence[str] = (), eyes: int = 0
) -> Iterator[tuple[str, str, list[object]]]:
    """Yield each value of a place: its subject, its name, and its value in each source."""
    light = prepare(read_environment(file))
    snapshot, printed = snapshot_of(head, light), solved(file, head.name)
    detail = DetailResolver()
    for count, name in enumerate(styles or snapshot.results):
        state = detail.at(snapshot, name, None, _SMALL, quick=True)
        sheet = sheet_of(snapshot, name)
        told = [
            screen_values(snapshot, state),
            sheet_values(sheet),
            file_values(printed[name]),
        ]
        for key in told[0]:
            yield name, key, [one[key] for one in told if key in one]
        grade = snapshot.results[name].grade
        words = grade_words(grade, snapshot.results[name].attainable)
        stated = grade_words(printed[name]["grade"], printed[name]["attainable"])
        yield name, "grade", [words, stated]
        card = card_of(snapshot, name)
        if card.turn:
            yield name, "turn on the card", [card.turn, state.turn]
        yield name, "grade on the card", [card.word, grade_on_card(grade, within=card.in_reach)]
        if count < eyes:
            seen = snapshot.head_for(name)
            lit = Facing(light, wrap(whole(state.needle)))
            mirrored = seen.catchlights(lit, snapshot.question.findings()) or ()
            names = {lamp.letter: lamp.kind for lamp in snapshot.question.findings().lamps}
            for one in mirrored:
                if one.letter:
                    yield name, "lamp in the eyes", [one.letter in names, True]
    found = lamps_here(light, None)
    rows, marks = lamp_rows(found, 0.0), sheet.lamps
    for row, mark in zip(rows, marks, strict=True):
        yield row.letter, "letter", [row.letter, mark.name]
        yield row.letter, "share", [row.share, share_words(mark.share, mark.clipped)]
        yield row.letter, "sun", [row.name == "Sun", mark.sun]


def main(words: Sequence[str] | None = None) -> int:
    """Compare everything in some panoramas; return 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("panoramas", nargs="+", type=Path)
    parser.add_argument("--heads", nargs="+", default=["generic"])
    parser.add_argument("--eyes", type=int, default=0)
    args = parser.parse_args(words)
    count = differences = 0
    for name in args.heads:
        head = load_head(name)
        for file in args.panoramas:
            for what, key, values in compare(file, head, (), args.eyes):
                count += 1
                if any(value != values[0] for value in values):
                    differences += 1
                    print(f"{file.name}, {name}, {what}, {key}: {values}")
            print(f"{file.name}, {name}: {count} values so far", file=sys.stderr, flush=True)
    print(f"{differences} of {count} values differ")
    return int(differences > 0)


if __name__ == "__main__":
    raise SystemExit(main())
