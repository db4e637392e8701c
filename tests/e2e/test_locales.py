"""The program works the same whatever the language of the computer is.

Qt takes that language for C's functions: in Turkish the capital of "i" is another letter, in
German a decimal point is a comma, in Arabic there are other digits, and some systems name a
language that they do not have.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from app.core.base.paths import resources
from tests.helpers.cases import sample_first

pytestmark = pytest.mark.skipif(os.name != "posix", reason="languages as POSIX names them")

ROOT = Path(__file__).resolve().parents[2]
SCENE = resources() / "demo" / "scenes" / "studio.exr"
TURKISH = "tr_TR.UTF-8"
OLD_TURKISH = "tr_TR.ISO-8859-9"
MADE = (TURKISH, OLD_TURKISH, "de_DE.UTF-8", "ar_EG.UTF-8")
OTHERS = ("de_DE.UTF-8", "ar_EG.UTF-8", "C", "xx_XX.UTF-8")
PATIENCE_S = 280


def answers_to(name: str, folder: Path) -> bool:
    """Whether the system's C library has a language."""
    code = "import locale; locale.setlocale(locale.LC_ALL, '')"
    environment = {**os.environ, "LOCPATH": str(folder), "LC_ALL": name}
    done = subprocess.run([sys.executable, "-c", code], env=environment, check=False)
    return done.returncode == 0


@pytest.fixture(scope="session")
def languages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the languages that these tests take, made from the system's descriptions."""
    folder = tmp_path_factory.mktemp("languages")
    for name in MADE:
        territory, charset = name.split(".")
        if tool := shutil.which("localedef"):
            command = [tool, "-i", territory, "-f", charset, str(folder / name)]
            subprocess.run(command, capture_output=True, check=False)
        if not answers_to(name, folder):
            pytest.skip(f"no {name} and nothing to make it of; install the package 'locales'")
    return folder


def run(
    languages: Path, language: str, home: Path, *words: str
) -> subprocess.CompletedProcess[str]:
    environment = {
        **{key: value for key, value in os.environ.items() if not key.startswith(("LC_", "LANG"))},
        "LOCPATH": str(languages),
        "LC_ALL": language,
        "QT_QPA_PLATFORM": "offscreen",
        "TURNLIGHT_HOME": str(home),
        "PYTHONPATH": str(ROOT),
    }
    return subprocess.run(
        [sys.executable, "-P", *words],
        cwd=home,
        env=environment,
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        timeout=PATIENCE_S,
        check=False,
    )


def walk(languages: Path, language: str, home: Path, *words: str) -> dict[str, Any]:
    report = home / "walk.json"
    script = str(Path(__file__).with_name("locale_walk.py"))
    done = run(languages, language, home, script, str(report), *words)
    assert done.returncode == 0, done.stderr
    facts: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    assert not facts["error"]
    assert facts["code"] == 0
    assert "Traceback" not in done.stderr
    log = home / "logs" / "turnlight.log"
    assert "ERROR" not in log.read_text(encoding="utf-8")
    # Libraries in C read and write numbers with a point.
    assert facts["number"] == "0.5"
    return facts


def solve(languages: Path, language: str, home: Path) -> dict[str, Any]:
    """Answers of a style, without the time that they took; its sheet has letters of Turkish."""
    words = (str(SCENE), "--style", "left-loop", "--json", "--sheet", "ışık.png")
    done = run(languages, language, home, "-m", "app", "solve", *words)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "locale" not in done.stderr
    assert (home / "ışık.png").stat().st_size > 10_000
    answers: dict[str, Any] = json.loads(done.stdout)
    return answers | {"seconds": 0}


def test_names_from_qt_are_found_where_the_encoding_is_another(
    languages: Path, tmp_path: Path
) -> None:
    file = tmp_path / "ışık é.png"
    file.write_bytes(b"content")
    code = (
        "import sys; from app.core.base.native import native_path, path_from_library;"
        "assert sys.getfilesystemencoding() == 'iso8859-9', sys.getfilesystemencoding();"
        f"path = path_from_library({str(file)!a}); assert path.read_bytes() == b'content';"
        "import os; name = native_path(path).encode(); assert open(name, 'rb').read() == b'content'"
    )
    done = run(languages, OLD_TURKISH, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr


def test_window_starts_in_turkish(languages: Path, tmp_path: Path) -> None:
    assert walk(languages, TURKISH, tmp_path)["language"] == TURKISH


def test_solve_answers_in_turkish_as_in_no_language(languages: Path, tmp_path: Path) -> None:
    assert solve(languages, TURKISH, tmp_path) == solve(languages, "C", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("language", sample_first(OTHERS, 1))
def test_window_and_solve_work_in_other_languages(
    languages: Path, tmp_path: Path, language: str
) -> None:
    walk(languages, language, tmp_path)
    assert solve(languages, language, tmp_path) == solve(languages, TURKISH, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("language", sample_first([TURKISH, *OTHERS], 1))
def test_capture_and_saved_place_in_every_language(
    languages: Path, tmp_path: Path, language: str
) -> None:
    walk(languages, language, tmp_path, "--demo")
    (place,) = (tmp_path / "places").glob("*/place.json")
    facts = json.loads(place.read_text(encoding="utf-8"))
    environment = str(place.parent / facts["environment"])
    again = run(languages, language, tmp_path, "-m", "app", "solve", environment, "--json")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["styles"]
