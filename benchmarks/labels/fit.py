"""Fit the limits of the grades to what blind readers and the blind judge see, leaving places out.

Every labelled picture counts for every style, and for the mirror image of a style as well. A
picture's worth under a grade is the mean over those who looked at it: three readers, and the judge
of `benchmarks.answers.blind_judge` as half as much as all of them. The limits of each relation for
yes and for soft, and the least match, are moved one after another from those in use as long as the
sum of the worth grows by more than `PRICE` a stop. A style's own target keeps its grade on every
head. Figures are those of places left out, in five folds.

    python -m benchmarks.labels.fit PLACE ... [--style NAME ...] [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.environment.environment import read_environment, reduce_light
from app.core.solver.face import AREAS, AROUND, mirror_area
from app.core.solver.place_light import pictures_at, prepare
from app.core.solver.style_signature import Signature, stops_of
from app.core.solver.transport import load_named
from app.core.styles.style import Style
from app.core.styles.style_pack_file import load_named_pack, pack_names
from app.core.styles.styles import load_styles, mirror_name
from benchmarks.answers.blind_judge import knows, opinion
from benchmarks.answers.offered_turns import searched
from benchmarks.labels.readings import Labels, agreement, load

Floats = NDArray[np.float64]

FOLDS: Final = 5
PRICE: Final = 0.35
"""Worth that moving a limit by a stop, or a match by 20 points, must gain."""

TEXTBOOK: Final = {
    # A patch of light under the eye comes from above the eyes, and light on the hair from above.
    ("left-rembrandt", "forehead - lids", "least"): (1.1, 0.4),
    ("hair-light", "crown - left edge", "least"): (3.0, 0.3),
    # Even light from behind is no flat light, even if both sides of the face are alike.
    ("flat", "match", "match"): (60.0, 60.0),
    # A silhouette has dark edges and a background brighter than the rest of the place.
    ("silhouette", "left edge - background", "most"): (0.0, 0.5),
    ("silhouette", "background - surroundings", "least"): (0.4, 0.15),
}
"""Limits of yes and of soft that are not loosened, whatever the pictures ask for."""

YES_KEPT: Final = frozenset({"left-split"})
"""Styles that keep their limits of yes: eleven times the fill is a split, few as they are here."""

WORTH: Final = np.array([[0.0, 0.0, 0.0], [-0.6, 1.0, 1.0], [-1.4, 1.15, 1.8]])
"""Worth of the grades no, soft and yes (rows) for a style that is not, softly or clearly seen."""

_JUDGE: Final = 1.0 / 3.0  # share of the judge's opinion
_CLEAR: Final = 0.4  # stops inside the judge's limits
_EVENEST: Final = 0.4  # stops; smaller differences between both sides are in every face
_POINTS: Final = 20.0  # points of match that count as one stop
_MATCHES: Final = (30.0 / _POINTS, 96.0 / _POINTS)
_MOVES: Final = np.arange(-15, 31) * 0.1
_LEAST_SEEN: Final = 6  # pictures; styles seen less often keep their limits
_SPARE: Final = 0.2  # stops by which targets lie within the limits
_SWEEPS: Final = 6
_OPEN: Final = 90.0  # limits beyond this are none
_HERE: Final = Path(__file__).resolve().parent


@dataclass(frozen=True, slots=True, eq=False)
class Measures:
    """Measurements of each picture.

    Attributes:
        stops: (pictures, areas) float64. Brightness of `AREAS`.
        match: (pictures, styles) float64.
        judge: (pictures, styles) float64. Margin of the judge in stops, or NaN.
    """

    stops: Floats
    match: Floats
    judge: Floats


@dataclass(frozen=True, slots=True)
class Bound:
    """One limit: of a relation, or of the match if there is no relation."""

    relation: int | None
    kind: str

    def shown(self, value: float) -> float:
        """Return the limit as style files have it."""
        if self.relation is None:
            return round(_POINTS * value)
        return round(value if self.kind == "least" else -value, 2)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """All pictures, as one style sees them.

    Attributes:
        yes_kept: Whether the limits of yes are not moved.
        values: (bounds, pictures) float64. Values that must not be less than the limits.
        yes, soft: (bounds,) float64. Limits in use.
        floors: (2, bounds) float64. Limits of yes and of soft that are not loosened.
        most: (bounds,) float64. Limits with which the style's own target keeps its grade.
        worth: (pictures, 3) float64. Worth of each grade.
        label: (pictures,) int64. The grade chosen by most readers.
        own: (pictures,) bool. Pictures chosen for this style.
        place: (pictures,) int64. Fold of the picture's place.
    """

    bounds: tuple[Bound, ...]
    yes_kept: bool
    values: Floats
    yes: Floats
    soft: Floats
    floors: Floats
    most: Floats
    worth: Floats
    label: NDArray[np.int64]
    judge: Floats
    own: NDArray[np.bool_]
    place: NDArray[np.int64]

    def grades(self, yes: Floats, soft: Floats) -> NDArray[np.int64]:
        """Grade all pictures by other limits."""
        is_soft = (self.values >= soft[:, None]).all(axis=0)
        is_yes = is_soft & (self.values >= yes[:, None]).all(axis=0)
        return np.asarray(is_soft.astype(np.int64) + is_yes)


def measure(labels: Labels, places: dict[str, Path]) -> Measures:
    """Measure every labelled picture at exactly its turn."""
    shape = len(labels.recipe), len(labels.styles)
    stops, match = np.zeros((shape[0], len(AREAS))), np.zeros(shape)
    judge, head = np.full(shape, np.nan), load_named("generic")
    by_place: dict[str, list[int]] = defaultdict(list)
    for index, one in enumerate(labels.recipe):
        by_place[one["place"]].append(index)
    for place, indices in by_place.items():
        environment = read_environment(places[place])
        turns = [labels.recipe[index]["turn_deg"] for index in indices]
        pictures = pictures_at(head, prepare(environment), turns)
        for index, turn, picture in zip(indices, turns, pictures, strict=True):
            columns = round(turn / 360.0 * environment.radiance.shape[1])
            light = reduce_light(np.roll(environment.radiance, -columns, axis=1))
            found = searched(load_named_pack(labels.recipe[index]["head"]), light)
            stops[index] = stops_of(found.curves.others[: len(AREAS), :1])[:, 0]
            match[index] = found.measured.match[:, 0]
            for row, style in enumerate(labels.styles):
                if knows(style):
                    judge[index, row] = opinion(picture, style).margin
    return Measures(stops, match, judge)


def targets_of(style: Style) -> Floats:
    """Return the brightness of the areas in a style's own target, (heads, areas)."""
    found = []
    for pack in map(load_named_pack, pack_names()):
        areas = pack.areas.reshape(len(AREAS), -1).astype(np.float64)
        picture = luminance(pack.target(style.name)).ravel().astype(np.float64)
        means = areas @ picture / np.maximum(areas.sum(axis=1), 1e-30)
        means[AROUND] = np.nan  # studios have no background
        found.append(stops_of(np.nan_to_num(means)[:, None])[:, 0] + 0.0 * means)
    return np.array(found)


