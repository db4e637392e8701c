"""Rebuild what portraits from aside are drawn from: ``resources/portraits/*-aside.npz``.

    python scripts/build_portraits_aside.py [--heads NAME ...] [--paths N] [--work FOLDER]

Needs the heads, skins and hair of build_portraits.py, and LLVM (see CONTRIBUTING). What is done is
kept in the folder for work, and taken from there.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from build_portraits import HEADS, SEED, SHADE_STEP
from scipy.spatial import cKDTree

from app.core.baking.exposure import Points, place_points
from app.core.baking.kernel_lanes import select_variant
from app.core.baking.scene import build_scene, load_head
from app.core.baking.skin import find_skin
from app.core.base.paths import resources
from app.core.portrait.head_views import YAWS
from app.core.portrait.portrait_file import HAIRS, load_portrait
from app.core.portrait.portrait_head import PortraitHead
from app.core.portrait.turned_portrait import PLACE_STEP
from scenes.portraits.aside import (
    Aside,
    View,
    all_patches,
    aside_skin,
    best_views,
    colours_and_pores,
    find_aside,
    joined,
)
from scenes.portraits.detail import (
    Detail,
    cover,
    detailed_scene,
    follow,
    in_common,
    shortened,
    smoothed_colours,
)
from scenes.portraits.files import save_aside, save_hair_aside, save_skin
from scenes.portraits.light import Nodes, eye_colours, horizon, limited, seen_nodes
from scenes.portraits.scene import look, portrait_frame

_QUALITY = 90
_ROUNDED = 1e-4
_KEPT, _RANK, _STEPS = 32, 10, 21
_COLOURS = 64 / 3
_BLUR = 1.0
_BARELY = 0.01


def main() -> None:
    """Bake what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--heads", nargs="+", default=list(HEADS))
    parser.add_argument("--paths", type=int, default=8192)
    parser.add_argument("--hair-paths", type=int, default=256)
    parser.add_argument("--tones", nargs="*", help="skins; all by default")
    parser.add_argument("--cuts", nargs="*", default=list(HAIRS))
    parser.add_argument("--work", type=Path, required=True, help="folder for what took long")
    parser.add_argument("-o", type=Path, default=resources() / "portraits")
    args = parser.parse_args()
    select_variant("llvm")
    args.o.mkdir(parents=True, exist_ok=True)
    for name in args.heads:
        _bake(name, args)


def _bake(name: str, args: argparse.Namespace) -> None:
    started = time.perf_counter()

    def say(what: str) -> None:
        print(f"{name}{what}: {time.perf_counter() - started:.0f} s", flush=True)

    portrait = load_portrait(name, "medium")
    assert portrait is not None
    head = portrait[0]
    args.work.mkdir(parents=True, exist_ok=True)
    aside, scene = found_aside(name, head, args.work / f"{name}-hidden.npz")
    say(f", {aside.count} nodes more are seen, {len(aside.hidden.positions)} hidden")
    labels = all_patches(aside, head)
    sky = limited(horizon(scene, aside.extra), aside.extra)
    _save(name, aside, labels, scene, sky, args.o)
    say("")
    for cut in args.cuts:
        _dress(name, cut, aside, head, sky, args)
        say(f", {cut}")
    traced = Nodes(aside.shown.positions[aside.traced], aside.shown.normals[aside.traced])
    eye = np.concatenate([head.nodes.eye[: aside.front], aside.eye[: aside.count]])[aside.traced]
    colours = np.where(eye[:, None], eye_colours(aside.mesh, traced), 0).astype(np.float32)
    counts = tuple(int(count) for count in labels.max(axis=0) + 1)
    for tone in HEADS[name] if args.tones is None else args.tones:
        skin = aside_skin(aside, labels, counts, find_skin(tone), args.paths, colours)
        save_skin(args.o / f"{name}-{tone}-aside.npz", skin)
        say(f", {tone}")


