"""Quick tests read no clock: a slow or busy machine must not fail them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
CLOCKS = {"monotonic", "perf_counter", "process_time", "thread_time", "time"}
CLOCKS |= {f"{name}_ns" for name in CLOCKS}


def reads_clock(node: ast.AST) -> bool:
    """Whether a node is a call such as `time.monotonic()`; `time.time() + 7200` is a date."""
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == "time"
        and node.func.attr in CLOCKS
    )


def is_slow(nodes: list[ast.expr]) -> bool:
    """Whether marks include `slow`, or `sweep`, which is slow, too."""
    marks = ("mark.slow", "mark.sweep")
    return any(mark in ast.unparse(node) for mark in marks for node in nodes)


def dates(tree: ast.AST) -> set[ast.AST]:
    """Find the clocks that are read for a date far away, not to measure."""
    return {
        node.left
        for node in ast.walk(tree)
        if isinstance(node, ast.BinOp) and isinstance(node.right, ast.Constant)
    }


def quick_clocks(source: str) -> list[int]:
    """Return the lines of a file of tests on which a quick test, or a helper in it, measures.

    A function without a mark counts as quick, unless only slow tests call it.
    """
    tree = ast.parse(source)
    far = dates(tree)
    marks = [node for node in tree.body if isinstance(node, ast.Assign)]
    if any(
        ast.unparse(node.targets[0]) == "pytestmark" and is_slow([node.value]) for node in marks
    ):
        return []
    lines: list[int] = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and is_slow(node.decorator_list):
            continue
        parts = node.body if isinstance(node, ast.ClassDef) else [node]
        for part in parts:
            calls = [
                each.lineno
                for each in ast.walk(part)
                if isinstance(each, ast.Call) and reads_clock(each) and each not in far
            ]
            if not calls or (isinstance(part, ast.FunctionDef) and serves_slow(part, tree)):
                continue
            lines += calls
    return lines


def serves_slow(function: ast.FunctionDef, tree: ast.Module) -> bool:
    """Whether a function is a slow test, or a helper that slow tests alone use."""
    callers = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and node is not function
        and any(isinstance(each, ast.Name) and each.id == function.name for each in ast.walk(node))
    ]
    return is_slow(function.decorator_list) or (
        bool(callers) and all(is_slow(node.decorator_list) for node in callers)
    )


@pytest.mark.parametrize(
    "file",
    sorted(TESTS.glob("*/test_*.py")),
    ids=lambda file: file.relative_to(TESTS).as_posix(),
)
def test_quick_tests_read_no_clock(file: Path) -> None:
    lines = quick_clocks(file.read_text(encoding="utf-8"))
    assert not lines, "wait with tests.helpers.waiting, or measure in a test marked 'alone'"


def test_a_clock_in_a_quick_test_is_found() -> None:
    quick = "import time\ndef test_it():\n    start = time.monotonic()\n"
    assert quick_clocks(quick) == [3]
    assert not quick_clocks(quick.replace("def", "@pytest.mark.slow\ndef"))
    assert not quick_clocks("import time\ndef test_it():\n    sweep(time.time() + 7200)\n")


def test_a_timing_is_marked_alone() -> None:
    """What counts units of work or processor time must have the machine for itself."""
    wrong = []
    for file in TESTS.glob("*/test_*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef) or not node.name.startswith("test_"):
                continue
            measures = any(
                isinstance(each, ast.Call)
                and isinstance(each.func, ast.Name)
                and each.func.id == "units"
                for each in ast.walk(node)
            )
            if measures and "mark.alone" not in "".join(map(ast.unparse, node.decorator_list)):
                wrong.append(f"{file.name}: {node.name}")
    assert not wrong