def bounds_of(signature: Signature, stops: Floats, match: Floats) -> dict[Bound, Any]:
    """Return the values, the limit of yes and the limit of soft of every bound."""
    found: dict[Bound, Any] = {}
    for row, one in enumerate(signature.relations):
        value = stops[:, AREAS.index(one.bright)] - stops[:, AREAS.index(one.dark)]
        if abs(one.least + one.most) < 1e-9:
            found[Bound(row, "even")] = -np.abs(value), -one.most, -one.most - one.soft
            continue
        if one.least > -_OPEN:
            found[Bound(row, "least")] = value, one.least, one.least - one.soft
        if one.most < _OPEN:
            found[Bound(row, "most")] = -value, -one.most, -one.most - one.soft
    found[Bound(None, "match")] = match / _POINTS, *(each / _POINTS for each in signature.match)
    return found


def join_sides(signature: Signature, found: dict[Bound, Any]) -> dict[Bound, Any]:
    """Let the relations of both sides of a style without a side share their limits."""
    joined: dict[Bound, Any] = {}
    pairs = {(r.bright, r.dark): row for row, r in enumerate(signature.relations)}
    for bound, (value, yes, soft) in found.items():
        if bound.relation is not None:
            relation = signature.relations[bound.relation]
            twin = pairs.get((mirror_area(relation.bright), mirror_area(relation.dark)))
            other = Bound(twin, bound.kind)
            if other != bound and other in joined:
                joined[other] = (np.minimum(joined[other][0], value), *joined[other][1:])
                continue
        joined[bound] = value, yes, soft
    return joined


