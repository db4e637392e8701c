"""``turnlight bench``: how fast the hot paths are here, beside a plain implementation."""

from __future__ import annotations

import json
import os
import sys
from typing import TYPE_CHECKING, Any

from app.core.bench import run_all
from app.core.bench_light import run_light
from app.core.bench_merge import run_merge
from app.core.pack import load_named_pack, load_transport_of
from app.core.progress import Token, span

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from app.core.bench import Row

__all__ = ["add_parser", "run"]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the ``bench`` command to the command line.

    Parameters
    ----------
    subparsers : argparse._SubParsersAction
        Where commands are added.
    """
    parser = subparsers.add_parser(
        "bench",
        help="time the hot paths against a plain implementation",
        description="Time each hot path, a plain implementation of the same, and the time that "
        "its memory traffic alone would take here, all in one run.",
    )
    parser.add_argument(
        "--head", metavar="NAME", default="generic", help="head to use (default: %(default)s)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command.

    Parameters
    ----------
    args : argparse.Namespace
        With ``head`` and ``json``.

    Returns
    -------
    int
        0.

    Raises
    ------
    CoreError
        When the head is unknown or its files are damaged.
    """
    pack = load_named_pack(args.head)
    transport = load_transport_of(pack, args.head)
    rows, speed = run_all(transport, pack, span(_report, 0.0, 0.4), Token())
    rows += run_light(pack, transport, span(_report, 0.4, 0.6), Token(), speed)
    rows += run_merge(pack, span(_report, 0.6, 1.0), Token())
    if args.json:
        print(json.dumps(_as_json(rows, speed, args.head)))
    else:
        print(_table(rows, speed))
    return 0


def _report(fraction: float, message: str) -> None:
    print(f"{100 * fraction:3.0f} %  {message}", file=sys.stderr)


def _as_json(rows: Sequence[Row], speed: float, head: str) -> dict[str, Any]:
    return {
        "head": head,
        "processors": os.cpu_count(),
        "bandwidth_bytes_per_s": round(speed),
        "rows": [
            {
                "name": row.name,
                "seconds": row.seconds,
                "median_seconds": row.median_seconds,
                "baseline_seconds": row.baseline_seconds,
                "ratio": row.ratio,
                "limit_seconds": row.limit_seconds,
                "baseline": row.baseline,
            }
            for row in rows
        ],
    }


def _table(rows: Sequence[Row], speed: float) -> str:
    lines = [
        f"{'':<21}{'here':>10}{'median':>10}{'plain':>11}{'faster':>9}{'limit':>10}  plain is",
    ]
    for row in rows:
        times = [row.seconds, row.median_seconds, row.baseline_seconds]
        cells = [f"{1e3 * t:.3f}" for t in times]
        lines.append(
            f"{row.name:<21}{cells[0]:>10}{cells[1]:>10}{cells[2]:>11}"
            f"{row.ratio:>8.0f}x{1e3 * row.limit_seconds:>10.3f}  {row.baseline}"
        )
    lines += ["", f"Milliseconds. Limit: memory traffic at {speed / 1e9:.1f} GB/s, measured now."]
    return "\n".join(lines)
