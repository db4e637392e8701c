"""`python -m tests`: which checks run, in which order, and with which exit code."""

from __future__ import annotations

from pathlib import Path

import pytest

import tests.__main__ as checks


class Runs:
    """Records the modules that are run, and answers with the exit codes it was given."""

    def __init__(self, *codes: int) -> None:
        self.commands: list[list[str]] = []
        self.codes = list(codes)

    def __call__(self, module: str, *arguments: str) -> int:
        self.commands.append([module, *arguments])
        return self.codes.pop(0) if self.codes else 0


def runs(monkeypatch: pytest.MonkeyPatch, *codes: int) -> Runs:
    recorder = Runs(*codes)
    monkeypatch.setattr(checks, "run", recorder)
    monkeypatch.setattr(checks, "run_checks", list)
    return recorder


def test_quick_run_has_all_checks_and_pytest_last(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = runs(monkeypatch)
    assert [module for module, *_ in checks.CHECKS.values()] == ["ruff", "ruff", "mypy", "mkdocs"]
    monkeypatch.setattr(checks, "run_checks", lambda: [0, 0, 1, 0])
    assert checks.main([]) == 1
    assert recorder.commands == [["pytest", "-m", "not slow", *checks.WORKERS]]


def test_checks_report_in_order_and_name_the_failed_one(
    monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    calendar = {"good": ["calendar", "2026", "6"], "bad": ["calendar", "2026", "13"]}
    monkeypatch.setattr(checks, "CHECKS", calendar)
    codes = checks.run_checks()
    assert (codes[0], codes[1] != 0) == (0, True)
    report = capfdbinary.readouterr().out.decode()
    assert report.index("June 2026") < report.index("good: passed") < report.index("bad: FAILED")


def test_quick_run_counts_lines_only_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = runs(monkeypatch)
    checks.main([])
    assert "--cov" not in recorder.commands[-1]
    checks.main(["--coverage"])
    assert "--cov" in recorder.commands[-1]
    assert "--coverage" not in recorder.commands[-1]


def test_arguments_go_to_pytest_in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = runs(monkeypatch)
    checks.main(["-k", "turn"])
    assert recorder.commands[-1] == ["pytest", "-m", "not slow", "-k", "turn"]
    recorder.commands.clear()
    assert checks.main(["--slow", "-x"]) == 0
    assert recorder.commands == [["pytest", "-m", "slow and not sweep", "-x"]]


@pytest.mark.parametrize(
    ("codes", "count", "code"),
    [([0, 0], 2, 0), ([1, 0], 2, 1), ([0, 1], 2, 1), ([2], 1, 2), ([143], 1, 143)],
)
def test_tests_that_measure_time_run_last_and_alone(
    monkeypatch: pytest.MonkeyPatch, codes: list[int], count: int, code: int
) -> None:
    recorder = runs(monkeypatch, *codes)
    assert checks.main(["--slow"]) == code
    assert recorder.commands[0] == [
        "pytest",
        "-m",
        "slow and not sweep and not alone",
        *checks.WORKERS,
    ]
    assert len(recorder.commands) == count
    if count == 2:
        assert recorder.commands[-1][:3] == ["pytest", "-m", "slow and not sweep and alone"]
        assert recorder.commands[-1][3:] == checks.timing_files()


def test_timing_files_hold_every_test_that_measures_time() -> None:
    files = {Path(file).name for file in checks.timing_files()}
    assert {"test_speed.py", "test_app_walk.py"} <= files
    assert len(files) < 40
