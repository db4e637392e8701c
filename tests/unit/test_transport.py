"""Transports in files: packed without loss, old ones read as before, damaged ones refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from app.core.base.archive import write_sealed
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.solver.transport import (
    Transport,
    _half_floats,
    _pack,
    _unpacked,
    load_transport,
    save_transport,
    transport_names,
    transport_path,
)
from tests.helpers.hostile_data import sealed_archives
from tests.helpers.synthetic import lambert_sphere_transport

RNG = np.random.default_rng(5)


def uneven() -> Transport:
    """Random numbers: nothing in it is like its mirror image."""
    even = lambert_sphere_transport()
    kept = np.arange(len(even.pixels)) % 3 > 0
    shape = (3, np.count_nonzero(kept), even.header.rank)
    return replace(
        even,
        pixels=even.pixels[kept],
        coverage=even.coverage[kept],
        pixel_basis=RNG.normal(size=shape).astype(np.float32),
        texel_basis=RNG.normal(size=even.texel_basis.shape).astype(np.float32),
    )


@pytest.mark.parametrize("make", [lambert_sphere_transport, uneven])
def test_packing_loses_nothing(make: Callable[[], Transport], tmp_path: Path) -> None:
    transport = make()
    arrays = _half_floats(transport)
    again = _unpacked(_pack(arrays, transport.header), transport.header)
    assert again.keys() == arrays.keys()
    for name, array in arrays.items():
        assert again[name].dtype == array.dtype
        assert again[name].shape == array.shape
        assert again[name].tobytes() == array.tobytes(), name
    checksum = save_transport(tmp_path / "new.npz", transport)
    header = asdict(transport.header) | {"format_version": 1}
    assert write_sealed(tmp_path / "old.npz", arrays, header) == checksum
    new, old = (load_transport(tmp_path / f"{name}.npz") for name in ("new", "old"))
    assert new.digest == old.digest == checksum
    np.testing.assert_array_equal(new.pixel_basis, old.pixel_basis)
    np.testing.assert_array_equal(new.texel_basis, old.texel_basis)
    assert (new.header.format_version, old.header.format_version) == (2, 1)


def test_what_ships_is_small() -> None:
    sizes = [transport_path(name).stat().st_size for name in transport_names()]
    assert len(sizes) == 5
    assert max(sizes) < 5e6
    assert sum(file.stat().st_size for file in (resources() / "transport").iterdir()) < 37e6


@pytest.mark.slow
def test_sealed_files_with_wrong_values_are_refused(tmp_path: Path) -> None:
    for hostile in sealed_archives(tmp_path / "sealed"):
        if hostile.path.stem != "sealed-no-basis":
            with pytest.raises(TransportError):
                load_transport(hostile.path)
