"""Files and options that should not be: a fixed sample through every command.

`benchmarks/ui/hostile_files.py` runs them all; results/hostile-files.json there is what it found.
"""

from __future__ import annotations

import os
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.cli import COMMANDS
from tests.helpers.hostile_data import Hostile
from tests.helpers.hostile_files import make_corpus
from tests.helpers.hostile_runs import Case, Zygote, file_cases, option_cases

pytestmark = pytest.mark.skipif(os.name != "posix", reason="forks")


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> list[Hostile]:
    return make_corpus(tmp_path_factory.mktemp("hostile") / "corpus", bombs=False)


@pytest.fixture(scope="module")
def zygote(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Zygote]:
    with Zygote(tmp_path_factory.mktemp("runs")) as process:
        yield process


def _sound(corpus: list[Hostile]) -> Path:
    return corpus[0].path.parent


def _run(zygote: Zygote, cases: list[Case]) -> None:
    bad = {
        " ".join(done.case.words): (done.faults, done.err[-300:])
        for done in map(zygote.run, cases)
        if done.faults
    }
    assert not bad


@pytest.mark.slow
def test_the_corpus_is_as_large_as_was_asked_for(corpus: list[Hostile]) -> None:
    assert len(corpus) >= 400
    options = option_cases(_sound(corpus))
    assert len(options) >= 350
    assert {case.words[0] for case in options} == set(COMMANDS)


def _of_files(corpus: list[Hostile], count: int) -> list[Case]:
    cases = [case for each in corpus for case in file_cases(each, _sound(corpus))]
    quick = [case for case in cases if case.words[0] not in ("bench", "light", "bake")]
    return random.Random(1).sample(quick, count)


def _of_options(corpus: list[Hostile], count: int) -> list[Case]:
    cases = [case for case in option_cases(_sound(corpus)) if case.stop_s is None]
    quick = [case for case in cases if case.words[0] not in ("light", "locate")]
    return random.Random(1).sample(quick, count)


@pytest.mark.slow
def test_a_few_files_through_their_commands(zygote: Zygote, corpus: list[Hostile]) -> None:
    _run(zygote, _of_files(corpus, 30))


@pytest.mark.slow
def test_a_few_options(zygote: Zygote, corpus: list[Hostile]) -> None:
    _run(zygote, _of_options(corpus, 25))


@pytest.mark.sweep
@pytest.mark.timeout(1800)
def test_more_files_and_options(zygote: Zygote, corpus: list[Hostile]) -> None:
    _run(zygote, _of_files(corpus, 500) + _of_options(corpus, 250))
