"""No slot or event handler touches widgets that may be half destroyed when it runs.

While Qt takes a dialog down, the focus moves, widgets are hidden and lists of children have gaps.
To wrap one of those gaps for Python ends the whole program (``std::bad_typeid``).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "app" / "ui").rglob("*.py"))
SEARCHING = {"findChildren", "findChild", "children"}
RISKY = {"focusChanged", "destroyed"}


def functions(tree: ast.Module) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def slots(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Give the risky signals that are connected, each with what takes it."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Attribute(value=ast.Attribute(attr=signal), attr="connect")):
                if signal in RISKY:
                    yield signal, node.args[0]


def name_of(slot: ast.expr) -> str:
    return slot.attr if isinstance(slot, ast.Attribute) else getattr(slot, "id", "")


def handlers(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    connected = {name_of(slot) for _, slot in slots(tree)}
    for name, function in functions(tree).items():
        if name.endswith("Event") or name in {"event", "eventFilter"} or name in connected:
            yield function


def test_who_follows_the_focus_takes_neither_widget() -> None:
    found = 0
    for file in FILES:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        for signal, slot in slots(tree):
            if signal == "focusChanged":
                function = functions(tree)[name_of(slot)]
                assert [one.arg for one in function.args.args] == ["self"], file
                found += 1
    assert found >= 3


def test_no_handler_looks_through_the_children() -> None:
    for file in FILES:
        for function in handlers(ast.parse(file.read_text(encoding="utf-8"))):
            called = {
                node.func.attr
                for node in ast.walk(function)
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            }
            assert not called & SEARCHING, f"{file}: {function.name}"


def test_dialogs_for_files_are_asked_in_one_place() -> None:
    using = [file.name for file in FILES if "QFileDialog" in file.read_text(encoding="utf-8")]
    assert using == ["dialogs.py"]
