"""What the program ships stays small enough for the package index."""

from __future__ import annotations

from pathlib import Path

RESOURCES = Path(__file__).resolve().parents[2] / "resources"
PORTRAITS = 18_000_000  # bytes, of all heads, skins and hair
TRANSPORTS = 30_000_000  # bytes, of all heads and their styles
VIEWS = 8_000_000  # bytes, of all heads from aside


def test_transports_styles_and_views_fit_their_budgets() -> None:
    size = {file: file.stat().st_size for file in (RESOURCES / "transport").glob("*.npz")}
    views = sum(size[file] for file in size if file.name.endswith(".views.npz"))
    assert views <= VIEWS
    assert sum(size.values()) - views <= TRANSPORTS


def test_portraits_fit_what_the_views_leave() -> None:
    size = {file: file.stat().st_size for file in RESOURCES.glob("*/*.npz")}
    views = sum(size[file] for file in size if file.name.endswith(".views.npz"))
    portraits = sum(size[file] for file in size if file.parent.name == "portraits")
    assert portraits <= PORTRAITS + VIEWS - views
