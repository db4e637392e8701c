"""Save parts of a bake on disk, so that an interrupted bake can be resumed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from app.core.base.archive import read_arrays, write_arrays
from app.core.base.arrays import Float32
from app.core.base.errors import TransportError
from app.core.text import tr

Keep: TypeAlias = Callable[[str, tuple[int, ...], Callable[[], Float32]], Float32]
"""Function ``keep(name, shape, compute)`` that returns a saved part, or computes and saves it."""

_MOST_BYTES: Final = 1 << 34


@dataclass(frozen=True, slots=True)
class BakeCache:
    """A folder of arrays, with one file for each finished part of a bake."""

    folder: Path

    def keep(self, name: str, shape: tuple[int, ...], compute: Callable[[], Float32]) -> Float32:
        """Return the saved part with this name and shape, or compute and save the part."""
        file = self.folder / f"{name}.npz"
        with contextlib.suppress(TransportError):
            matrix = read_arrays(file, tr("part of a bake"), "", _MOST_BYTES).get("matrix")
            if matrix is not None and matrix.shape == shape:
                return np.asarray(matrix, np.float32)
        part = compute()
        self.folder.mkdir(parents=True, exist_ok=True)
        write_arrays(file, {"matrix": part})
        return part

    def prefixed(self, prefix: str) -> Keep:
        """Return a variant of `keep` that adds a prefix to every name."""
        return lambda name, shape, compute: self.keep(f"{prefix}-{name}", shape, compute)

    def clear(self) -> None:
        """Delete all parts, then the folder and its parent if they are empty."""
        for file in self.folder.glob("*.npz"):
            file.unlink(missing_ok=True)
        for path in (self.folder, self.folder.parent):
            try:
                path.rmdir()
            except OSError:
                return


def no_keep(_name: str, _shape: tuple[int, ...], compute: Callable[[], Float32]) -> Float32:
    """Compute the part without saving it."""
    return compute()
