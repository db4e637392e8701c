"""The benchmark: its plain implementations compute the same, and its rows are complete."""

from __future__ import annotations

import numpy as np
import pytest

from app.core import bench
from app.core.bench import Row, run_all
from app.core.errors import Cancelled
from app.core.progress import Token, silent
from app.core.search import curves, quality_curves
from app.core.solve import match_and_strength
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_pack

NAMES = [
    "solve.quality",
    "solve.match",
    "solve.match.product",
    "preintegrate.full",
    "preintegrate.stroke",
    "render.rgb",
    "paint.segment",
]


def test_plain_implementations_compute_the_same() -> None:
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    light = np.exp(np.random.default_rng(0).standard_normal((32, 64))).astype(np.float32)
    quality = quality_curves(pack.tables, pack.seen(light))
    plain = bench._plain_quality(pack.preintegrated, light)
    np.testing.assert_allclose(plain, quality, atol=1e-5 * np.abs(quality).max())
    match, _, _ = match_and_strength(pack, curves(pack.tables, pack.seen(light)))
    flat = pack.targets.reshape(len(pack.styles), -1, 3).astype(np.float32)
    pictures = (flat @ np.array([0.2126, 0.7152, 0.0722], np.float32))[:, transport.pixels]
    full = transport.matrix()
    np.testing.assert_allclose(bench._plain_match(full, pictures, light), match, atol=0.5)
    np.testing.assert_allclose(bench._product_match(full, pictures, light), match, atol=0.5)


def test_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "_time", lambda call, budget, most: (_once(call), 2.0))
    told: list[str] = []
    rows, speed = run_all(
        lambert_sphere_transport(),
        synthetic_pack(),
        lambda fraction, message: told.append(message),
        Token(),
    )
    assert [row.name for row in rows] == NAMES
    assert told == [*NAMES, *NAMES, "done"]
    assert speed > 0
    for row in rows:
        assert row.ratio == 1.0
        assert row.limit_seconds > 0


def _once(call: object) -> float:
    call()  # type: ignore[operator]
    return 1.0


def test_ratio() -> None:
    assert Row("a", 2.0, 3.0, 10.0, 1.0, "loop").ratio == 5.0


def test_timing_calls_at_least_three_times() -> None:
    calls: list[int] = []
    best, median = bench._time(lambda: calls.append(1), 0.0, 100)
    assert len(calls) >= 4
    assert 0 <= best <= median


def test_cancelling() -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        run_all(lambert_sphere_transport(), synthetic_pack(), silent, token)
