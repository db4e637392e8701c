"""Choosing how Mitsuba computes: on the graphics card, compiled for this processor, or plainly."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from app.core.base.errors import BakeError
from app.core.text import tr

VARIANTS = ("auto", "llvm", "cuda", "scalar")
_NAMES = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb", "scalar": "scalar_rgb"}
_log = logging.getLogger(__name__)


def select_variant(variant: str = "auto") -> Any:
    """Make a Mitsuba variant current and return the module.

    Args:
        variant: ``llvm``, ``cuda``, ``scalar``, or ``auto``: llvm where a new enough LLVM is found,
            else scalar with a notice.

    Raises:
        BakeError: If the variant is unknown or does not work on this machine.
    """
    if variant not in VARIANTS:
        raise BakeError(
            tr("There is no variant called “{variant}”.", variant=variant),
            hint=tr("Choose from {names}.", names=", ".join(VARIANTS)),
        )
    wanted = variant
    if variant in ("auto", "llvm"):
        wanted = "llvm" if _point_to_llvm() else "scalar"
        if wanted == "scalar":
            _log.warning(
                "No LLVM 16 or newer was found, so baking runs in Mitsuba's scalar variant: the "
                "same result, hundreds of times slower. Install libllvm19 (Debian, Ubuntu) or "
                "point DRJIT_LIBLLVM_PATH at a libLLVM."
            )
    try:
        mitsuba = importlib.import_module("mitsuba")
        mitsuba.set_variant(_NAMES[wanted])
        # Its remarks would stand in the answer, in colour; what matters is raised.
        mitsuba.set_log_level(mitsuba.LogLevel.Error)
        if wanted != "scalar":
            float_type = mitsuba.Float
            importlib.import_module("drjit").eval(float_type(1.0) + float_type(1.0))
    except (ImportError, RuntimeError, AttributeError) as error:
        raise BakeError(
            tr("Mitsuba's {wanted} variant does not work on this machine.", wanted=wanted),
            hint=tr("Try --variant llvm or --variant scalar."),
        ) from error
    return mitsuba


def is_wavefront(mitsuba: Any) -> bool:
    """Tell whether the current variant traces many paths at once (llvm, cuda)."""
    return not str(mitsuba.variant()).startswith("scalar")


def find_llvm() -> Path | None:
    """Find a libLLVM of version 16 or newer; older ones abort inside Mitsuba 3.9."""
    for candidate in _llvm_candidates():
        if candidate.exists() and _llvm_major(candidate) >= 16:
            return candidate
    return None


def _point_to_llvm() -> bool:
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return True
    found = find_llvm()
    if found is not None:
        os.environ["DRJIT_LIBLLVM_PATH"] = str(found)
    return found is not None


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
    """Major version of a libLLVM, 0 when it cannot say (``LLVMGetVersion`` came with 16)."""
    try:
        get_version = ctypes.CDLL(str(library)).LLVMGetVersion
    except (OSError, AttributeError):
        return 0
    major, minor, patch = ctypes.c_uint(), ctypes.c_uint(), ctypes.c_uint()
    get_version(ctypes.byref(major), ctypes.byref(minor), ctypes.byref(patch))
    return int(major.value)
