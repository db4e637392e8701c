"""Whole portraits of the app against one path trace by stock Mitsuba.

Traces the generic head with short hair, brows, lashes, wet eyes and collar by `volpathmis`, its
skin a scattering medium as in the bake, with the app's own colours. Twelve pictures, each with two
independent seeds. An interrupted `render` resumes, and refines all pictures in turn; `keep` writes
the data for the repository; `compare` compares the app's pictures with them.

    python -m benchmarks.truth.portrait_truth render --places P --work W
    python -m benchmarks.truth.portrait_truth keep|compare|figure --places P
                                                                  --work W
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import select_variant
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import face_exposure, luminance, to_bytes, tone_map
from app.core.environment.environment import read_environment
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.light import portrait_light
from app.core.portrait.portrait_file import load_portrait
from benchmarks.truth.stock import ROOT

Float32: TypeAlias = NDArray[np.float32]
Bools: TypeAlias = NDArray[np.bool_]
PAIRS: Final = tuple(
    (f"{place}_1k.hdr", turn)
    for place, turns in (
        ("quarry_01", (-106, 14, 134)),
        ("rooitou_park", (-106, 14, 134)),
        ("st_fagans_interior", (-60, 60, 180)),
        ("st_peters_square_night", (0, 120, -120)),
    )
    for turn in turns
)
SHOWN: Final = (PAIRS[0], PAIRS[5], PAIRS[7], PAIRS[9])
FIGURE: Final = ROOT / "docs" / "images" / "portrait-truth.webp"
WIDTH: Final = 512
FINE: Final = (1024, 2048)
"""Size to which places are enlarged, so that Mitsuba's rows are right; see `stock.FINE`."""
SEEDS: Final = 2
PASS: Final = 8
"""Samples per pixel in one pass."""
STEP: Final = 192
_SMALL: Final = (cv2.IMWRITE_PNG_COMPRESSION, 9)
BLUR_PX: Final = 1.5
WINDOW: Final = 11
FACE: Final = (slice(200, 520), slice(130, 382))
"""Rows and columns of the face: from the hairline to the chin, ear to ear."""
KEPT: Final = ROOT / "benchmarks" / "results" / "portrait-truth"
ROULETTE: Final = 5
"""Events after which Mitsuba may use Russian roulette; see baking.md."""


def coloured_skin() -> Any:
    """Return the skin's mesh, divided until a vertex has the colour of a pixel.

    A path that leaves the skin has crossed its surface twice: each time it is tinted by the square
    root.
    """
    from app.core.baking.scene import Mesh
    from scenes.head_detail.colours import relative_albedo
    from scenes.head_detail.heads import load
    from scenes.head_detail.surface import refine

    points, normals, faces = refine(load("generic"), 3)
    root = np.sqrt(relative_albedo("generic", points, normals))
    return Mesh(
        points.astype(np.float32), normals.astype(np.float32), faces.astype(np.uint32), root
    )