def sample(labels: Labels, measures: Measures, style: Style) -> Sample:
    """Return all pictures as a style and its mirror image see them."""
    name, signature = style.name, style.signature
    targets = targets_of(style)
    there = bounds_of(signature, targets, np.full(len(targets), _MATCHES[1] * _POINTS))
    names = [name] if mirror_name(name) == name else [name, mirror_name(name)]
    rows = [labels.styles.index(one) for one in names]
    signatures = (signature, signature.mirrored)
    parts = [
        bounds_of(each, measures.stops, measures.match[:, row])
        for each, row in zip(signatures, rows, strict=False)
    ]
    if len(parts) == 1:
        parts, there = [join_sides(signature, parts[0])], join_sides(signature, there)
    judge = np.concatenate([measures.judge[:, row] for row in rows])
    seen = np.concatenate([labels.seen[:, :, row] for row in rows], axis=1)
    share = np.stack([(seen == degree).mean(axis=0) for degree in range(3)], axis=-1)
    clear = judge >= _CLEAR
    opinions = np.stack([judge < 0, (judge >= 0) & ~clear, clear], axis=-1)
    known = ~np.isnan(judge)
    share[known] += _JUDGE * (opinions[known] - share[known])
    order = sorted({one["place"] for one in labels.recipe})
    place = [order.index(one["place"]) % FOLDS for one in labels.recipe]
    _, own = labels.own()
    return Sample(
        bounds=tuple(parts[0]),
        yes_kept=style.name in YES_KEPT,
        values=np.stack([np.concatenate([part[b][0] for part in parts]) for b in parts[0]]),
        yes=np.array([yes for _, yes, _ in parts[0].values()]),
        soft=np.array([soft for _, _, soft in parts[0].values()]),
        floors=np.array([_floors(style, bound) for bound in parts[0]]).T,
        most=np.array([np.nan_to_num(v.min() - _SPARE, nan=np.inf) for v, _, _ in there.values()]),
        worth=share @ WORTH.T,
        label=np.concatenate([labels.majority[:, row] for row in rows]).astype(np.int64),
        judge=judge,
        own=np.concatenate([own == row for row in rows]),
        place=np.array(place * len(rows)),
    )


def _floors(style: Style, bound: Bound) -> tuple[float, float]:
    """Return the limits of yes and of soft that are not loosened, as `Sample` has them."""
    key = _key(style, bound)
    if bound.relation is None:
        yes, soft = TEXTBOOK.get(key, (0.0, 0.0))
        return max(yes / _POINTS, _MATCHES[0]), max(soft / _POINTS, _MATCHES[0])
    yes, soft = TEXTBOOK.get(key, (-np.inf, -np.inf))
    return (-yes, -soft) if bound.kind != "least" and key in TEXTBOOK else (yes, soft)


def _key(style: Style, bound: Bound) -> tuple[str, str, str]:
    return style.name, words_of(style.signature, bound), bound.kind


