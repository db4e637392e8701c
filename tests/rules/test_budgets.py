"""The program's size goes down only, but for what each new feature is allowed to add."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.house import House, counted

ROOT = Path(__file__).resolve().parents[2]
LINES, MODULES, CODE = 100_966, 414, 70_248  # with what measuring without a 360 camera may add
DOCSTRINGS_A_LINE = 0.216
SINGLE = 48
CIRCLES = 0
PORTRAITS = 18_000_000  # bytes, of all heads, skins and hair
TRANSPORTS = 30_000_000  # bytes, of all heads and their styles
VIEWS = 8_000_000  # bytes, of all heads from aside


@pytest.fixture(scope="module")
def house() -> House:
    return counted(ROOT / "app")


def test_lines_and_modules(house: House) -> None:
    assert house.lines <= LINES
    assert house.modules <= MODULES
    assert house.code <= CODE


def test_docstrings_beside_code(house: House) -> None:
    assert house.docstrings <= DOCSTRINGS_A_LINE * house.code


def test_modules_that_one_neighbour_imports(house: House) -> None:
    assert len(house.single) <= SINGLE


def test_import_circles(house: House) -> None:
    assert len(house.circles) <= CIRCLES


def test_transports_styles_and_views() -> None:
    folder = ROOT / "resources" / "transport"
    size = {file: file.stat().st_size for file in folder.glob("*.npz")}
    views = sum(size[file] for file in folder.glob("*.views.npz"))
    assert views <= VIEWS
    assert sum(size.values()) - views <= TRANSPORTS


def test_portraits() -> None:
    """From aside they are drawn from what the budget for views leaves, and what packing saved."""
    size = {file: file.stat().st_size for file in (ROOT / "resources").glob("*/*.npz")}
    views = sum(size[file] for file in size if file.name.endswith(".views.npz"))
    portraits = sum(size[file] for file in size if file.parent.name == "portraits")
    assert portraits <= PORTRAITS + VIEWS - views


def test_what_is_counted(tmp_path: Path) -> None:
    """By hand: a package of four modules, two in a circle, one with one neighbour."""
    package = tmp_path / "shop"
    package.mkdir()
    (package / "__init__.py").write_text('"""A shop."""\n')
    (package / "till.py").write_text(
        '"""The till.\n\nTwo lines more.\n"""\n\nfrom shop import stock\n\n# A comment.\nX = 1\n'
    )
    (package / "stock.py").write_text(
        "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from shop.till import X\n"
    )
    (package / "door.py").write_text('from .till import X\n\nTEXT = """one\ntwo"""\n')
    found = counted(package)
    assert (found.lines, found.modules, found.docstrings) == (18, 4, 5)
    assert found.code == 2 + 3 + 3
    assert found.single == {"shop.stock"}
    assert found.circles == {frozenset({"shop.till", "shop.stock"})}
