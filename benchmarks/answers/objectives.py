"""Both objectives, judged by measures that neither of them optimises.

For every style and place each objective offers a turn. Its picture, at the target's exposure, is
compared with the target by structural similarity and by gradient similarity, and a classifier finds
the style whose target has the most similar pattern. The pictures are those in the modelled place
(`truth_in_place.py`) and, for scenes, those under distant light.

    python benchmarks/answers/objectives.py --work FOLDER --scenes FOLDER
        [-o FILE.json]

SSIM: Wang et al. 2004, eq. 13, Gaussian window of 1.5 pixels. Gradients: Xue et al. 2014, eq. 4.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import srgb_encode
from app.core.environment.environment import read_environment, reduce
from app.core.solver.solve import solve_all
from app.core.solver.transport import Transport, load_named, render
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.truth.stock import ROOT, rotate
from benchmarks.truth.truth_in_place import (
    OBJECTIVES,
    ROUNDS,
    SEEDS,
    TURNS,
    grey_of,
    light_at,
    pictures_file,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SIDE: Final = 100
SSIM_C: Final = (0.01**2, 0.03**2)
GRADIENT_C: Final = 0.0026  # for pictures from 0 to 1, as in the paper
EXPOSURE: Final = 0.18  # linear mean of every face
EVEN: Final = 1e-3  # smaller differences of two measures count as none
Float64 = NDArray[np.float64]


class Seen(NamedTuple):
    """Similarity of a picture and a target, and the style closest to the picture."""

    ssim: float
    gradients: float
    nearest: int


class Judge:
    """Compares pictures of a head with the targets of its styles."""

    def __init__(self, transport: Transport, pack: StylePack) -> None:
        self._pixels, self._face = transport.pixels, transport.face
        targets = grey_of(pack.targets).reshape(len(pack.styles), -1)[:, transport.pixels]
        self._shown = np.stack([self.shown(target) for target in targets])
        self._mask = np.zeros(SIDE * SIDE, bool)
        self._mask[self._pixels[self._face]] = True
        self._patterns = np.stack([self._pattern(target) for target in self._shown])

    def shown(self, grey: Float64) -> Float64:
        """Return a picture as on screen, (100, 100), 0 to 1, with equal brightness of all faces."""
        gain = EXPOSURE / max(float(grey[self._face].mean()), 1e-12)
        out = np.zeros(SIDE * SIDE)
        out[self._pixels] = srgb_encode(np.clip(grey * gain, 0.0, 1.0))
        return out.reshape(SIDE, SIDE)

    def see(self, grey: Float64, style: int) -> Seen:
        """Compare a picture, (P,) linear luminance, with a style's target."""
        picture = self.shown(grey)
        nearest = int(np.argmax(self._patterns @ self._pattern(picture)))
        return Seen(self._ssim(picture, style), self._gradients(picture, style), nearest)

    def _pattern(self, picture: Float64) -> Float64:
        """Return the face minus its mean, over its spread, independent of the light's strength."""
        face = picture.ravel()[self._mask]
        return np.asarray((face - face.mean()) / max(float(face.std()), 1e-9) / np.sqrt(face.size))

    def _ssim(self, picture: Float64, style: int) -> float:
        other = self._shown[style]
        one, two = _blurred(picture), _blurred(other)
        spread = [_blurred(a * b) for a, b in ((picture, picture), (other, other))]
        both = _blurred(picture * other) - one * two
        low, high = SSIM_C
        top = (2 * one * two + low) * (2 * both + high)
        square = one**2 + two**2
        value = top / ((square + low) * (spread[0] + spread[1] - square + high))
        return float(value.ravel()[self._mask].mean())

    def _gradients(self, picture: Float64, style: int) -> float:
        one, two = _slope(picture), _slope(self._shown[style])
        value = (2 * one * two + GRADIENT_C) / (one**2 + two**2 + GRADIENT_C)
        return float(value.ravel()[self._mask].mean())


def _blurred(picture: Float64) -> Float64:
    return np.asarray(cv2.GaussianBlur(picture, (11, 11), 1.5), np.float64)


def _slope(picture: Float64) -> Float64:
    kernel = np.array([[1.0, 0.0, -1.0]] * 3) / 3
    return np.hypot(cv2.filter2D(picture, -1, kernel), cv2.filter2D(picture, -1, kernel.T))


