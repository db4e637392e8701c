"""Numbers of the report and its JSON: the paper's, ours, and the targets."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.core.base.atomic_files import atomic_write_text
from app.core.styles.certainty import CERTAINTY_VERSION, TOLERANCE_DEG, Certainty

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.answers.evaluation.evaluate import Evaluation, Moved, Row
    from benchmarks.answers.evaluation.heads import Spread
    from benchmarks.answers.evaluation.lens import LensGains

PAPER: Final[dict[str, tuple[float, ...]]] = {
    "lighting": (6.15, 1.9, 0.0),
    "pictures": (4.95, 2.02, 0.0),
    "width": (17.05, 9.73),
    "offset": (6.43,),
}
"""The paper's numbers (Algorithmic Evaluation), deg.

By size, smallest first; mean and deviation of the peak's width; mean over places 1 and 2 ft off.
"""

_MIDDLE: Final = 1  # of three sizes: that of the app
_MOST_REGRET: Final = 0.003


@dataclass(frozen=True, slots=True)
class Bar:
    """One number with a target.

    Attributes:
        unit: "°" or "%".
    """

    name: str
    found: float
    most: float
    unit: str
    paper: str

    @property
    def met(self) -> bool:
        """Whether the target was reached."""
        return self.found <= self.most


def bars_of(found: Evaluation) -> tuple[Bar, ...]:
    """Return all numbers with a target."""
    light, picture = found.lighting[_MIDDLE].change, found.pictures[_MIDDLE].change
    own = found.spreads["picture"]
    paper = found.spreads["paper"]
    none = "not measured"
    return (
        Bar("Environment 64 × 32: best turn differs by", light.mean, 1.9, "°", "1.9°"),
        Bar("Picture 100 × 100: best turn differs by", picture.mean, 2.02, "°", "2.02°"),
        Bar(
            "Environment 64 × 32: quality given up",
            100 * light.mean_regret,
            100 * _MOST_REGRET,
            "%",
            none,
        ),
        Bar(
            "Picture 100 × 100: quality given up",
            100 * picture.mean_regret,
            100 * _MOST_REGRET,
            "%",
            none,
        ),
        Bar("Other heads and skins, by match: best turn differs by", own.mean, 8.5, "°", none),
        Bar("Other heads and skins, by quality: best turn differs by", paper.mean, 8.5, "°", none),
    )


def verdict(bars: tuple[Bar, ...]) -> str:
    """Return a sentence with the number of targets reached."""
    missed = [bar.name.lower() for bar in bars if not bar.met]
    if not missed:
        return f"All {len(bars)} bars are met."
    return f"{len(bars) - len(missed)} of {len(bars)} bars are met; not met: {'; '.join(missed)}."


def certainty_of(found: Evaluation) -> Certainty:
    """Return the app's data on each style's dependence on the head, by its own objective."""
    spread = found.spreads["picture"]
    by_style = zip(found.styles, spread.by_style, strict=True)
    return Certainty(
        spread_deg={style.name: float(value) for style, value in by_style if np.isfinite(value)},
        scenes=len(found.scenes),
        heads=spread.names,
    )


def save_certainty(path: Path, certainty: Certainty) -> None:
    """Write the data for the app, atomically."""
    facts = {
        "format_version": CERTAINTY_VERSION,
        "tolerance_deg": TOLERANCE_DEG,
        "scenes": certainty.scenes,
        "heads": list(certainty.heads),
        "spread_deg": {name: round(value, 2) for name, value in certainty.spread_deg.items()},
    }
    atomic_write_text(path, json.dumps(facts, indent=1) + "\n")


def as_json(found: Evaluation) -> dict[str, Any]:
    """Return all numbers as plain data."""
    bars = bars_of(found)
    return {
        "scenes": list(found.scenes),
        "styles": [style.name for style in found.styles],
        "pairs": found.pairs,
        "objective": found.objective,
        "bars": [
            {"name": b.name, "found": _short(b.found), "most": b.most, "met": b.met} for b in bars
        ],
        "lighting": [_row(row) for row in found.lighting],
        "pictures": [_row(row) for row in found.pictures],
        "peak_width_deg": {
            name: {
                "all": [_short(x) for x in width.mean()],
                "attainable": [_short(x) for x in width.mean(attainable=True)],
            }
            for name, width in found.widths.items()
        },
        "attainable": {
            scene: [one.name for one in row if one.attainable]
            for scene, row in zip(found.scenes, found.results, strict=True)
        },
        "lens": None if found.lens is None else _lens(found.lens, found),
        "heads": {name: _spread(spread, found) for name, spread in found.spreads.items()},
        "offsets": None if found.moved is None else _moved(found.moved),
        "paper": PAPER,
        "tolerance_deg": TOLERANCE_DEG,
    }


def _row(row: Row) -> dict[str, Any]:
    change = row.change
    clear = change.degrees[~change.tied]
    return {
        "size": row.name,
        "mean_deg": _short(change.mean),
        "mean_of_all_deg": _short(float(change.degrees.mean())),
        "mean_refined_deg": _short(change.mean_refined),
        "mean_by_own_steps_deg": None if row.own_steps is None else _short(row.own_steps),
        "same": int((clear == 0).sum()),
        "tied": int(change.tied.sum()),
        "percentiles_deg": [_short(float(x)) for x in np.percentile(change.degrees, (50, 90, 95))],
        "mean_regret": _short(float(change.regret.mean())),
        "mean_regret_of_range": _short(float(change.regret_of_range.mean())),
        "worst_regret": _short(float(change.regret.max())),
    }


def _spread(spread: Spread, found: Evaluation) -> dict[str, Any]:
    styles = [style.name for style in found.styles]
    return {
        "mean_deg": _short(spread.mean),
        "mean_of_all_deg": _short(spread.mean_of_all),
        "by_head_deg": {
            name: _short(float(one[spread.counted].mean())) if spread.counted.any() else None
            for name, one in zip(spread.names, spread.degrees, strict=True)
        },
        "by_style_deg": {
            name: _short(float(value)) if np.isfinite(value) else None
            for name, value in zip(styles, spread.by_style, strict=True)
        },
        "mean_regret": _short(float(spread.regret[:, spread.counted].mean()))
        if spread.counted.any()
        else None,
    }


def _moved(moved: Moved) -> dict[str, Any]:
    clear = ~moved.tied
    feet = sorted({float(f) for f in moved.feet})
    return {
        "mean_deg": _short(float(moved.degrees.mean())),
        "mean_untied_deg": _short(float(moved.degrees[clear].mean())),
        "mean_regret": _short(float(moved.regret.mean())),
        "by_feet_deg": {
            f"{f:g}": _short(float(moved.degrees[moved.feet == f].mean())) for f in feet
        },
        "by_spot_deg": {
            name: _short(float(moved.degrees[moved.spot == k].mean()))
            for k, name in enumerate(moved.spots)
        },
    }


def _lens(lens: LensGains, found: Evaluation) -> dict[str, Any]:
    names = ("in_reach", "in_reach_at_any_yaw", "match", "match_at_any_yaw", "gains_named")
    each = {"all": lens.of()} | {s.name: lens.of(k) for k, s in enumerate(found.styles)}
    return {
        style: {
            name: _short(value) if np.isfinite(value) else None
            for name, value in zip(names, values, strict=True)
        }
        for style, values in each.items()
    }


def _short(value: float) -> float:
    return float(f"{value:.6g}")
