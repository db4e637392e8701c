"""Turns against brute force: the head rendered by stock Mitsuba at each of 64 turns.

Renders five indoor scenes at 64 turns with two seeds (about an hour on two cores; an interrupted
run resumes), then compares the turns that the shipped pack chooses with the best turns of the
rendered pictures and writes the result as JSON.

    python benchmarks/truth/brute_force.py --scenes FOLDER --work FOLDER [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import cv2
import numpy as np

from app.core.baking.kernel_lanes import select_variant
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import luminance
from app.core.solver.solve import solve_all
from app.core.solver.transport import Transport, load_named, load_transport, render
from app.core.solver.turn_choice import Limits
from app.core.solver.weights import region_weights, target_weights
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.stock import (
    INDOORS,
    ROOT,
    as_placed,
    generic_head,
    read_light,
    rotate,
    stock_picture,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.core.solver.turn_choice import Objective

    Weights: TypeAlias = dict[Objective, tuple[NDArray[np.float64], NDArray[np.float64]]]

TURNS = 64
SEEDS = 2
# Harmonics of a curve over the turns that are kept. A face under soft skin changes smoothly with
# the turn: the part of T's own curves above is reported with every pair (`above_band`); noise is
# equal in all harmonics.
BAND = 12
_COMMON = 0.1  # of the power of two renders
# Large enough for the turns; `as_placed` states the light that Mitsuba makes of it.
FINE = (512, 1024)


def render_all(scenes: Path, work: Path, paths: int) -> None:
    """Render all missing pictures."""
    select_variant("llvm")
    head, camera = generic_head()
    work.mkdir(parents=True, exist_ok=True)
    started, made = time.perf_counter(), 0
    for number, name in enumerate(INDOORS):
        light = read_light(scenes / name)
        for turn in range(TURNS):
            for seed in range(SEEDS):
                file = work / kept_name(name, paths, turn, seed)
                if file.exists():
                    continue
                picture = stock_picture(
                    head, camera, "medium", rotate(light, turn), paths, turn * SEEDS + seed, FINE
                )
                partial = file.with_suffix(".part.npy")
                np.save(partial, picture)
                partial.replace(file)
                made += 1
        minutes = (time.perf_counter() - started) / 60
        print(f"{number + 1} of {len(INDOORS)} scenes, {made} pictures, {minutes:.1f} min")


def kept_name(scene: str, paths: int, turn: int, seed: int) -> str:
    """Return the file of one picture; the number of paths is part of its name."""
    return f"{Path(scene).stem}-{paths}-{turn:02d}-{seed}.npy"


def head_alone(picture: NDArray[np.float64], transport: Transport) -> NDArray[np.float64]:
    """Return the luminance of the head's pixels, without the environment at its outline.

    Stock Mitsuba draws the environment where a pixel at the outline is not covered; T does not. It
    is estimated from the nearest pixel that shows only the environment.
    """
    size = transport.size
    coverage = np.zeros(size * size)
    coverage[transport.pixels] = transport.coverage
    beside = (coverage > 0).astype(np.uint8).reshape(size, size)
    _, label = cv2.distanceTransformWithLabels(
        beside, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    grey = luminance(picture).astype(np.float64).ravel()
    behind = np.zeros(int(label.max()) + 1)
    empty = beside.ravel() == 0
    behind[label.ravel()[empty]] = grey[empty]
    alone: NDArray[np.float64] = grey - (1.0 - coverage) * behind[label.ravel()]
    return alone[transport.pixels]


def curves(
    pictures: NDArray[np.float64], weights: NDArray[np.float64], region: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return quality and match of rendered pictures, free of the bias from their noise.

    Args:
        pictures: (SEEDS, TURNS, P) float. Luminance on the head's pixels.
        weights: (S, P) float.
        region: (P,) float. Weight of each pixel, 0 outside the weights.

    Returns:
        quality, match: (S, TURNS) float64. The pictures' norm comes from the product of two seeds,
            whose noise is independent. If the seeds have less than a tenth of their power in
            common, it may vanish, and a tenth is used: match is low there.
    """
    share = region / region.sum()
    quality = weights @ pictures.mean(axis=0).T
    one, two = (p - (p @ share)[:, None] for p in pictures)
    power = (one**2 + two**2) @ region / 2
    norm = np.sqrt(np.maximum((one * two) @ region, _COMMON * power + 1e-30))
    size = np.sqrt((weights**2 / np.maximum(region, 1e-30)).sum(axis=1))
    return quality, 100 * quality / norm / size[:, None]


