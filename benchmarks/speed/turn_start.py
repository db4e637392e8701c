"""Measure how soon Turn guides: times to the number and the live heading, first and second use.

Opens the whole window without a screen on the demo location and its webcam, presses "Turn to this",
and starts the program again on the same places. Besides wall time, which other programs extend, it
measures CPU time of all threads together, including the simulated webcam's. Writes
``results/turn-start.json``::

    QT_QPA_PLATFORM=offscreen python -m benchmarks.speed.turn_start
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from app.core.base.paths import resources
from app.core.localization import features
from app.devices.webcam import SimulatedWebcam
from app.ui.presenters.window_model import Step
from app.ui.screens.turn.screen_view import TurnScreen
from tests.helpers.watchdog import WatchedApplication
from tests.helpers.whole_window import OneWebcam, open_light, opened, until

RESULT = Path(__file__).resolve().parents[1] / "results" / "turn-start.json"
LOCATION = resources() / "demo" / "location"


def measured(
    application: WatchedApplication, home: Path, mark: str, *, fresh: bool, looks: bool = False
) -> dict[str, float]:
    """Go to Turn once: return seconds from the click to the number and to the live heading.

    Args:
        looks: Whether to look at the gallery first until all pictures are drawn and the background
            is learnt, instead of pressing the button as soon as it can be pressed.
    """
    webcam = SimulatedWebcam(LOCATION / "views")
    with opened(home, OneWebcam(webcam), camera_looks="sitter", sounds=False) as (app, robot):
        if fresh:
            open_light(app, robot, LOCATION / "probe-1.exr")
            robot.wait(lambda: app.model.place_folder is not None, "the place", 120)
        else:
            robot.wait(lambda: bool(app.model.results), "the last place", 120)
        app.model.update(step=Step.STYLES, chosen="right-below-side")
        robot.settle()
        until(robot, lambda: robot.find("Turn to this").isEnabled(), "the gallery", 60)
        if looks:
            light = app.model.light
            assert light is not None
            learnt = app.services.backgrounds.at_hand
            robot.wait(lambda: learnt(light) is not None, "the background", 60)
        application.mark = mark
        before = len(application.slow)
        begun, used = time.perf_counter(), time.process_time()
        robot.click("Turn to this")
        robot.wait(lambda: robot.window.findChild(TurnScreen) is not None, "the screen", 60)
        screen = robot.window.findChild(TurnScreen)
        assert screen is not None
        robot.wait(lambda: screen.column._degrees._number is not None, "the number", 60)
        screen.grab()
        number_s, number_cpu_s = time.perf_counter() - begun, time.process_time() - used
        tracker = screen.presenter._tracker
        robot.wait(lambda: tracker.index is not None, "the background", 60)
        learnt_s = time.perf_counter() - begun
        robot.wait(lambda: screen.presenter.resolve().scale.now_deg is not None, "live", 60)
        live_s, live_cpu_s = time.perf_counter() - begun, time.process_time() - used
        robot.wait(lambda: not app.runner.running("turn-index-keep"), "keeping", 60)
        slow = [event.cpu_s for event in application.slow[before:]]
    return {
        "number_s": round(number_s, 3),
        "number_processor_s": round(number_cpu_s, 3),
        "learnt_s": round(learnt_s, 3),
        "live_s": round(live_s, 3),
        "live_processor_s": round(live_cpu_s, 3),
        "longest_event_s": round(max(slow, default=0.0), 3),
    }


def main() -> None:
    """Measure, print and save."""
    application = WatchedApplication(["turn_start"])
    built: list[float] = []
    build = features.build_index

    def counted(panorama: Any, *rest: Any) -> Any:
        begun = time.thread_time()
        index = build(panorama, *rest)
        built.append(round(time.thread_time() - begun, 3))
        return index

    setattr(features, "build_index", counted)  # noqa: B010 - as its thread calls it
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        first = measured(application, home, "first", fresh=True)
        after = len(built)
        again = measured(application, home, "second", fresh=False)
        described = [after, len(built) - after]
        kept = sum(path.stat().st_size for path in home.rglob("background.points"))
        looked = measured(application, home / "looks", "looked", fresh=True, looks=True)
    found = {
        "first": first,
        "after a look at the gallery": looked,
        "after a restart": again,
        "backgrounds_described": described,
        "describing_cpu_s": built,
        "kept_megabytes": round(kept / 1e6, 2),
        "processors": os.cpu_count(),
        "load": round(float(np.mean(os.getloadavg()[:1])), 1),
    }
    print(json.dumps(found, indent=2))
    RESULT.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
