"""Labels of blind readers: complete, and read as they were written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.core.solver.face import AREAS
from app.core.styles.styles import load_styles
from benchmarks.labels.fit import WORTH, Bound, Sample, bounds_of, fit, targets_of, words_of
from benchmarks.labels.readings import agreement, load, style_of

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks" / "labels"
RESULTS = FOLDER.parent / "results" / "label-limits.json"
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
    """Pictures graded by known limits: the fit finds limits that grade other pictures alike."""
    chance = np.random.default_rng(2)
    values = np.stack([chance.uniform(-1.0, 2.5, 600), chance.uniform(2.0, 5.0, 600)])
    true = np.array([1.2, 3.8]), np.array([0.4, 3.1])
    start = np.array([0.8, 4.0]), np.array([0.6, 3.5])
    none = np.full(600, np.nan)
    one = Sample(
        bounds=(Bound(0, "least"), Bound(None, "match")),
        yes_kept=False,
        values=values,
        yes=start[0],
        soft=start[1],
        floors=np.full((2, 2), -np.inf),
        most=np.array([np.inf, 4.8]),
        worth=np.zeros((600, 3)),
        label=np.zeros(600, np.int64),
        judge=none,
        own=np.ones(600, bool),
        place=np.zeros(600, np.int64),
    )
    label = one.grades(*true)
    readers = np.array([[1.0, 0.0, 0.0], [0.3, 0.6, 0.1], [0.0, 0.3, 0.7]])
    one = replace(one, worth=readers[label] @ WORTH.T)
    inside = np.arange(600) % 2 == 0
    found = one.grades(*fit(one, inside))
    assert np.mean(found[~inside] == label[~inside]) > 0.95
    assert np.mean(one.grades(*start)[~inside] == label[~inside]) < 0.9


def test_limits_in_use_are_those_of_the_fit() -> None:
    fitted = json.loads(RESULTS.read_text(encoding="utf-8"))
    for style in load_styles():
        if style.name not in fitted:
            continue
        areas = np.zeros((1, len(AREAS)))
        found = bounds_of(style.signature, areas, np.zeros(1))
        wanted = {(words, kind): limits for words, kind, *limits in fitted[style.name]["limits"]}
        for bound, (_, yes, soft) in found.items():
            words = words_of(style.signature, bound)
            if (words, bound.kind) in wanted:
                shown = [bound.shown(yes), bound.shown(soft)]
                assert shown == pytest.approx(wanted[words, bound.kind], abs=0.011)


def test_a_target_lies_within_the_limits_of_its_style() -> None:
    for style in load_styles():
        targets = targets_of(style)
        bounds = bounds_of(style.signature, targets, np.full(len(targets), 100.0))
        for bound, (value, yes, _) in bounds.items():
            assert np.isnan(value).all() or value.min() >= yes, (style.name, bound)