def fit(one: Sample, inside: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the limits of yes and of soft that some of the pictures ask for."""
    values, worth = one.values[:, inside], one.worth[inside]
    rows = np.arange(len(worth))

    def total(limits: tuple[Floats, Floats]) -> float:
        yes, soft = limits
        is_soft = (values >= soft[:, None]).all(axis=0)
        is_yes = is_soft & (values >= yes[:, None]).all(axis=0)
        moved = np.abs(yes - one.yes).sum() + np.abs(soft - one.soft).sum()
        return float(worth[rows, is_soft.astype(int) + is_yes].sum() - PRICE * moved)

    # Once more from tighter relations with less match.
    up = np.where([bound.relation is None for bound in one.bounds], -0.3, 0.3)
    tight = np.minimum(one.yes + np.maximum(up, 0.1), np.maximum(one.most, one.yes))
    loose = np.maximum(one.soft + up, one.floors[1])
    starts = ((one.yes, one.soft), (tight, np.minimum(loose, tight)))
    found = [_climb(one, total, start) for start in starts[: 1 if one.yes_kept else 2]]
    return max(found, key=total)


def _climb(one: Sample, total: Any, start: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    limits, best = start, total(start)
    for _ in range(_SWEEPS):
        before = best
        for row in range(len(one.bounds)):
            for level in ("soft",) if one.yes_kept else ("soft", "yes", "both"):
                for there in _moved(one, limits, row, level):
                    value = total(there)
                    if value > best + 1e-9:
                        limits, best = there, value
        if best == before:
            break
    return limits


def _moved(
    one: Sample, limits: tuple[Floats, Floats], row: int, level: str
) -> list[tuple[Floats, Floats]]:
    """Return the limits with one of them moved in either direction."""
    bound = one.bounds[row]
    moved: list[tuple[Floats, Floats]] = []
    for step in _MOVES:
        yes, soft = limits[0].copy(), limits[1].copy()
        if level == "both":
            yes[row] += step
            soft[row] += step
        elif level == "yes":
            yes[row] = one.yes[row] + step
        else:
            soft[row] = one.soft[row] + step
        most = min(one.most[row], -_EVENEST if bound.kind == "even" else np.inf)
        # A limit of 0 only says which of two areas is brighter.
        most = one.yes[row] if one.yes[row] == 0.0 else max(most, one.yes[row])
        ordered = soft[row] <= yes[row] + 1e-9 and yes[row] <= most + 1e-9
        if ordered and (np.array([yes, soft]) >= one.floors - 1e-9).all():
            moved.append((yes, soft))
    return moved


def figures(one: Sample, grades: NDArray[np.int64]) -> dict[str, Any]:
    """Return how grades agree with the readers and with the judge."""
    table = np.zeros((3, 3), int)
    np.add.at(table, (grades, one.label), 1)
    shown = [one.judge[grades == grade] >= 0 for grade in range(3)]
    judged = not np.isnan(one.judge).all()
    return {
        "labels_by_grade": table.tolist(),
        "own_pictures": float(np.mean(grades[one.own] == one.label[one.own])),
        "seen": [_share(row[1:].sum(), row.sum()) for row in table],
        "judge": [_share(each.sum(), len(each)) for each in shown] if judged else None,
        "worth": round(float(one.worth[np.arange(len(grades)), grades].sum()), 2),
    }


def _share(part: int, whole: int) -> float | None:
    return round(float(part) / whole, 3) if whole else None


def main() -> None:
    """Fit, and report the figures of places left out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("--style", nargs="*", default=[])
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    styles = load_styles()
    labels = load(_HERE, tuple(style.name for style in styles))
    measures = measure(labels, {path.stem: path for path in args.places})
    facts: dict[str, Any] = {"readers": agreement(labels)}
    for style in styles:
        if style.name.startswith("right-") or (args.style and style.name not in args.style):
            continue
        one = sample(labels, measures, style)
        if (one.label > 0).sum() < _LEAST_SEEN:
            continue
        left_out = np.zeros(len(one.label), np.int64)
        for fold in range(FOLDS):
            inside = one.place != fold
            left_out[~inside] = one.grades(*fit(one, inside))[~inside]
        yes, soft = fit(one, np.ones(len(one.label), bool))
        facts[style.name] = {
            "now": figures(one, one.grades(one.yes, one.soft)),
            "left_out": figures(one, left_out),
            "fitted": figures(one, one.grades(yes, soft)),
            "limits": [
                [words_of(style.signature, bound), bound.kind, bound.shown(y), bound.shown(s)]
                for bound, y, s in zip(one.bounds, yes.tolist(), soft.tolist(), strict=True)
            ],
        }
        print(style.name, json.dumps(facts[style.name]), flush=True)
    if args.output is not None:
        atomic_write_text(args.output, json.dumps(facts, indent=1) + "\n")


def words_of(signature: Signature, bound: Bound) -> str:
    """Return the two areas that a bound compares, or "match"."""
    if bound.relation is None:
        return "match"
    relation = signature.relations[bound.relation]
    return f"{relation.bright} - {relation.dark}"


if __name__ == "__main__":
    main()
