"""Styles rescued by a second light, and losses of the greedy search, over scenes and styles.

Every scene gets a plausible vertical illuminance at the face. The table of rescued styles uses
lamps dimmed to the best power, like `turnlight light`; greedy and full search are compared at full
power, where all else is equal.

    python benchmarks/answers/second_light.py --scenes DIR [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.core.base.angles import difference
from app.core.base.atomic_files import atomic_write_text
from app.core.environment.environment import read_environment, reduce
from app.core.second_light.added_light import from_numbers, prepare_near
from app.core.second_light.contrast import prepare_face
from app.core.second_light.lamp_presets import parse
from app.core.second_light.place_brightness import illuminance
from app.core.second_light.search import place_all
from app.core.solver.head_shape import load_shape_of
from app.core.solver.turn_choice import OBJECTIVES
from app.core.styles.style_pack_file import load_named_pack, load_transport_of

if TYPE_CHECKING:
    from app.core.second_light.search import LampPlacement
    from app.core.solver.turn_choice import Objective

ROOT = Path(__file__).resolve().parents[2]

from app.core.second_light.lamp_presets import (  # noqa: E402
    FULL,
    powers_of,
)
from app.core.second_light.lamp_tables import lamp_tables  # noqa: E402
from app.core.second_light.search import LampPlacement  # noqa: E402
from app.core.solver.turn_choice import Objective  # noqa: E402

# Vertical illuminance at the face, lux: night, cellar, interiors, studio, overcast, sun.
LUX = {
    "dikhololo_night": 5.0,
    "st_peters_square_night": 5.0,
    "drachenfels_cellar": 30.0,
    "empty_warehouse_01": 150.0,
    "leadenhall_market": 200.0,
    "lebombo": 200.0,
    "st_fagans_interior": 300.0,
    "brown_photostudio_02": 500.0,
    "chinese_garden": 8000.0,
    "potsdamer_platz": 8000.0,
    "rooitou_park": 60000.0,
    "quarry_01": 60000.0,
}
LAMPS = ("phone@0.3", "panel@0.3", "flash@1")
WATCHED = ("badger", "left-loop-rim", "right-loop-rim")
DIM = 300.0  # lux, up to which the panel must help


@dataclass(frozen=True, slots=True)
class GreedyPair:
    """Full and greedy search for one style.

    Attributes:
        lost: Loss of the greedy search: points of match, or per cent of the larger quality.
            Negative if greedy stopped at a better match of a combination that is not strong enough.
    """

    same: bool
    turn_apart_deg: float
    lost: float
    attainable_full: bool
    attainable_greedy: bool


def compared(full: LampPlacement, greedy: LampPlacement, objective: Objective) -> GreedyPair:
    """Compare the full search with the paper's greedy one, which turns first and then places."""
    lost = full.match - greedy.match
    if objective == "paper":
        size = max(abs(full.quality), abs(greedy.quality), 1e-30)
        lost = 100.0 * (full.quality - greedy.quality) / size
    same = (full.turn_index, full.placement) == (greedy.turn_index, greedy.placement)
    return GreedyPair(
        same=same,
        turn_apart_deg=abs(difference(full.turn_deg, greedy.turn_deg)),
        lost=0.0 if same else lost,
        attainable_full=full.attainable,
        attainable_greedy=greedy.attainable,
    )


def scenes(folder: Path, shape: tuple[int, int]) -> dict[str, np.ndarray[Any, Any]]:
    """Return the environments of a folder in cd/m2, by name."""
    found = {}
    for path in sorted([*folder.glob("*.hdr"), *folder.glob("*.exr")]):
        name = path.stem.removesuffix("_1k")
        if name in LUX:
            light = reduce(read_environment(path), shape)
            found[name] = light * np.float32(LUX[name] / illuminance(light))
    return dict(sorted(found.items(), key=lambda item: LUX[item[0]]))


def rescue(found: tuple[Any, ...]) -> dict[str, Any]:
    """Return the effect of a lamp in a scene."""
    return {
        "attainable": sum(one.attainable for one in found),
        "rescued": [one.name for one in found if one.rescued],
        "lost": [one.name for one in found if one.before.attainable and not one.attainable],
        "match": {one.name: round(one.match, 2) for one in found},
        "strength": {one.name: round(one.strength, 1) for one in found},
        "power": {one.name: one.power for one in found},
    }


