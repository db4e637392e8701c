"""Find code that reads a sentence: splits, searches, compares, shortens or looks up by it.

What makes a sentence: `tr`, `tr_plural`, whatever `app.words` returns, functions and properties
that return one of these, and names and tables that hold them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal, TypeAlias

Kind: TypeAlias = Literal["sentence", "table", "either"]

READS: Final = frozenset(
    {
        *("split", "rsplit", "partition", "rpartition", "splitlines", "find", "rfind", "index"),
        *("rindex", "startswith", "endswith", "removeprefix", "removesuffix", "replace", "count"),
        *("strip", "lstrip", "rstrip"),
    }
)
"""Methods of text that take it apart or look into it."""
_STRIPS: Final = frozenset({"strip", "lstrip", "rstrip"})
_TRANSLATES: Final = frozenset({"tr", "tr_plural"})
_PATTERNS: Final = frozenset(
    {"search", "match", "fullmatch", "findall", "finditer", "split", "sub"}
)
_HOLDS: Final = frozenset({"get", "values", "items", "pop", "copy"})
_FUNCTIONS: Final = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass
class _Body:
    """A function, and the nodes in it."""

    function: ast.FunctionDef | ast.AsyncFunctionDef
    nodes: list[ast.AST]


@dataclass
class Module:
    """A parsed file, with what its names stand for."""

    name: str
    where: str
    tree: ast.Module
    imports: dict[str, tuple[str, str]] = field(default_factory=dict)
    names: dict[str, Kind] = field(default_factory=dict)
    functions: dict[str, Kind] = field(default_factory=dict)
    nodes: list[ast.AST] = field(default_factory=list)
    bodies: list[_Body] = field(default_factory=list)


def readers(root: Path, package: str = "app") -> list[str]:
    """Name every place, as ``file:line: code``."""
    files = sorted((root / package).rglob("*.py"))
    modules = [_parsed(file, root) for file in files]
    return list(find(modules))


def find(modules: Iterable[Module]) -> Iterator[str]:
    """Look through parsed modules."""
    every = {module.name: module for module in modules}
    properties: dict[str, Kind] = {}
    # An attribute that is data somewhere cannot be told from a property of that name.
    fields = frozenset(name for module in every.values() for name in _fields(module.tree))
    while _learnt(every, properties, fields):
        pass
    for module in every.values():
        yield from _Finder(module, every, properties).find()


def parse(text: str, name: str = "app.sample") -> Module:
    """Parse one module from its text."""
    tree = ast.parse(text)
    module = Module(name, name.replace(".", "/") + ".py", tree)
    module.nodes = list(_own(tree.body))
    for node in ast.walk(tree):
        if isinstance(node, _FUNCTIONS):
            module.bodies.append(_Body(node, list(_own(node.body))))
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                module.imports[alias.asname or alias.name] = (node.module, alias.name)
    return module


def _parsed(file: Path, root: Path) -> Module:
    path = file.relative_to(root).with_suffix("")
    parts = path.parts[:-1] if path.name == "__init__" else path.parts
    module = parse(file.read_text(encoding="utf-8"), ".".join(parts))
    module.where = str(file.relative_to(root))
    return module


def _learnt(
    every: Mapping[str, Module], properties: dict[str, Kind], fields: frozenset[str]
) -> bool:
    """Find functions, properties and constants that hold sentences; whether any was new."""
    count = _known(every, properties)
    for module in every.values():
        scope = _Scope(module, every, properties, module.names)
        scope.assign(module.nodes)
        for body in module.bodies:
            kind = _returned(body, _Scope(module, every, properties, dict(module.names)))
            function = body.function
            if kind is None:
                continue
            if any(isinstance(d, ast.Name) and "property" in d.id for d in function.decorator_list):
                if function.name not in fields:
                    properties.setdefault(function.name, kind)
            else:
                module.functions.setdefault(function.name, kind)
    return _known(every, properties) != count


def _known(every: Mapping[str, Module], properties: Mapping[str, Kind]) -> int:
    return len(properties) + sum(len(one.names) + len(one.functions) for one in every.values())


def _fields(tree: ast.AST) -> Iterator[str]:
    """Names of the attributes that are data."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            for one in node.body:
                if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
                    yield one.target.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr


