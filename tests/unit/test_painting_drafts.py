"""Drafts: the canvas comes back bit by bit, and anything else ends in a sentence."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.core.base.errors import StyleError
from app.core.painting.canvas import make_canvas
from app.core.painting.draft_file import Draft, load_draft, save_draft

LAYERS = ("weights", "ignore", "start_weights", "start_ignore")


def draft(seed: int = 0, size: int = 48) -> Draft:
    rng = np.random.default_rng(seed)
    weights, ignore = rng.uniform(-1, 1, (size, size)), rng.random((size, size))
    canvas = make_canvas(weights, ignore, weights[::-1], ignore[::-1])
    return Draft(canvas, title="Mine ☼", origin="left-loop", style="mine", head="generic")


def test_a_draft_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "draft.npz"
    for seed in (1, 2):
        save_draft(path, draft(seed))
    back = load_draft(path)
    for name in LAYERS:
        np.testing.assert_array_equal(getattr(back.canvas, name), getattr(draft(2).canvas, name))
    assert (back.title, back.origin, back.style, back.head) == (
        "Mine ☼",
        "left-loop",
        "mine",
        "generic",
    )


def _stored(path: Path, **changes: object) -> None:
    arrays = {name: getattr(draft().canvas, name) for name in LAYERS}
    header = {"format": 1, "title": "", "origin": "", "style": "", "head": ""}
    arrays |= {k: v for k, v in changes.items() if isinstance(v, np.ndarray)}
    header |= {k: v for k, v in changes.items() if not isinstance(v, np.ndarray)}
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(path, header=text, **arrays)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": 2}, "newer version of Turnlight"),
        ({"format": 0}, "not a draft"),
        ({"format": None}, "not a draft"),
        ({"weights": np.zeros((48, 48))}, "not a draft"),
        ({"weights": np.zeros((48, 47), np.float32)}, "square"),
        ({"ignore": np.full((48, 48), np.nan, np.float32)}, "damaged"),
        ({"start_ignore": np.zeros((20, 20), np.float32)}, "damaged"),
    ],
)
def test_drafts_that_do_not_fit_are_refused(
    tmp_path: Path, changes: dict[str, object], words: str
) -> None:
    path = tmp_path / "draft.npz"
    _stored(path, **changes)
    with pytest.raises(StyleError, match=words):
        load_draft(path)


def test_pickles_are_never_opened(tmp_path: Path) -> None:
    path = tmp_path / "draft.npz"
    np.savez(path, allow_pickle=True, header=np.array([{"format": 1}], object))
    with pytest.raises(StyleError, match="damaged"):
        load_draft(path)


def test_missing_and_large(tmp_path: Path) -> None:
    with pytest.raises(StyleError, match="no draft"):
        load_draft(tmp_path / "draft.npz")
    with (tmp_path / "large.npz").open("wb") as stream:
        stream.truncate(100_000_000)
    with pytest.raises(StyleError, match="too large"):
        load_draft(tmp_path / "large.npz")


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_damaged_drafts_end_in_a_sentence(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "draft.npz"
    save_draft(path, draft(size=16))
    whole = path.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    path.write_bytes(
        data.draw(st.sampled_from([whole[:place], whole[:place] + b"\xff" + whole[place + 1 :]]))
    )
    try:
        back = load_draft(path)
    except StyleError:
        return
    np.testing.assert_array_equal(back.canvas.weights, draft(size=16).canvas.weights)
