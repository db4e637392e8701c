"""Time the light probe: three frames of a 360 camera to the light and the display panorama."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from app.core.base.colour import luminance, srgb_decode
from app.core.base.paths import resources
from app.core.camera_catalogue import camera_facts
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.bracket.measure import measure
from app.core.measure.plan.planner import plan
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from benchmarks.light.shots.brackets import write_bracket
from benchmarks.speed.timing.runner.rows import Case, PeerCase

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from types import ModuleType

    from numpy.typing import NDArray

    from app.core.base.colour import FloatImage
    from app.core.base.progress import Token
    from app.core.styles.style_pack import StylePack

_SCENE: Final = "interior"
_EV100: Final = 8.0
_ROUNDS: Final = 12  # threads find both cores free only now and then
_SRGB: Final = srgb_decode(np.arange(256) / 255.0)


@dataclass(frozen=True, slots=True, eq=False)
class Bracket:
    """Files of a simulated camera, and the light that they show.

    Attributes:
        seconds: (n,) float32. Exposure times.
        light: (H, 2 H, 3) float32. Linear Rec. 709, cd/m2.
    """

    files: tuple[Path, ...]
    seconds: NDArray[np.float32]
    light: FloatImage = field(repr=False)


def make_bracket(folder: Path, stops: Sequence[float] | None, shape: tuple[int, int]) -> Bracket:
    """Shoot a bracket of a bundled scene.

    Args:
        stops: Exposures relative to the metered one; None for the program's plan as in the paper.
        shape: Rows and columns of the frames.
    """
    radiance = read_environment(resources() / "demo" / "scenes" / f"{_SCENE}.exr").radiance
    light = radiance * np.float32(meter(radiance, THETA_V).factor * 2.0**_EV100)
    model = camera_facts(THETA_V.model)
    assert model is not None
    metered = meter(light, THETA_V)
    if stops is None:
        shots = [shot.exposure for shot in plan(metered, model.limits, "paper").shots]
    else:
        shots = [replace(metered, shutter_s=metered.shutter_s * 2.0**stop) for stop in stops]
    files = write_bracket(folder, light, THETA_V, shots, shape=shape)
    times = np.array([shot.shutter_s for shot in shots], np.float32)
    return Bracket(tuple(files), times, light)


def merge_case(
    bracket: Bracket, pack: StylePack, token: Token, colour_hdri: ModuleType | None = None
) -> Case:
    """Return the case of merging the paper's bracket in memory, with response check and audit.

    Args:
        colour_hdri: Module to time as well; its weights and sRGB's curve.

    Returns:
        ``merge.three``: against decoding the same files one after another and merging them by
        Debevec's weights, both by OpenCV. Its limit is that decoding alone.
    """
    shape = pack.header.environment
    truth = _relative(reduce_radiance(bracket.light, shape))

    def merged() -> FloatImage:
        radiance = measure(bracket.files, token=token).merged.radiance
        return reduce_radiance(radiance, shape)

    ours = _error(_relative(merged()), truth)

    def judge(result: object) -> str:
        found = np.ascontiguousarray(np.asarray(result, np.float32))
        theirs = _error(_relative(reduce_radiance(found, shape)), truth)
        return f"light off by {theirs:.2f} % in the median, ours {ours:.2f} %"

    peers = [PeerCase("OpenCV", lambda: debevec(bracket), judge)]
    if colour_hdri is not None:
        peer = colour_hdri
        peers.append(
            PeerCase("colour-hdri", lambda: _by_colour_hdri(peer, bracket), judge, rounds=1)
        )
    return Case(
        "merge.three",
        merged,
        lambda: debevec(bracket),
        "OpenCV: imread, then createMergeDebevec",
        lambda: decoded(bracket),
        "imread of the files alone",
        rounds=_ROUNDS,
        least=1,
        budget_s=0.0,
        by="threads",
        peers=tuple(peers),
    )


def decoded(bracket: Bracket) -> list[NDArray[np.uint8]]:
    """Decode a bracket's files one after another, by OpenCV, BGR."""
    return [np.asarray(cv2.imread(str(file)), np.uint8) for file in bracket.files]


def debevec(bracket: Bracket) -> NDArray[Any]:
    """Decode and merge by OpenCV, as in its manual; RGB."""
    response = np.repeat(_SRGB.astype(np.float32)[:, None, None], 3, axis=2)
    merger = cv2.createMergeDebevec()
    merged = merger.process(decoded(bracket), bracket.seconds, response)
    return np.asarray(merged)[..., ::-1]


def _by_colour_hdri(peer: Any, bracket: Bracket) -> object:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stack = peer.ImageStack()
        # It treats the first frame as the darkest.
        for k in np.argsort(bracket.seconds):
            picture = np.asarray(cv2.imread(str(bracket.files[k])), np.uint8)[..., ::-1] / 255.0
            about = peer.Metadata(1.0, float(bracket.seconds[k]), 100.0)
            stack.append(peer.Image(data=picture, metadata=about))
        return peer.image_stack_to_HDRI(
            stack,
            weighting_function=peer.weighting_function_Debevec1997,
            camera_response_functions=np.repeat(_SRGB[:, None], 3, axis=1),
        )


def _relative(light: FloatImage) -> NDArray[np.float64]:
    """Return luminance in units of its median, since merged light is known up to one factor."""
    values = luminance(light).astype(np.float64)
    return values / np.median(values)


def _error(found: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Return the median relative difference, percent, after the best common factor."""
    quotient = found / np.maximum(truth, 1e-12)
    return float(100.0 * np.median(np.abs(quotient / np.median(quotient) - 1.0)))
