"""Every sentence given to `tr` is a whole one that translators can find and fill in."""

from __future__ import annotations

import ast
import string
from pathlib import Path

import pytest
from babel.messages.extract import extract_from_dir

ROOT = Path(__file__).resolve().parents[2]
SPEAKS = {"tr": 1, "tr_plural": 2}
"""Functions that translate, and how many of their first arguments are sentences."""


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


@pytest.mark.parametrize(("where", "call"), calls())
def test_sentences_are_literal_and_their_names_are_given(where: str, call: ast.Call) -> None:
    assert isinstance(call.func, ast.Name)
    sentences = call.args[: SPEAKS[call.func.id]]
    given = {keyword.arg for keyword in call.keywords} | (
        {"count"} if call.func.id == "tr_plural" else set()
    )
    for node in sentences:
        assert isinstance(node, ast.Constant), f"{where}: a sentence is written, not computed"
        assert isinstance(node.value, str), where
        assert node.value == node.value.strip(), f"{where}: a piece of a sentence"
        if given and None not in given:  # None: a dictionary of values
            names = {name for _, name, _, _ in string.Formatter().parse(node.value) if name}
            assert names <= given, f"{where}: {names - given} are not given"


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
