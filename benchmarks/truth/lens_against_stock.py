"""Views from the side against stock Mitsuba: their pictures, and the best turn and yaw of a place.

Used by `benchmarks/answers/nose_and_lens.py`. A head is fixed; the camera moves around it, and the
light is rotated to the azimuth of the nose.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.baking.scene import frame_head
from app.core.base.angles import TURNS, turn_of_index, wrap
from app.core.base.colour import luminance
from app.core.portrait.head_views import HeadViews, load_views_of
from app.core.solver.face import region_in_view
from app.core.solver.lens.lens_search import solve_lens
from app.core.solver.lens.lens_wish import LensWish
from app.core.solver.lens.view_tables import ViewTables, match_curves, view_tables
from app.core.solver.search import curves
from app.core.solver.solve import measure
from app.core.solver.transport import Transport, load_named, render
from app.core.solver.turn_choice import LIMITS, StyleMeasures, choose
from app.core.solver.weights import region_weights
from app.core.styles.lamps import mirror_index
from app.core.styles.style_pack import StylePack, judged_region
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth import brute_force
from benchmarks.truth.product_form import kept
from benchmarks.truth.stock import as_placed, generic_head, read_light, rotate, stock_picture

Float64: TypeAlias = NDArray[np.float64]
Bools: TypeAlias = NDArray[np.bool_]

HEAD: Final = "generic"
PLACES: Final = ("drachenfels_cellar", "brown_photostudio_02", "leadenhall_market")
"""Hard light from one side, lamps of a studio, soft light from a glass roof."""
STYLES: Final = ("butterfly", "left-loop", "left-rembrandt", "left-split")
SHOWN: Final = (-45.0, -30.0, 15.0, 30.0, 45.0)
NOSES: Final = (8, 40)
"""Columns that the nose points to in the pictures: towards 45 deg, and away from there."""
SEEDS: Final = 2
SMALL: Final = 50  # pixels, of the pictures of the search
BESIDE: Final = 2  # pixels, so that the area behind the outline is known
FINE: Final = brute_force.FINE
YAW_STEP: Final = 15.0
GIVEN_UP: Final = 0.02
AGAIN: Final = 24  # seeds, for pairs that are compared once more


@dataclass(frozen=True, slots=True, eq=False)
class Head:
    """The program's head, from the front and from the side."""

    pack: StylePack
    front: Transport = field(repr=False)
    views: HeadViews = field(repr=False)

    @property
    def yaws(self) -> tuple[float, ...]:
        """All yaws with views, deg."""
        return self.views.yaws

    def seen_at(self, yaw_deg: float) -> tuple[Transport, Float64, Float64]:
        """Return transport, targets (S, P) and region (P,) at a yaw."""
        if not yaw_deg:
            flat = self.pack.targets.reshape(len(self.pack.styles), -1, 3)[:, self.front.pixels]
            grey = luminance(flat.astype(np.float64))
            return self.front, np.asarray(grey), self.pack.region_on(self.front)
        view = self.views.at(yaw_deg, self.pack.styles)
        region = region_in_view(view.transport, view.shape, self.views.shape)
        return view.transport, view.targets.astype(np.float64), region


def load_head() -> Head:
    """Load the generic head with its views."""
    pack = load_named_pack(HEAD)
    return Head(pack, load_named(HEAD), load_views_of(pack, HEAD))


def light_of(scenes: Path, place: str) -> NDArray[np.float32]:
    """Return a place's light on 64 x 32 texels, mean radiance 1."""
    return read_light(scenes / f"{place}_1k.hdr")


def render_picture(
    light: NDArray[np.float32],
    yaw: float,
    nose: int,
    size: int,
    paths: int,
    seed: int,
    part: tuple[slice, slice] | None = None,
) -> NDArray[np.float32]:
    """Render the head by stock Mitsuba, its nose at a column of the light, the lens beside it."""
    head, _ = generic_head()
    camera, turned = frame_head(head, size, yaw), rotate(light, nose)
    return stock_picture(head, camera, "medium", turned, paths, seed, FINE, part=part)


# Pictures


