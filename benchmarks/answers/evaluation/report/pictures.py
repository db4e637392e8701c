"""The pictures of the result sheets: every style's target, and the head at every best turn."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.environment.environment import reduce_radiance
from app.core.portrait.gallery_portraits import framing, greyed, portraits
from app.core.solver.transport import render, to_image

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.progress import PhraseReport, Token
    from app.core.solver.style_result import StyleResult
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack
    from benchmarks.answers.evaluation.scenes import Scene

Bytes: TypeAlias = NDArray[np.uint8]

SIZE: Final = (112, 96)
"""Rows and columns of one picture."""

_QUALITY: Final = 84


@dataclass(frozen=True, slots=True, eq=False)
class Sheets:
    """Pictures as data URIs."""

    targets: tuple[str, ...] = field(repr=False)
    found: tuple[tuple[str, ...], ...] = field(repr=False)


def draw_sheets(
    scenes: Sequence[Scene],
    results: Sequence[Sequence[StyleResult]],
    pack: StylePack,
    transport: Transport,
    *,
    report: PhraseReport,
    token: Token,
) -> Sheets:
    """Render the head at every best turn.

    Raises:
        Cancelled: If the token was cancelled.
    """
    frame = framing(transport.size, SIZE)
    coverage = pack.coverage.astype(np.float32)
    wanted = [pack.target(one.name) for one in results[0]]
    targets = portraits(np.stack(wanted), coverage, frame)
    rows = []
    for number, (scene, answers) in enumerate(zip(scenes, results, strict=True)):
        token.check()
        report(number / len(scenes), "Drawing the result sheets")
        pictures = [_picture(transport, scene, one.turn_refined_deg) for one in answers]
        shown = portraits(np.stack(pictures), coverage, frame)
        rows.append(
            tuple(
                data_uri(picture if one.attainable else greyed(picture))
                for picture, one in zip(shown, answers, strict=True)
            )
        )
    return Sheets(tuple(data_uri(picture) for picture in targets), tuple(rows))


def _picture(transport: Transport, scene: Scene, turn_deg: float) -> NDArray[np.float32]:
    light = reduce_radiance(scene.fine, transport.environment_shape, turn_deg)
    return to_image(transport, render(transport, light))


def data_uri(picture: Bytes) -> str:
    """Encode an sRGB picture (H, W, 3) as a JPEG inside the page."""
    options = [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    done, packed = cv2.imencode(".jpg", np.ascontiguousarray(picture[..., ::-1]), options)
    if not done:  # only for pictures of no size
        raise ValueError("the picture cannot be encoded")
    return "data:image/jpeg;base64," + base64.b64encode(packed.tobytes()).decode("ascii")
