"""Timing the light probe: three frames of a 360 camera to the light and the panorama to look at."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from app.core.bench import Row
from app.core.environment import read_environment, reduce_radiance
from app.core.paths import resources
from app.core.probe.planner import plan
from app.core.probe.probe import measure
from app.core.probe.theta_limits import theta_limits
from app.core.simulation.bracket_maker import meter, write_bracket
from app.core.simulation.cameras import THETA_V

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from app.core.pack import StylePack
    from app.core.progress import Report, Token

__all__ = ["run_merge"]

_SCENE: Final = "interior"
_EV100: Final = 8.0
_ROUNDS: Final = 9


def run_merge(
    pack: StylePack,
    report: Report,
    token: Token,
    shape: tuple[int, int] = THETA_V.shape,
) -> tuple[Row, ...]:
    """Time the merge of the paper's bracket, in memory, response check and audit included.

    Parameters
    ----------
    pack : StylePack
        For the audit.
    report : Report
        Told what is being timed.
    token : Token
        Checked between calls.
    shape : tuple[int, int], optional
        Rows and columns of the frames.

    Returns
    -------
    tuple of Row
        ``merge.three``: beside decoding the same files one after another and merging them by
        Debevec's weights, both by OpenCV. Its limit is that decoding alone.
    """
    radiance = read_environment(resources() / "demo" / "scenes" / f"{_SCENE}.exr").radiance
    light = radiance * np.float32(meter(radiance, THETA_V).factor * 2.0**_EV100)
    model = theta_limits(THETA_V.model)
    assert model is not None
    shots = [shot.exposure for shot in plan(meter(light, THETA_V), model.limits, "paper").shots]
    report(0.0, "making a bracket")
    with tempfile.TemporaryDirectory() as folder:
        files = write_bracket(Path(folder), light, THETA_V, shots, shape=shape)
        times = np.array([shot.shutter_s for shot in shots], np.float32)

        def merged() -> object:
            return reduce_radiance(
                measure(files, pack, token=token).merged.radiance, pack.header.environment
            )

        calls = (merged, lambda: _decode(files), lambda: _plain(files, times))
        found = _alternately(calls, report, token)
    fast, decoding, plain = (np.array(each) for each in found)
    return (
        Row(
            "merge.three",
            float(fast.min()),
            float(np.median(fast)),
            float(plain.min()),
            float(decoding.min()),
            "OpenCV: imread, then createMergeDebevec; limit: imread alone",
        ),
    )


def _alternately(
    calls: Sequence[Callable[[], object]], report: Report, token: Token
) -> list[list[float]]:
    """Time calls in turn, so that a busy moment of the machine spoils none of the ratios."""
    times: list[list[float]] = [[] for _ in calls]
    for lap in range(_ROUNDS + 1):
        for call, found in zip(calls, times, strict=True):
            token.check()
            report(lap / (_ROUNDS + 1), "merge.three")
            start = time.perf_counter()
            call()
            # The first lap only wakes what sleeps.
            if lap:
                found.append(time.perf_counter() - start)
    return times


def _decode(files: Sequence[Path]) -> list[NDArray[np.uint8]]:
    return [np.asarray(cv2.imread(str(file)), np.uint8) for file in files]


def _plain(files: Sequence[Path], times: NDArray[np.float32]) -> object:
    return cv2.createMergeDebevec().process(_decode(files), times)