def weights_of(pack: StylePack, transport: Transport) -> Weights:
    """Return, by objective, the styles' weights on a head's pixels, (S, P), and their region, (P,).

    The paper's are taken over the whole head, those of match over the face.
    """
    targets = luminance(np.asarray(pack.targets, np.float64)).reshape(len(pack.styles), -1)
    whole, face = transport.face, pack.region_on(transport)
    pictures = targets[:, transport.pixels]
    return {
        "paper": (np.stack([target_weights(t, whole) for t in pictures]), whole.astype(float)),
        "picture": (np.stack([region_weights(t, face) for t in pictures]), face),
    }


def band_limited(curves_: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return curves without the harmonics above `BAND`, which are almost pure noise."""
    spectrum = np.fft.rfft(curves_, axis=-1)
    spectrum[..., BAND + 1 :] = 0
    return np.asarray(np.fft.irfft(spectrum, TURNS, axis=-1))


def above_band(curves_: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the RMS of the part that `band_limited` removes, as a share of each curve's range."""
    lost = curves_ - band_limited(curves_)
    return np.asarray(np.sqrt(np.mean(lost**2, axis=-1)) / np.ptp(curves_, axis=-1))


def given_up(curve: NDArray[np.float64], turn: int) -> float:
    """Return the loss of a turn against the best, as a share of the curve's range."""
    return float((curve.max() - curve[turn]) / np.ptp(curve))


def compare(scenes: Path, work: Path, paths: int) -> dict[str, object]:
    """Compare the pack's turns with the rendered pictures' own best turns."""
    transport, pack = load_named("generic"), load_named_pack("generic")
    rows: list[dict[str, Any]] = []
    for name in INDOORS:
        stem = Path(name).stem
        files = [[work / kept_name(name, paths, t, s) for t in range(TURNS)] for s in range(SEEDS)]
        pictures = np.array([[head_alone(np.load(f), transport) for f in row] for row in files])
        rows += _pairs(stem, read_light(scenes / name), pictures, pack, transport)
    worst = {key: max(row[key] for row in rows) for key in ("quality_given_up", "match_given_up")}
    return {
        "transport_sha256": transport.digest,
        "paths_per_pixel": paths,
        "seeds": SEEDS,
        "band": BAND,
        "worst": worst,
        "rows": rows,
    }


def compare_pictures(
    bakes: tuple[Transport, Transport], scenes: Path, work: Path, paths: int
) -> list[dict[str, Any]]:
    """Compare T's pictures with the rendered ones: colour, and error beyond all noise.

    The error of one bake against one seed and that of the other bake against the other seed have
    independent noise, so the mean of their product over all turns contains the errors of both
    bakes.
    """
    whole = bakes[0].face & (bakes[0].coverage > 0.999)
    rows = []
    for name in INDOORS:
        light = as_placed(read_light(scenes / name), FINE[0])
        squares, colours = [], []
        for turn in range(TURNS):
            files = [work / kept_name(name, paths, turn, seed) for seed in range(SEEDS)]
            one, two = (
                np.load(file).reshape(-1, 3)[bakes[0].pixels][whole].astype(np.float64)
                for file in files
            )
            first, second = (
                render(bake, rotate(light, turn))[whole].astype(np.float64) for bake in bakes
            )
            cross = (first - one) * (second - two) + (second - one) * (first - two)
            squares.append(cross.mean() / 2 / (one * two).mean())
            colours.append([(first + second).mean(axis=0), (one + two).mean(axis=0)])
        ours, theirs = np.sum(colours, axis=0)
        error = float(np.std(squares) / np.sqrt(TURNS))
        rows.append(
            {
                "scene": Path(name).stem,
                "colour": float(np.abs(ours / theirs - 1).max()),
                "rmse": float(np.sqrt(max(0.0, np.mean(squares)))),
                "rmse_2_sigma": float(np.sqrt(max(0.0, np.mean(squares) + 2 * error))),
            }
        )
    return rows


def _noise(between: NDArray[np.float64], curve: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the noise of two seeds' mean curve from their difference, as a share of the range."""
    square = np.mean(band_limited(between) ** 2, axis=-1)
    return np.asarray(np.sqrt(square) / 2 / np.ptp(curve, axis=-1))


def _pairs(
    scene: str,
    light: NDArray[np.float32],
    pictures: NDArray[np.float64],
    pack: StylePack,
    transport: Transport,
) -> list[dict[str, Any]]:
    weights = weights_of(pack, transport)
    whole, face = curves(pictures, *weights["paper"]), curves(pictures, *weights["picture"])
    quality, match = band_limited(whole[0]), band_limited(face[1])
    apart, apart_face = (
        np.subtract(*(curves(np.stack([p, p]), *weights[each])[0] for p in pictures))
        for each in ("paper", "picture")
    )
    noise = _noise(apart, quality)
    match_noise = _noise(apart_face * face[1] / face[0], match)
    own = np.stack([luminance(render(transport, rotate(light, k))) for k in range(TURNS)])
    twice = np.stack([own, own]).astype(np.float64)
    own_curves = curves(twice, *weights["paper"])[0], curves(twice, *weights["picture"])[1]
    chosen = {
        objective: solve_all(pack, light, objective=objective, limits=Limits(0.0, 0.0))
        for objective in ("paper", "picture")
    }
    rows: list[dict[str, Any]] = []
    for number, style in enumerate(pack.styles):
        turns = {key: results[number].turn_deg for key, results in chosen.items()}
        index = {key: round(turn / 360 * TURNS) % TURNS for key, turn in turns.items()}
        rows.append(
            {
                "scene": scene,
                "style": style.name,
                "quality_turn_deg": turns["paper"],
                "match_turn_deg": turns["picture"],
                "quality_best_deg": float(np.argmax(quality[number])) * 360 / TURNS,
                "match_best_deg": float(np.argmax(match[number])) * 360 / TURNS,
                "quality_given_up": given_up(quality[number], index["paper"]),
                "match_given_up": given_up(match[number], index["picture"]),
                "quality_noise": float(noise[number]),
                "match_noise": float(match_noise[number]),
                "quality_given_up_unfiltered": given_up(whole[0][number], index["paper"]),
                "match_given_up_unfiltered": given_up(face[1][number], index["picture"]),
                "quality_above_band": float(above_band(own_curves[0][number])),
                "match_above_band": float(above_band(own_curves[1][number])),
            }
        )
    return rows


def main() -> None:
    """Render what is missing, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--paths", type=int, default=256)
    parser.add_argument("--second", type=Path, help="a bake with another seed, for the pictures")
    parser.add_argument("--render-only", action="store_true")
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "brute-force.json"
    )
    args = parser.parse_args()
    render_all(args.scenes, args.work, args.paths)
    if not args.render_only:
        result = compare(args.scenes, args.work, args.paths)
        if args.second is not None:
            bakes = load_named("generic"), load_transport(args.second)
            result["pictures"] = compare_pictures(bakes, args.scenes, args.work, args.paths)
        atomic_write_text(args.o, json.dumps(result, indent=1) + "\n")
        print(json.dumps(result["worst"]))


if __name__ == "__main__":
    main()
