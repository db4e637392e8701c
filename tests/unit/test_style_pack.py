"""Style packs: building, mirror exactness, storing, and every way a file can be bad."""

from __future__ import annotations

import dataclasses
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from app.core.base.archive import read_arrays
from app.core.base.errors import CoreError, StyleError, TransportError
from app.core.solver.solve import solve_all
from app.core.solver.transport import save_transport
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_build import build_pack
from app.core.styles.style_pack_file import (
    load_named_pack,
    load_pack,
    load_transport_of,
    pack_names,
    pack_path,
    save_pack,
)
from app.core.styles.styles import NAMES, load_styles, mirror_name
from tests.helpers.synthetic import (
    lambert_sphere_transport,
    lamp_environment,
    style_target,
    synthetic_pack,
    synthetic_shape,
)

LIGHT = lamp_environment(30.0, 35.0, fill=0.1)


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    path = tmp_path / "head.styles.npz"
    save_pack(path, synthetic_pack())
    return path


def _rewrite(path: Path, **changes: object) -> None:
    """Replace arrays of a stored pack without touching its checksum."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    for name, value in changes.items():
        if value is None:
            del arrays[name]
        else:
            arrays[name] = np.asarray(value)
    np.savez(path, **arrays)


def _header(path: Path) -> dict[str, object]:
    with np.load(path) as stored:
        values: dict[str, object] = json.loads(stored["header"].tobytes())
    return values


def _raw(values: object) -> np.ndarray:
    return np.frombuffer(json.dumps(values).encode(), np.uint8)


def test_mirrored_styles_have_exactly_mirrored_targets() -> None:
    pack = synthetic_pack()
    for row, style in enumerate(pack.styles):
        other = pack.index(mirror_name(style.name))
        np.testing.assert_array_equal(
            pack.preintegrated[other], pack.preintegrated[row][:, ::-1], err_msg=style.name
        )
    mean = pack.mean_rows[: pack.header.environment[0]]
    np.testing.assert_array_equal(mean, mean[:, ::-1])


def test_the_target_under_itself_has_strength_and_norm() -> None:
    transport, pack = lambert_sphere_transport(), synthetic_pack()
    row = pack.index("left-loop")
    target = style_target(transport, pack.styles[row]) @ np.array([0.2126, 0.7152, 0.0722])
    region = pack.region_on(transport)
    inside, mean = target[region > 0], region @ target / region.sum()
    f = (target - mean) / np.ptp(inside)
    assert pack.weight_norm[row] == pytest.approx(np.sqrt(region @ f**2), rel=1e-3)
    assert pack.studio_ratio[row] == pytest.approx(region @ (f * target) / mean, rel=1e-3)


def test_noise_in_targets_is_averaged_over_mirror_images() -> None:
    transport = lambert_sphere_transport()
    styles = [s for s in load_styles() if s.name in ("left-loop", "right-loop", "butterfly")]
    clean = np.stack([style_target(transport, s) for s in styles])
    noisy = clean * (1 + 0.1 * np.random.default_rng(0).standard_normal(clean.shape))
    pack = build_pack(transport, styles, noisy, synthetic_shape())
    left, right = pack.index("left-loop"), pack.index("right-loop")
    np.testing.assert_array_equal(pack.targets[right], pack.targets[left][:, ::-1])
    assert pack.studio_ratio[right] == pytest.approx(pack.studio_ratio[left], rel=1e-12)
    for style in ("left-loop", "butterfly"):
        (result,) = solve_all(pack, lamp_environment(0.0, 40.0), styles=[style])
        assert result.match > 90


def test_targets_must_fit() -> None:
    transport = lambert_sphere_transport()
    with pytest.raises(StyleError, match="do not fit"):
        build_pack(transport, load_styles(), np.ones((2, 3, 3)), synthetic_shape())
    with pytest.raises(StyleError, match="do not fit"):
        build_pack(transport, [], np.ones((0, len(transport.pixels), 3)), synthetic_shape())


def test_a_style_without_mirror_image_is_welcome() -> None:
    transport = lambert_sphere_transport()
    lone = Style("mine", "Mine", "left", "", "", (StyleLamp(20.0, 10.0, 8.0, 1.0, 2.0),))
    pack = build_pack(transport, [lone], style_target(transport, lone)[None], synthetic_shape())
    (result,) = solve_all(pack, lamp_environment(5.0, 10.0))
    assert result.turn_refined_deg == pytest.approx(25.0, abs=2.0)


def test_a_stored_pack_gives_identical_answers(stored: Path) -> None:
    pack, loaded = synthetic_pack(), load_pack(stored)
    assert loaded.header == pack.header
    assert loaded.styles == pack.styles
    for before, after in zip(solve_all(pack, LIGHT), solve_all(loaded, LIGHT), strict=True):
        assert after.turn_refined_deg == before.turn_refined_deg
        np.testing.assert_array_equal(after.match_curve, before.match_curve)
        np.testing.assert_array_equal(after.quality_curve, before.quality_curve)


def test_target_pictures_come_back(stored: Path) -> None:
    transport, pack = lambert_sphere_transport(), load_pack(stored)
    expected = style_target(transport, pack.styles[0])
    expected = expected / expected.max()
    picture = pack.target(pack.styles[0].name)
    assert picture.shape == (transport.size, transport.size, 3)
    np.testing.assert_allclose(picture.reshape(-1, 3)[transport.pixels], expected, atol=1e-3)


def test_unknown_styles_are_refused() -> None:
    with pytest.raises(StyleError, match="disco"):
        synthetic_pack().target("disco")


def test_the_file_has_no_pickles(stored: Path) -> None:
    with zipfile.ZipFile(stored) as archive:
        for name in archive.namelist():
            with archive.open(name) as member:
                version = np.lib.format.read_magic(member)
                assert version <= (2, 0)
                header = np.lib.format.read_array_header_1_0(member)
                assert not header[2].hasobject


@pytest.mark.parametrize("keep", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_truncated_files_are_refused(stored: Path, keep: float) -> None:
    raw = stored.read_bytes()
    stored.write_bytes(raw[: int(keep * len(raw))])
    with pytest.raises(TransportError, match=r"head\.styles\.npz"):
        load_pack(stored)


@pytest.mark.parametrize("seed", range(30))
def test_damaged_files_are_refused_or_harmless(stored: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    raw = bytearray(stored.read_bytes())
    for place in rng.integers(0, len(raw), 4):
        raw[place] ^= int(rng.integers(1, 256))
    stored.write_bytes(bytes(raw))
    try:
        loaded = load_pack(stored)
    except TransportError as error:
        said = str(error)
    else:
        np.testing.assert_array_equal(loaded.preintegrated, synthetic_pack().preintegrated)
        said = "head.styles.npz"
    assert "head.styles.npz" in said


@pytest.mark.parametrize("text", [b"", b"hello", b"PK\x03\x04rubbish", b"\x93NUMPY\x01\x00"])
def test_other_files_are_refused(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "odd.npz"
    path.write_bytes(text)
    with pytest.raises(TransportError, match=r"odd\.npz"):
        load_pack(path)


def test_missing_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(TransportError, match="There is no style pack"):
        load_pack(tmp_path / "nothing.npz")


def test_newer_files_ask_for_an_update(stored: Path) -> None:
    values = _header(stored)
    _rewrite(stored, header=_raw({**values, "format_version": 99}))
    with pytest.raises(TransportError, match="newer version of Turnlight"):
        load_pack(stored)


def test_older_packs_are_to_be_baked_again(stored: Path) -> None:
    _rewrite(stored, header=_raw({**_header(stored), "format_version": 1}))
    with pytest.raises(TransportError, match="older version of Turnlight"):
        load_pack(stored)


def test_changed_numbers_fail_the_checksum(stored: Path) -> None:
    _rewrite(stored, mean_rows=synthetic_pack().mean_rows * 2)
    with pytest.raises(TransportError, match="checksum"):
        load_pack(stored)


@pytest.mark.parametrize(
    "changes",
    [
        {"header": None},
        {"mean_rows": None},
        {"header": np.frombuffer(b"{", np.uint8)},
        {"header": np.frombuffer(b"[1]", np.uint8)},
        {"header": np.frombuffer(b'{"format_version": 5}', np.uint8)},
        {"header": np.frombuffer(b'{"format_version": null}', np.uint8)},
    ],
)
def test_incomplete_files_are_refused(stored: Path, changes: dict[str, object]) -> None:
    _rewrite(stored, **changes)
    with pytest.raises(TransportError, match="not a style pack"):
        load_pack(stored)


@pytest.mark.parametrize(
    "change",
    [
        {"mean_rows": np.ones((4, 8), np.float32)},
        {"mixtures": np.ones((4, 8))},
        {"mixing": np.full((2, 3), np.inf)},
        {"weight_norm": np.full(len(NAMES), np.nan)},
        {"region": np.full((36, 36), np.nan, np.float16)},
        {"area_rows": synthetic_pack().area_rows[1:]},
        {"studio_ratio": np.zeros(len(NAMES))},
        {"basis_even": np.zeros((0, *synthetic_pack().basis_even.shape[1:]), np.float32)},
        {"targets": synthetic_pack().targets.astype(np.float32)},
    ],
)
def test_contradictions_are_refused(tmp_path: Path, change: dict[str, np.ndarray]) -> None:
    """Well-formed files, checksum included, whose arrays cannot belong together."""
    path = tmp_path / "odd.styles.npz"
    save_pack(path, dataclasses.replace(synthetic_pack(), **change))  # type: ignore[arg-type]
    with pytest.raises(TransportError, match="inconsistent"):
        load_pack(path)


def test_pickles_are_never_read(tmp_path: Path) -> None:
    path = tmp_path / "evil.npz"
    np.savez(path, header=np.array([{"a": 1}], dtype=object))
    with pytest.raises(TransportError, match=r"evil\.npz"):
        load_pack(path)


def test_huge_files_are_refused(stored: Path) -> None:
    with pytest.raises(TransportError, match="too large to be a style pack"):
        read_arrays(stored, "style pack", "", most=1000)


@pytest.mark.slow
def test_zip_bombs_are_refused_unopened(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        array = io.BytesIO()
        np.save(array, np.zeros(40_000_000))
        archive.writestr("mean.npy", array.getvalue())
    assert path.stat().st_size < 1_000_000
    with pytest.raises(TransportError, match="too large"):
        load_pack(path)


def test_nothing_is_left_behind_when_a_pack_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match="does not exist"):
        save_pack(tmp_path / "missing" / "a.npz", synthetic_pack())
    assert list(tmp_path.iterdir()) == []


def test_unknown_heads_are_refused() -> None:
    with pytest.raises(TransportError, match="no head 'nobody'"):
        load_named_pack("nobody")
    assert "nobody" not in pack_names()


def test_a_pack_and_its_transport_find_each_other(tmp_path: Path) -> None:
    transport = lambert_sphere_transport()
    path = tmp_path / "mine.npz"
    digest = save_transport(path, transport)
    pack = _with_digest(synthetic_pack(), digest)
    save_pack(pack_path(path), pack)
    for head in (path, pack_path(path)):
        loaded = load_named_pack(str(head))
        assert loaded.styles == pack.styles
        assert load_transport_of(loaded, str(head)).digest == digest


def test_a_pack_of_another_transport_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "mine.npz"
    save_transport(path, lambert_sphere_transport())
    save_pack(pack_path(path), synthetic_pack())
    with pytest.raises(TransportError, match="a different transport"):
        load_transport_of(load_named_pack(str(path)), str(path))


def _with_digest(pack: StylePack, digest: str) -> StylePack:
    header = dataclasses.replace(pack.header, transport_sha256=digest)
    return dataclasses.replace(pack, header=header)


def test_mirror_images_are_made_again_when_a_pack_is_read(tmp_path: Path) -> None:
    """They are not stored, and come back to the last bit."""
    pack, path = load_named_pack("generic"), tmp_path / "head.styles.npz"
    save_pack(path, pack)
    with np.load(path) as stored:
        lefts = sum(not style.name.startswith("right-") for style in pack.styles)
        assert len(stored["targets"]) == lefts == stored["face_rows"].shape[1]
        assert stored["area_rows"].shape[1] < len(pack.area_rows)
    again = load_pack(path)
    assert again.styles == pack.styles
    for name in ("targets", "target_rows", "face_rows", "area_rows", "weight_norm"):
        np.testing.assert_array_equal(getattr(again, name), getattr(pack, name))
