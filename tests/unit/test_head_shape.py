"""The shape beside a transport: on the mesh it was made from, in its frame, and never trusted."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base.archive import digest
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.solver.head_shape import HeadShape, load_shape, load_shape_of, save_shape, shape_path
from app.core.solver.transport import load_named
from tests.helpers.synthetic import HEAD, synthetic_shape

HEADS = ("generic", "female", "male")
METRES_PER_UNIT = 0.1


def _mesh(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Vertices and normals of a shipped head, scene units."""
    raw = (resources() / "heads" / f"{name}.ply").read_bytes()
    header, _, body = raw.partition(b"end_header\n")
    lines = header.decode().splitlines()
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    columns = [line.split()[2] for line in lines if line.startswith("property float")]
    assert columns[:6] == ["x", "y", "z", "nx", "ny", "nz"]
    rows = np.frombuffer(body, "<f4", count * len(columns)).reshape(count, -1)
    return rows[:, :3].astype(np.float64), rows[:, 3:6].astype(np.float64)


def _shape(name: str) -> HeadShape:
    return load_shape(resources() / "transport" / f"{name}.shape.npz")


def _middle(name: str) -> NDArray[np.float64]:
    """Of the head, scene units, from the extreme points of mesh and shape."""
    vertices, _ = _mesh(name)
    skin = _shape(name).skin / METRES_PER_UNIT
    found: NDArray[np.float64] = vertices.max(axis=0) - skin.max(axis=0)
    return found


@pytest.mark.parametrize("name", HEADS)
def test_pixels_look_at_places_on_the_mesh(name: str) -> None:
    vertices, normals = _mesh(name)
    transport, shape = load_named(name), _shape(name)
    whole = np.flatnonzero(transport.coverage >= 1.0)[::17]
    places = shape.positions[whole] / METRES_PER_UNIT + _middle(name)
    tree = [int(np.argmin(np.square(vertices - place).sum(axis=1))) for place in places]
    normal = normals[tree]
    away = ((places - vertices[tree]) * normal).sum(axis=1)
    # Extremes give the middle to the 6 mm of the thinned skin; the rest of it is found here.
    rest = np.linalg.lstsq(normal, away, rcond=None)[0]
    assert np.abs(rest).max() * METRES_PER_UNIT < 0.006
    millimetres = 1000.0 * METRES_PER_UNIT * np.abs(away - normal @ rest)
    # Eyes are no skin, and where a pixel of 3 mm sees two places it has their mean.
    assert np.median(millimetres) < 0.5
    assert np.quantile(millimetres, 0.9) < 2.5


@pytest.mark.parametrize("name", HEADS)
def test_the_frame_is_the_heads_with_its_middle_between_the_ears(name: str) -> None:
    shape = _shape(name)
    x, y, _ = shape.skin.astype(np.float64).T
    # Ears: the outermost points of the head proper, its neck and shoulders being lower.
    head = y > shape.eye_point[1] - 0.09
    left, right = np.argmax(np.where(head, x, -1)), np.argmax(np.where(head, -x, -1))
    between = 0.5 * (shape.skin[left] + shape.skin[right])
    assert np.abs(between).max() < 0.02
    assert 0.06 < x[left] < 0.11
    # Eyes in front of the ears and about as high; the face looks along +Z.
    assert abs(shape.eye_point[0]) < 1e-3
    assert 0.06 < shape.eye_point[2] < 0.12
    assert abs(shape.eye_point[1]) < 0.05
    assert shape.positions[:, 2].max() > shape.eye_point[2]


@pytest.mark.parametrize("name", HEADS)
def test_a_picture_and_its_places_run_alike(name: str) -> None:
    """Image right is the sitter's left, +X; down is down."""
    shape, size = _shape(name), load_named(name).size
    row, column = np.divmod(shape.pixels, size)
    assert np.corrcoef(column, shape.positions[:, 0])[0, 1] > 0.99
    assert np.corrcoef(row, shape.positions[:, 1])[0, 1] < -0.99


@pytest.mark.parametrize("name", HEADS)
def test_a_symmetric_head_has_a_symmetric_shape(name: str) -> None:
    shape, transport = _shape(name), load_named(name)
    assert transport.header.symmetric
    mirrored = shape.pixels // 100 * 100 + 99 - shape.pixels % 100
    twin = np.searchsorted(shape.pixels, mirrored)
    np.testing.assert_allclose(
        shape.positions[twin] * [-1, 1, 1], shape.positions, rtol=0, atol=1e-6
    )


@pytest.mark.parametrize("name", HEADS)
def test_outlines_go_around_all_skin(name: str) -> None:
    shape = _shape(name)
    side, skin = shape.side, shape.skin[:, [2, 1]]
    assert np.abs(side.max(axis=0) - skin.max(axis=0)).max() < 0.008
    assert np.abs(side.min(axis=0) - skin.min(axis=0)).max() < 0.008
    for outline in (shape.above, shape.side):
        x, y = outline.astype(np.float64).T
        area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
        assert 0.02 < area < 0.15  # counter-clockwise, square metres
    # Seen from above: the nose in the middle and in front.
    tip = shape.above[np.argmax(shape.above[:, 1])]
    assert abs(tip[0]) < 0.01
    assert tip[1] == pytest.approx(shape.positions[:, 2].max(), abs=0.006)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.3), (0.25, 0.1, 0.1), (0.0, 0.4, 0.0)])
