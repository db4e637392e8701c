"""Captures over a bad line: one request in ten fails, in one of fourteen ways.

The whole proof is `benchmarks/cameras/bad_line.py`, kept in docs/camera.md; here runs a sample.
"""

from __future__ import annotations

import copy
import itertools
import json
import re
from pathlib import Path

import pytest

from app.devices.simulated.exchange import Reply, Request, json_reply
from tests.faulty_camera.bad_line import KINDS, BadLine
from tests.helpers.cameras import Rig
from tests.helpers.captures import (
    Weather,
    asked,
    rig,
    when,
    without_merging,
    without_waiting_for_the_disk,
)
from tests.helpers.cases import sample_first
from tests.helpers.simulated import content, stored


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    without_waiting_for_the_disk(monkeypatch)
    without_merging(monkeypatch)


def check_frames(made: Rig, frames: tuple[Path, ...]) -> None:
    """Each file is the camera's own, whole, as planned, and was shot once."""
    written = stored(made.camera)
    assert [path.read_bytes() for path in frames] == [file.data for file in written]
    assert len(frames) == 3


@pytest.mark.parametrize("kind", ["reset", "truncation", "stall"])
@pytest.mark.parametrize("seed", range(3))
def test_a_bad_line_to_a_forgetful_camera_stops_nothing(
    tmp_path: Path, kind: str, seed: int
) -> None:
    """A lost reply is not a lost connection: an SC2 keeps its settings then."""
    check_capture(tmp_path, "SC2", kind, seed)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", sample_first(["V", "SC2", "S", "A1", "insta360"], 2))
def test_a_bad_line_stops_nothing(tmp_path: Path, model: str, kind: str) -> None:
    check_capture(tmp_path, model, kind, seed=1)


def check_capture(folder: Path, model: str, kind: str, seed: int) -> None:
    made = rig(folder, model)
    before = copy.deepcopy(made.camera.options)
    line = BadLine(made.camera, kind, seed=seed)
    result = made.shoot()
    assert line.struck >= 3
    check_frames(made, result.frames)  # The picture for metering is gone.
    assert made.camera.options == before


@pytest.mark.parametrize("model", ["V", "S", "X", "A1"])
@pytest.mark.parametrize("path", ["/osc/commands/status", "/osc/commands/"])
def test_replies_without_an_id_stop_nothing(tmp_path: Path, model: str, path: str) -> None:
    """Nowhere but in the reply to the command itself, or not even there."""
    made = rig(tmp_path, model)
    before = copy.deepcopy(made.camera.options)
    answer = made.camera.answer

    def without(request: Request) -> Reply:
        reply = answer(request)
        if not request.target.startswith(path):
            return reply
        body = re.sub(rb'"id": "?\w+"?, ', b"", content(reply))
        return json_reply(json.loads(body), reply.status)

    made.camera.answer = without  # type: ignore[method-assign]
    result = made.shoot()
    check_frames(made, result.frames)
    assert made.camera.options == before
    assert asked(made, "startCapture") == (0 if model == "A1" else 1)


@pytest.mark.slow
@pytest.mark.parametrize("away_s", [60.0, 120.0])
@pytest.mark.parametrize("model", sample_first(["SC2", "V", "S"], 1))
@pytest.mark.parametrize("words", ["_filter", "takePicture", "startCapture", "type=thumb"])
def test_the_wifi_goes_away_and_comes_back(
    tmp_path: Path, model: str, words: str, away_s: float
) -> None:
    made = rig(tmp_path, model)
    before = copy.deepcopy(made.camera.options)
    weather = Weather(made)
    when(made, words, lambda: weather.lose(away_s))
    result = made.shoot()
    check_frames(made, result.frames)
    assert made.camera.options == before
    assert asked(made, "startCapture") <= 2
    left = [each.seconds_left for each in made.seen if each.seeking]
    assert len(left) > away_s / 4.0
    assert all(one is not None for one in left)
    assert any(a and b and 0.5 < a - b <= 1.01 for a, b in itertools.pairwise(left))
