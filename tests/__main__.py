"""Run checks and tests: `python -m tests [--slow | --sweeps] [--coverage] [ARGS of pytest]`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CHECKS = {
    "lint": ["ruff", "check", "."],
    "format": ["ruff", "format", "--check", "."],
    "types": ["mypy"],
    "docs": ["mkdocs", "build", "--strict", "--quiet"],
}
LONG = {"--slow": "slow and not sweep", "--sweeps": "sweep"}  # which tests each word runs
WORKERS = ["-n", "auto", "--dist", "worksteal"]
COMPLETED = (0, 1)  # pytest's exit codes after a whole run: all passed, or some failed
INTERRUPTED = 130


def run(module: str, *arguments: str) -> int:
    return subprocess.run(
        [sys.executable, "-m", module, *arguments], cwd=ROOT, env=environment()
    ).returncode


def environment() -> dict[str, str]:
    """Return the environment for tests, which start hundreds of processes."""
    # Each would compile every module again.
    inherited = {k: text for k, text in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    # Large pages save a tenth of the time; only the GNU C library reads this.
    return {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1", **inherited}


def run_checks() -> list[int]:
    """Run the checks side by side, and print the report of each in order; return exit codes."""
    checks = {
        name: subprocess.Popen(
            [sys.executable, "-m", module, *options],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        for name, (module, *options) in CHECKS.items()
    }
    for name, process in checks.items():
        print(f"{name}: {' '.join(CHECKS[name])}", flush=True)
        report, _ = process.communicate()
        sys.stdout.buffer.write(report)
        print(f"{name}: FAILED" if process.returncode else f"{name}: passed", flush=True)
    return [process.returncode for process in checks.values()]


def run_quick_tests(arguments: list[str]) -> int:
    """Run the checks and the quick tests; pytest comes last, so its closing line is the last."""
    codes = run_checks()
    # Coverage adds a quarter to the time.
    coverage = ["--cov", "--cov-report=term"] if "--coverage" in arguments else []
    selection = [word for word in arguments if word != "--coverage"] or WORKERS
    codes.append(run("pytest", "-m", "not slow", *coverage, *selection))
    return next((code for code in codes if code), 0)


def run_slow_tests(kind: str, arguments: list[str]) -> int:
    """Run long tests of a kind; those that measure time come last, with nothing beside them."""
    if arguments:
        return run("pytest", "-m", kind, *arguments)
    code = run("pytest", "-m", f"{kind} and not alone", *WORKERS)
    if code not in COMPLETED:
        return code
    return run("pytest", "-m", f"{kind} and alone", *timing_files()) or code


def timing_files() -> list[str]:
    """List the files that measure time: importing all the others takes half a minute."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return [str(file) for file in files if ".alone" in file.read_text(encoding="utf-8")]


def main(arguments: list[str]) -> int:
    try:
        for word, kind in LONG.items():
            if word in arguments:
                return run_slow_tests(kind, [other for other in arguments if other != word])
        return run_quick_tests(arguments)
    except KeyboardInterrupt:
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
