"""Stock Mitsuba against our picture: the same head, skin and light, with its own integrator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.baking.kernel_lanes import is_wavefront, select_variant
from app.core.baking.scene import build_scene, frame_head, load_head
from app.core.baking.skin import find_skin
from app.core.base.errors import BakeError
from app.core.base.paths import resources
from app.core.environment.environment import enlarge, read_environment, reduce
from app.core.solver.transport import render
from benchmarks.speed.timing.runner.rows import PeerCase

if TYPE_CHECKING:
    from app.core.solver.transport import Transport

Float32: TypeAlias = NDArray[np.float32]

_PATHS: Final = 32  # per pixel
_FINE: Final = (512, 1024)
_WHOLE: Final = 0.999
_HEAD: Final = "generic"
_SCENE: Final = "interior"


def mitsuba_case(transport: Transport) -> PeerCase | None:
    """Return the case of rendering the face in a bundled scene with ``volpathmis``.

    Its picture is noisy and ours adds no noise: T's own noise was paid for once, in the bake. So
    the stated time is that of Mitsuba for the same noise as T's, extrapolated from two pictures
    with few paths.

    Returns:
        None for another head, where T's noise is not known, or without a compiler for Mitsuba.
    """
    header = transport.header
    noise = header.noise
    if header.head != _HEAD or not noise > 0:
        return None
    try:
        mitsuba: Any = select_variant("auto")
    except BakeError:
        return None
    if not is_wavefront(mitsuba):
        return None
    picture = _Renderer(transport, mitsuba)
    first = picture(0)
    measured = _noise(transport, first, picture(1))
    share = min((noise / measured) ** 2, 1.0)

    def judge(result: object) -> str:
        ours = render(transport, _light(transport))[picture.inside]
        mean = 0.5 * (first + np.asarray(result, np.float32))[picture.inside]
        off = 100.0 * np.abs(ours.mean(axis=0) / mean.mean(axis=0) - 1.0).max()
        return (
            f"at {_PATHS} paths per pixel, {100.0 * measured:.1f} % noise; extrapolated to "
            f"T's {100.0 * noise:.1f} %; mean colour {off:.1f} % from ours"
        )

    return PeerCase("Mitsuba", lambda: picture(2), judge, share=share)


class _Renderer:
    """The scene, made and compiled before the timing."""

    def __init__(self, transport: Transport, mitsuba: Any) -> None:
        heads = resources() / "heads"
        head = load_head(_HEAD, heads / f"{_HEAD}.ply", heads / f"{_HEAD}-eyes.ply")
        camera = frame_head(head, transport.size)
        fine = np.ascontiguousarray(enlarge(_light(transport), _FINE))
        light = {"light": {"type": "envmap", "bitmap": mitsuba.Bitmap(fine)}}
        self._scene = build_scene(head, find_skin(transport.header.skin), camera, light)
        self._mitsuba, self._pixels = mitsuba, transport.pixels
        # The picture beside the head shows the environment.
        self.inside = transport.face & (transport.coverage > _WHOLE)

    def __call__(self, seed: int) -> Float32:
        picture = self._mitsuba.render(self._scene, spp=_PATHS, seed=seed)
        return np.array(picture, np.float32).reshape(-1, 3)[self._pixels]


def _light(transport: Transport) -> Float32:
    scene = read_environment(resources() / "demo" / "scenes" / f"{_SCENE}.exr")
    return reduce(scene, transport.environment_shape)


def _noise(transport: Transport, first: Float32, second: Float32) -> float:
    """Return RMS difference / sqrt 2 / RMS over the face."""
    face = transport.face & (transport.coverage > _WHOLE)
    one, two = (each[face].astype(np.float64) for each in (first, second))
    return float(np.sqrt(np.square(one - two).mean() / 2.0 / (one * two).mean()))
