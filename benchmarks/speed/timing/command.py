"""``turnlight bench``: speed of the hot paths here, against plain code, limits and peers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.commands.shared.arguments import check_outputs, head_files
from app.commands.shared.console import stopping
from app.commands.shared.printing import ProgressPrinter
from app.core.base.atomic_files import atomic_write_text
from app.core.base.errors import CoreError, TransportError
from app.core.base.progress import Token
from app.core.portrait.head_views import load_views_of
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from benchmarks.speed.timing.runner.bars import BARS
from benchmarks.speed.timing.runner.rows import MEMORY
from benchmarks.speed.timing.runner.run import as_json, run_all

if TYPE_CHECKING:
    import argparse

    from app.core.portrait.head_views import HeadViews
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack
    from benchmarks.speed.timing.growth import Growth
    from benchmarks.speed.timing.runner.rows import Row
    from benchmarks.speed.timing.runner.run import Bench

_SPEED: Final = "speed.json"
_GROWTH: Final = "growth.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the help and arguments of ``bench``."""
    parser.description = (
        "Time each hot path, a plain implementation of the same, what the machine "
        "needs for it at least, and other programs that do the same job where they are "
        "installed, all in one run."
    )
    parser.add_argument(
        "--head", metavar="NAME", default="generic", help="head to use (default: %(default)s)"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--growth",
        action="store_true",
        help="instead: how cost grows with styles, turns, texels and frames",
    )
    which.add_argument("--only", choices=BARS, metavar="ROW", default="", help="time one row")
    parser.add_argument(
        "--no-peers", action="store_true", help="leave out other programs, some take minutes"
    )
    parser.add_argument(
        "--brief", action="store_true", help="stop timing a row as soon as it meets its targets"
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        type=Path,
        help=f"keep the numbers there ({_SPEED}; with --growth {_GROWTH} and a plot of each)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command.

    Returns:
        0, even if targets are missed, which is reported.

    Raises:
        CoreError: If the head is unknown, its files are damaged, or the folder cannot be written
            to.
        Cancelled: After Ctrl-C.
    """
    folder: Path | None = args.output
    if folder is not None:
        _make(folder)
        check_outputs([folder / _SPEED, folder / _GROWTH], head_files(args.head))
    pack = load_named_pack(args.head)
    transport = load_transport_of(pack, args.head)
    token = Token()
    with stopping(token):
        return (_grow if args.growth else _bench)(args, transport, pack, token)


def _bench(args: argparse.Namespace, transport: Transport, pack: StylePack, token: Token) -> int:
    peers = not args.no_peers
    views, only = _views(pack, args.head), args.only
    found = run_all(
        transport,
        pack,
        ProgressPrinter(),
        token,
        views=views,
        peers=peers,
        only=only,
        brief=args.brief,
    )
    values = as_json(found, args.head)
    # Printed first, so that minutes of measuring are not lost to a full disk.
    print(json.dumps(values) if args.json else _table(found))
    if args.output is not None:
        atomic_write_text(args.output / _SPEED, json.dumps(values, indent=1) + "\n")
    return 0


def _views(pack: StylePack, head: str) -> HeadViews | None:
    """Load the views of a head; one from an earlier version has none."""
    try:
        return load_views_of(pack, head)
    except TransportError:
        return None


def _grow(args: argparse.Namespace, transport: Transport, pack: StylePack, token: Token) -> int:
    # Only this needs the drawing code.
    from benchmarks.speed.timing.growth import grow, growth_json, growth_svg

    found = grow(transport, pack, ProgressPrinter(), token)
    values = growth_json(found, args.head)
    print(json.dumps(values) if args.json else "\n\n".join(_growth_table(one) for one in found))
    if args.output is not None:
        for growth in found:
            atomic_write_text(args.output / f"growth-{growth.name}.svg", growth_svg(growth) + "\n")
        atomic_write_text(args.output / _GROWTH, json.dumps(values, indent=1) + "\n")
    return 0


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise CoreError(
            f"Cannot make the folder {folder}: {reason}.", "Choose another one."
        ) from error


def _table(found: Bench) -> str:
    lines = [
        f"{'':<21}{'here':>10}{'median':>10}{'plain':>11}{'faster':>9}{'limit':>10}  "
        f"{'bar':<18}plain is",
    ]
    for row in found.rows:
        lines.append(_line(row, found))
        for peer in row.peers:
            more = peer.seconds / row.seconds
            lines.append(f"  {peer.name:<19}{1e3 * peer.seconds:>10.3f}  {more:.3g}x; {peer.note}")
    lines += [
        "",
        f"Milliseconds. Limit: memory traffic at {found.bandwidth / 1e9:.1f} GB/s, measured now; "
        f"{_limits(found)}.",
        "Indented: other programs at the same job, and how many times longer they take.",
    ]
    if found.without:
        lines.append(f"Not timed, since not installed or not wanted: {', '.join(found.without)}.")
    lines += [f"{name}: {'; '.join(words)}" for name, words in found.missed.items()]
    lines.append("Bars are missed." if found.missed else "All bars are met.")
    return "\n".join(lines)


def _limits(found: Bench) -> str:
    """Name the limits of another kind."""
    return "; ".join(f"{row.name}: {row.limit}" for row in found.rows if row.limit != MEMORY)


def _line(row: Row, found: Bench) -> str:
    cells = [f"{1e3 * t:.3f}" for t in (row.seconds, row.median_seconds, row.baseline_seconds)]
    bar = BARS[row.name].words if row.name in BARS else ""
    mark = " !" if row.name in found.missed else ""
    return (
        f"{row.name:<21}{cells[0]:>10}{cells[1]:>10}{cells[2]:>11}{row.ratio:>8.3g}x"
        f"{1e3 * row.limit_seconds:>10.3f}  {bar + mark:<18}{row.baseline}"
    )


def _growth_table(growth: Growth) -> str:
    width = max(12, *(len(name) + 2 for name in growth.series))
    lines = [f"{growth.name}: {growth.axis}; cost grows with the power {growth.slope:.2f}"]
    lines.append(f"{'':>10}" + "".join(f"{name:>{width}}" for name in growth.series))
    for k, size in enumerate(growth.sizes):
        cells: list[Any] = [f"{1e3 * values[k]:.3f}" for values in growth.series.values()]
        lines.append(f"{size:>10.4g}" + "".join(f"{cell:>{width}}" for cell in cells))
    return "\n".join([*lines, "Milliseconds."])
