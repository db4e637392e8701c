"""Qt objects are set up by their setters, never by keywords.

PySide6 looks up the setter of a keyword property under the language of the computer: in Turkish
the capital of "interval" begins with another letter, and the constructor fails.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from PySide6.QtCore import QObject

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "app").rglob("*.py"))
ARGUMENTS = {"parent"}


def qt_classes(tree: ast.Module) -> set[str]:
    """Names in a module of Qt's classes that have properties, and of plain subclasses of them."""
    names = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("PySide6")
        for alias in node.names
        if isinstance(kind := getattr(import_module(str(node.module)), alias.name, None), type)
        and issubclass(kind, QObject)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and bases(node) & names and not own_constructor(node):
            names.add(node.name)
    return names


def bases(node: ast.ClassDef) -> set[str]:
    return {base.id for base in node.bases if isinstance(base, ast.Name)}


def own_constructor(node: ast.ClassDef) -> bool:
    return any(isinstance(part, ast.FunctionDef) and part.name == "__init__" for part in node.body)


def constructions(tree: ast.Module) -> Iterator[ast.Call]:
    """Give the calls of the constructors of Qt's classes, also by their subclasses."""
    names = qt_classes(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names:
            yield node
        if isinstance(node, ast.ClassDef) and bases(node) & names:
            for call in ast.walk(node):
                if isinstance(call, ast.Call) and ast.unparse(call.func) == "super().__init__":
                    yield call


def keywords(source: str) -> list[tuple[int, str]]:
    return [
        (call.lineno, keyword.arg or "**")
        for call in constructions(ast.parse(source))
        for keyword in call.keywords
        if keyword.arg not in ARGUMENTS
    ]


def test_qt_objects_take_no_keyword_properties() -> None:
    found = {
        file.relative_to(ROOT).as_posix(): lines
        for file in FILES
        if (lines := keywords(file.read_text(encoding="utf-8")))
    }
    assert not found


def test_rule_finds_properties_and_signals() -> None:
    source = """
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QLabel
class Plain(QLabel):
    pass
class Own(QLabel):
    def __init__(self):
        super().__init__("words", parent=None, indent=3)
QTimer(None, interval=0, timeout=print)
Plain("words", indent=2)
Own(1, more=3)
"""
    assert sorted(keywords(source)) == [
        (8, "indent"), (9, "interval"), (9, "timeout"), (10, "indent"),
    ]  # fmt: skip
