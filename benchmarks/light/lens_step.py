"""Steps between the lenses of a 360 camera: how many are noticed, and how often there is none.

    python -m benchmarks.light.lens_step [--places DIR ...] [--turns N] [-o FILE.json]

One hemisphere of each panorama is brightened by 0.5, 0.7 or 1 stop: first by 0.5, with the front
lens at the centre of the panorama, and then with the panorama and the seam turned at random and the
seam tilted by up to 5 degrees. The hemispheres are blended over 1 to 5 degrees. The panorama is
then used in one of three ways: as it is, merged from five 8-bit JPEG frames with the noise of a
Theta, or saved as a single JPEG. A step that is noticed in a panorama without one is a false alarm.
The least evidence is also chosen for each tenth of the places from the others, as the smallest one
that at most 1 % of their panoramas without a step exceed.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final, Literal, TypeAlias, get_args

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import srgb_decode, srgb_encode
from app.core.base.sphere import direction, directions
from app.core.cautions.lens_step import LEAST_EVIDENCE, LensStep, likeliest_step
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import add_sensor_noise
from benchmarks.light.plain_panorama import (
    FOLDERS,
    automatic,
    light_of,
    places,
    report,
    same_places,
)

Condition: TypeAlias = Literal["hdr", "bracket", "jpeg"]
STOPS: Final = (0.5, 0.7, 1.0)
_FEATHER_DEG: Final = (1.0, 5.0)
_MOST_TILT_DEG: Final = 5.0
_FRAMES_EV: Final = (2.0, 0.0, -2.0, -4.0, -6.0)
_QUALITY: Final = 90
_WHITE: Final = 250.0 / 255.0
_FOLDS: Final = 10
_LEAST_FALSE: Final = 0.01
_AIM_DEG: Final = 10.0


@dataclass(frozen=True, slots=True)
class Seam:
    """A step that was added to a panorama; the hemisphere around the azimuth is brighter."""

    stops: float
    azimuth_deg: float
    elevation_deg: float
    feather_deg: float


@dataclass(frozen=True, slots=True)
class Trial:
    """One search for a step."""

    place: str
    condition: Condition
    seam: Seam | None
    evidence: float
    amount: float
    off_deg: float | None  # angle between the added and the reported axis
    held_out: float = LEAST_EVIDENCE

    def noticed(self, least: float) -> bool:
        """Return whether a step is noticed, given the least evidence."""
        return self.evidence >= least


def stepped(light: Float32, seam: Seam) -> Float32:
    """Return a panorama with a brighter hemisphere, blended smoothly across the seam."""
    axis = direction(seam.azimuth_deg, seam.elevation_deg).astype(np.float32)
    angle = np.degrees(np.arcsin(np.clip(directions(light.shape[:2]) @ axis, -1.0, 1.0)))
    share = np.clip(0.5 + angle / seam.feather_deg, 0.0, 1.0)
    gain = 1.0 + (2.0**seam.stops - 1.0) * share * share * (3.0 - 2.0 * share)
    return np.asarray(light * gain[..., None], np.float32)


def turned(light: Float32, azimuth_deg: float) -> Float32:
    """Turn a panorama by whole columns."""
    return np.roll(light, round(azimuth_deg / 360.0 * light.shape[1]), axis=1)


def as_measured(
    light: Float32, condition: Condition, generator: np.random.Generator
) -> tuple[Float32, Float32 | None]:
    """Return a panorama as a camera would measure it, and the fraction of clipped texels."""
    if condition == "hdr":
        return light, None
    factor = automatic(light, "grey")
    stops = (0.0,) if condition == "jpeg" else _FRAMES_EV
    total, weights = np.zeros_like(light), np.full_like(light, 1e-6)
    clipped = np.zeros(light.shape[:2], np.bool_)
    for ev in stops:
        scale = np.float32(factor * 2.0**ev)
        coded = _developed(light * scale, generator)
        weight = np.minimum(coded, 1.0 - coded) + 1e-3
        clipped = coded.max(axis=-1) >= _WHITE
        weight[clipped] = 1e-6
        total += weight * srgb_decode(coded) / scale
        weights += weight
    if condition == "jpeg":
        return np.asarray(srgb_decode(coded), np.float32), clipped.astype(np.float32)
    return np.asarray(total / weights, np.float32), clipped.astype(np.float32)


def _developed(share: Float32, generator: np.random.Generator) -> Float32:
    """Return the sRGB values of a frame after noise, 8-bit coding and JPEG compression."""
    counts = np.ascontiguousarray(share, np.float32)
    add_sensor_noise(counts, THETA_V, THETA_V.base_iso, generator)
    codes = np.rint(255.0 * srgb_encode(counts)).astype(np.uint8)
    _, data = cv2.imencode(".jpg", codes, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.float32) / np.float32(255.0)


def search(
    place: str,
    light: Float32,
    seam: Seam | None,
    condition: Condition,
    generator: np.random.Generator,
) -> Trial:
    """Add a step to a panorama, measure it, and search for the step."""
    whole = light if seam is None else stepped(light, seam)
    step = likeliest_step(*as_measured(whole, condition, generator))
    off = None if seam is None else angle_between(seam, step)
    return Trial(place, condition, seam, step.evidence, step.stops, off)


def angle_between(seam: Seam, step: LensStep) -> float:
    """Return the angle between the axes of the added and the reported step, in degrees."""
    added = direction(seam.azimuth_deg, seam.elevation_deg)
    reported = direction(step.azimuth_deg, step.elevation_deg)
    return float(np.degrees(np.arccos(np.clip(added @ reported, -1.0, 1.0))))


def trials(lights: dict[str, Float32], turns: int) -> list[Trial]:
    """Search every panorama at several turns, each with and without a step."""
    generator = np.random.default_rng(43)
    conditions = get_args(Condition)
    found: list[Trial] = []
    for number, (place, light) in enumerate(lights.items()):
        for turn in range(turns):
            condition = conditions[(number + turn) % len(conditions)]
            feather = generator.uniform(*_FEATHER_DEG)
            seam = Seam(STOPS[0], float(generator.choice((0.0, 180.0))), 0.0, feather)
            rolled = light
            if turn:
                rolled = turned(light, generator.uniform(0.0, 360.0))
                seam = Seam(
                    STOPS[(number // len(conditions) + turn) % len(STOPS)],
                    generator.uniform(-180.0, 180.0),
                    generator.uniform(-_MOST_TILT_DEG, _MOST_TILT_DEG),
                    feather,
                )
            found += [search(place, rolled, each, condition, generator) for each in (None, seam)]
        print(place, *(f"{trial.evidence:.1f}" for trial in found[-2 * turns :]), flush=True)
    return found


def held_out(found: list[Trial]) -> list[Trial]:
    """Choose the least evidence for each tenth of the places from all others."""
    names = sorted({trial.place for trial in found})
    fold = {name: number % _FOLDS for number, name in enumerate(names)}
    least: dict[int, float] = {}
    for number in range(_FOLDS):
        others = [
            trial.evidence for trial in found if trial.seam is None and fold[trial.place] != number
        ]
        least[number] = float(np.quantile(others, 1.0 - _LEAST_FALSE, method="higher")) + 1e-9
    return [replace(trial, held_out=least[fold[trial.place]]) for trial in found]


def rows(found: list[Trial]) -> list[dict[str, float | str]]:
    """Return the table: what is noticed for each condition and size of the step."""
    table: list[dict[str, float | str]] = []
    for condition in (*get_args(Condition), "all"):
        for stops in (None, *STOPS):
            some = [
                trial
                for trial in found
                if condition in (trial.condition, "all")
                and (None if trial.seam is None else trial.seam.stops) == stops
            ]
            if not some:
                continue
            shipped = [trial for trial in some if trial.noticed(LEAST_EVIDENCE)]
            row: dict[str, float | str] = {
                "condition": condition,
                "stops": stops or 0.0,
                "searches": len(some),
                "places": len({trial.place for trial in some}),
                "noticed": len(shipped) / len(some),
                "held_out": float(np.mean([trial.noticed(trial.held_out) for trial in some])),
                "places_noticed": len({trial.place for trial in shipped}),
            }
            if stops and shipped:
                errors = [abs(trial.amount - stops) for trial in shipped]
                row["amount_off"] = float(np.median(errors))
                aimed = [(trial.off_deg or 0.0) < _AIM_DEG for trial in shipped]
                row["right_seam"] = float(np.mean(aimed))
            table.append(row)
    return table


def main() -> None:
    """Print the table, and write all searches."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", nargs="*", type=Path, default=[])
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    start = time.perf_counter()
    lights = {name: light_of(file) for name, file in places((*args.places, *FOLDERS)).items()}
    again = same_places(lights)
    lights = {name: light for name, light in lights.items() if name not in again}
    found = held_out(trials(lights, args.turns))
    table = rows(found)
    seconds = time.perf_counter() - start
    report(lights, seconds, table, [asdict(one) for one in found], args.output)


if __name__ == "__main__":
    main()