def found_aside(name: str, head: PortraitHead, work: Path) -> tuple[Aside, Any]:
    """Find the nodes that views show, beside those of the head's own file; and the scene."""
    files = (resources() / "heads" / f"{name}{end}.ply" for end in ("", "-eyes"))
    mesh = load_head(name, *files)
    frame, camera = portrait_frame(mesh)
    scene = build_scene(mesh, find_skin("medium"), camera)
    points = place_points(scene, mesh, SEED)
    samples = look(scene, mesh, frame, points)
    seen, _, _ = seen_nodes(points, samples)
    nodes, straight = known_nodes(seen, points, head), head.visible.straight
    kept = Nodes(**np.load(work)) if work.exists() else None
    aside = find_aside(mesh, points, nodes, straight, YAWS, scene, kept)
    np.savez(work, positions=aside.hidden.positions, normals=aside.hidden.normals)
    return aside, scene


def known_nodes(seen: Nodes, points: Points, head: PortraitHead) -> Nodes:
    """Where the nodes of a head's file are, found again by their normals."""
    side = np.where(points.positions[:, :1] > 0, np.array([-1, 1, 1], np.float32), 1)
    away, found = cKDTree(points.normals * side).query(head.nodes.normals[seen.count :])
    same = np.abs(seen.normals - head.nodes.normals[: seen.count]).max() < _ROUNDED
    if len(head.visible.index) != seen.count or not same or away.max() > _ROUNDED:
        raise SystemExit("bake the head with build_portraits.py first")
    return joined(seen, Nodes((points.positions * side)[found], (points.normals * side)[found]))


def _dress(
    name: str,
    cut: str,
    aside: Aside,
    bald: PortraitHead,
    sky: np.ndarray,
    args: argparse.Namespace,
) -> None:
    """Bake one cut of hair with brows, lashes and collar."""
    known = load_portrait(name, "medium", cut)
    assert known is not None
    scene, names = detailed_scene(name, f"hair-{cut}", aside.mesh)
    details, short, wholes, seen = [], [], [], np.zeros(aside.nodes.count, bool)
    for view in aside.views:
        file = args.work / f"{name}-{cut}-{view.camera.yaw_deg:g}.npz"
        if not file.exists():
            _follow(view, scene, names, args.hair_paths, file)
        kept = dict(np.load(file))
        # In place of its light the colour, which is all that is still needed.
        details.append(Detail(view.frame.shape, kept["pixel"], kept["cover"], kept["colour"]))
        short.append((kept["basis"], kept["cells"]))
        wholes.append(kept["whole"])
        seen[_bare(aside, view, kept)] = True
    bases, cells = in_common(details, short, _RANK, _BLUR)
    views: dict[str, dict[str, np.ndarray]] = {}
    for view, one, basis, whole in zip(aside.views, details, bases, wholes, strict=True):
        covered = closed(bald_share(view).flat[one.pixel], one.cover, whole)
        views[f"_{view.camera.yaw_deg:g}"] = {
            "pixel": one.pixel,
            "cover": covered,
            "colour": coarse(smoothed_colours(one, one.light, _BLUR)),
            "basis": basis * np.minimum(covered / one.cover, 2)[:, None],
        }
    path = args.o / f"{name}-hair-{cut}-aside.npz"
    save_hair_aside(path, _shade(aside, bald, known[0], sky, scene, seen), cells, views, _STEPS)


def bald_share(view: View) -> np.ndarray:
    """Share of each pixel that a bald head covers, by its samples."""
    share = np.zeros(view.frame.shape, np.float32)
    single = int(view.samples.inside.sum())
    share[view.samples.inside] = view.samples.valid[:single]
    share[view.samples.edge] = view.samples.valid[single:].reshape(-1, 4).mean(axis=1)
    return share