class Stage:
    """The head in front of Mitsuba, ready for any place."""

    def __init__(self, work: Path) -> None:
        self.mi = select_variant("llvm")
        from app.core.baking.scene import medium, mitsuba_mesh
        from app.core.baking.skin import EYE_COAT, eye_bsdf, find_skin, skin_bsdf
        from benchmarks.truth.portrait_scene import Crop, cropped, details, framed_head
        from scenes.portraits.scene import SHAPE

        load, skin = self.mi.load_dict, find_skin("medium")
        head, _, camera = framed_head()
        assert head.eyes is not None
        dyed = {"type": "mesh_attribute", "name": "vertex_color"}
        surface = load({**skin_bsdf(skin), "specular_transmittance": dyed})
        inside = {"bsdf": surface, "interior": load(medium(skin))}
        crop = Crop(0, (SHAPE[1] - WIDTH) // 2, SHAPE[0], WIDTH)
        parts = details(work / "strands")
        self.parts = {
            "type": "scene",
            "integrator": {
                "type": "volpathmis",
                "rr_depth": ROULETTE,
                "hide_emitters": True,
            },
            "sensor": load(cropped(camera, crop)),
            "skin": mitsuba_mesh("skin", coloured_skin(), inside),
            "eyes": mitsuba_mesh("eyes", head.eyes, {"bsdf": load(eye_bsdf(EYE_COAT))}),
            **{n: load(one) if isinstance(one, dict) else one for n, one in parts.items()},
        }

    def picture(self, place: Path, turn_deg: float, samples: int, seed: int) -> Float32:
        """Return the linear picture on black."""
        from benchmarks.truth.portrait_scene import environment

        light = environment(read_environment(place).radiance, turn_deg, FINE)
        scene = self.mi.load_dict({**self.parts, "light": light})
        return np.array(self.mi.render(scene, spp=samples, seed=seed), np.float32)


def render(work: Path, places: Path, samples: int) -> None:
    """Add passes until every picture of each seed has the requested number of samples per pixel."""
    stage = Stage(work)
    for done in range(0, samples, PASS):
        for number, (place, turn) in enumerate(PAIRS):
            for seed in range(SEEDS):
                file = work / f"{Path(place).stem}-{turn}-{seed}.npz"
                kept = dict(np.load(file)) if file.exists() else {"sum": 0.0, "samples": 0}
                if int(kept["samples"]) > done:
                    continue
                started = time.perf_counter()
                own = 1000 * (done // PASS) + 10 * number + seed
                found = stage.picture(places / place, turn, PASS, own) * PASS
                total = np.asarray(kept["sum"] + found, np.float32)
                np.savez(file.with_suffix(".part.npz"), sum=total, samples=done + PASS)
                file.with_suffix(".part.npz").replace(file)
                seconds = time.perf_counter() - started
                print(f"{place} {turn} seed {seed}: {done + PASS}, {seconds:.0f} s", flush=True)


@dataclass(frozen=True, slots=True)
class Truth:
    """A traced picture by two independent seeds, linear on black, (640, 512, 3) each."""

    one: Float32
    two: Float32
    samples: int

    @property
    def mean(self) -> Float32:
        """Mean of both seeds."""
        return np.asarray((self.one + self.two) / 2, np.float32)


def traced(work: Path, place: str, turn: float) -> Truth:
    """Return the current result of `render` for a picture."""
    both = [np.load(work / f"{Path(place).stem}-{turn}-{seed}.npz") for seed in range(SEEDS)]
    one, two = (np.asarray(kept["sum"] / kept["samples"], np.float32) for kept in both)
    return Truth(one, two, sum(int(kept["samples"]) for kept in both))


def blurred(picture: Float32) -> Float32:
    """Apply the Gaussian blur of both pictures before their comparison."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), BLUR_PX), np.float32)


def ssim(one: Float32, two: Float32) -> Float32:
    """Return the structural similarity of 8-bit luminance, pixel by pixel, in a square window."""

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(cv2.blur(values, (WINDOW, WINDOW)))

    x, y = one.astype(np.float64), two.astype(np.float64)
    mx, my = mean(x), mean(y)
    vx, vy, vxy = mean(x * x) - mx * mx, mean(y * y) - my * my, mean(x * y) - mx * my
    a, b = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    found = (2 * mx * my + a) * (2 * vxy + b) / ((mx**2 + my**2 + a) * (vx + vy + b))
    return np.asarray(found, np.float32)


def ssim_beyond_noise(ours: Float32, one: Float32, two: Float32) -> Float32:
    """Return `ssim` with the seeds' covariance in place of the truth's own variance."""

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(cv2.blur(values, (WINDOW, WINDOW)))

    x, y, z = (picture.astype(np.float64) for picture in (ours, one, two))
    mx, my, mz = mean(x), mean(y), mean(z)
    mt = (my + mz) / 2
    shared = np.maximum(mean(y * z) - my * mz, 0)
    both = mean(x * (y + z) / 2) - mx * mt
    a, b = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    spread = mean(x * x) - mx * mx + shared
    found = (2 * mx * mt + a) * (2 * both + b) / ((mx**2 + mt**2 + a) * (spread + b))
    return np.asarray(np.minimum(found, 1), np.float32)


def seen(picture: Float32, gain: float) -> Float32:
    """Return the luminance of a picture as the app shows it, 0 to 255 in whole steps."""
    toned = luminance(tone_map(blurred(picture), gain))
    return np.asarray(to_bytes(toned), np.float32)


def quartered(picture: Float32) -> Float32:
    """Average four by four pixels."""
    size = picture.shape[1] // 4, picture.shape[0] // 4
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.float32)


def alike(ours: Float32, truth: Truth, head: Bools, gain: float) -> dict[str, float]:
    """Return the SSIM over the head: as it is, between the seeds, and beyond their noise."""
    shown = [seen(one, gain) for one in (ours, truth.mean, truth.one, truth.two)]
    return {
        "ssim": float(ssim(shown[0], shown[1])[head].mean()),
        "ssim_of_two_seeds": float(ssim(shown[2], shown[3])[head].mean()),
        "ssim_beyond_noise": float(ssim_beyond_noise(shown[0], *shown[2:])[head].mean()),
    }


def rmse(ours: Float32, truth: Truth, face: Bools) -> tuple[float, float]:
    """Return the face's RMS error beyond noise, and the noise of both seeds' mean; relative."""
    one, two, mine = (p[face].astype(np.float64) for p in (truth.one, truth.two, ours))
    power = (one * two).mean()
    cross = ((mine - one) * (mine - two)).mean()
    return float(np.sqrt(max(cross, 0) / power)), float(
        np.sqrt(((one - two) ** 2).mean() / power) / 2
    )


def measured(ours: Float32, truth: Truth, coverage: Float32) -> dict[str, float]:
    """Return one picture's errors at full size."""
    head, face = coverage > 0.5, _face(coverage)
    gain = face_exposure(luminance(blurred(truth.mean)[face]))
    found = alike(ours, truth, head, gain)
    found["rmse"], found["noise"] = rmse(ours, truth, face)
    return found


def _face(coverage: Float32) -> Bools:
    face = np.zeros(coverage.shape, bool)
    face[FACE] = coverage[FACE] > 0.999
    return face


def measured_small(ours: Float32, truth: Truth, coverage: Float32) -> dict[str, float]:
    """Return errors at a quarter of the size, where the reference has a quarter of the noise.

    Args:
        truth: Reduced to a quarter already.
    """
    mine, covered = quartered(ours), quartered(coverage)
    head, face = covered > 0.5, quartered(_face(coverage).astype(np.float32)) > 0.999
    gain = face_exposure(luminance(truth.mean[face]))
    found = alike(mine, truth, head, gain)
    found["rmse"], found["noise"] = rmse(mine, truth, face)
    for name, area in (("head", head), ("face", face)):
        own, one, two = (p[area].sum(axis=0, dtype=float) for p in (mine, truth.one, truth.two))
        for place, channel in enumerate("rgb"):
            found[f"{name}_{channel}"] = float(2 * own[place] / (one + two)[place])
        found[f"{name}_noise"] = float((np.abs(one - two) / (one + two)).max())
    return {f"quarter_{name}": value for name, value in found.items()}


def drawn(places: Path, place: str, turn: float) -> tuple[Float32, Float32]:
    """Return the app's picture as shown, and the share of each pixel that it covers."""
    known = load_portrait("generic", "medium", "short")
    assert known is not None
    light = portrait_light(read_environment(places / place).radiance)
    picture = portrait_picture(*known, light, turn)
    edge = (picture.shape[1] - WIDTH) // 2
    return picture[:, edge : edge + WIDTH], known[0].coverage[:, edge : edge + WIDTH]


def keep(work: Path, folder: Path) -> None:
    """Write the saved part of the traced pictures, as square roots of light in 16 bits.

    The blurred picture for the comparison, in steps far below its noise, to keep it small; and both
    seeds at a quarter of the size, one above the other.
    """
    folder.mkdir(parents=True, exist_ok=True)
    facts = {}
    for place, turn in PAIRS:
        truth, name = traced(work, place, turn), f"{Path(place).stem}{turn:+}"
        soft = blurred(truth.mean)
        seeds = np.concatenate([quartered(truth.one), quartered(truth.two)])
        for file, picture, step in ((name, soft, STEP), (f"{name}-seeds", seeds, STEP // 4)):
            gain = 1 / float(picture.max())
            root = np.sqrt(np.clip(picture * gain, 0, 1)) * 65535
            steps = (np.round(root / step) * step).clip(0, 65535).astype(np.uint16)
            cv2.imwrite(str(folder / f"{file}.png"), steps[..., ::-1], _SMALL)
            facts[file] = {"gain": gain, "samples": truth.samples}
    atomic_write_text(folder / "facts.json", json.dumps(facts, indent=1) + "\n")


def kept(folder: Path, place: str, turn: float) -> tuple[Float32, Truth]:
    """Read the files of `keep`: the blurred picture, and the seeds at a quarter of the size."""
    name = f"{Path(place).stem}{turn:+}"
    facts = json.loads((folder / "facts.json").read_text(encoding="utf-8"))
    whole, seeds = (
        _linear(folder / f"{file}.png", facts[file]["gain"]) for file in (name, f"{name}-seeds")
    )
    half = len(seeds) // 2
    return whole, Truth(seeds[:half], seeds[half:], facts[name]["samples"])


def _linear(file: Path, gain: float) -> Float32:
    root = np.asarray(cv2.imread(str(file), cv2.IMREAD_UNCHANGED), np.float32) / np.float32(65535)
    return np.asarray(root[..., ::-1] ** 2 / np.float32(gain), np.float32)


def compare(work: Path | None, places: Path) -> list[dict[str, Any]]:
    """Compare the app's pictures with the traced ones of a work folder, or with saved ones."""
    rows = []
    for place, turn in PAIRS:
        ours, coverage = drawn(places, place, turn)
        if work is None:
            _, small = kept(KEPT, place, turn)
            found = {}
        else:
            truth = traced(work, place, turn)
            small = Truth(quartered(truth.one), quartered(truth.two), truth.samples)
            found = measured(ours, truth, coverage)
        found |= measured_small(ours, small, coverage)
        rows.append({"place": place, "turn": turn, "samples": small.samples, **found})
        print({key: round(v, 3) if isinstance(v, float) else v for key, v in rows[-1].items()})
    return rows


def figure(work: Path, places: Path, file: Path) -> None:
    """Draw one turn of each place, blurred by 3 px against Mitsuba's noise, at half the size.

    The app, Mitsuba, and their difference on grey.
    """
    rows = []
    for place, turn in SHOWN:
        ours, coverage = drawn(places, place, turn)
        truth = traced(work, place, turn).mean
        gain = face_exposure(luminance(blurred(truth)[_face(coverage)]))
        size = WIDTH // 2, ours.shape[0] // 2
        pair = [
            cv2.resize(cv2.GaussianBlur(one, (0, 0), 2 * BLUR_PX), size) for one in (ours, truth)
        ]
        shown = [tone_map(np.asarray(one, np.float32), gain) for one in pair]
        rows.append(np.concatenate([*shown, np.clip(0.5 + shown[0] - shown[1], 0, 1)], axis=1))
    both = [np.concatenate(rows[k : k + 2], axis=0) for k in (0, 2)]
    picture = to_bytes(np.concatenate(both, axis=1))[..., ::-1]
    cv2.imwrite(str(file), picture, [cv2.IMWRITE_WEBP_QUALITY, 70])


def main() -> None:
    """Command line entry."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("render", "keep", "compare", "figure"))
    parser.add_argument("--work", type=Path)
    parser.add_argument(
        "--places", type=Path, required=True, help="twelve panoramas of Poly Haven, 1k"
    )
    parser.add_argument("--samples", type=int, default=64)
    args = parser.parse_args()
    if args.what == "render":
        args.work.mkdir(parents=True, exist_ok=True)
        render(args.work, args.places, args.samples)
    elif args.what == "compare":
        rows = compare(args.work, args.places)
        file = ROOT / "benchmarks" / "results" / "portrait-truth.json"
        if args.work is not None:
            atomic_write_text(file, json.dumps(rows, indent=1) + "\n")
    elif args.what == "keep":
        keep(args.work, KEPT)
    elif args.what == "figure":
        figure(args.work, args.places, FIGURE)


if __name__ == "__main__":
    main()
