"""Tilted cameras: how many are noticed, how often a level one is, and which styles are cautioned.

    python -m benchmarks.light.level.tilted_camera [--places DIR ...] [-o FILE.json]

Each panorama is searched as it is and tilted by 8 and 12 degrees about a random horizontal axis, as
HDR, and every second one as a single JPEG, too. A tilt that is noticed in a panorama as it is
counts as a false alarm, although nobody knows how level its camera was. The least sureness is also
chosen for each tenth of the places from the others, as the smallest one that none of their
panoramas as they are exceeds.

A style loses if the turn that is offered in the tilted panorama has more than 3 points less match
in the level one than the turn offered there.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np

from app.core.base.arrays import Float32
from app.core.base.colour import srgb_decode, srgb_encode
from app.core.base.sphere import from_vector, rotate_light
from app.core.cautions.lost_match import lost_match
from app.core.cautions.tilt import (
    LEAST_DEG,
    LEAST_SURENESS,
    LOSS,
    MOST_DEG,
    likeliest_tilt,
    tilted_styles,
)
from app.core.environment.environment import reduce_light
from app.core.measure.finish.clip_audit import choices
from app.core.solver.search import luminance_of
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.light.plain_panorama import FOLDERS, light_of, places, report, same_places

TILTS_DEG: Final = (0.0, 8.0, 12.0)
_FOLDS: Final = 10
_GREY: Final = 0.18
_QUALITY: Final = 90
_NAMED: Final = ("hdri", "scenes")
"""Folders whose panoramas are also reported by themselves, as HDR."""


@dataclass(frozen=True, slots=True)
class TiltTrial:
    """One search for a tilt.

    Attributes:
        off_deg: Angle between the estimated and the true vertical.
        lost, cautioned: Names of styles. None are cautioned in a level panorama without an alarm.
    """

    place: str
    jpeg: bool
    tilt_deg: float
    estimate_deg: float
    off_deg: float
    sureness: float
    held_out: float = LEAST_SURENESS
    lost: tuple[str, ...] = field(default=())
    cautioned: tuple[str, ...] = field(default=())

    def noticed(self, least: float) -> bool:
        """Return whether a tilt is noticed, given the least sureness."""
        return self.sureness >= least and LEAST_DEG < self.estimate_deg <= MOST_DEG


def as_jpeg(light: Float32) -> Float32:
    """Return the light that a single JPEG keeps, exposed for the middle of the place."""
    scale = np.float32(_GREY / max(float(np.median(luminance_of(light))), 1e-9))
    codes = np.rint(255.0 * srgb_encode(np.minimum(light * scale, 1.0))).astype(np.uint8)
    _, data = cv2.imencode(".jpg", codes, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    coded = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.float32) / np.float32(255.0)
    return np.asarray(srgb_decode(coded), np.float32)


def trials_of(
    place: str, level: Float32, jpeg: bool, pack: StylePack, seed: int
) -> Iterator[TiltTrial]:
    """Tilt a panorama, measure it, and search for the tilt."""
    straight = as_jpeg(level) if jpeg else level
    shape, generator = pack.header.environment, np.random.default_rng(seed)
    for tilt_deg in TILTS_DEG:
        around = generator.uniform(0.0, 2.0 * math.pi)
        axis = np.array([math.cos(around), 0.0, math.sin(around)])
        matrix = from_vector(axis * math.radians(tilt_deg))
        light = straight
        if tilt_deg:
            light = np.maximum(rotate_light(level, matrix), 0.0)
            light = as_jpeg(light) if jpeg else light
        tilt = likeliest_tilt(light)
        up = tilt.levelling @ matrix @ np.array([0.0, 1.0, 0.0])
        off = math.degrees(math.acos(min(1.0, float(up[1]))))
        result = TiltTrial(place, jpeg, tilt_deg, tilt.degrees, off, tilt.sureness)
        choice = choices(pack, [reduce_light(each, shape) for each in (light, straight)])
        hits = zip(pack.styles, lost_match(choice)[0] > LOSS, strict=True)
        yield replace(
            result,
            lost=tuple(style.name for style, hit in hits if hit),
            cautioned=tilted_styles(light, tilt, pack) if result.noticed(LEAST_SURENESS) else (),
        )


def held_out(trials: Sequence[TiltTrial]) -> list[TiltTrial]:
    """Choose the least sureness for each tenth of the places from all others."""
    names = sorted({one.place for one in trials})
    fold = {name: number % _FOLDS for number, name in enumerate(names)}
    least = {
        number: max(
            one.sureness
            for one in trials
            if not one.tilt_deg and fold[one.place] != number and one.noticed(0.0)
        )
        + 1e-9
        for number in range(_FOLDS)
    }
    return [replace(one, held_out=least[fold[one.place]]) for one in trials]


def rows(trials: Sequence[TiltTrial], styles: int) -> list[dict[str, Any]]:
    """Return the table: what is noticed and cautioned, by tilt."""
    table = []
    groups = {
        "all": list(trials),
        "hdr": [one for one in trials if not one.jpeg],
        "jpeg": [one for one in trials if one.jpeg],
        "named": [one for one in trials if one.place.split("/")[0] in _NAMED and not one.jpeg],
    }
    for group, some in groups.items():
        for tilt_deg in TILTS_DEG:
            ones = [one for one in some if one.tilt_deg == tilt_deg]
            alarms = [one for one in ones if one.noticed(LEAST_SURENESS)]
            lost = sum(len(one.lost) for one in ones)
            hit = sum(len({*one.lost} & {*one.cautioned}) for one in ones)
            rest = sum(len(one.cautioned) for one in ones) - hit
            table.append(
                {
                    "group": group,
                    "tilt_deg": tilt_deg,
                    "searches": len(ones),
                    "places": len({one.place for one in ones}),
                    "noticed": len(alarms) / len(ones),
                    "held_out": float(np.mean([one.noticed(one.held_out) for one in ones])),
                    "off_deg": float(np.median([a.off_deg for a in alarms])) if alarms else None,
                    "wrong": sum(one.off_deg > LEAST_DEG for one in alarms) if tilt_deg else None,
                    "lose": lost / (styles * len(ones)),
                    "lose_cautioned": hit / lost if lost else None,
                    "others_cautioned": rest / (styles * len(ones) - lost),
                }
            )
    return table


def main() -> None:
    """Print the table, and write all searches."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", nargs="*", type=Path, default=[])
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    start, pack = time.perf_counter(), load_named_pack("generic")
    lights = {name: light_of(file) for name, file in places((*FOLDERS, *args.places)).items()}
    again = same_places(lights)
    lights = {name: light for name, light in lights.items() if name not in again}
    found: list[TiltTrial] = []
    for number, (place, light) in enumerate(lights.items()):
        for jpeg in (False, True)[: 1 + number % 2]:
            found += trials_of(place, light, jpeg, pack, 10 * number + jpeg)
        last = found[-len(TILTS_DEG) :]
        print(place, *(f"{one.estimate_deg:.0f}:{one.sureness:.2f}" for one in last), flush=True)
    found = held_out(found)
    table = rows(found, len(pack.styles))
    seconds = time.perf_counter() - start
    report(lights, seconds, table, [asdict(one) for one in found], args.output)


if __name__ == "__main__":
    main()