def test_distance_to_the_skin_is_that_to_the_mesh(place: tuple[float, float, float]) -> None:
    vertices, _ = _mesh("generic")
    skin = (vertices - _middle("generic")) * METRES_PER_UNIT
    nearest = float(np.linalg.norm(skin - np.array(place), axis=1).min())
    assert _shape("generic").distance_to_skin(np.array(place)) == pytest.approx(nearest, abs=0.006)


def test_distance_to_an_ellipsoid() -> None:
    for axis in range(3):
        place = np.zeros(3)
        place[axis] = 0.3
        assert synthetic_shape().distance_to_skin(place) == pytest.approx(
            0.3 - HEAD[axis], abs=0.002
        )


def test_a_shape_comes_back_as_it_was_stored(tmp_path: Path) -> None:
    shape = synthetic_shape()
    path = shape_path(tmp_path / "anna.npz")
    assert path.name == "anna.shape.npz"
    checksum = save_shape(path, shape)
    found = load_shape(path)
    assert found.head == shape.head
    assert len(checksum) == 64
    for name in ("pixels", "positions", "skin", "above", "side", "eye_point"):
        np.testing.assert_array_equal(getattr(found, name), getattr(shape, name))
    assert [file.name for file in tmp_path.iterdir()] == ["anna.shape.npz"]


def test_skins_share_their_heads_shape_and_others_do_not() -> None:
    assert load_shape_of(load_named("generic-dark"), "generic-dark").head == "generic"
    with pytest.raises(TransportError, match="was made for a different head"):
        load_shape_of(load_named("female"), str(resources() / "transport" / "generic.npz"))


def _arrays(
    changed: dict[str, NDArray[Any]] | None = None, version: int = 1
) -> dict[str, NDArray[Any]]:
    shape = synthetic_shape()
    names = ("pixels", "positions", "skin", "above", "side", "eye_point")
    arrays: dict[str, NDArray[Any]] = {name: getattr(shape, name) for name in names}
    arrays.update(changed or {})
    header = {"format_version": version, "head": "x", "sha256": digest(arrays)}
    return {**arrays, "header": np.frombuffer(json.dumps(header).encode(), np.uint8)}


def _store(path: Path, arrays: dict[str, NDArray[Any]]) -> Path:
    with path.open("wb") as stream:
        np.savez(stream, allow_pickle=True, **arrays)
    return path


def test_files_that_are_no_shape_are_refused_in_sentences(tmp_path: Path) -> None:
    path = tmp_path / "x.shape.npz"
    with pytest.raises(TransportError, match="There is no head-shape file"):
        load_shape(path)
    path.write_bytes(b"not a zip")
    with pytest.raises(TransportError, match="damaged or not a head-shape file"):
        load_shape(path)
    whole = _store(path, _arrays()).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(TransportError, match="damaged"):
        load_shape(path)


def test_one_changed_number_is_found(tmp_path: Path) -> None:
    arrays = _arrays()
    arrays["positions"] = arrays["positions"] + np.float32(1e-3)
    with pytest.raises(TransportError, match="checksum"):
        load_shape(_store(tmp_path / "x.shape.npz", arrays))


def test_a_newer_shape_asks_for_an_update(tmp_path: Path) -> None:
    with pytest.raises(TransportError, match="newer version of Turnlight") as found:
        load_shape(_store(tmp_path / "x.shape.npz", _arrays(version=2)))
    assert "Update" in (found.value.hint or "")


@pytest.mark.parametrize(
    "changed",
    [
        {"positions": np.zeros((3, 3), np.float32)},
        {"skin": np.full((9, 3), np.nan, np.float32)},
        {"above": np.full((9, 2), 30.0, np.float32)},
        {"side": np.zeros((9, 3), np.float32)},
        {"eye_point": np.zeros(2, np.float32)},
        {"skin": np.zeros((9, 3), np.float64)},
    ],
)
def test_shapes_that_contradict_themselves_are_refused(
    changed: dict[str, NDArray[Any]], tmp_path: Path
) -> None:
    with pytest.raises(TransportError, match="inconsistent"):
        load_shape(_store(tmp_path / "x.shape.npz", _arrays(changed)))


def test_a_small_file_that_unpacks_to_a_huge_one_is_not_unpacked(tmp_path: Path) -> None:
    path = _store(tmp_path / "x.shape.npz", _arrays())
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("more.npy", bytes(1 << 25))
    with pytest.raises(TransportError, match="too large"):
        load_shape(path)


def test_pickles_are_not_read(tmp_path: Path) -> None:
    arrays = _arrays()
    arrays["skin"] = np.array([{"a": 1}], object)
    with pytest.raises(TransportError, match="damaged or not"):
        load_shape(_store(tmp_path / "x.shape.npz", arrays))
