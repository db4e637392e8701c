"""Reads the imports of a package from its source."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

__all__ = ["import_circles", "libraries", "libraries_by_module", "reached_from", "unreached"]


def import_circles(package: Path) -> frozenset[frozenset[str]]:
    """Return the groups of modules that import each other in a circle, if only for their types."""
    return _circles(_graph(package))


def libraries(package: Path) -> frozenset[str]:
    """Return the top-level names that a package imports, inside functions and for types too."""
    trees = (ast.parse(file.read_text(encoding="utf-8")) for file in package.rglob("*.py"))
    return frozenset().union(*map(_libraries, trees))


def libraries_by_module(package: Path) -> dict[str, frozenset[str]]:
    """Return the top-level names that each module of a package imports itself."""
    return {
        _name(package, file): _libraries(ast.parse(file.read_text(encoding="utf-8")))
        for file in package.rglob("*.py")
    }


def reached_from(package: Path, modules: Iterable[str]) -> dict[str, frozenset[str]]:
    """Return the modules that importing each of some modules leads to, itself among them.

    Imports inside functions and for types count too.
    """
    imports = _graph(package)
    return {name: frozenset(_reached(name, imports) | {name}) for name in modules}


def _graph(package: Path) -> dict[str, set[str]]:
    """Return the modules of the package that each of its modules imports."""
    files = {_name(package, file): file for file in sorted(package.rglob("*.py"))}
    imports: dict[str, set[str]] = {}
    for name, file in files.items():
        tree = ast.parse(file.read_text(encoding="utf-8"))
        imports[name] = _imported(tree, name, file.name == "__init__.py", set(files)) - {name}
    return imports


def _libraries(tree: ast.Module) -> frozenset[str]:
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.partition(".")[0])
    return frozenset(names)


def unreached(package: Path, entries: Iterable[str]) -> frozenset[str]:
    """Return the modules that no chain of imports leads to from some entry modules."""
    files = {_name(package, file): file for file in package.rglob("*.py")}
    imports: dict[str, set[str]] = {}
    for name, file in files.items():
        tree = ast.parse(file.read_text(encoding="utf-8"))
        # An import runs the packages around a module first.
        around = {name.rsplit(".", up)[0] for up in range(1, name.count(".") + 1)}
        imports[name] = _imported(tree, name, file.name == "__init__.py", set(files)) | around
    imports[""] = set(entries)
    return frozenset(files) - _reached("", imports)


def _name(package: Path, file: Path) -> str:
    parts = file.relative_to(package.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(tree: ast.Module, name: str, is_package: bool, known: set[str]) -> set[str]:
    """Return the modules of the package that a module imports, for its types too."""
    found: set[str] = set()
    here = name.split(".") if is_package else name.split(".")[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = here[: len(here) - node.level + 1] if node.level else []
            start = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            found.add(start)
            found.update(f"{start}.{alias.name}" for alias in node.names)
    # A package is not imported by naming what is in it.
    inside = {one for one in found if one in known}
    return {one for one in inside if not any(o.startswith(f"{one}.") for o in inside)}


def _circles(imports: dict[str, set[str]]) -> frozenset[frozenset[str]]:
    """Return the groups of modules that reach each other."""
    reached = {name: _reached(name, imports) for name in imports}
    groups = (
        frozenset(other for other in reached[name] if name in reached[other]) for name in imports
    )
    return frozenset(group for group in groups if len(group) > 1)


def _reached(name: str, imports: dict[str, set[str]]) -> set[str]:
    found: set[str] = set()
    left = [name]
    while left:
        new = imports.get(left.pop(), set()) - found
        found |= new
        left += new
    return found