def compare_pictures(scenes: Path, work: Path, paths: int, noses: int) -> dict[str, Any]:
    """Compare pictures of views with renders, two seeds each, rendering missing ones.

    All saved seeds count: noise may hide whether a picture is right.
    """
    head, rows = load_head(), []
    select_variant("llvm")
    for column in NOSES[:noses]:
        for place in PLACES:
            light = light_of(scenes, place)
            seen = rotate(as_placed(light, FINE[0]), column)
            for yaw in SHOWN:
                renders = []
                for seed in itertools.count():
                    file = work / f"picture-{place}-{paths}-{yaw:g}-{column}-{seed}.npy"
                    if seed >= SEEDS and not file.exists():
                        break
                    make = partial(render_picture, light, yaw, column, 100, paths, seed)
                    made = kept(file, make)
                    renders.append(made.reshape(-1, 3).astype(np.float64))
                view = head.views.at(yaw, head.pack.styles).transport
                # At the outline stock Mitsuba shows the background behind the head.
                whole = view.face & (view.coverage > 0.999)
                ours = render(view, seen)[whole].astype(np.float64)
                theirs = np.stack([each[view.pixels][whole] for each in renders])
                nose = turn_of_index(column)
                about = {"place": place, "yaw_deg": yaw, "turn_deg": wrap(nose + yaw)}
                rows.append({**about, "nose_deg": nose, **apart(ours, theirs)})
                print(rows[-1], flush=True)
    return {"paths_per_pixel": paths, "seeds": SEEDS, "summary": over_pictures(rows), "rows": rows}


def apart(ours: Float64, theirs: Float64) -> dict[str, Any]:
    """Return the difference of a picture from renders, beyond their noise.

    Args:
        ours: (P, 3) float64. Linear, of whole pixels of the head.
        theirs: (n, P, 3) float64. Renders with different seeds.

    Returns:
        ``ratio``: mean colour over the renders', by channel; ``square``: mean square difference
        over mean square, free of the renders' noise, possibly below 0; ``rmse`` and
        ``rmse_of_mean``:
        its root, relative to RMS and to mean; ``noise``: of one render.
    """

    def free_of_noise(values: Float64) -> Float64:
        """Return the mean of the products of all pairs: noise of two renders is independent."""
        pairs = len(values) * (len(values) - 1)
        return np.asarray((values.sum(0) ** 2 - (values**2).sum(0)) / pairs)

    power = float(free_of_noise(theirs).mean())
    products = free_of_noise(ours - theirs).mean(axis=1)
    square, error = float(products.mean()), float(products.std() / np.sqrt(len(products)))
    rmse = float(np.sqrt(max(square, 0.0)))
    noise = float(np.sqrt(theirs.var(axis=0, ddof=1).mean() / power))
    return {
        "seeds": len(theirs),
        "ratio": np.round(ours.mean(axis=0) / theirs.mean(axis=(0, 1)), 4).tolist(),
        "square": square / power,
        "square_error": error / power,
        "rmse": round(rmse / np.sqrt(power), 4),
        "rmse_of_mean": round(rmse / float(theirs.mean()), 4),
        "noise": round(noise, 4),
    }


def over_pictures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Combine all pictures of a place, where noise hides less than in one."""
    found: dict[str, Any] = {}
    for place in ("all", *PLACES):
        some = [row for row in rows if place in ("all", row["place"])]
        if not some:
            continue
        off = np.abs([np.subtract(row["ratio"], 1.0) for row in some])
        square = float(np.mean([row["square"] for row in some]))
        error = float(np.sqrt(np.sum(np.square([r["square_error"] for r in some])))) / len(some)
        found[place] = {
            "pictures": len(some),
            "worst_colour": round(float(off.max()), 4),
            "rmse": round(float(np.sqrt(max(square, 0.0))), 4),
            "rmse_2_sigma": round(float(np.sqrt(max(square + 2 * error, 0.0))), 4),
            "worst_rmse": max(row["rmse"] for row in some),
        }
    return found


# Search


def halved(view: Transport) -> Transport:
    """Return the same view with half the pixels along each side, each the mean of four."""
    size = view.size // 2
    where = _block(view)
    pixels = np.unique(where).astype(np.int32)
    basis = np.stack([_sums(where, values.T).T for values in view.pixel_basis]) / 4
    return replace(
        view,
        header=replace(view.header, picture=size),
        pixels=pixels,
        coverage=(_sums(where, view.coverage[None])[0] / 4).astype(np.float32),
        pixel_basis=basis.astype(np.float32),
    )


def _block(view: Transport) -> NDArray[np.intp]:
    """Return the pixel of the smaller picture that contains each pixel, (P,)."""
    size = view.size
    return np.asarray(view.pixels // size // 2 * (size // 2) + view.pixels % size // 2, np.intp)


def _sums(where: NDArray[np.intp], values: NDArray[Any]) -> Float64:
    """Return sums of (n, P) values over the pixels of each block, (n, p)."""
    rows = np.unique(where, return_inverse=True)[1]
    return np.stack([np.bincount(rows, weights=each) for each in values])


def search_files(work: Path, place: str, paths: int, yaw: float, seed: int) -> list[Path]:
    """Return the files of a place's renders from one side, by column of the nose."""
    return [work / f"search-{place}-{paths}-{yaw:g}-{k:02d}-{seed}.npy" for k in range(TURNS)]


