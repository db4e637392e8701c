"""Errors carry one sentence and a hint."""

from __future__ import annotations

import pickle

import pytest

from app.core.base import errors
from app.core.base.errors import Cancelled, CoreError

KINDS = [
    kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and kind.__module__ == errors.__name__
]


def test_sentence_and_hint() -> None:
    error = CoreError("The file is empty.", "Copy it again.")
    assert (error.message, error.hint) == ("The file is empty.", "Copy it again.")
    assert str(error) == "The file is empty. Copy it again."
    assert str(CoreError("The file is empty.")) == "The file is empty."


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_a_core_error_and_no_runtime_error(kind: type[CoreError]) -> None:
    # Worker helpers of Qt bindings swallow RuntimeError.
    assert issubclass(kind, CoreError)
    assert not issubclass(kind, RuntimeError)


@pytest.mark.parametrize("kind", KINDS)
def test_survives_a_process_boundary(kind: type[CoreError]) -> None:
    again = pickle.loads(pickle.dumps(kind("No.", "Try 2.")))
    assert type(again) is kind
    assert str(again) == "No. Try 2."


def test_cancelled_needs_no_words() -> None:
    assert str(Cancelled()) == "Cancelled."
