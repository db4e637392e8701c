"""The whole window in the language "test": every word is translated, and nothing is cut off.

The walk is the one of ``--demo --screenshots``, at the designed size and in the compact layout.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from app.core.base.catalogue import stretched
from tests.helpers.spoken_window import untranslated

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@cache
def _walk(folder: Path) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-m", "tests.helpers.spoken_window", str(folder)],
        cwd=ROOT,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=580,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    facts: dict[str, Any] = json.loads(done.stdout)
    return facts


@pytest.fixture(scope="module")
def facts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return _walk(tmp_path_factory.mktemp("walk"))


def test_every_word_on_every_screen_is_translated(facts: dict[str, Any]) -> None:
    english = [f"{where}: {text}" for text, where in facts["english"].items()]
    assert not english, "\n" + "\n".join(english)


def test_nothing_is_cut_off_in_a_longer_language(facts: dict[str, Any]) -> None:
    assert not facts["clipped"], "\n" + "\n".join(facts["clipped"])


@pytest.mark.parametrize(
    ("text", "english"),
    [
        (stretched("Turn to this"), ""),
        ("Turn to this", "Turn to this"),
        ("[Ţåķé the lamp]", "the lamp"),
        ("THETA V, 82 %, 1.9 GB", ""),
        ("−1.5 EV, 1/250 s, A, 4:1, Ctrl+Z, place 1", ""),
        ("<b>Sun</b>", "Sun"),
    ],
)
def test_what_counts_as_translated(text: str, english: str) -> None:
    assert untranslated(text, ["place 1"]) == english