def judged(
    place: str, light: NDArray[np.float32], at: Callable[[float], Float64], judge: Judge,
    pack: StylePack,
) -> Iterator[dict[str, Any]]:  # fmt: skip
    """Yield the results of both objectives for each style at a place; `at` renders a turn."""
    answers = [solve_all(pack, light, objective) for objective in OBJECTIVES]
    # Styles judged by areas hardly light the face, so the similarity of faces is meaningless.
    for style, both in enumerate(zip(*answers, strict=True)):
        if pack.styles[style].signature.areas:
            continue
        row: dict[str, Any] = {"place": place, "style": both[0].name}
        for objective, answer in zip(OBJECTIVES, both, strict=True):
            seen = judge.see(at(answer.turn_deg), style)
            row[objective] = {
                "turn_deg": answer.turn_deg % 360,
                "attainable": answer.attainable,
                "ssim": round(seen.ssim, 4),
                "gradients": round(seen.gradients, 4),
                "seen_as": pack.styles[seen.nearest].name,
            }
        yield row


def in_the_place(work: Path, name: str, rounds: int) -> Callable[[float], Float64]:
    """Return a function for pictures of the sitter in the modelled place at any turn, (P,)."""
    pictures = np.load(pictures_file(work, name, rounds))
    grey = grey_of(pictures).reshape(TURNS, SEEDS, -1).mean(axis=1)
    return lambda turn: np.asarray(grey[round(turn / 360 * TURNS) % TURNS])


def summary(rows: list[dict[str, Any]], key: str) -> dict[str, Any]:
    """Count over the pairs that either objective calls attainable (`key`), or over all."""
    chosen = [r for r in rows if key == "all" or any(r[o]["attainable"] for o in OBJECTIVES)]
    out: dict[str, Any] = {"pairs": len(chosen)}
    apart = [r for r in chosen if len({r[o]["turn_deg"] for o in OBJECTIVES}) > 1]
    out["turns_differ"] = len(apart)
    for objective, other in (OBJECTIVES, OBJECTIVES[::-1]):
        out[objective] = {
            "ssim": float(np.mean([r[objective]["ssim"] for r in chosen])),
            "gradients": float(np.mean([r[objective]["gradients"] for r in chosen])),
            "seen_as_itself": float(
                np.mean([r[objective]["seen_as"] == r["style"] for r in chosen])
            ),
            "better_ssim": sum(r[objective]["ssim"] > r[other]["ssim"] + EVEN for r in apart),
            "better_gradients": sum(
                r[objective]["gradients"] > r[other]["gradients"] + EVEN for r in apart
            ),
        }
    return out


def main() -> None:
    """Judge, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="where truth_in_place.py worked")
    parser.add_argument("--scenes", type=Path, required=True)
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "objectives.json"
    )
    args = parser.parse_args()
    transport, pack = load_named("generic"), load_named_pack("generic")
    judge = Judge(transport, pack)
    groups: dict[str, list[dict[str, Any]]] = {"in the place": [], "scenes": []}
    for number, rounds in enumerate(ROUNDS):
        name = f"probe-{number + 1}"
        at = in_the_place(args.work, name, rounds)
        groups["in the place"] += judged(name, light_at(name), at, judge, pack)
    for file in sorted(args.scenes.iterdir()):
        if file.suffix not in (".hdr", ".exr"):
            continue
        light = reduce(read_environment(file), (32, 64))

        def far(turn: float, light: NDArray[np.float32] = light) -> Float64:
            columns = round(turn / 360 * TURNS) % TURNS
            return grey_of(render(transport, rotate(light, columns)))

        groups["scenes"] += judged(file.stem, light, far, judge, pack)
    found = {
        "transport_sha256": transport.digest,
        "summary": {
            name: {key: summary(rows, key) for key in ("attainable", "all")}
            for name, rows in groups.items()
        },
        "rows": [row for rows in groups.values() for row in rows],
    }
    atomic_write_text(args.o, json.dumps(found, indent=1) + "\n")
    print(json.dumps(found["summary"], indent=1))


if __name__ == "__main__":
    main()
