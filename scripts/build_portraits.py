"""Rebuild ``resources/portraits/``: what portraits at full size are drawn from.

    python scripts/build_portraits.py [--heads NAME ...] [--paths N] [-o FOLDER]

Takes some ten minutes for each head and skin on two cores, and needs LLVM (see CONTRIBUTING).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from app.core.baking.exposure import Points, place_points
from app.core.baking.kernel_lanes import select_variant
from app.core.baking.random_walk import (
    PROFILE_BINS,
    SceneTables,
    fit_profile,
    scene_tables,
    trace_profile,
)
from app.core.baking.scene import HeadMesh, build_scene, load_head
from app.core.baking.skin import find_skin
from app.core.base.paths import resources
from app.core.portrait.portrait_file import HAIRS
from app.core.portrait.portrait_head import Hair, PortraitHead, PortraitSkin, SeenNodes, SkinNodes
from scenes.head_detail.bump import oiliness, skin_bump
from scenes.head_detail.colours import eye_albedo, relative_albedo
from scenes.portraits.detail import Detail, compressed, cover, detailed_scene, follow
from scenes.portraits.files import save_hair, save_head, save_skin
from scenes.portraits.light import (
    FILM,
    Nodes,
    eye_colours,
    films,
    hidden_nodes,
    horizon,
    limited,
    nearest,
    seen_nodes,
    traced,
)
from scenes.portraits.patches import Shares, packed, patches
from scenes.portraits.scene import Frame, Samples, look, portrait_frame
from scenes.portraits.sheen import mirrored

HEADS = {"generic": ("medium", "light", "dark"), "female": ("medium",), "male": ("medium",)}
_PILOT = 128
SEED = 3
_HAIR_PATHS = 512
_RANK = 14
_BARELY = 0.05
SHADE_STEP = 12
_BROKEN, _STEPS = 5.0, 16


def main() -> None:
    """Bake what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--heads", nargs="+", default=list(HEADS))
    parser.add_argument("--paths", type=int, default=8192)
    parser.add_argument("--cuts", nargs="*", default=list(HAIRS))
    parser.add_argument("--no-skins", action="store_true", help="the heads alone, in a minute")
    parser.add_argument("-o", type=Path, default=resources() / "portraits")
    args = parser.parse_args()
    select_variant("llvm")
    args.o.mkdir(parents=True, exist_ok=True)
    for name in args.heads:
        _bake(name, 0 if args.no_skins else args.paths, args.cuts, args.o)


def _bake(name: str, paths: int, cuts: Sequence[str], folder: Path) -> None:
    started = time.perf_counter()

    def say(what: str) -> None:
        print(f"{name}{what}: {time.perf_counter() - started:.0f} s", flush=True)

    files = (resources() / "heads" / f"{name}{end}.ply" for end in ("", "-eyes"))
    head = load_head(name, *files)
    frame, camera = portrait_frame(head)
    scene = build_scene(head, find_skin("medium"), camera)
    points = place_points(scene, head, SEED)
    samples = look(scene, head, frame, points)
    seen, three, _ = seen_nodes(points, samples)
    film = films(frame, scene, seen, samples, three)
    tables = scene_tables(scene, head, find_skin("medium"), points, FILM)
    nodes = with_hidden(seen, points, tables, film)
    near, _ = nearest(nodes, points.positions, points.normals)
    labels, counts = patches(nodes)
    eye = np.zeros(nodes.count, bool)
    eye[np.unique(three[samples.valid & ~samples.skin])] = True
    say(f", {seen.count} of {nodes.count} nodes seen")
    kept = limited(horizon(scene, nodes), nodes)
    skin_nodes = SkinNodes(
        normals=nodes.normals,
        horizon=np.ascontiguousarray(kept.transpose(1, 2, 0)),
        eye=eye,
        profile=_profile(tables, film),
        patches=labels,
    )
    portrait = _portrait(name, scene, frame, skin_nodes, seen, samples, three)
    save_head(folder / f"{name}.npz", portrait)
    for hair in cuts:
        where = samples, portrait.glass, three
        _dress(name, hair, head, frame, nodes, seen, kept, where, folder)
        say(f", {hair}")
    colours = eye_colours(head, seen)
    for tone in HEADS[name] if paths else ():
        skin = find_skin(tone)
        tables = scene_tables(build_scene(head, skin, camera), head, skin, points, FILM)
        shares = _shares(tables, film, near, paths)
        done = _with_eyes(packed(shares, seen.count, labels, counts), eye, colours)
        save_skin(folder / f"{name}-{tone}.npz", done)
        say(f", {tone}")


