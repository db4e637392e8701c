"""Drafts: what was painted and not saved comes back to the last bit."""

from __future__ import annotations

import errno
import io
import json
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as limits
from hypothesis import strategies as st

from app.core.places import PlaceError
from app.core.places.drafts import (
    discard_draft,
    list_drafts,
    read_draft,
    save_draft,
    undo_discard,
)

SHARED = limits(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=30
)
WEIGHTS = np.linspace(-1, 1, 12, dtype=np.float32).reshape(3, 4)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@SHARED
@given(
    st.dictionaries(st.text(max_size=9), st.floats(allow_nan=False, allow_infinity=False)),
    st.integers(0, 2**32 - 1),
    st.sampled_from(["<f4", "<f8", "|u1", "|b1", "<i4", "<f2"]),
)
def test_any_draft_comes_back(tmp_path: Path, facts: dict[str, Any], seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(0, 6, size=rng.integers(0, 4)))
    count = int(np.prod(shape)) * np.dtype(kind).itemsize
    # Any bits, NaN among them; truth values are 0 and 1 alone.
    raw = rng.integers(0, 2 if kind == "|b1" else 256, size=count, dtype=np.uint8).tobytes()
    array = np.frombuffer(raw, np.dtype(kind)).reshape(shape)
    save_draft(tmp_path, "painting", facts, {"weights": array})
    draft = read_draft(tmp_path, "painting")
    assert draft.facts == facts
    assert set(draft.arrays) == {"weights"}
    again = draft.arrays["weights"]
    assert (again.dtype, again.shape, again.tobytes()) == (array.dtype, array.shape, raw)
    assert names(tmp_path) == ["painting.npz"]


def test_list_is_newest_first_and_leaves_others_out(tmp_path: Path) -> None:
    assert list_drafts(tmp_path / "missing") == ()
    for key, when in (("a", 100), ("b", 300), ("c", 200)):
        os.utime(save_draft(tmp_path, key, {}, {}), (when, when))
    (tmp_path / ".b-x.npz").write_bytes(b"half")
    (tmp_path / "notes.txt").write_bytes(b"x")
    (tmp_path / "d.npz").mkdir()
    listed = list_drafts(tmp_path)
    assert [draft.key for draft in listed] == ["b", "c", "a"]
    assert listed[0].saved_at.timestamp() == 300
    assert listed[0].saved_at.utcoffset() is not None


def test_discarding_can_be_taken_back(tmp_path: Path) -> None:
    save_draft(tmp_path, "a", {"n": 1}, {"w": WEIGHTS})
    discard_draft(tmp_path, "a")
    assert list_drafts(tmp_path) == ()
    with pytest.raises(PlaceError, match="no draft"):
        read_draft(tmp_path, "a")
    assert undo_discard(tmp_path, "a")
    assert np.array_equal(read_draft(tmp_path, "a").arrays["w"], WEIGHTS)
    assert not undo_discard(tmp_path, "a")
    discard_draft(tmp_path, "gone")


def test_taking_back_does_not_replace_a_new_draft(tmp_path: Path) -> None:
    save_draft(tmp_path, "a", {"n": 1}, {})
    discard_draft(tmp_path, "a")
    save_draft(tmp_path, "a", {"n": 2}, {})
    assert not undo_discard(tmp_path, "a")
    assert read_draft(tmp_path, "a").facts == {"n": 2}


def test_full_disk_keeps_the_draft_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_draft(tmp_path, "a", {"n": 1}, {"w": WEIGHTS})

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(PlaceError, match=r"not kept.*no space left.*still here"):
        save_draft(tmp_path, "a", {"n": 2}, {"w": WEIGHTS})
    assert read_draft(tmp_path, "a").facts == {"n": 1}
    assert names(tmp_path) == ["a.npz"]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.99])
def test_cut_off_draft_is_a_sentence_and_stays(tmp_path: Path, share: float) -> None:
    path = save_draft(tmp_path, "a", {"n": 1}, {"w": WEIGHTS})
    data = path.read_bytes()[: int(len(path.read_bytes()) * share)]
    path.write_bytes(data)
    with pytest.raises(PlaceError, match=r"a\.npz is damaged.* untouched"):
        read_draft(tmp_path, "a")
    assert path.read_bytes() == data
    assert [draft.key for draft in list_drafts(tmp_path)] == ["a"]


def raw_draft(path: Path, header: bytes | None, **arrays: Any) -> None:
    stream = io.BytesIO()
    if header is not None:
        arrays["header"] = np.frombuffer(header, np.uint8)
    np.savez(stream, **arrays)
    path.write_bytes(stream.getvalue())


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (None, "not a draft"),
        (b"", "not a draft"),
        (b"\xff", "not a draft"),
        (b"[]", "not a draft"),
        (b'{"version": 1}', "not a draft"),
        (b'{"version": "1", "facts": {}}', "not a draft"),
        (b'{"version": 1, "facts": []}', "not a draft"),
        (b"[" * 99999, "not a draft"),
        (json.dumps({"version": 2, "facts": {}}).encode(), "newer"),
    ],
)
def test_something_else_is_a_sentence(tmp_path: Path, header: bytes | None, words: str) -> None:
    raw_draft(tmp_path / "a.npz", header, w=WEIGHTS)
    with pytest.raises(PlaceError, match=words):
        read_draft(tmp_path, "a")


def test_no_pickle_is_ever_opened(tmp_path: Path) -> None:

    class Trap:
        def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
            return (os.mkdir, (str(tmp_path / "fired"),))

    raw_draft(
        tmp_path / "a.npz", b'{"version": 1, "facts": {}}', w=np.array([Trap()], dtype=object)
    )
    with pytest.raises(PlaceError, match="damaged"):
        read_draft(tmp_path, "a")
    (tmp_path / "b.npz").write_bytes(pickle.dumps(Trap()))
    with pytest.raises(PlaceError, match="damaged"):
        read_draft(tmp_path, "b")
    assert not (tmp_path / "fired").exists()


def test_arrays_of_objects_and_odd_names_are_refused(tmp_path: Path) -> None:
    for name, array in (
        ("w", np.array([{}], dtype=object)),
        ("w", np.array(["x"])),
        ("header", WEIGHTS),
        ("../w", WEIGHTS),
    ):
        with pytest.raises(ValueError, match="draft"):
            save_draft(tmp_path, "a", {}, {name: array})
    assert names(tmp_path) == []


@pytest.mark.parametrize("key", ["", "../x", "A", ".x", "x" * 81, "a.b", "a/b"])
def test_keys_are_plain(tmp_path: Path, key: str) -> None:
    for act in (
        lambda: save_draft(tmp_path, key, {}, {}),
        lambda: read_draft(tmp_path, key),
        lambda: discard_draft(tmp_path, key),
        lambda: undo_discard(tmp_path, key),
    ):
        with pytest.raises(ValueError, match="key of a draft"):
            act()


def test_too_large_a_draft_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(PlaceError, match=r"too large.*Save it as a style"):
        save_draft(tmp_path, "a", {}, {"w": np.zeros((1 << 27) + 1, np.uint8)})
    assert names(tmp_path) == []
