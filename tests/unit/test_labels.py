"""Labels of blind readers: complete, and read as they were written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.core.styles.styles import load_styles
from benchmarks.labels.fit import fit_limits, grades_by
from benchmarks.labels.readings import agreement, load, style_of

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks" / "labels"
STYLES = tuple(style.name for style in load_styles())


@pytest.mark.parametrize(
    ("word", "style"),
    [("loop-L", "right-loop"), ("looprim-R", "left-loop-rim"), ("doublerim", "double-rim")],
)
def test_the_left_of_a_picture_is_the_right_of_the_sitter(word: str, style: str) -> None:
    assert style_of(word) == style


def test_three_readers_saw_every_picture() -> None:
    labels = load(FOLDER, STYLES)
    assert labels.seen.shape == (3, len(labels.recipe), len(STYLES))
    assert len(labels.recipe) >= 1200
    assert len({one["place"] for one in labels.recipe}) >= 40
    assert len({one["head"] for one in labels.recipe}) == 3
    order = json.loads((FOLDER / "order.json").read_text(encoding="utf-8"))
    assert set(order) == set(range(len(labels.recipe)))
    assert len(labels.again) == 3 * (len(order) - len(labels.recipe))


def test_readers_agree_far_better_than_by_chance() -> None:
    labels = load(FOLDER, STYLES)
    assert agreement(labels)["all"] > 0.9
    pictures, rows = labels.own()
    seen, others = labels.seen[:, pictures, rows], labels.seen[::-1, pictures, rows]
    together = np.mean((seen[0] > 0) & (others[0] > 0))
    assert together > 3 * np.mean(seen[0] > 0) * np.mean(others[0] > 0)


def test_limits_are_found_again() -> None:
    """Pictures labelled by known limits: nearly all are graded like their label."""
    chance = np.random.default_rng(2)
    room, match = chance.uniform(-1.0, 1.5, 400), chance.uniform(40.0, 100.0, 400)
    label = grades_by((0.5, 0.1, 81.0, 69.0), room, match)
    found = fit_limits(room[::2], match[::2], label[::2], np.ones(200))
    assert np.mean(grades_by(found, room[1::2], match[1::2]) == label[1::2]) > 0.95
