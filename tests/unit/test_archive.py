"""Archives of arrays that may be anything end in a sentence, and are written whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.core.base.archive import read_arrays, read_sealed, write_sealed
from app.core.base.errors import TransportError
from app.core.solver.head_shape import load_shape
from app.core.solver.transport import load_transport
from app.core.styles.style_pack_file import load_pack
from tests.helpers.hostile_data import Hostile, hostile_archives


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> list[Hostile]:
    return hostile_archives(tmp_path_factory.mktemp("hostile") / "archives")


@pytest.mark.slow
@pytest.mark.parametrize("load", [load_transport, load_pack, load_shape])
def test_every_hostile_archive_is_refused(load: object, archives: list[Hostile]) -> None:
    assert callable(load)
    names = {hostile.path.stem for hostile in archives}
    assert {"deep", "raw", "raw-header", "infinite", "claims", "bomb", "pickle"} <= names
    for hostile in archives:
        with pytest.raises(TransportError):
            load(hostile.path)


@pytest.mark.slow
def test_a_member_that_is_not_an_array_is_not_taken_for_one(archives: list[Hostile]) -> None:
    raw = next(hostile.path for hostile in archives if hostile.path.stem == "raw")
    with pytest.raises(TransportError, match="damaged or not a table"):
        read_arrays(raw, "table", "")


def test_what_was_sealed_comes_back(tmp_path: Path) -> None:
    arrays = {"a": np.arange(12.0).reshape(3, 4), "b": np.ones(2, np.int8)}
    write_sealed(tmp_path / "s.npz", arrays, {"format_version": 2, "word": "ü"})
    header, found = read_sealed(tmp_path / "s.npz", "thing", "", 2)
    assert header["word"] == "ü"
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
