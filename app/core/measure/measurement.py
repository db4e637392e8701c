"""The result of a measurement, whatever its source."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np

from app.core.base.arrays import Bytes, Float32
from app.core.base.progress import Report, Token
from app.core.base.remarks import Remark
from app.core.environment.environment import Environment, from_radiance, kept_shares
from app.core.measure.bracket.alignment.align import FrameAlignment
from app.core.measure.bracket.alignment.handheld import Lay
from app.core.measure.bracket.alignment.levelling import Levelling
from app.core.measure.bracket.curve.response import ResponseChoice, srgb_choice
from app.core.measure.bracket.deghosting import FrameTrust
from app.core.measure.bracket.foreign_frames import LeftOut
from app.core.measure.finish.corrections import FinishedLight
from app.core.measure.options import MeasureOptions
from app.core.measure.read.frame import Bracket, MergedLight


class WayFacts(Protocol):
    """Facts that only one measuring method provides."""

    def facts(self) -> dict[str, Any]:
        """Return the facts as a dictionary for JSON."""
        ...


_Facts = TypeVar("_Facts")


@dataclass(frozen=True, slots=True)
class Measurement:
    """The light at a place, how reliable it is and how it was measured.

    Attributes:
        way: Key of the measuring method, as in `ways.WAYS`.
        bracket: The frames in use, with their true exposures. For a video, there are no frames.
        finished: The light, its lamps and sun, and the answers that depend on clipping.
        warnings, notes: Remarks on possible problems, and a record of the steps that were taken.
        display: (h, w, 3) uint8 sRGB. The panorama as measured, or an empty array if the pictures
            do not form a panorama.
        blind: Fraction of the sphere that lay in gaps, which were filled.
        left_out: Files that were left out because they do not belong to the series.
        response, alignments, lays, levelling, motion: Results of the individual steps of the merge.
        own: Facts that only this measuring method provides, or None.
    """

    way: str
    bracket: Bracket
    finished: FinishedLight
    warnings: tuple[Remark, ...] = ()
    notes: tuple[Remark, ...] = ()
    display: Bytes = field(default_factory=lambda: np.empty((0, 0, 3), np.uint8), repr=False)
    blind: float = 0.0
    left_out: tuple[LeftOut, ...] = ()
    response: ResponseChoice = field(default_factory=srgb_choice)
    alignments: tuple[FrameAlignment, ...] = ()
    lays: tuple[Lay, ...] = ()
    levelling: Levelling = field(default_factory=Levelling)
    motion: FrameTrust = field(default_factory=lambda: FrameTrust(()))
    own: WayFacts | None = None

    @property
    def merged(self) -> MergedLight:
        """The finished light."""
        return self.finished.merged

    @property
    def rough(self) -> bool:
        """Whether the light comes from a single photo, in which case clipped light is estimated."""
        return len(self.bracket.frames) == 1

    @property
    def shares(self) -> dict[str, Float32]:
        """Extra channels for a file, (H, W) each: light clipped in a single photo, and gaps."""
        return kept_shares(self.merged.clipped if self.rough else None, self.finished.unseen)

    def of(self, kind: type[_Facts]) -> _Facts | None:
        """Return the facts of one method, or None if the light was measured in another way."""
        return self.own if isinstance(self.own, kind) else None

    def environment(self, name: str) -> Environment:
        """Return the light as an environment that can be solved.

        Raises:
            EnvironmentFileError: If the picture is not a panorama or is entirely black.
        """
        light, clipped = from_radiance(self.merged.radiance.copy(), name), self.merged.clipped
        return replace(
            light,
            rough=self.rough,
            clipped=clipped if self.rough and clipped.any() else None,
            unseen=self.finished.unseen,
        )


Entry: TypeAlias = Callable[[Sequence[Path], MeasureOptions, Token, Report], Measurement]
"""A function that measures light from files, or from one folder of files.

It raises `ProbeError` (one sentence and a hint) if the files are unsuitable or an option cannot be
applied, `CoreError` if a file cannot be read, and `Cancelled` if the token is cancelled.
"""
