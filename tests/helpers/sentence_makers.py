"""Finds the sentences that a package makes other than for an exception.

A call of ``tr`` may stand in a ``raise``, in the call of an exception's class, or in a call that
takes an exception's class and raises it (`os_errors_as`). It may reach one of these by a variable,
a constant, an argument or the result of a function, if all that uses it is such a place.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

MAKERS = {"tr", "tr_plural"}
# Raise what they are given.
RAISERS = {"os_errors_as", "first_bytes", "read_arrays", "read_sealed"}
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)


@dataclass(eq=False)
class Module:
    """A parsed file: the parents of its nodes, and where its names come from."""

    name: str
    tree: ast.Module
    parents: dict[ast.AST, ast.AST] = field(default_factory=dict)
    imports: dict[str, tuple[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for node in ast.walk(self.tree):
            for child in ast.iter_child_nodes(node):
                self.parents[child] = node
            if isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    self.imports[alias.asname or alias.name] = (node.module, alias.name)

    def scope(self, node: ast.AST) -> ast.AST:
        """The function around a node, or the module."""
        while not isinstance(node, ast.Module):
            node = self.parents[node]
            if isinstance(node, _FUNCTIONS):
                return node
        return node

    def loads(self, name: str, within: ast.AST) -> Iterator[ast.Name]:
        """Uses of a name in a scope."""
        for node in ast.walk(within):
            if isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Load):
                yield node


class Makers:
    """Looks through the modules of a package."""

    def __init__(self, modules: dict[str, str]) -> None:
        self._modules = {name: Module(name, ast.parse(code)) for name, code in modules.items()}
        self._errors = {"Exception", "ValueError", "Unfit"} | {
            node.name
            for module in self._modules.values()
            for node in ast.walk(module.tree)
            if isinstance(node, ast.ClassDef) and self._is_error(node)
        }
        self._asked: dict[ast.AST, bool] = {}

    @staticmethod
    def _is_error(node: ast.ClassDef) -> bool:
        bases = [ast.unparse(base) for base in node.bases]
        return any(base.endswith("Error") or base == "Exception" for base in bases)

    def _is_class(self, name: str) -> bool:
        return name in self._errors or name.endswith("Error")

    def found(self) -> Iterator[tuple[str, int]]:
        """Module and line of each sentence that is made for something else than an error."""
        for module in self._modules.values():
            for node in ast.walk(module.tree):
                if not isinstance(node, ast.Call) or _name(node.func) not in MAKERS:
                    continue
                if not self._raised(module, node):
                    yield module.name, node.lineno

    def _raised(self, module: Module, node: ast.AST) -> bool:
        if node not in self._asked:
            self._asked[node] = True  # of a circle
            self._asked[node] = self._reaches(module, node)
        return self._asked[node]

    def _reaches(self, module: Module, node: ast.AST) -> bool:
        """Whether what a node makes ends in an exception, wherever it goes."""
        while True:
            child, node = node, module.parents[node]
            if isinstance(node, ast.Raise):
                return True
            if isinstance(node, ast.Call) and child is not node.func:
                if self._raises(module, node):
                    return True
                parameter = self._parameter(module, node, child)
                if parameter is not None and self._uses(*parameter):
                    return True
            if isinstance(node, (ast.Assign, ast.AnnAssign, ast.NamedExpr)):
                return self._assigned(module, node)
            if isinstance(node, (ast.Return, ast.Lambda)):
                return self._returned(module, node)
            if isinstance(node, ast.stmt):
                return False

    def _raises(self, module: Module, call: ast.Call) -> bool:
        name = _name(call.func)
        if self._is_class(name) or name in RAISERS:
            return True
        if any(self._is_class(_name(each)) for each in call.args):
            return True
        around = module.parents[module.scope(call)] if name == "__init__" else None
        return isinstance(around, ast.ClassDef) and self._is_error(around)

    def _assigned(self, module: Module, node: ast.Assign | ast.AnnAssign | ast.NamedExpr) -> bool:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [each.id for target in targets for each in ast.walk(target) if _is_name(each)]  # type: ignore[attr-defined]
        scope = module.scope(node)
        if isinstance(scope, ast.Module):
            return bool(names) and all(self._everywhere(module, name) for name in names)
        return bool(names) and all(self._uses(module, name, scope) for name in names)

    def _returned(self, module: Module, node: ast.AST) -> bool:
        function = node if isinstance(node, ast.Lambda) else module.scope(node)
        if isinstance(function, ast.Lambda):
            return self._raised(module, function)
        assert isinstance(function, ast.FunctionDef)
        around = module.parents[function]
        if isinstance(around, ast.ClassDef):
            return False
        return self._everywhere(module, function.name)

    def _parameter(
        self, module: Module, call: ast.Call, argument: ast.AST
    ) -> tuple[Module, str, ast.AST] | None:
        """The parameter that takes an argument, of a function here or imported, and its module."""
        home, name = module, _name(call.func)
        if name in module.imports:
            source, name = module.imports[name]
            home = self._modules.get(source, module)
        function = next(
            (
                each
                for each in ast.walk(home.tree)
                if isinstance(each, ast.FunctionDef) and each.name == name
            ),
            None,
        )
        if function is None:
            return None
        if isinstance(argument, ast.keyword):
            return (home, argument.arg, function) if argument.arg else None
        if argument not in call.args:
            return None
        names = [each.arg for each in function.args.args]
        number = call.args.index(argument)
        return (home, names[number], function) if number < len(names) else None

    def _uses(self, module: Module, name: str, scope: ast.AST) -> bool:
        uses = list(module.loads(name, scope))
        return bool(uses) and all(self._raised(module, use) for use in uses)

    def _everywhere(self, module: Module, name: str) -> bool:
        """Whether all uses of a name of a module, here and where it is imported, are errors."""
        uses = [(module, use) for use in module.loads(name, module.tree)]
        for other in self._modules.values():
            for here, origin in other.imports.items():
                if origin == (module.name, name):
                    uses += [(other, use) for use in other.loads(here, other.tree)]
        return bool(uses) and all(self._raised(where, use) for where, use in uses)


def _is_name(node: ast.AST) -> bool:
    return isinstance(node, ast.Name)


def _name(node: ast.AST) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def makers_in(root: Path) -> set[str]:
    """The files of a package that make sentences for something else than an error."""
    top = root.parents[1]
    names = {
        ".".join(path.relative_to(top).with_suffix("").parts): path for path in root.rglob("*.py")
    }
    makers = Makers({name: path.read_text(encoding="utf-8") for name, path in names.items()})
    return {names[name].relative_to(top).as_posix() for name, _ in makers.found()}