def with_hidden(seen: Nodes, points: Points, tables: SceneTables, film: np.ndarray) -> Nodes:
    """Add nodes that no pixel shows but whose light comes through, by a few paths."""
    mass = np.zeros(points.count, np.float32)
    for _, share in traced(tables, film[::4], _PILOT, 5):
        mass += share.sum(axis=(0, 2))
    return _with(seen, points, hidden_nodes(seen, points, mass))


def _profile(tables: SceneTables, film: np.ndarray) -> np.ndarray:
    bins = np.zeros((PROFILE_BINS, 3))
    some = film[::25]
    for start in range(0, len(some), 96):
        bins += trace_profile(tables, some[start : start + 96], 512, 999 + start)
    return np.asarray(fit_profile(bins).mean(axis=0), np.float32)


def _portrait(
    name: str,
    scene: Any,
    frame: Frame,
    nodes: SkinNodes,
    seen: Nodes,
    samples: Samples,
    three: np.ndarray,
) -> PortraitHead:
    """What the camera sees of the nodes, and the samples of the picture."""
    gain, way = mirrored(scene, frame, seen.positions, seen.normals, skin=True)
    glass = np.flatnonzero(samples.valid & ~samples.skin)
    glass_gain, glass_way = mirrored(
        scene, frame, samples.positions[glass], samples.normals[glass], skin=False
    )
    view = np.asarray(frame.origin, np.float32) - seen.positions
    eye = nodes.eye[: seen.count]
    return PortraitHead(
        nodes,
        SeenNodes(
            index=np.arange(seen.count),
            normals=seen.normals,
            view=view / np.linalg.norm(view, axis=1, keepdims=True),
            gain=np.where(eye, 0, gain),
            way=way,
            eye=eye,
            passes=np.ones((seen.count, 3), np.float32),
        ),
        inside=samples.inside,
        edge=samples.edge,
        three=three,
        weights=samples.weights * samples.valid[:, None],
        albedo=_colours(name, samples),
        detail=_pores(name, samples),
        glass=glass,
        glass_gain=glass_gain,
        glass_way=glass_way,
    )


def _colours(name: str, samples: Samples) -> np.ndarray:
    """Colour of each sample by that of the skin, or of the eye's mesh."""
    place, normal = (a.astype(np.float64) for a in (samples.positions, samples.normals))
    kinds = relative_albedo(name, place, normal), eye_albedo(name, place)
    colour = np.where(samples.skin[:, None], *kinds)
    return np.where(samples.valid[:, None], colour, 1).astype(np.float32)


def _pores(name: str, samples: Samples) -> np.ndarray:
    """How much of its nodes' sheen each sample has: less in pores, more where oily or wet."""
    place, normal = (a.astype(np.float64) for a in (samples.positions, samples.normals))
    slope = np.linalg.norm(skin_bump(place, normal, name) - normal, axis=1)
    shown = samples.skin & samples.valid
    broken = np.exp(-_BROKEN * slope)
    # Whoever looks along the skin does not see into its pores.
    straight = np.clip(1.2 * normal[:, 2], 0, 1) ** 2
    broken = 1 + straight * (broken / broken[shown].mean() - 1)
    # In steps that nobody sees, and that pack to two thirds.
    detail = np.round(broken * oiliness(name, place) * _STEPS) / _STEPS
    return np.where(shown, detail, 1).astype(np.float32)


