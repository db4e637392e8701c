"""Every sentence about reach over the demo scenes, as each screen, sheet and command shows it.

    python -m tests.helpers.reach_sentences     writes tests/data/reach-sentences.json anew

Run it only after a change of wording, and read the difference.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from app.commands import light as light_command
from app.commands import solve as command
from app.core.environment.environment import read_environment
from app.core.second_light.added_light import AddedLight
from app.core.second_light.search import place_all
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.lens.view_tables import views_of
from app.core.solver.place_light import PlaceLight, prepare
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import UNSIGNED
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.export import result_card
from app.ui.presenters import spots
from app.ui.screens.light import style_list
from app.ui.screens.paint.live import LiveState
from app.ui.screens.styles import detail
from app.ui.screens.styles.cards import card_of
from app.ui.screens.styles.detail import DetailState
from app.ui.screens.styles.gallery import GalleryQuestion, Snapshot
from app.words.styles import full_title
from tests.helpers import second_light
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_shape

FILE: Final = Path(__file__).resolve().parents[1] / "data" / "reach-sentences.json"
SCENES: Final = Path(__file__).resolve().parents[2] / "resources" / "demo" / "scenes"

WHERE: Final = (
    *("reason", "shortfall", "table", "card", "tool tip", "spoken"),
    *("verdict", "detail", "sheet", "paint", "spot", "spots"),
)
Sentences = dict[str, dict[str, dict[str, str | None]]]


def sentences() -> Sentences:
    """Collect them by question, style and where they are shown; styles in full reach have none."""
    every = {each[0]: dict(_shown(*each[1:])) for each in _questions()}
    return every | {each[0]: dict(_with_lamp(*each[1:])) for each in _lamps()}


def _questions() -> Iterator[tuple[str, StylePack, PlaceLight, Sequence[StyleResult], str]]:
    packs = {name: load_named_pack(name) for name in ("generic", "female")}
    unsigned = _unsigned(packs["generic"])
    views = views_of(packs["generic"], "generic")
    for file in sorted(SCENES.glob("*.exr")):
        light = prepare(read_environment(file))
        for head, pack in packs.items():
            for objective in ("picture", "paper") if head == "generic" else ("picture",):
                results = solve_all(pack, light.searched, objective)
                yield f"{file.stem}, {head}, {objective}", pack, light, results, objective
        results = solve_all(unsigned, light.searched)
        yield f"{file.stem}, without signatures", unsigned, light, results, "picture"
        if file.stem in ("studio", "sunset"):
            for wish in (LensWish("short"), LensWish("broad"), LensWish("auto", (10.0, 12.0))):
                results = solve_lens(packs["generic"], views, light.searched, wish)
                name = f"{file.stem}, {wish.yaw}, {wish.background}"
                yield name, packs["generic"], light, results, "picture"
    even = replace(light, searched=np.ones_like(light.searched))
    for name, pack in {"even": packs["generic"], "even, without signatures": unsigned}.items():
        yield name, pack, even, solve_all(pack, even.searched), "picture"


def _unsigned(pack: StylePack) -> StylePack:
    """The same styles judged by match and contrast, as painted ones are."""
    styles = tuple(replace(style, signature=UNSIGNED) for style in pack.styles)
    return replace(pack, styles=styles)


def _shown(
    pack: StylePack, light: PlaceLight, results: Sequence[StyleResult], objective: str
) -> Iterable[tuple[str, dict[str, str | None]]]:
    styles = {style.name: style for style in pack.styles}
    head: Any = SimpleNamespace(pack=pack, studio_wanted=pack.studio)
    question = GalleryQuestion(head, light, results=tuple(results), objective=objective)
    pictures = dict.fromkeys(styles, (None, None))
    snapshot = Snapshot(question, styles, {one.name: one for one in results}, {}, {}, pictures)
    spot = spots.Spot(
        Path(),
        "here",
        results=snapshot.results,
        pictures=dict.fromkeys(styles, np.zeros((1, 1, 3), np.uint8)),
        titles={name: full_title(style) for name, style in styles.items()},
    )
    for result in results:
        if result.attainable and result.grade in ("yes", None):
            continue
        card = card_of(snapshot, result.name)
        base = DetailState(key=result.name)
        turn = result.turn_refined_deg
        shown = detail.with_words(base, snapshot, result, turn, at_best=True)
        facts = command._style_json(result)
        yield (
            result.name,
            {
                "reason": facts["reason"],
                "shortfall": facts["shortfall"],
                "table": command._row(result)[-1],
                "card": f"{card.word} {card.line}",
                "tool tip": card.tip,
                "spoken": card.spoken,
                "verdict": shown.verdict,
                "detail": shown.reason,
                "sheet": " / ".join(result_card._reason_lines(result)),
                "paint": LiveState(result=result).good,
                "spot": spots._card(spot, result.name, False).why,
                "spots": spots._verdict(spot, result.name),
            },
        )


def _lamps() -> Iterator[tuple[str, StylePack, AddedLight]]:
    packs = {"signed": second_light.pack(), "unsigned": _unsigned(second_light.pack())}
    for strength, gain in {"strong": 400.0, "weak": 4e-4}.items():
        for name, pack in packs.items():
            yield f"lamp, {strength}, {name}", pack, second_light.captured(gain)


def _with_lamp(pack: StylePack, added: AddedLight) -> Iterable[tuple[str, dict[str, str | None]]]:
    transport, shape = lambert_sphere_transport(), synthetic_shape()
    placed = place_all(pack, transport, second_light.coloured_place(), added)
    styles = {style.name: style for style in pack.styles}
    answers: Any = SimpleNamespace(
        question=SimpleNamespace(objective="picture"),
        hand=SimpleNamespace(lamp=None),
    )
    for one in placed:
        if one.attainable and one.grade in ("yes", None):
            continue
        facts = light_command._style_json(one, added, shape)
        row = style_list._row(one, styles[one.name], "", answers)
        yield (
            one.name,
            {
                **dict.fromkeys(WHERE),
                "reason": facts["reason"],
                "shortfall": facts["shortfall"],
                "table": facts["before"]["reason"],
                "card": row.line,
                "spoken": row.spoken,
            },
        )


def write() -> None:
    """Keep them, shared strings once."""
    FILE.write_text(json.dumps(_indexed(sentences()), ensure_ascii=False, indent=0) + "\n", "utf-8")


def read() -> Sentences:
    """Read what was kept."""
    facts = json.loads(FILE.read_text("utf-8"))
    words = facts["sentences"]
    return {
        question: {
            style: {
                where: None if number is None else words[number]
                for where, number in zip(WHERE, row, strict=True)
            }
            for style, row in rows.items()
        }
        for question, rows in facts["shown"].items()
    }


def _indexed(every: Sentences) -> dict[str, Any]:
    flat = [row for rows in every.values() for row in rows.values()]
    words = sorted({text for row in flat for text in row.values() if text is not None})
    numbers: dict[str | None, int | None] = {text: number for number, text in enumerate(words)}
    numbers[None] = None
    return {
        "sentences": words,
        "shown": {
            question: {
                style: [numbers[row[where]] for where in WHERE] for style, row in rows.items()
            }
            for question, rows in every.items()
        },
    }


if __name__ == "__main__":
    write()
