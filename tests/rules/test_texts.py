"""Every sentence given to `tr` is a whole one that translators can find and fill in."""

from __future__ import annotations

import ast
import string
from functools import cache
from pathlib import Path

import pytest
from babel.messages.extract import extract_from_dir

ROOT = Path(__file__).resolve().parents[2]
SPEAKS = {"tr": 1, "tr_plural": 2}
"""Functions that translate, and how many of their first arguments are sentences."""


@cache
def calls() -> list[tuple[str, ast.Call]]:
    found = []
    for file in sorted((ROOT / "app").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            name = (
                node.func.id
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
                else ""
            )
            if name in SPEAKS and isinstance(node, ast.Call):
                found.append((f"{file.relative_to(ROOT)}:{node.lineno}", node))
    return found


def faults(call: ast.Call) -> list[str]:
    """What keeps a call of `tr` or `tr_plural` from being translated."""
    assert isinstance(call.func, ast.Name)
    given = {keyword.arg for keyword in call.keywords}
    given |= {"count"} if call.func.id == "tr_plural" else set()
    found = []
    for node in call.args[: SPEAKS[call.func.id]]:
        if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
            found.append("a sentence is written, not computed")
        elif node.value != node.value.strip():
            found.append("a piece of a sentence")
        elif given and None not in given:  # None: a dictionary of values
            names = {name for _, name, _, _ in string.Formatter().parse(node.value) if name}
            found += [f"{name} is not given" for name in sorted(names - given)]
    return found


def test_sentences_are_literal_and_their_names_are_given() -> None:
    assert [f"{where}: {fault}" for where, call in calls() for fault in faults(call)] == []


@pytest.mark.parametrize(
    "text", ['tr(f"{x} cm")', 'tr(" left")', 'tr("{x} cm", y=1)', 'tr_plural("a" + b, "c", 2)']
)
def test_what_cannot_be_translated_is_noticed(text: str) -> None:
    call = ast.parse(text, mode="eval").body
    assert isinstance(call, ast.Call)
    assert len(faults(call)) == 1


@pytest.mark.slow
def test_translators_tools_find_every_sentence() -> None:
    keywords = {"tr": None, "tr_plural": (1, 2)}
    found = extract_from_dir(
        ROOT / "app", method_map=[("**.py", "python")], keywords=keywords, comment_tags=()
    )
    extracted = set()
    for _, _, message, _, _ in found:
        extracted |= {message} if isinstance(message, str) else set(message)
    for where, call in calls():
        assert isinstance(call.func, ast.Name)
        for node in call.args[: SPEAKS[call.func.id]]:
            assert isinstance(node, ast.Constant)
            assert node.value in extracted, where
