"""The benchmark: its plain implementations compute the same, and its rows are complete."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest

from app.core.base.angles import difference
from app.core.base.errors import Cancelled, CoreError
from app.core.base.progress import Token, silent
from app.core.portrait.head_views import load_views_of
from app.core.solver.search import curves, quality_curves
from app.core.solver.solve import measure
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from benchmarks.speed.plain_search import matrix
from benchmarks.speed.timing import growth, merge, start
from benchmarks.speed.timing.environments import environment_cases
from benchmarks.speed.timing.growth import Growth, grow, growth_json, growth_svg
from benchmarks.speed.timing.headings import heading_cases
from benchmarks.speed.timing.lens import lens_cases
from benchmarks.speed.timing.pictures import gallery_case, picture_cases
from benchmarks.speed.timing.preview import preview_case
from benchmarks.speed.timing.runner import machine, run
from benchmarks.speed.timing.runner.bars import BARS, Bar, missed
from benchmarks.speed.timing.runner.rows import (
    Case,
    Peer,
    PeerCase,
    Row,
    bandwidth,
    clock,
    time_all,
)
from benchmarks.speed.timing.runner.run import find_peers, run_all
from benchmarks.speed.timing.search import plain_match, plain_quality, product_match
from tests.helpers.synthetic import lambert_sphere_transport, synthetic_pack


def row(name: str = "a", seconds: float = 2.0, plain: float = 10.0, limit: float = 1.0) -> Row:
    return Row(name, seconds, seconds, plain, limit, "loop")


def test_plain_searches_compute_the_same() -> None:
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    light = np.exp(np.random.default_rng(0).standard_normal((32, 64))).astype(np.float32)
    quality = quality_curves(pack.tables, pack.project(light))
    plain = plain_quality(pack.preintegrated, light)
    np.testing.assert_allclose(plain, quality, atol=1e-5 * np.abs(quality).max())
    match = measure(pack, curves(pack.tables, pack.project(light))).match
    flat = pack.targets.reshape(len(pack.styles), -1, 3).astype(np.float32)
    pictures = (flat @ np.array([0.2126, 0.7152, 0.0722], np.float32))[:, transport.pixels]
    full, root = matrix(transport), np.sqrt(pack.region_on(transport)).astype(np.float32)
    np.testing.assert_allclose(plain_match(full, pictures, root, light), match, atol=0.5)
    np.testing.assert_allclose(product_match(full, pictures, root, light), match, atol=0.5)


def test_plain_search_of_all_yaws_computes_the_same() -> None:
    pack = load_named_pack("generic")
    views = load_views_of(pack, "generic")
    curves_, answers = lens_cases(load_transport_of(pack, "generic"), pack, views)
    assert (curves_.name, answers.name) == ("solve.match.yaw", "answers.yaw")
    # The others are judged by the whole head.
    rows = [row for row, style in enumerate(pack.styles) if not style.signature.areas]
    found = curves_.fast()
    for yaw, plain in zip(views.yaws, curves_.plain(), strict=True):
        np.testing.assert_allclose(plain[rows], found[yaw][0][rows], atol=1.0)
    assert [one.name for one in answers.fast()] == [style.name for style in pack.styles]
    assert answers.plain().shape == (len(pack.styles),)


def test_plain_pictures_are_the_same() -> None:
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    full, stroke, rgb = picture_cases(transport)
    ours = np.asarray(full.fast())
    np.testing.assert_allclose(np.ravel(ours), full.plain(), atol=1e-4 * np.abs(ours).max())
    assert np.shape(stroke.fast()) == (32, 64)
    theirs = np.stack(rgb.plain(), axis=1)
    np.testing.assert_allclose(rgb.fast(), theirs, rtol=1e-3, atol=1e-4 * theirs.max())
    gallery = gallery_case(transport, pack)
    cards = np.asarray(gallery.fast(), np.float64) / 255.0
    for card, plain in zip(cards, gallery.plain(), strict=True):
        # The plain way shows the whole picture, the gallery a little less of it.
        assert np.corrcoef(card.ravel(), np.ravel(plain))[0, 1] > 0.7


def test_plain_panoramas_are_the_same() -> None:
    reduced, turned, rotated = environment_cases()
    ours = np.asarray(reduced.fast())
    np.testing.assert_allclose(reduced.plain(), ours, rtol=1e-4)
    # The plain way turns to the nearest column.
    apart = np.abs(np.asarray(turned.plain()) - np.asarray(turned.fast()))
    assert np.median(apart) <= 0.02 * np.median(np.asarray(turned.fast()))
    ours = np.asarray(rotated.fast())[8:-8]
    apart = np.abs(np.asarray(rotated.plain())[8:-8] - ours)
    assert np.median(apart) <= 1e-3 * np.median(ours)
    assert callable(rotated.limit)
    assert np.shape(rotated.limit()) == np.shape(rotated.fast())


@pytest.mark.slow
def test_plain_headings_are_right() -> None:
    search, track = heading_cases(Token())
    plain = search.plain()
    for case in (search, track):
        found = case.fast()
        assert found.status == "found"
        assert abs(difference(found.heading_deg, -140.0)) < 2.0
    # Parallax, which the textbook knows nothing of, moves it.
    assert abs(difference(float(plain), -140.0)) < 8.0


def test_previews_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    decoded: list[np.ndarray] = []
    case = preview_case()
    original = np.asarray

    def note(*given: Any) -> np.ndarray:
        decoded.append(original(*given))
        return decoded[-1]

    monkeypatch.setattr(
        "benchmarks.speed.timing.preview.np",
        SimpleNamespace(
            asarray=note,
            frombuffer=np.frombuffer,
            uint8=np.uint8,
        ),
    )
    for _ in range(3):
        case.fast()
    ours = decoded[-1]
    case.plain()
    theirs = decoded[-1]
    assert ours.shape == (512, 1024, 3)
    np.testing.assert_array_equal(ours, theirs)


def test_merges_are_of_the_same_light(tmp_path: Path) -> None:
    bracket = merge.make_bracket(tmp_path, None, (256, 512))
    fake = SimpleNamespace(
        ImageStack=list,
        Metadata=lambda *about: about,
        Image=lambda data, metadata: (data, metadata),
        weighting_function_Debevec1997=None,
        image_stack_to_HDRI=lambda stack, **_: merge.debevec(bracket),
    )
    case = merge.merge_case(bracket, synthetic_pack(), Token(), fake)  # type: ignore[arg-type]
    assert callable(case.limit)
    assert len(case.limit()) == len(bracket.files) == 3
    for peer in case.peers:
        off, ours = (float(word) for word in peer.judge(peer.work()).split() if word[0].isdigit())
        assert ours < 3.0
        assert off < 10.0
    assert [peer.name for peer in case.peers] == ["OpenCV", "colour-hdri"]


def hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    """One call each: how fast it is is not what is tested."""

    def once(work: Callable[[], Any], *_: object, **__: object) -> list[float]:
        work()
        return [0.001]

    monkeypatch.setattr("benchmarks.speed.timing.runner.rows.clock", once)
    monkeypatch.setattr(growth, "clock", once)


@pytest.mark.slow
def test_cost_is_measured_at_every_size(monkeypatch: pytest.MonkeyPatch) -> None:
    hurry(monkeypatch)
    monkeypatch.setattr(growth, "_WIDTHS", (128, 256))
    monkeypatch.setattr(growth, "_STYLES", (1, 18))
    monkeypatch.setattr(growth, "_TURNS", (1, 4))
    monkeypatch.setattr(growth, "_ROWS", (16, 32))
    monkeypatch.setattr(growth, "_FRAMES", ((0.0, -2.0),))
    monkeypatch.setattr(growth, "_MANY", (0.0, 2.0, -2.0))
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    found = grow(transport, pack, silent, Token(), shape=(128, 256))
    assert [one.name for one in found] == ["styles", "turns", "light", "panorama", "frames"]
    for one in found:
        assert next(iter(one.series)) == "here"
        assert all(len(values) == len(one.sizes) == 2 for values in one.series.values())
        assert ElementTree.fromstring(growth_svg(one)).tag.endswith("svg")
    assert growth_json(found, "sphere")["growth"][4]["sizes"] == [2.0, 3.0]


def test_power_of_growth() -> None:
    sizes = (1.0, 2.0, 4.0, 8.0)
    square = tuple(3.0 * size**2 for size in sizes)
    assert Growth("a", sizes, "things", {"here": square}).slope == pytest.approx(2.0)
    drawn = ElementTree.fromstring(growth_svg(Growth("a", sizes, "things", {"here": square})))
    spots = [mark for mark in drawn.iter() if mark.tag.endswith("circle")]
    x, y = ([float(mark.attrib[name]) for mark in spots] for name in ("cx", "cy"))
    assert np.diff(x) == pytest.approx(x[1] - x[0], abs=0.2)
    assert np.diff(y) == pytest.approx(y[1] - y[0], abs=0.2)


def test_what_a_row_comes_to() -> None:
    assert row().ratio == 5.0
    assert row(limit=0.5).limits == 4.0


def test_bars() -> None:
    bar = Bar(ratio=6.0, seconds=1.0, limits=1.5)
    assert len(bar.missed(row())) == 3
    assert len(bar.missed(row(), slack=4.0)) == 2
    assert bar.missed(row(seconds=0.5, plain=3.0)) == ()
    assert bar.words == "≥ 6x, ≤ 1000 ms, ≤ 1.5 limits"
    assert missed([row("merge.three"), row("unknown")]) == {}
    assert "merge.three" in missed([row("merge.three", plain=6.0)])
    assert all(bar.words for bar in BARS.values())


def test_timing_has_its_turns() -> None:
    calls: list[str] = []
    case = Case(
        "a",
        lambda: calls.append("fast"),
        lambda: calls.append("plain"),
        "loop",
        lambda: calls.append("limit"),
        rounds=2,
        least=1,
        budget_s=0.0,
        share=0.5,
        peers=(PeerCase("other", lambda: 7, lambda result: f"gave {result}", share=0.25),),
    )
    (found,) = time_all([case], 1.0, silent, Token())
    assert calls == ["plain", "plain", "fast", "fast", "limit", "limit", "plain", "fast", "limit"]
    assert found.peers[0] == Peer("other", found.peers[0].seconds, "gave 7")


def test_timing_calls_at_least_three_times() -> None:
    calls: list[int] = []
    times = clock(lambda: calls.append(1), 0.0)
    assert len(times) == 3
    assert len(calls) == 4
    assert min(times) >= 0
    assert 1e8 < bandwidth() < 1e13


def test_what_waits_for_a_core_does_not_count() -> None:
    import time

    assert min(clock(lambda: time.sleep(0.05), 0.0, least=1)) < 0.04
    assert min(clock(lambda: time.sleep(0.05), 0.0, least=1, by="threads")) >= 0.05


def test_cancelling() -> None:
    token = Token()
    token.cancel()
    with pytest.raises(Cancelled):
        run_all(lambert_sphere_transport(), synthetic_pack(), silent, token, peers=False)
    with pytest.raises(Cancelled):
        grow(lambert_sphere_transport(), synthetic_pack(), silent, token)


def test_peers_are_those_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    def only_one(name: str) -> object:
        if name == "envmap":
            return math
        raise ImportError(name)

    monkeypatch.setattr(run, "importlib", SimpleNamespace(import_module=only_one))
    assert find_peers() == {"skylibs": math}
    assert importlib.import_module("math") is math


def test_skylibs_is_asked_for_the_same() -> None:
    """A stand-in with the axes that skylibs documents: x right, y up, z out of the back."""

    class EnvironmentMap:
        def __init__(self, data: np.ndarray, kind: str, copy: bool) -> None:
            assert (kind, copy) == ("latlong", False)
            self.data = data

        def resize(self, shape: tuple[int, int]) -> EnvironmentMap:
            self.data = cv2.resize(self.data, shape[::-1], interpolation=cv2.INTER_AREA)
            return self

        def rotate(self, matrix: np.ndarray) -> EnvironmentMap:
            height, width = self.data.shape[:2]
            azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
            up = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
            a, e = np.meshgrid(azimuth, up)
            rays = np.stack([np.sin(a) * np.cos(e), np.sin(e), -np.cos(a) * np.cos(e)], axis=-1)
            x, y, z = np.moveaxis(rays @ matrix.T, -1, 0)
            columns = ((np.arctan2(x, -z) / (2 * np.pi) + 0.5) * width - 0.5).astype(np.float32)
            rows = ((0.5 - np.arcsin(np.clip(y, -1, 1)) / np.pi) * height - 0.5).astype(np.float32)
            given = self.data.astype(np.float32)
            self.data = cv2.remap(given, columns, rows, cv2.INTER_LINEAR)
            return self

    reduced, _, rotated = environment_cases(
        SimpleNamespace(EnvironmentMap=EnvironmentMap)  # type: ignore[arg-type]
    )
    for peer in reduced.peers:
        assert peer.judge(peer.work()).startswith("energy changed by 0")
    (peer,) = rotated.peers
    assert float(peer.judge(peer.work()).split()[0]) < 0.5


def test_machines_have_no_names() -> None:
    found = machine.describe_machine()
    assert set(found) == {
        "date",
        "processor",
        "cores",
        "memory_gib",
        "system",
        "python",
        "versions",
    }
    assert found["versions"]["numpy"] == np.__version__
    assert not any("/" in str(value) and str(value).startswith("/") for value in found.values())


def test_a_command_line_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(code: int) -> None:
        done = SimpleNamespace(returncode=code, stderr=b"one\nno panorama\n")
        monkeypatch.setattr("benchmarks.speed.timing.start.subprocess.run", lambda *_, **__: done)

    case = start.start_case()
    ended(0)
    case.fast()
    ended(2)
    with pytest.raises(CoreError, match="no panorama"):
        case.plain()
    ended(130)
    with pytest.raises(Cancelled):
        case.fast()
