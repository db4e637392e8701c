"""Which of a test's many cases every change is checked with; the others belong to the sweeps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["sample_first"]


def sample_first(values: Iterable[Any], sample: int) -> list[Any]:
    """Return the values of a parameter, marking all but the first few for the sweeps.

    Args:
        values: One for each case; tuples where the test has several parameters.
        sample: How many cases every change is checked with.

    Returns:
        For `pytest.mark.parametrize`.
    """
    cases = list(values)
    return cases[:sample] + [_later(case) for case in cases[sample:]]


def _later(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.sweep)
