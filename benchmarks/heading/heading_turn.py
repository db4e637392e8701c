"""Accuracy of the *turn*: heading and sitter's angle both from the picture, for `heading.py`.

The program's own head detector searches for the person, who is at -15, 0 or +15 deg in the picture.
A camera that looks at the sitter gives turn = heading + that angle - 180; one that looks at its
holder gives turn = heading, wherever that person is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.base.angles import difference
from app.core.localization.heading import Heading, find_heading
from app.core.localization.heading_conversion import (
    Looks,
    assumed_fov,
    offset_angle,
    turn_of_heading,
)
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.localization.views import Lens
from benchmarks.heading.heading_cases import SIZE, disturbance
from benchmarks.heading.scripted_turn.phone import disturbed
from benchmarks.heading.scripted_turn.scene_views import SceneViews, Stand

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from app.core.localization.features import HeadingIndex

__all__ = ["ANGLES_DEG", "turn_rows", "turn_table"]

ANGLES_DEG: Final = (-15.0, 0.0, 15.0)
_FOVS_DEG: Final = (45.0, 80.0)  # with less, a head at 15 deg is cut off
_LOOKS: Final = (Looks.SITTER, Looks.PHOTOGRAPHER)


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """A picture and its truth."""

    picture: NDArray[np.uint8]
    looks: Looks
    person_deg: float
    turn_deg: float
    fov_deg: float
    known: bool


def turn_rows(
    views: SceneViews, index: HeadingIndex, chance: np.random.Generator, count: int
) -> list[dict[str, Any]]:
    """Measure the turn: a row for each direction of the camera and position of the person."""
    errors: dict[tuple[Looks, float], list[float | None]] = {
        (looks, angle): [] for looks in _LOOKS for angle in ANGLES_DEG
    }
    for case in _cases(views, chance, count):
        errors[case.looks, case.person_deg].append(_error(case, index))
    return [_row(looks, angle, each) for (looks, angle), each in errors.items()]


def _cases(views: SceneViews, chance: np.random.Generator, count: int) -> Iterator[_Case]:
    kinds = [(looks, angle) for looks in _LOOKS for angle in ANGLES_DEG]
    for number in range(count):
        looks, angle = kinds[number % len(kinds)]
        fov = chance.uniform(*_FOVS_DEG)
        stand = Stand(
            turn_deg=chance.uniform(-180.0, 180.0),
            distance_m=chance.uniform(1.2, 2.5),
            aim_deg=-angle,
            pitch_deg=chance.uniform(-6.0, 6.0),
            roll_deg=chance.uniform(-5.0, 5.0),
            away=looks is Looks.PHOTOGRAPHER,
        )
        seen = views.view(stand, Lens(fov, SIZE))
        picture = disturbed(seen.picture, disturbance(chance, 1.0), chance)
        turn = seen.heading_deg if stand.away else seen.turn_deg
        yield _Case(picture, looks, angle, turn, fov, number // len(kinds) % 2 == 0)


def _error(case: _Case, index: HeadingIndex) -> float | None:
    """Return the error of the turn, deg; None if heading or sitter is not found."""
    fov = case.fov_deg if case.known else None
    guess = fov or assumed_fov(SIZE)
    away = case.looks is Looks.PHOTOGRAPHER
    person = find_sitter(case.picture, guess, keen=not away)
    if person is None and not away:
        return None
    found = _heading(case.picture, index, fov, person, away)
    if found.heading_deg is None:
        return None
    angle = 0.0 if person is None else offset_angle(person.column, 1, found.fov_deg)
    turn = turn_of_heading(found.heading_deg, looks=case.looks, sitter_deg=angle)
    return difference(turn, case.turn_deg)


def _heading(
    picture: NDArray[np.uint8],
    index: HeadingIndex,
    fov_deg: float | None,
    person: Sitter | None,
    away: bool,
) -> Heading:
    """Return the heading, with the tracker's arguments."""
    angle, mask = None, None
    if person is not None:
        mask = background_mask(person, picture.shape[:2])
        angle = offset_angle(person.column, 1, fov_deg or assumed_fov(SIZE))
    return find_heading(picture, index, fov_deg, sitter_deg=angle, mask=mask, away=away)


def _row(looks: Looks, angle_deg: float, errors: list[float | None]) -> dict[str, Any]:
    off = np.abs([error for error in errors if error is not None])
    return {
        "looks": looks.value,
        "person_deg": angle_deg,
        "pictures": len(errors),
        "accepted": round(len(off) / max(len(errors), 1), 4),
        "median_deg": round(float(np.median(off)), 3) if len(off) else 180.0,
        "p95_deg": round(float(np.percentile(off, 95)), 3) if len(off) else 180.0,
        "largest_deg": round(float(off.max()), 2) if len(off) else 180.0,
    }


def turn_table(rows: list[dict[str, Any]]) -> list[str]:
    """Return the lines of benchmarks/heading.md."""
    lines = [
        "| the camera looks at | who is at | pictures | accepted | turn: median | 95 % | largest |",
        "|---|---|---|---|---|---|---|",
    ]
    names = {Looks.SITTER.value: "the sitter", Looks.PHOTOGRAPHER.value: "the photographer"}
    for row in rows:
        angle = f"{row['person_deg']:+.0f}°" if row["person_deg"] else "0°"
        lines.append(
            f"| {names[row['looks']]} | {angle.replace('-', '−')} | {row['pictures']} "
            f"| {100 * row['accepted']:.1f} % | {row['median_deg']:.2f}° | {row['p95_deg']:.2f}° "
            f"| {row['largest_deg']:.1f}° |"
        )
    return lines