def render_search(scenes: Path, work: Path, paths: int) -> None:
    """Render missing pictures, place by place, so that finished ones can be compared."""
    select_variant("llvm")
    head = load_head()
    parts = [face_part(head, yaw) for yaw in head.yaws]
    for place in PLACES:
        light = light_of(scenes, place)
        for number, (yaw, part) in enumerate(zip(head.yaws, parts, strict=True)):
            for seed in range(SEEDS):
                for k, file in enumerate(search_files(work, place, paths, yaw, seed)):
                    own = seed + SEEDS * (k + TURNS * number)
                    kept(file, partial(render_picture, light, yaw, k, SMALL, paths, own, part))
            print(f"{place} yaw {yaw:g} done", flush=True)


def face_part(head: Head, yaw: float) -> tuple[slice, slice]:
    """Return rows and columns for match in the small pictures, with a margin."""
    view, _, region = head.seen_at(yaw)
    small = halved(view)
    judged = np.zeros((SMALL, SMALL))
    judged.flat[small.pixels] = _sums(_block(view), region[None])[0]
    rows, columns = (np.flatnonzero(judged.any(axis=axis)) for axis in (1, 0))
    row, column = (
        slice(max(int(each[0]) - BESIDE, 0), min(int(each[-1]) + 1 + BESIDE, SMALL))
        for each in (rows, columns)
    )
    return row, column


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Match of some styles by yaw and azimuth of the nose.

    Attributes:
        ours: (Y, S, 64) float64. From the program's search.
        own: (Y, S, 64) float64. Of the program's own pictures, at the size of the renders.
        theirs: (Y, S, 64) float64. Of the renders, free of the bias of noise.
        seeds: (2, Y, S, 64) float64. The same of each seed alone.
        counts: (Y, S) bool. Yaws at which enough of the style's areas is visible.
        answers: The program's answer for each style: index of the yaw, turn of the nose.
    """

    yaws: tuple[float, ...]
    front: StyleMeasures
    ours: Float64
    own: Float64
    theirs: Float64
    seeds: Float64
    counts: Bools
    answers: tuple[tuple[int, int], ...]


def matches(scenes: Path, work: Path, paths: int, place: str, head: Head) -> Matches:
    """Measure a place whose renders are complete."""
    light = as_placed(light_of(scenes, place), FINE[0])
    chosen = [head.pack.index(name) for name in STYLES]
    seen, tables = head.pack.project(light), tables_of(head)
    front = measure(head.pack, curves(head.pack.tables, seen))
    by_yaw = match_curves(head.pack, tables, seen, front)
    rendered = [
        _rendered(head, yaw, light, [search_files(work, place, paths, yaw, s) for s in range(2)])
        for yaw in head.yaws
    ]
    own, theirs, seeds = (np.stack(each) for each in zip(*rendered, strict=True))
    told = {one.name: one for one in solve_lens(head.pack, tables, light, LensWish("auto"))}
    return Matches(
        head.yaws,
        StyleMeasures(*(getattr(front, name)[chosen] for name in StyleMeasures.__slots__)),
        np.stack([by_yaw[yaw][0][chosen] for yaw in head.yaws]),
        own,
        theirs,
        np.moveaxis(seeds, 1, 0),
        seen_styles(head.pack, tables, head.yaws)[:, chosen],
        tuple((head.yaws.index(told[n].yaw_deg), told[n].turn_index) for n in STYLES),
    )


def tables_of(head: Head) -> list[ViewTables]:
    """Return the search tables of all views of a head."""
    pack, views = head.pack, head.views
    return [view_tables(pack, views.at(yaw, pack.styles), views.shape) for yaw in views.parts]


def seen_styles(pack: StylePack, tables: list[ViewTables], yaws: tuple[float, ...]) -> Bools:
    """Return whether enough of each style's areas is visible at each yaw, (Y, S)."""
    twins = [mirror_index(pack.styles, style) for style in pack.styles]
    rows = [row if twin is None else twin for row, twin in enumerate(twins)]
    counts = {0.0: np.ones(len(pack.styles), bool)}
    for view in tables:
        counts |= {view.yaw_deg: view.counts, -view.yaw_deg: view.counts[rows]}
    return np.stack([counts[yaw] for yaw in yaws])


