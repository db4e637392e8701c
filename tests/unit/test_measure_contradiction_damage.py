"""Frames of a bracket whose JPEG was damaged so that it still decodes."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.measure.bracket.contradiction import disagreeing
from app.core.measure.read.decoding import proxy_shape, shrunk
from tests.helpers.cameras import Rig, room
from tests.helpers.captures import without_merging

Bytes = NDArray[np.uint8]


@cache
def bracket(model: str) -> tuple[list[bytes], list[float]]:
    """Files of a bracket of the studio, and their exposures in stops."""
    from app.devices.simulated.scene import Scene

    with TemporaryDirectory() as place, pytest.MonkeyPatch.context() as patch:
        without_merging(patch)
        made = Rig(Path(place) / "s", model, shape=(512, 1024), scene=Scene(300.0 * room(256)))
        result = made.shoot()
        files = [path.read_bytes() for path in result.frames]
        return files, [shot.ev_offset for shot in result.plan.shots]


def decoded(data: bytes) -> Bytes:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture, np.uint8)


def small(picture: Bytes) -> Bytes:
    return np.asarray(shrunk(picture, proxy_shape(picture.shape[:2])), np.uint8)


@pytest.mark.parametrize("model", ["V", "S", "A1"])
def test_whole_frames_agree(model: str) -> None:
    files, stops = bracket(model)
    assert disagreeing([small(decoded(data)) for data in files], stops) == ()


@pytest.mark.slow
def test_one_wrong_bit_in_the_coded_data() -> None:
    """The truth is the decoder's: how many pixels one flipped bit has changed."""
    files, stops = bracket("V")
    whole = [decoded(data) for data in files]
    dice = random.Random(1)
    found = []
    for _ in range(150):
        number = dice.randrange(3)
        data = bytearray(files[number])
        place = dice.randrange(data.index(b"\xff\xda") + 14, len(data) - 2)
        data[place] ^= 1 << dice.randrange(8)
        if 0xFF in data[place - 1 : place + 1]:
            continue
        damaged = decoded(bytes(data))
        frames = [small(each) for each in whole]
        frames[number] = small(damaged)
        changed = (cv2.absdiff(damaged, whole[number]).max(axis=2) > 16).mean()
        if changed > 0.1:
            found.append(number in disagreeing(frames, stops))
    assert len(found) >= 10
    assert np.mean(found) >= 0.6


def test_somebody_who_walks_and_a_lamp_that_goes_out_are_no_damage() -> None:
    files, stops = bracket("V")
    frames = [decoded(data) for data in files]
    frames[1] = frames[1].copy()
    frames[1][150:480, 300:420] = (90, 110, 140)
    frames[2] = frames[2].copy()
    frames[2][:, 600:900] //= 2
    assert disagreeing([small(each) for each in frames], stops) == ()


def test_two_frames_or_none_say_nothing() -> None:
    files, stops = bracket("V")
    assert disagreeing([small(decoded(data)) for data in files[:2]], stops[:2]) == ()
    assert disagreeing([], []) == ()
