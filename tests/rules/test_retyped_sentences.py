"""No test retypes a sentence of the program: it compares data, or what makes the sentence.

What this cannot see: parts of a sentence, labels without a full stop, and sentences in tests/data.
Tests of `app.words` themselves may write how data read.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[2]
_WORD = re.compile(r"[^\W\d_]{2,}")
_PLACEHOLDER = re.compile(r"\{[^}]*\}")
_FEWEST_WORDS = 4
_OF_WORDS = ("test_words_", "test_text_")


def _literals(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the strings of code and their lines, without docstrings."""
    for node in ast.walk(tree):
        children = ast.iter_child_nodes(node)
        for child in children:
            if isinstance(node, ast.Expr) and isinstance(child, ast.Constant):
                continue
            if isinstance(child, ast.Constant) and isinstance(child.value, str):
                yield child.lineno, child.value


def _sentences(tree: ast.AST) -> Iterator[str]:
    """Yield the sentences given to `tr` and `tr_plural`: four words or more, and a full stop."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            continue
        if node.func.id not in ("tr", "tr_plural"):
            continue
        for given in node.args[:2]:
            if isinstance(given, ast.Constant) and isinstance(given.value, str):
                words = _WORD.findall(_PLACEHOLDER.sub(" ", given.value))
                if len(words) >= _FEWEST_WORDS and given.value.endswith((".", "!", "?", "…")):
                    yield given.value


def _contains(text: str, sentence: str) -> bool:
    """Tell whether a text has the sentence in it, with anything in its placeholders."""
    parts = _PLACEHOLDER.split(sentence)
    if max(parts, key=len) not in text:
        return False
    return re.search(".+?".join(map(re.escape, parts)), text) is not None


def _retyped(tests: Iterable[tuple[str, str]], app: Iterable[str]) -> list[str]:
    """Return the places of sentences in tests, given as name and code, that are in app."""
    sentences = {one for code in app for one in _sentences(ast.parse(code))}
    return [
        f"{name}:{line}: {text}"
        for name, code in tests
        for line, text in _literals(ast.parse(code))
        if len(_WORD.findall(text)) >= _FEWEST_WORDS
        and any(_contains(text, sentence) for sentence in sentences)
    ]


def test_no_test_retypes_a_sentence() -> None:
    tests = (
        (path.relative_to(_ROOT).as_posix(), path.read_text(encoding="utf-8"))
        for path in sorted((_ROOT / "tests").rglob("test_*.py"))
        if not path.name.startswith(_OF_WORDS) and path != Path(__file__).resolve()
    )
    app = (path.read_text(encoding="utf-8") for path in sorted((_ROOT / "app").rglob("*.py")))
    assert _retyped(tests, app) == []


@pytest.mark.parametrize(
    ("code", "number"),
    [
        ('assert note == "The lamp is gone now."', 1),
        ('assert "So: The lamp is gone now. Go." in note', 1),
        ('assert note == "Frame 2 of 3 was lost."', 1),
        ('gone = "The lamp is gone now."\nassert note == gone', 1),
        ('"""The lamp is gone now."""', 0),
        ('assert "lamp is gone" in note', 0),
        ("assert note == GONE.format(count=2)", 0),
    ],
)
def test_a_planted_sentence_is_found(code: str, number: int) -> None:
    app = 'GONE = tr("The lamp is gone now.")\ntr("Frame {here} of {count} was lost.", here=1)\n'
    assert len(_retyped([("sample", code)], [app])) == number