def _rendered(
    head: Head, yaw: float, light: NDArray[np.float32], files: list[list[Path]]
) -> tuple[Float64, Float64, Float64]:
    """Return match of the program's pictures and the renders, (S, 64), and per seed (2, S, 64)."""
    view, targets, region = head.seen_at(yaw)
    small, where = halved(view), _block(view)
    chosen = [head.pack.index(name) for name in STYLES]
    targets, region = _sums(where, targets[chosen]) / 4, _sums(where, region[None])[0] / 4
    styles = [head.pack.styles[row] for row in chosen]
    regions = [judged_region(style, small, region) for style in styles]
    weights = np.stack([region_weights(*pair) for pair in zip(targets, regions, strict=True)])
    own = np.stack([luminance(render(small, rotate(light, k))) for k in range(TURNS)])
    twice = np.stack([own, own]).astype(np.float64)
    pictures = np.array(
        [[brute_force.head_alone(np.load(file), small) for file in row] for row in files]
    )
    quality, match = brute_force.curves(pictures, weights, region)
    alone = [brute_force.curves(np.stack([p, p]), weights, region)[0] for p in pictures]
    by_seed = np.stack([match * each / quality for each in alone])
    return (
        brute_force.curves(twice, weights, region)[1],
        brute_force.band_limited(match),
        brute_force.band_limited(by_seed),
    )


def compare_search(scenes: Path, work: Path, paths: int) -> dict[str, Any]:
    """Compare the program's best turn and yaw with the best of the renders, place by place."""
    head, rows = load_head(), []
    for place in PLACES:
        if all(
            file.exists()
            for yaw in head.yaws
            for seed in range(SEEDS)
            for file in search_files(work, place, paths, yaw, seed)
        ):
            rows += list(_pairs(place, matches(scenes, work, paths, place, head)))
    for row in rows:
        for kind in ("match_alone", "rule"):
            if not row[kind]["met"]:
                which = row["place"], row["style"]
                row[kind]["again"] = again(scenes, work, paths, *which, row[kind])
    return {
        "paths_per_pixel": paths,
        "seeds": SEEDS,
        "picture": SMALL,
        "yaws": list(head.yaws),
        "band": brute_force.BAND,
        "summary": over_pairs(rows),
        "rows": rows,
    }


def _pairs(place: str, found: Matches) -> Iterator[dict[str, Any]]:
    """Yield each style of a place, by match alone and by the program's rule."""
    for row, style in enumerate(STYLES):
        ours, theirs, seeds = found.ours[:, row], found.theirs[:, row], found.seeds[:, :, row]
        is_open = np.repeat(found.counts[:, row, None], TURNS, axis=1)
        here, span = (theirs, seeds), float(np.ptp(theirs[is_open]))
        noise = float(np.sqrt(np.mean((seeds[0] - seeds[1])[is_open] ** 2)) / 2)
        own = found.own[:, row] - ours
        yield {
            "place": place,
            "style": style,
            "range": round(span, 2),
            "noise": round(noise, 2),
            "off": round(float(np.sqrt(np.mean((ours - theirs)[is_open] ** 2))), 2),
            "off_by_size": round(float(np.sqrt(np.mean(own[is_open] ** 2))), 2),
            "match_alone": _pair(found.yaws, _best(ours, is_open), *here, is_open, span),
            "rule": _pair(
                found.yaws,
                found.answers[row],
                *here,
                _by_rule(found.front, row, theirs, is_open),
                span,
            ),
        }