def closed(bald: np.ndarray, hair: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Share of pixels that hair covers, with the gaps that few samples leave to the face.

    Through a gap between a cheek and the hair behind it a bright window would be seen.

    Args:
        whole: Share that head or hair covers.
    """
    return np.asarray(np.where(bald > 0, np.maximum(hair, whole - bald), hair))


def coarse(colours: np.ndarray) -> np.ndarray:
    """Colours in steps that nobody sees on hair, and that pack small."""
    return np.asarray(np.round(colours * _COLOURS) / _COLOURS)


def _follow(view: View, scene: Any, names: tuple[str, ...], paths: int, file: Path) -> None:
    covered, whole = (each.ravel() for each in cover(scene, view.frame, names))
    pixel = np.flatnonzero(covered > 0)
    light = follow(scene, view.frame, names, pixel, paths)
    found = Detail(view.frame.shape, pixel, covered[pixel], light)
    colour, basis, cells = shortened(found, _KEPT)
    whole, hair = whole[pixel], found.cover
    np.savez(file, pixel=pixel, cover=hair, whole=whole, colour=colour, basis=basis, cells=cells)


def _bare(aside: Aside, view: View, hair: dict[str, np.ndarray]) -> np.ndarray:
    """Nodes that a view shows once hair covers what it covers."""
    covered = np.zeros(view.frame.shape, np.float32)
    covered.flat[hair["pixel"]] = hair["cover"]
    samples = view.samples
    pixel = np.concatenate(
        [np.flatnonzero(samples.inside), np.repeat(np.flatnonzero(samples.edge), 4)]
    )
    weight = samples.weights * (samples.valid * (1 - covered.ravel()[pixel]))[:, None]
    node = view.three % aside.shown.count
    return np.flatnonzero(np.bincount(node.ravel(), weight.ravel(), aside.nodes.count) > _BARELY)


def _shade(
    aside: Aside,
    bald: PortraitHead,
    dressed: PortraitHead,
    sky: np.ndarray,
    scene: Any,
    seen: np.ndarray,
) -> np.ndarray:
    """How much less of the sky nodes see that hair hides from the front, (N, 32, 64) int8."""
    front, count = aside.front, aside.count
    known = [(head.nodes.horizon.transpose(2, 0, 1)) for head in (bald, dressed)]
    free = np.concatenate([known[0][:front], sky[:count], known[0][front:], sky[count:]])
    out = np.zeros(free.shape, np.int8)
    done = np.zeros(len(free), bool)
    done[:front] = (known[0] != known[1])[:front].any(axis=(1, 2))
    wanted = np.flatnonzero(seen & ~done)
    nodes = Nodes(aside.nodes.positions[wanted], aside.nodes.normals[wanted])
    less = limited(horizon(scene, nodes), nodes).astype(int) - free[wanted]
    out[wanted] = (np.round(less / SHADE_STEP) * SHADE_STEP).astype(np.int8)
    return out


def _save(
    name: str, aside: Aside, labels: np.ndarray, scene: Any, sky: np.ndarray, folder: Path
) -> None:
    extra = aside.extra
    front, count, old = aside.front, aside.count, aside.old.count
    new = np.concatenate([labels[front : front + count], labels[front + count + old :]])
    _, straight = best_views(aside)
    # From the height of the camera, or they would not fit into 16 bits.
    level = np.array([0, aside.views[0].frame.origin[1], 0], np.float32)
    places = np.round((aside.nodes.positions - level) / PLACE_STEP)
    assert np.abs(places).max() < 1 << 15
    arrays = {
        "positions": places.astype(np.int16),
        "normals": np.round(extra.normals * 32767).astype(np.int16),
        "horizon": sky,
        "eye": np.packbits(aside.eye),
        "patches": new.astype(np.uint16),
        "straight": straight.astype(np.float16),
        "again": aside.traced[: len(aside.traced) - count].astype(np.uint16),
    }
    frames = {}
    for view in aside.views:
        end = f"_{view.camera.yaw_deg:g}"
        origin = [float(x) for x in np.array(view.frame.origin) - level]
        frames[end] = {"origin": origin, "top": view.frame.top, "step": view.frame.step}
        arrays[f"three{end}"] = view.three
        pixels = np.stack([view.samples.inside, view.samples.edge])
        arrays[f"pixels{end}"] = np.packbits(pixels, axis=-1)
        arrays[f"albedo{end}"], arrays[f"detail{end}"] = colours_and_pores(name, view, scene)
    save_aside(folder / f"{name}-aside.npz", arrays, {"frames": frames}, _QUALITY)


if __name__ == "__main__":
    main()
