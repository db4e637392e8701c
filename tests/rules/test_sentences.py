"""Nobody reads a sentence that was made for people.

What this cannot see: sentences that arrive as arguments or as fields of data, and text that Qt
hands back. Layout that breaks lines or elides what does not fit works on arguments, and may.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.sentence_readers import find, parse, readers

ROOT = Path(__file__).resolve().parents[2]

WORDS = parse(
    'def verdict(x):\n    return tr("Out of reach: {why}", why=x)\n'
    'TABLE = {"a": tr("Yes"), "b": tr("No")}\n',
    "app.words.sample",
)


def test_no_code_reads_a_sentence() -> None:
    assert list(readers(ROOT)) == []


@pytest.mark.parametrize(
    "code",
    [
        'tr("The light is flat: {n}", n=1).partition(":")',
        'tr("One. Two.").split(". ")[0]',
        'tr("Too dark")[:7]',
        'message == tr("Looking for it")',
        'tr("Too dark") in message',
        'SHORTER = {tr("Too dark"): tr("Dark")}',
        're.search("[0-9]+", tr("{n} stops", n=2))',
        'GONE = tr("The webcam is gone.")\nlost = GONE.rstrip(".")',
        'GONE = tr("The webcam is gone.")\ndef f(said):\n    return said != GONE',
        "def f(x):\n    return verdict(x).partition(':')[0]",
        "def f(x):\n    words = verdict(x)\n    return words.replace('reach', 'sight')",
        "def f(x):\n    return f'{verdict(x)}!'.startswith('Out')",
        "def f(x):\n    return sample.verdict(x).split(':')",
        "def f(x):\n    return TABLE[x].startswith('Y')",
        "def f(x):\n    for word in TABLE.values():\n        word.split()",
        "class A:\n    @property\n    def words(self):\n        return tr('A. B.')\n"
        "def f(a):\n    return a.words.partition('. ')",
        "class A:\n    def say(self):\n        return tr('A. B.')\n"
        "    def first(self):\n        return self.say().partition('. ')",
    ],
)
def test_a_planted_reader_is_found(code: str) -> None:
    imports = "from app.words import sample\nfrom app.words.sample import TABLE, verdict\n"
    found = list(find([WORDS, parse(imports + code)]))
    assert len(found) == 1, found


@pytest.mark.parametrize(
    "code",
    [
        'if tr("Too dark") == "":\n    pass',
        "def f(x):\n    return TABLE[x]",
        "def f(x):\n    return x in TABLE",
        "def f(x):\n    return verdict(x) or 'none'",
        "def f(name):\n    return name.partition('.')[0]",
        "def f(TABLE):\n    return TABLE[0].split()",
    ],
)
def test_what_reads_no_sentence_is_left_alone(code: str) -> None:
    imports = "from app.words.sample import TABLE, verdict\n"
    assert list(find([WORDS, parse(imports + code)])) == []
