"""Data that tests may read but the project may not ship; absent on most machines."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"
_NAMED = os.environ.get("TURNLIGHT_SHARED")
SHARED = Path(_NAMED) if _NAMED else _BESIDE

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="needs data that is not shipped")
