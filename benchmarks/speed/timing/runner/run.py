"""All hot paths in one run."""

from __future__ import annotations

import importlib
import multiprocessing
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.core.base.progress import Token, silent, span
from app.devices.simulated.cameras import THETA_V
from benchmarks.speed.timing.environments import environment_cases
from benchmarks.speed.timing.headings import heading_cases
from benchmarks.speed.timing.lens import lens_cases
from benchmarks.speed.timing.light import light_cases
from benchmarks.speed.timing.merge import Bracket, make_bracket, merge_case
from benchmarks.speed.timing.painting import paint_case
from benchmarks.speed.timing.pictures import gallery_case, picture_cases
from benchmarks.speed.timing.preview import preview_case
from benchmarks.speed.timing.runner.bars import BARS, missed
from benchmarks.speed.timing.runner.machine import describe_machine, load_average
from benchmarks.speed.timing.runner.rows import bandwidth, time_all
from benchmarks.speed.timing.search import search_cases
from benchmarks.speed.timing.start import start_case

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

    from app.core.base.progress import PhraseReport
    from app.core.portrait.head_views import HeadViews
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack
    from benchmarks.speed.timing.runner.rows import Case, PeerCase, Row

PEERS: Final = {"colour-hdri": "colour_hdri", "skylibs": "envmap"}
"""Programs that are timed if they are installed, and their modules."""


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Results of one run.

    Attributes:
        bandwidth: Memory bandwidth, bytes per second.
        without: Peers that are not installed.
    """

    rows: tuple[Row, ...]
    bandwidth: float
    without: tuple[str, ...]
    machine: dict[str, Any]

    @property
    def missed(self) -> dict[str, tuple[str, ...]]:
        """Targets that were missed, by row."""
        return missed(self.rows)


def find_peers() -> dict[str, ModuleType]:
    """Import the peers that are installed."""
    found = {}
    for name, module in PEERS.items():
        try:
            found[name] = importlib.import_module(module)
        except ImportError:
            continue
    return found


def run_all(
    transport: Transport,
    pack: StylePack,
    report: PhraseReport,
    token: Token,
    *,
    views: HeadViews | None = None,
    peers: bool = True,
    only: str = "",
    brief: bool = False,
    shape: tuple[int, int] = THETA_V.shape,
) -> Bench:
    """Time every hot path.

    Args:
        report: Called with the row that is being timed.
        views: Views of the same head from the side; without them their rows are left out.
        only: Name of the only row to time.
        brief: Whether to stop timing a row as soon as it meets its targets.
        shape: Rows and columns of the bracket's frames.
    """
    before = load_average()
    speed = bandwidth()
    modules = find_peers() if peers else {}
    absent = [name for name in PEERS if name not in modules] if peers else [*PEERS]
    rows: list[Row] = []

    def timed(cases: Sequence[Case], start: float, stop: float) -> None:
        wanted = [case for case in cases if only in ("", case.name)]
        rows.extend(time_all(wanted, speed, span(report, start, stop), token, _enough(brief)))

    timed([*search_cases(transport, pack)], 0.0, 0.1)
    if views is not None:
        timed([*lens_cases(transport, pack, views)], 0.1, 0.15)
    stock = _stock(transport) if peers else ()
    if not stock:
        absent.append("Mitsuba")
    timed([*picture_cases(transport, stock), gallery_case(transport, pack)], 0.15, 0.3)
    timed([paint_case(transport)], 0.3, 0.35)
    timed([*light_cases(transport, pack, token)], 0.35, 0.45)
    timed([*environment_cases(modules.get("skylibs"))], 0.45, 0.55)
    timed([*heading_cases(token)], 0.55, 0.65)
    timed([preview_case(), start_case()], 0.65, 0.75)
    token.check()
    if only in ("", "merge.three"):
        report(0.75, "merge.three")
        rows.extend(_merge_apart(pack, shape, speed, peers, brief))
    machine = describe_machine() | {"load_before": before, "load_after": load_average()}
    return Bench(tuple(rows), speed, tuple(absent), machine)


def _enough(brief: bool) -> Callable[[Row], bool]:
    """Return the rule by which timing a row ends early."""
    return lambda row: brief and not missed([row])


def _merge_apart(
    pack: StylePack, shape: tuple[int, int], speed: float, peers: bool, brief: bool
) -> tuple[Row, ...]:
    """Shoot a bracket in a separate process, and time the merge in another.

    That is how the program gets the files of a camera. The history of a process changes the cost of
    its memory pages: after the simulator, OpenCV decodes in two thirds of the time.
    """
    with tempfile.TemporaryDirectory() as folder:
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as apart:
            bracket = apart.submit(make_bracket, Path(folder), None, shape).result()
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as apart:
            return apart.submit(_time_merge, bracket, pack, speed, peers, brief).result()


def _time_merge(
    bracket: Bracket, pack: StylePack, speed: float, peers: bool, brief: bool
) -> tuple[Row, ...]:
    token = Token()
    case = merge_case(bracket, pack, token, find_peers().get("colour-hdri") if peers else None)
    # OpenCV's merge is the baseline as well: without peers, its note is not worth seconds.
    case = case if peers else replace(case, peers=())
    return time_all([case], speed, silent, token, _enough(brief))


def as_json(found: Bench, head: str) -> dict[str, Any]:
    """Convert a run to plain values for saving and printing."""
    return {
        "head": head,
        "machine": found.machine,
        "processors": found.machine["cores"],
        "bandwidth_bytes_per_s": round(found.bandwidth),
        "peers_not_there": list(found.without),
        "rows": [_row_json(row) for row in found.rows],
        "missed": {name: list(words) for name, words in found.missed.items()},
    }


def _row_json(row: Row) -> dict[str, Any]:
    bar = BARS.get(row.name)
    return {
        "name": row.name,
        "seconds": row.seconds,
        "median_seconds": row.median_seconds,
        "baseline_seconds": row.baseline_seconds,
        "ratio": row.ratio,
        "limit_seconds": row.limit_seconds,
        "baseline": row.baseline,
        "limit": row.limit,
        "bar": bar.words if bar is not None else None,
        "peers": [
            {"name": peer.name, "seconds": peer.seconds, "note": peer.note} for peer in row.peers
        ],
    }


def _stock(transport: Transport) -> tuple[PeerCase, ...]:
    # Mitsuba is slow to import, and its scenes belong to baking.
    from benchmarks.speed.timing.stock import mitsuba_case

    case = mitsuba_case(transport)
    return () if case is None else (case,)