def _returned(body: _Body, scope: _Scope) -> Kind | None:
    returns = [node for node in body.nodes if isinstance(node, ast.Return) and node.value]
    if not returns:
        return None
    scope.enter(body)
    empty = [one for one in returns if isinstance(one.value, ast.Constant) and not one.value.value]
    return _joint([scope.kind(one.value) for one in returns if one not in empty])


def _own(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Walk through statements, but not into functions and classes inside."""
    for node in body:
        if isinstance(node, (*_FUNCTIONS, ast.ClassDef)):
            continue
        yield node
        yield from _own(ast.iter_child_nodes(node))


def _joint(kinds: list[Kind | None]) -> Kind | None:
    """What may be one or the other; a name with a sentence for a default is "either"."""
    if len(set(kinds)) == 1:
        return kinds[0]
    return "either" if any(kinds) else None


class _Scope:
    """What names stand for at one place."""

    def __init__(
        self,
        module: Module,
        every: Mapping[str, Module],
        properties: Mapping[str, Kind],
        names: dict[str, Kind],
    ) -> None:
        self.module, self.every, self.properties, self.names = module, every, properties, names
        self._hidden: set[str] = set()

    def enter(self, body: _Body) -> None:
        """Go into a function, whose arguments hide names of the module."""
        args = body.function.args
        self._hidden = {arg.arg for arg in (*args.posonlyargs, *args.args, *args.kwonlyargs)}
        for name in self._hidden:
            self.names.pop(name, None)
        self.assign(body.nodes)

    def assign(self, nodes: Iterable[ast.AST]) -> None:
        """Note which names are given sentences."""
        for node in nodes:
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    self._bind(target, node.value)
            elif isinstance(node, (ast.AnnAssign, ast.NamedExpr)) and node.value is not None:
                self._bind(node.target, node.value)
            elif isinstance(node, ast.For) and self.kind(node.iter) in ("table", "either"):
                self._spread(node.target)

    def _bind(self, target: ast.AST, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for one, other in zip(target.elts, value.elts, strict=False):
                self._bind(one, other)
            return
        kind = self.kind(value)
        if kind is None:
            return
        if isinstance(target, ast.Name):
            self.names.setdefault(target.id, kind)
        elif isinstance(target, ast.Tuple):
            self._spread(target)

    def _spread(self, target: ast.AST) -> None:
        for node in ast.walk(target):
            if isinstance(node, ast.Name):
                self.names.setdefault(node.id, "either")

    def kind(self, node: ast.expr | None) -> Kind | None:
        """Tell what an expression is; None for what is no sentence, or cannot be told."""
        match node:
            case ast.Call():
                return self._call(node)
            case ast.Name():
                return self.names.get(node.id) or self._imported(node.id, "names")
            case ast.Attribute():
                return self.properties.get(node.attr)
            case ast.JoinedStr():
                parts = [one.value for one in node.values if isinstance(one, ast.FormattedValue)]
                return "sentence" if any(map(self.kind, parts)) else None
            case ast.Starred():
                return self.kind(node.value)
            case ast.Subscript():
                return "either" if self.kind(node.value) in ("table", "either") else None
        return self._choice(node) or self._table(node)

    def _choice(self, node: ast.expr | None) -> Kind | None:
        match node:
            case ast.BinOp(op=ast.Add()):
                return self.kind(node.left) or self.kind(node.right)
            case ast.IfExp():
                return _joint([self.kind(node.body), self.kind(node.orelse)])
            case ast.BoolOp():
                return _joint([self.kind(one) for one in node.values])
        return None

    def _table(self, node: ast.expr | None) -> Kind | None:
        values: list[ast.expr] = []
        if isinstance(node, ast.Dict):
            values = node.values
        elif isinstance(node, (ast.Tuple, ast.List, ast.Set)):
            values = node.elts
        return "table" if any(map(self.kind, values)) else None

    def _call(self, node: ast.Call) -> Kind | None:
        function = node.func
        if isinstance(function, ast.Name):
            if function.id in _TRANSLATES:
                return "sentence"
            own = self.module.functions.get(function.id)
            return own or self._imported(function.id, "functions")
        if not isinstance(function, ast.Attribute):
            return None
        if function.attr == "join":
            return "sentence" if any(map(self.kind, node.args)) else None
        held = self.kind(function.value)
        if held and function.attr in _HOLDS:
            return "either"
        if held and function.attr in ("format", "lower", "upper", "casefold", "capitalize"):
            return "sentence"
        if isinstance(function.value, ast.Name):
            if function.value.id == "self":
                return self.module.functions.get(function.attr)
            package, name = self.module.imports.get(function.value.id, ("", ""))
            other = self.every.get(f"{package}.{name}")
            return None if other is None else other.functions.get(function.attr)
        return None

    def _imported(self, name: str, what: Literal["names", "functions"]) -> Kind | None:
        if name in self._hidden:
            return None
        package, origin = self.module.imports.get(name, ("", ""))
        other = self.every.get(package)
        if other is None:
            return None
        table: dict[str, Kind] = getattr(other, what)
        return table.get(origin)


def _is_plain(node: ast.expr) -> bool:
    """Whether a sentence may be compared to it: nothing, or what was shown before."""
    if isinstance(node, ast.Attribute):
        return isinstance(node.value, ast.Name) and node.value.id == "self"
    return isinstance(node, ast.Constant) and node.value in ("", None)


class _Finder:
    """Finds what reads sentences in one module."""

    def __init__(
        self, module: Module, every: Mapping[str, Module], properties: Mapping[str, Kind]
    ) -> None:
        self._module, self._every, self._properties = module, every, properties

    def find(self) -> Iterator[str]:
        """Look at the module's own statements, then at each function with its own names."""
        places = [(self._module.nodes, self._scope())]
        for body in self._module.bodies:
            scope = self._scope()
            scope.enter(body)
            places.append((body.nodes, scope))
        for nodes, scope in places:
            for node in nodes:
                if isinstance(node, ast.expr) and self._reads(node, scope):
                    yield f"{self._module.where}:{node.lineno}: {ast.unparse(node)}"

    def _scope(self) -> _Scope:
        names = dict(self._module.names)
        return _Scope(self._module, self._every, self._properties, names)

    def _reads(self, node: ast.expr, scope: _Scope) -> bool:
        match node:
            case ast.Call(func=ast.Attribute(attr=method, value=text)):
                # Without an argument it takes off spaces only.
                plain = method in _STRIPS and not node.args
                if method in READS and not plain and scope.kind(text) in ("sentence", "either"):
                    return True
                searched = isinstance(text, ast.Name) and text.id == "re" and method in _PATTERNS
                return searched and any(map(scope.kind, node.args))
            case ast.Subscript(slice=ast.Slice()):
                return scope.kind(node.value) == "sentence"
            case ast.Compare():
                return self._compares(node, scope)
            case ast.Dict():
                return any(key is not None and scope.kind(key) for key in node.keys)
        return False

    def _compares(self, node: ast.Compare, scope: _Scope) -> bool:
        sides = [node.left, *node.comparators]
        for operator, left, right in zip(node.ops, sides, sides[1:], strict=False):
            if isinstance(operator, (ast.In, ast.NotIn)):
                if scope.kind(left) == "sentence" or scope.kind(right) == "sentence":
                    return True
            elif isinstance(operator, (ast.Eq, ast.NotEq)):
                pair = (left, right)
                if not any(map(_is_plain, pair)) and "sentence" in map(scope.kind, pair):
                    return True
        return False