def main() -> None:
    """Try every scene, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, default=ROOT.parent / "shared" / "data" / "hdri")
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "second-light.json"
    )
    args = parser.parse_args()
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    shape = load_shape_of(transport, "generic")
    face = prepare_face(transport, pack.region_on(transport))
    near = prepare_near(transport, shape)
    places = scenes(args.scenes, pack.header.environment)
    rows: dict[str, dict[str, Any]] = {name: {"lux": LUX[name], "lamps": {}} for name in places}
    greedy: list[tuple[str, str, str, tuple[GreedyPair, ...]]] = []
    for word in LAMPS:
        lamp = parse(word)
        added = from_numbers(transport, shape, lamp, near=near, face=face)
        tables = lamp_tables(pack, transport, added)
        for name, light in places.items():
            best = place_all(
                pack, transport, light, added, powers=powers_of(lamp.kind), tables=tables
            )
            full = place_all(pack, transport, light, added, powers=FULL, tables=tables)
            rows[name]["without"] = {
                "attainable": sum(one.before.attainable for one in best),
                "match": {one.name: round(one.before.match, 2) for one in best},
            }
            rows[name]["lamps"][word] = {"dimmed": rescue(best), "full": rescue(full)}
            for objective in OBJECTIVES:
                both, quick = (
                    place_all(pack, transport, light, added, objective, tables=tables, greedy=way)
                    for way in (False, True)
                )
                pairs = zip(both, quick, strict=True)
                found = tuple(compared(a, b, objective) for a, b in pairs)
                greedy.append((word, objective, name, found))
        print(word, file=sys.stderr)
    values = {"scenes": rows, "greedy": summary(greedy)}
    atomic_write_text(args.o, json.dumps(values, indent=1) + "\n")
    show(values)


def summary(greedy: list[tuple[str, str, str, tuple[GreedyPair, ...]]]) -> dict[str, Any]:
    """Summarise agreement of greedy and full search, and greedy's losses, by lamp and objective."""
    found: dict[str, Any] = {}
    for word in LAMPS:
        for objective in OBJECTIVES:
            pairs = [
                pair
                for lamp, wanted, _, those in greedy
                if (lamp, wanted) == (word, objective)
                for pair in those
            ]
            lost = np.array([pair.lost for pair in pairs])
            found[f"{word} {objective}"] = {
                "pairs": len(pairs),
                "same": float(np.mean([pair.same for pair in pairs])),
                "same_turn": float(np.mean([pair.turn_apart_deg == 0 for pair in pairs])),
                "mean_lost": round(float(lost.mean()), 4),
                "median_lost": round(float(np.median(lost)), 4),
                "worst_lost": round(float(lost.max()), 4),
                "mean_turn_apart_deg": round(
                    float(np.mean([pair.turn_apart_deg for pair in pairs])), 2
                ),
                "attainable_full": sum(pair.attainable_full for pair in pairs),
                "attainable_greedy": sum(pair.attainable_greedy for pair in pairs),
            }
    return found


def show(values: dict[str, Any]) -> None:
    """Print the tables as Markdown."""
    print("| scene | lux | without | " + " | ".join(LAMPS) + " |")
    print("|---|---|---|" + "---|" * len(LAMPS))
    for name, row in values["scenes"].items():
        cells = [f"{row['lamps'][word]['dimmed']['attainable']}" for word in LAMPS]
        print(f"| {name} | {row['lux']:g} | {row['without']['attainable']} | {' | '.join(cells)} |")
    print("\n| scene | lux | " + " | ".join(WATCHED) + " |")
    print("|---|---|" + "---|" * len(WATCHED))
    for name, row in values["scenes"].items():
        panel = row["lamps"]["panel@0.3"]
        cells = [
            f"{row['without']['match'][style]:.0f} → {panel['dimmed']['match'][style]:.0f}"
            f" ({panel['full']['match'][style]:.0f})"
            for style in WATCHED
        ]
        gains = all(
            panel["dimmed"]["match"][style] > row["without"]["match"][style] for style in WATCHED
        )
        mark = "" if gains or row["lux"] > DIM else " no gain"
        print(f"| {name} | {row['lux']:g} | {' | '.join(cells)} |{mark}")
    print("\n| lamp, objective | same | same turn | mean | median | worst | full | greedy |")
    print("|---|---|---|---|---|---|---|---|")
    for name, row in values["greedy"].items():
        print(
            f"| {name} | {100 * row['same']:.0f} % | {100 * row['same_turn']:.0f} % |"
            f" {row['mean_lost']} | {row['median_lost']} | {row['worst_lost']} |"
            f" {row['attainable_full']} | {row['attainable_greedy']} |"
        )


if __name__ == "__main__":
    main()
