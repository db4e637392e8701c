"""Run one kernel for many lanes: all at once if Mitsuba can, otherwise one after another.

In Mitsuba's wavefront variants (llvm, cuda), a number in a kernel is an array with one entry for
each lane, and one call computes all lanes. In the scalar variant, a number is a plain Python
number, and the kernel is called once for each lane. A kernel works in both if it reads from a
`Table`, adds to a `Tally`, and otherwise uses only ``dr.while_loop``, ``dr.if_stmt``, ``dr.select``
and arithmetic. A kernel must use `negate` in place of ``~``, because Python's ``~True`` is -2.

`select_variant` chooses how Mitsuba computes: on the graphics card, compiled for this processor, or
interpreted.
"""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.arrays import Float32
from app.core.base.errors import BakeError
from app.core.text import tr

Watch: TypeAlias = Callable[[float], None]
"""Function that is called with the fraction of the work done, 0 to 1.

The calls come a few times a second if the lanes run one after another. The function may raise an
exception to stop the work.
"""

_SCALAR_SHARE = 256
_WATCH_EVERY_S = 0.25


class Table:
    """A table of numbers or vectors from which the lanes read.

    Args:
        values: (n,) uint32, (n,) float or (n, 3) float. Floats are stored in single precision.
    """

    __slots__ = ("_kind", "_values")

    def __init__(self, values: NDArray[Any]) -> None:
        import mitsuba as mi

        whole = values.dtype.kind == "u"
        number = mi.UInt32 if whole else mi.Float
        self._kind = mi.Vector3f if values.ndim == 2 else number
        values = np.ascontiguousarray(values, np.uint32 if whole else np.float32)
        self._values: Any = number(values.ravel()) if is_wavefront(mi) else values.tolist()

    def take(self, index: Any, active: Any = True) -> Any:
        """Return the entry at an index as UInt32, Float or Vector3f, or zero in inactive lanes."""
        import drjit as dr

        if isinstance(self._values, list):
            return self._kind(self._values[index] if active else 0)
        return dr.gather(self._kind, self._values, index, active)


class Tally:
    """Running sums of RGB colours, to which the lanes add."""

    __slots__ = ("_sums",)

    def __init__(self, rows: int) -> None:
        import drjit as dr
        import mitsuba as mi

        size = rows * 3
        self._sums: Any = (
            dr.zeros(mi.Float, size) if is_wavefront(mi) else np.zeros(size, np.float32)
        )

    def add(self, row: Any, colour: Any, active: Any) -> None:
        """Add a Color3f to a row in the active lanes."""
        import drjit as dr

        parts = (colour.x, colour.y, colour.z)
        if isinstance(self._sums, np.ndarray):
            if active:
                self._sums[3 * row : 3 * row + 3] += parts
            return
        for channel, part in enumerate(parts):
            dr.scatter_reduce(dr.ReduceOp.Add, self._sums, part, row * 3 + channel, active)

    def sums(self, *shape: int) -> Float32:
        """Return the sums so far, (*shape, 3) float32. The product of `shape` is the row count."""
        return np.array(self._sums, np.float32).reshape(*shape, 3)


