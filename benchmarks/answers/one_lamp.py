"""Turns of each objective for a single lamp: writes benchmarks/one-lamp.md.

An environment with one small lamp at panorama azimuth p, at the height of a style's key, should
give the turn p + the style's lamp azimuth. The picture objective does; the paper's quality C also
rewards a face that is merely brighter in the right half, and is therefore biased.

    python benchmarks/answers/one_lamp.py [--head NAME] [-o PAGE.md]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.core.base.angles import TURNS, difference, wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.solver.solve import solve_all
from app.core.styles.lamps import far_lamp
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack

if TYPE_CHECKING:
    from app.core.solver.turn_choice import Objective

ROOT = Path(__file__).resolve().parents[2]


LAMPS = 4 * TURNS  # azimuths tried: on texels, between them, and half-way
DIAMETER_DEG = 5.0


@dataclass(frozen=True, slots=True)
class Errors:
    """Actual turn minus expected turn, deg, over all lamp azimuths."""

    grid: np.ndarray
    refined: np.ndarray
    least_match: float


def measure(pack: StylePack, style: Style, objective: Objective) -> Errors:
    """Solve for a single small lamp at many azimuths, at the height of the style's key."""
    key = style.lamps[0]
    grid, refined, matches = [], [], []
    for azimuth in (np.arange(LAMPS) * 360.0 / LAMPS).tolist():
        lamp = StyleLamp(-azimuth, key.elevation_deg, DIAMETER_DEG, 1.0, 2.0)
        light = far_lamp(replace(lamp, azimuth_deg=wrap(-azimuth)), pack.header.environment)
        (result,) = solve_all(pack, light, objective, styles=[style.name])
        expected = azimuth + key.azimuth_deg
        grid.append(difference(result.turn_deg, expected))
        refined.append(difference(result.turn_refined_deg, expected))
        matches.append(result.match)
    return Errors(np.array(grid), np.array(refined), min(matches))


def table(pack: StylePack) -> str:
    """Return the Markdown table for all styles with a single lamp."""
    lines = [
        "| style | lamp | picture, refined: mean (worst) | picture, grid: worst | least match "
        "| paper, refined: mean (worst) | paper puts the lamp at |",
        "|---|---|---|---|---|---|---|",
    ]
    for style in pack.styles:
        if len(style.lamps) > 1:
            continue
        key = style.lamps[0]
        picture, paper = measure(pack, style, "picture"), measure(pack, style, "paper")
        bias = float(paper.refined.mean())
        lines.append(
            f"| {style.name} | {key.azimuth_deg:+.0f}, {key.elevation_deg:+.0f} "
            f"| {picture.refined.mean():+.2f} ({np.abs(picture.refined).max():.2f}) "
            f"| {np.abs(picture.grid).max():.2f} | {picture.least_match:.1f} "
            f"| {bias:+.2f} ({np.abs(paper.refined).max():.2f}) "
            f"| {wrap(key.azimuth_deg + bias):+.1f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--head", default="generic")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "benchmarks" / "one-lamp.md")
    args = parser.parse_args()
    pack = load_named_pack(args.head)
    text = f"""# One lamp, both objectives

An environment with one small lamp ({DIAMETER_DEG:g} degrees across) at panorama azimuth p and at
the height of the style's key should give the turn p + the lamp's azimuth (positive towards the
sitter's left). Errors below are found minus expected turn, in degrees, over {LAMPS} azimuths p on
and between texels; the grid alone is worth up to 2.8. Lamp: azimuth, elevation from the face.

The **picture** objective (best match among the turns of sufficient strength) finds the lamp. The
**paper** objective (largest quality C) is reported as published, with its own bias: C is linear in
the light, so it also rewards a face that is merely brighter where the target is bright, and turns
the lamp to where it lights most of that part.

Head: {pack.header.head}, {pack.header.skin} skin. Written by
`python benchmarks/answers/one_lamp.py`; transport SHA-256 `{pack.header.transport_sha256[:16]}`.

{table(pack)}
"""
    atomic_write_text(args.output, text)
    print(text)


if __name__ == "__main__":
    main()