def _dress(
    name: str,
    cut: str,
    head: HeadMesh,
    frame: Frame,
    nodes: Nodes,
    seen: Nodes,
    bald: np.ndarray,
    where: tuple[Samples, np.ndarray, np.ndarray],
    folder: Path,
) -> None:
    """Bake one cut of hair with brows, lashes and collar."""
    scene, names = detailed_scene(name, f"hair-{cut}", head)
    covered, _ = cover(scene, frame, names)
    pixel = np.flatnonzero(covered.ravel() > 0)
    light = follow(scene, frame, names, pixel, _HAIR_PATHS)
    found = Detail(frame.shape, pixel, covered.ravel()[pixel], light)
    colour, basis, cells = compressed(found, _RANK)
    samples, glass, three = where
    gain, _ = mirrored(scene, frame, seen.positions, seen.normals, skin=True)
    glass_gain, _ = mirrored(
        scene, frame, samples.positions[glass], samples.normals[glass], skin=False
    )
    shade = limited(horizon(scene, nodes), nodes).astype(int) - bald
    # Under hair nobody sees whether light comes; and coarse steps pack small.
    shade[: seen.count][_hidden(covered, samples, three, seen.count)] = 0
    shade[seen.count :] = 0
    shade = np.round(shade / SHADE_STEP) * SHADE_STEP
    save_hair(
        folder / f"{name}-hair-{cut}.npz",
        Hair(
            pixel=pixel,
            cover=found.cover,
            colour=colour,
            basis=basis,
            cells=cells,
            shade=np.ascontiguousarray(shade.astype(np.int8).transpose(1, 2, 0)),
            gain=gain,
            glass_gain=glass_gain,
        ),
    )


def _hidden(covered: np.ndarray, samples: Samples, three: np.ndarray, count: int) -> np.ndarray:
    """Shown nodes that no pixel shows once details cover it."""
    pixel = np.concatenate(
        [np.flatnonzero(samples.inside), np.repeat(np.flatnonzero(samples.edge), 4)]
    )
    weight = samples.weights * (samples.valid * (1 - covered.ravel()[pixel]))[:, None]
    return np.bincount(three.ravel(), weight.ravel(), count) < _BARELY


def _with(seen: Nodes, points: Points, extra: np.ndarray) -> Nodes:
    side = np.where(points.positions[extra, :1] > 0, np.array([-1, 1, 1], np.float32), 1)
    return Nodes(
        np.concatenate([seen.positions, points.positions[extra] * side]).astype(np.float32),
        np.concatenate([seen.normals, points.normals[extra] * side]).astype(np.float32),
    )


def _shares(tables: SceneTables, film: np.ndarray, near: np.ndarray, paths: int) -> Shares:
    """Follow paths from every shown node, and add up where their light came in, by node."""
    order = np.argsort(near, kind="stable")
    starts = np.flatnonzero(np.diff(near[order], prepend=-1))
    ids = near[order][starts]
    rows, columns, values = [], [], []
    for start, share in traced(tables, film, paths, 77):
        summed = np.add.reduceat(share[:, order], starts, axis=1)
        row, column = np.nonzero(summed.any(axis=2))
        rows.append(row + start)
        columns.append(ids[column])
        values.append(summed[row, column])
    return Shares(np.concatenate(rows), np.concatenate(columns), np.concatenate(values))


def _with_eyes(skin: PortraitSkin, eye: np.ndarray, colours: np.ndarray) -> PortraitSkin:
    """Add what an eye's own surface scatters: walks note what reaches it by way of skin only."""
    count = skin.source.shape[1]
    own = np.where(eye[:count, None], colours, 0).astype(np.float32)
    return PortraitSkin(
        np.concatenate([skin.source, np.arange(count)[None]]),
        np.concatenate([skin.share, own[None]]),
    )


if __name__ == "__main__":
    main()
