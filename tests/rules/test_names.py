"""Names are nouns: a public class name occurs once in the app, and no participle names a thing."""

from __future__ import annotations

import ast
import functools
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[2]

# What was "found" is a match, a face, a camera; a name says which.
_PARTICIPLES = frozenset(
    re.findall(
        r"\w+",
        "asked begun caught felt forgotten found given gone heard kept known laid made met paid "
        "placed said sought seen shown taken told wanted written",
    )
)

# Keys of files that are on disks already, under the names of the fields that they fill.
_SAVED_KEYS = {
    ("app/core/measure/read/frame.py", "known"),
    ("app/core/places/journal.py", "taken"),
    ("app/core/places/place.py", "asked"),
    ("app/core/places/files/shots.py", "found"),
}
# Signals and events are named like those of Qt: clicked, moved, finished.
_SIGNALS = ("Signal", "Event")


@functools.cache
def _modules() -> tuple[tuple[str, ast.Module], ...]:
    paths = sorted((_ROOT / "app").rglob("*.py"))
    return tuple(
        (path.relative_to(_ROOT).as_posix(), ast.parse(path.read_text(encoding="utf-8")))
        for path in paths
    )


def _is_signal(value: ast.expr | None) -> bool:
    calls = value.elts if isinstance(value, ast.Tuple) else [value]
    names = [getattr(one, "func", None) for one in calls]
    return all(isinstance(name, ast.Name) and name.id in _SIGNALS for name in names)


def _names(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield every name that a module gives to something, with its line."""
    signals = {
        id(name)
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and _is_signal(node.value)
        for target in node.targets
        for name in ast.walk(target)
    }
    states = {
        id(name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and any("Enum" in ast.unparse(b) for b in node.bases)
        for line in node.body
        for name in ast.walk(line)
    }
    for node in ast.walk(tree):
        if id(node) in signals or id(node) in states:
            continue
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr, node.lineno


def test_public_classes_have_names_of_their_own() -> None:
    places = defaultdict(list)
    for path, tree in _modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(path)
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_names_are_no_participles() -> None:
    names = {
        (path, name)
        for path, tree in _modules()
        for name, _ in _names(tree)
        if name.strip("_").lower() in _PARTICIPLES
    }
    assert sorted(names - _SAVED_KEYS) == []


def test_saved_keys_are_still_there() -> None:
    names = {(path, name) for path, tree in _modules() for name, _ in _names(tree)}
    assert _SAVED_KEYS - names == set()
