"""Films, odd EXIF and XMP, and style files through readers, commands and the window: a sample.

`benchmarks/ui/hostile_media.py` runs them all; results/hostile-media.json there is what it found.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.helpers.hostile_data import Hostile
from tests.helpers.hostile_media import make_media, sound_files
from tests.helpers.hostile_runs import MOST_RSS, Case, Zygote, file_cases
from tests.helpers.hostile_window import DOORS, run_doors

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(1500),
    pytest.mark.skipif(sys.platform != "linux", reason="forks, and reads memory as Linux has it"),
]


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> list[Hostile]:
    return make_media(tmp_path_factory.mktemp("media") / "corpus")


@pytest.fixture(scope="module")
def zygote(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Zygote]:
    with Zygote(tmp_path_factory.mktemp("runs")) as process:
        yield process


def run(zygote: Zygote, cases: list[Case]) -> None:
    bad = {
        " ".join(done.case.words): (done.faults, done.err[-300:])
        for done in map(zygote.run, cases)
        if done.faults
    }
    assert not bad


def test_media_are_as_many_as_was_asked_for(corpus: list[Hostile]) -> None:
    assert len({each.path for each in corpus}) >= 400
    kinds = {each.kind for each in corpus}
    assert kinds == {"film", "picture", "light", "style"}


def test_readers_take_or_refuse_media(zygote: Zygote, corpus: list[Hostile]) -> None:
    call = ("call", "tests.helpers.hostile_readers", "read_all")
    sample = random.Random(3).sample(corpus, 60)
    run(zygote, [Case((*call, str(each.path)), (each.path,)) for each in sample])


def test_commands_take_or_refuse_media(zygote: Zygote, corpus: list[Hostile]) -> None:
    sound = sound_files(corpus[0].path.parent / "good")
    cases = [case for each in corpus for case in file_cases(each, sound)]
    quick = [case for case in cases if case.words[0] not in ("light", "simulate-camera")]
    run(zygote, random.Random(3).sample(quick, 40))


def test_doors_of_the_window_take_or_refuse_media(corpus: list[Hostile], tmp_path: Path) -> None:
    chance = random.Random(3)
    doors = DOORS[:-1]  # the last takes texts only
    visits = [(chance.choice(corpus).path, doors[number % len(doors)]) for number in range(26)]
    done, most, _ = run_doors(visits, tmp_path / "window", 1200)
    assert not [each for each in done if each.faults]
    assert len(done) == len(visits)
    assert most <= MOST_RSS