def at_once(lanes: int) -> int:
    """Return how many lanes run in one batch: all of them in a wavefront variant, else fewer."""
    import mitsuba as mi

    return lanes if is_wavefront(mi) else max(1, lanes // _SCALAR_SHARE)


def negate(condition: Any) -> Any:
    """Return the logical NOT of a mask or of a Python bool."""
    return condition ^ True


def unwatched(share: float) -> None:
    """Ignore the progress."""


def part_of(watch: Watch, start: float, stop: float) -> Watch:
    """Return a callback for part of the work that maps 0..1 to `start`..`stop` of the whole."""
    return lambda share: watch(start + share * (stop - start))


def run_lanes(
    count: int,
    seed: int,
    kernel: Callable[[Any, Any], tuple[Any, ...]],
    watch: Watch = unwatched,
) -> tuple[Float32, ...]:
    """Run a kernel for every lane.

    Args:
        kernel: Function ``kernel(lane, rng)`` that takes a UInt32 from 0 to `count` - 1 and a
            PCG32 and returns a tuple of Floats.

    Returns:
        The kernel's results for all lanes, as a tuple of (count,) float32 arrays.
    """
    import drjit as dr
    import mitsuba as mi

    watch(0.0)
    if is_wavefront(mi):
        lanes = dr.arange(mi.UInt32, count)
        result = kernel(lanes, _random(lanes, seed))
        dr.eval(*result)
        return tuple(np.array(one, np.float32) for one in result)
    rows: list[Float32] = []
    report_s = time.monotonic()
    for lane in range(count):
        if time.monotonic() > report_s + _WATCH_EVERY_S:
            watch(lane / count)
            report_s = time.monotonic()
        result = kernel(lane, _random(lane, seed))
        rows = rows or [np.empty(count, np.float32) for _ in result]
        for row, one in zip(rows, result, strict=True):
            row[lane] = one
    return tuple(rows)


def _random(lane: Any, seed: int) -> Any:
    """Return a random number generator for each lane.

    The seeds are scrambled as in Mitsuba's own samplers, since generators that differ only in their
    starting state are correlated between seeds.
    """
    import drjit as dr
    import mitsuba as mi

    one, two = mi.sample_tea_32(mi.UInt32(seed % 2**32), lane)
    # In a wavefront variant, PCG32 itself gives each lane its own stream.
    number = 0 if is_wavefront(mi) else lane
    return mi.PCG32(
        size=dr.width(lane),
        initstate=mi.UInt64(one) + number,
        initseq=mi.UInt64(two) + number,
    )


VARIANTS = ("auto", "llvm", "cuda", "scalar")
_NAMES = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb", "scalar": "scalar_rgb"}
_log = logging.getLogger(__name__)


def select_variant(variant: str = "auto") -> Any:
    """Activate a Mitsuba variant and return the Mitsuba module.

    Args:
        variant: ``llvm``, ``cuda``, ``scalar`` or ``auto``. ``auto`` means llvm if a recent enough
            LLVM is found. Otherwise, it means scalar, and a notice is shown.

    Raises:
        BakeError: If the variant is unknown or does not work on this computer.
    """
    if variant not in VARIANTS:
        raise BakeError(
            tr("There is no variant “{variant}”.", variant=variant),
            hint=tr("Choose from {names}.", names=", ".join(VARIANTS)),
        )
    variant_name = variant
    if variant in ("auto", "llvm"):
        variant_name = "llvm" if _point_to_llvm() else "scalar"
        if variant_name == "scalar":
            _log.warning(
                "No LLVM 16 or newer was found, so baking runs in Mitsuba's scalar variant, which "
                "gives the same result hundreds of times more slowly. Install libllvm19 (Debian, "
                "Ubuntu) or point DRJIT_LIBLLVM_PATH at a libLLVM."
            )
    try:
        mitsuba = importlib.import_module("mitsuba")
        mitsuba.set_variant(_NAMES[variant_name])
        # Mitsuba's coloured log would clutter the command's output; real problems raise errors.
        mitsuba.set_log_level(mitsuba.LogLevel.Error)
        if variant_name != "scalar":
            float_type = mitsuba.Float
            importlib.import_module("drjit").eval(float_type(1.0) + float_type(1.0))
    except (ImportError, RuntimeError, AttributeError) as error:
        raise BakeError(
            tr("Mitsuba’s {variant} variant does not work on this computer.", variant=variant_name),
            hint=tr("Try --variant llvm or --variant scalar."),
        ) from error
    return mitsuba


def is_wavefront(mitsuba: Any) -> bool:
    """Return whether the current variant traces many paths at once, as llvm and cuda do."""
    return not str(mitsuba.variant()).startswith("scalar")


def find_llvm() -> Path | None:
    """Find a libLLVM of version 16 or newer, since older versions abort inside Mitsuba 3.9."""
    for candidate in _llvm_candidates():
        if candidate.exists() and _llvm_major(candidate) >= 16:
            return candidate
    return None


def _point_to_llvm() -> bool:
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return True
    library = find_llvm()
    if library is not None:
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
    return library is not None


def _llvm_candidates() -> Iterator[Path]:
    folders = ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib"]
    folders += ["/opt/homebrew/opt/llvm/lib", "/usr/local/opt/llvm/lib"]
    names = ["libLLVM.so*", "libLLVM-*.so*", "libLLVM*.dylib"]
    for folder in map(Path, folders):
        for name in names:
            yield from sorted(folder.glob(name), reverse=True)
    for folder in sorted(Path("/usr/lib").glob("llvm-*"), reverse=True):
        yield from sorted((folder / "lib").glob("libLLVM*.so*"), reverse=True)
    if sys.platform == "win32":
        yield Path(os.environ.get("PROGRAMFILES", r"C:\Program Files")) / "LLVM/bin/LLVM-C.dll"


def _llvm_major(library: Path) -> int:
    """Return the major version of a libLLVM, or 0 if the library is too old to report one.

    Version 16 was the first to report its version.
    """
    try:
        get_version = ctypes.CDLL(str(library)).LLVMGetVersion
    except (OSError, AttributeError):
        return 0
    major, minor, patch = ctypes.c_uint(), ctypes.c_uint(), ctypes.c_uint()
    get_version(ctypes.byref(major), ctypes.byref(minor), ctypes.byref(patch))
    return int(major.value)