def _by_rule(front: StyleMeasures, row: int, match: Float64, is_open: Bools) -> Bools:
    """Return the pairs of the best grade, among which the program's rule chooses, (Y, 64)."""
    found, grades = np.zeros_like(is_open), []
    for yaw, some in enumerate(is_open):
        measured = replace(front[row], match=match[yaw], contrast=np.ones(TURNS))
        choice = choose(measured, "picture", LIMITS, some)
        found[yaw] = choice.eligible & some
        grades.append(int(choice.grade) if some.any() else -1)
    return np.asarray(found & (np.array(grades) == max(grades))[:, None])


def _pair(
    yaws: tuple[float, ...],
    chosen: tuple[int, int],
    theirs: Float64,
    seeds: Float64,
    allowed: Bools,
    span: float,
) -> dict[str, Any]:
    """Compare a pair of yaw and nose with the best permitted pair of the renders."""
    best = _best(theirs, allowed)
    steps = abs(short_way(chosen[1] - best[1])), abs(yaws[chosen[0]] - yaws[best[0]]) / YAW_STEP
    crossed = [other[_best(one, allowed)] - other[chosen] for one, other in (seeds, seeds[::-1])]
    return {
        "chosen": [turn_of_index(chosen[1]), yaws[chosen[0]]],
        "best": [turn_of_index(best[1]), yaws[best[0]]],
        "steps": [int(steps[0]), round(steps[1])],
        "points": round(float(theirs[best] - theirs[chosen]), 2),
        "given_up": round(float(theirs[best] - theirs[chosen]) / span, 4),
        "given_up_crossed": round(float(np.mean(crossed)) / span, 4),
        "met": bool(max(steps) <= 1 or theirs[best] - theirs[chosen] <= GIVEN_UP * span),
    }


def again(
    scenes: Path, work: Path, paths: int, place: str, style: str, pair: dict[str, Any]
) -> dict[str, Any]:
    """Compare the two pairs alone, with enough seeds that noise no longer decides.

    The largest of 448 noisy matches exceeds its true value by about their noise.
    """
    select_variant("llvm")
    head, light, matches = load_head(), light_of(scenes, place), []
    row = head.pack.index(style)
    for nose, yaw in (pair["chosen"], pair["best"]):
        k, part, renders = round(nose / (360 / TURNS)) % TURNS, face_part(head, yaw), []
        for seed in range(AGAIN):
            file = work / f"again-{place}-{paths}-{yaw:g}-{k:02d}-{seed}.npy"
            own = 1000 + seed + 100 * k
            renders.append(
                kept(file, partial(render_picture, light, yaw, k, SMALL, paths, own, part))
            )
        view, targets, region = head.seen_at(yaw)
        small, where = halved(view), _block(view)
        region = _sums(where, region[None])[0] / 4
        judged = judged_region(head.pack.styles[row], small, region)
        weights = region_weights(_sums(where, targets[[row]])[0] / 4, judged)[None]
        seen = np.stack(
            [brute_force.head_alone(each.astype(np.float64), small) for each in renders]
        )
        halves = np.stack([seen[::2].mean(axis=0), seen[1::2].mean(axis=0)])[:, None]
        matches.append(float(brute_force.curves(halves, weights, region)[1][0, 0]))
    points = matches[1] - matches[0]
    given_up = points / pair["points"] * pair["given_up"]
    return {
        "seeds": AGAIN,
        "matches": [round(each, 2) for each in matches],
        "points": round(points, 2),
        "given_up": round(given_up, 4),
        "met": given_up <= GIVEN_UP,
    }


def short_way(steps: int) -> int:
    """Return the steps of the nose by the shorter way."""
    return (steps + TURNS // 2) % TURNS - TURNS // 2


def _best(match: Float64, allowed: Bools) -> tuple[int, int]:
    """Return the yaw and nose of the largest permitted match."""
    at = int(np.where(allowed, match, -np.inf).argmax())
    return at // TURNS, at % TURNS


def over_pairs(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the number of pairs that meet the target, and the worst of them."""
    return {
        kind: {
            "pairs": len(rows),
            "met": sum(row[kind]["met"] for row in rows),
            "met_or_again": sum(
                row[kind].get("again", row[kind])["met"] or row[kind]["met"] for row in rows
            ),
            "within_one_step": sum(max(row[kind]["steps"]) <= 1 for row in rows),
            "worst_given_up": max((row[kind]["given_up"] for row in rows), default=0.0),
        }
        for kind in ("match_alone", "rule")
    }
