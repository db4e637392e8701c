"""Lamps near the head against path-traced pictures of the same lamps.

The pictures were rendered by ``benchmarks/truth/near_field.py`` with two seeds; a small copy lies
beside the tests, so that this program's side is reckoned anew here.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.second_light.added_light import NearField, near_picture, prepare_near
from app.core.second_light.lamp_presets import parse
from app.core.solver.head_shape import load_shape_of
from app.core.solver.transport import load_named
from app.core.styles.style_pack_file import load_named_pack

ROOT = Path(__file__).resolve().parents[2]
BAR = 10.0  # per cent
DISTANCES_M = (0.3, 0.6, 1.0, 2.0)
KNOWN = 3.0  # per cent of noise up to which a render says what the truth is

_found = json.loads(
    (ROOT / "benchmarks" / "results" / "near-field.json").read_text(encoding="utf-8")
)
ROWS: list[dict[str, Any]] = _found["rows"]


@cache
def _near() -> tuple[NearField, NDArray[np.float64]]:
    transport = load_named("generic")
    weights = np.asarray(transport.header.luminance_weights)
    return prepare_near(transport, load_shape_of(transport, "generic")), weights


@cache
def _truth() -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Where the rendered pixels stand in the transport's, and the pictures, (cases, pixels)."""
    with np.load(ROOT / "tests" / "data" / "near-field.npz", allow_pickle=False) as stored:
        pixels, bright, pictures = stored["pixels"], stored["bright"], stored["pictures"]
    place = np.searchsorted(load_named("generic").pixels, pixels)
    return place, pictures.astype(np.float64) / 65535 * bright[:, None]


def test_the_renders_are_of_the_head_that_ships() -> None:
    header = load_named("generic").header
    assert (_found["head"], _found["skin"]) == (header.head, header.skin)
    assert _found["transport_sha256"] == load_named_pack("generic").header.transport_sha256
    assert _found["seeds"] == 2
    place, pictures = _truth()
    transport = load_named("generic")
    assert pictures.shape == (len(ROWS), _found["pixels"])
    # Every other pixel of the face, on both sides alike.
    assert transport.face[place].all()
    assert len(place) > 0.45 * np.count_nonzero(transport.face)
    assert {row["lamp"] for row in ROWS} >= {"phone", "panel"}
    for lamp in ("phone", "panel"):
        mine = [row for row in ROWS if row["lamp"] == lamp]
        assert {row["distance_m"] for row in mine} == set(DISTANCES_M)
        places = {(row["azimuth_deg"], row["altitude_deg"]) for row in mine}
        assert any(abs(azimuth) > 120 for azimuth, _ in places)
        assert any(altitude < -40 for _, altitude in places)
        assert len(mine) == len(places) * len(DISTANCES_M)


def test_nearly_every_render_is_surer_than_the_bar() -> None:
    noise = np.array([row["noise_percent"] for row in ROWS])
    assert np.count_nonzero(noise > KNOWN) <= 2
    assert noise.max() < 0.6 * BAR


@pytest.mark.parametrize("number", range(len(ROWS)))
def test_a_near_lamp_is_within_a_tenth_of_its_render(number: int) -> None:
    row = ROWS[number]
    near, weights = _near()
    place, pictures = _truth()
    lamp = parse(f"{row['lamp']}@{row['distance_m']:g}")
    picture = near_picture(near, lamp, row["azimuth_deg"], row["altitude_deg"]) @ weights
    picture, truth = picture[place], pictures[number]
    scale = float(picture @ truth) / float(picture @ picture)
    rmse = 100 * float(np.linalg.norm(scale * picture - truth) / np.linalg.norm(truth))
    assert rmse <= BAR
    assert rmse == pytest.approx(row["rmse_percent"], abs=0.2)
    # The unit is right too: no scale is needed.
    assert scale == pytest.approx(1.0, abs=0.05)
    # And nearness is what it takes: as if from afar it would be far off.
    if row["distance_m"] <= 0.6:
        assert row["as_if_far_percent"] > 1.5 * rmse
