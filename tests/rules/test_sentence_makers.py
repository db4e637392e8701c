"""Core makes no sentence but for an exception; `app.words` makes the others."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.sentence_makers import Makers, makers_in

CORE = Path(__file__).resolve().parents[2] / "app" / "core"


def test_core_makes_no_sentence_but_for_an_exception() -> None:
    assert makers_in(CORE) == set()


IMPORTS = (
    "from app.core.base.errors import ProbeError\n"
    "from app.core.base.atomic_files import os_errors_as\n"
    "from app.core.text import tr\n"
)


def found(code: str, **others: str) -> int:
    return len(list(Makers({"sample": IMPORTS + code, **others}).found()))


@pytest.mark.parametrize(
    "code",
    [
        'raise ProbeError(tr("No."))',
        'error = ProbeError(tr("No."), tr("Do."))',
        'with os_errors_as(ProbeError, tr("No: {reason}.")):\n    pass',
        'HINT = tr("Do.")\ndef f():\n    raise ProbeError("", HINT)',
        'def f(x):\n    words = tr("No.") if x else tr("Not.")\n    raise ProbeError(words)',
        'def _what(x):\n    return tr("a {x}", x=x)\ndef f():\n    raise ProbeError(_what(1))',
        'def g(hint):\n    raise ProbeError("", hint)\ndef f():\n    g(tr("Do."))',
        'class Gone(ProbeError):\n    def __init__(self):\n        super().__init__(tr("Gone."))',
        "def g(x, words):\n    raise ProbeError(words(x))\n"
        'def f():\n    g(1, lambda x: tr("{x} pixels", x=x))',
    ],
)
def test_a_sentence_of_an_exception_is_allowed(code: str) -> None:
    assert found(code) == 0


@pytest.mark.parametrize(
    "code",
    [
        'tr("Done.")',
        'WORDS = tr("Done.")',
        'def f():\n    return tr("Done.")',
        'def f(log):\n    log.append(tr("Done."))',
        'WORDS = tr("No.")\ndef f(log):\n    log.append(WORDS)\n    raise ProbeError(WORDS)',
        'def _what():\n    return tr("it")\ndef f(log):\n    log.append(_what())',
        'def g(words):\n    return words\ndef f():\n    return g(tr("Done."))',
        'class A:\n    @property\n    def words(self):\n        return tr("Done.")',
    ],
)
def test_any_other_sentence_is_found(code: str) -> None:
    assert found(code) == 1


def test_a_constant_is_followed_to_where_it_is_imported() -> None:
    hint = 'AGAIN = tr("Again.")\n'
    raised = "from sample import AGAIN\ndef f():\n    raise ValueError(AGAIN)\n"
    told = "from sample import AGAIN\nLINES = [AGAIN]\n"
    assert found(hint, other=raised) == 0
    assert found(hint, other=raised, more=told) == 1
