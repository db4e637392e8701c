"""Options of a measurement: those shared by all ways of measuring, and those of one way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal, TypeVar

from app.core.measure.finish.masks import MaskSpec
from app.core.measure.finish.sunlight import SkyWord
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack

HEAD: Final = "generic"
"""The head whose styles decide which of a measured light's answers are in doubt."""

_Own = TypeVar("_Own", bound="WayOptions")


class WayOptions:
    """Base class for the options of one way of measuring."""

    __slots__ = ()

    @property
    def more_files(self) -> tuple[Path, ...]:
        """Further files to read."""
        return ()


@dataclass(frozen=True, slots=True)
class MeasureOptions:
    """Options of a measurement.

    Attributes:
        times: Exposure times in seconds in the order of the files, instead of those in EXIF.
        response: Tone curve: found automatically, sRGB, or recovered.
        weights: Weighting of the merge.
        full: Keep the frames' own size.
        sun: Assumed sky for restoring a clipped sun; "leave" to leave it clipped.
        gains, lux: By lamp: stops to add, and illuminance measured by a light meter.
        masks: Areas to fill.
        alone: Accept a single photo of all directions, for a rough answer.
        sort_out: Leave out files that do not belong to the bracket, as in a folder.
        mirrored: The files are mirror images, as some phones save selfies.
        pack: Styles that the clip audit answers for, or None for those of the generic head.
        own: Options of the way itself.
    """

    times: tuple[float, ...] | None = None
    response: Literal["auto", "srgb", "recover"] = "auto"
    weights: Literal["noise", "reinhard"] = "noise"
    full: bool = False
    sun: SkyWord | Literal["leave"] = "clear"
    gains: Mapping[str, float] = field(default_factory=dict)
    lux: Mapping[str, float] = field(default_factory=dict)
    masks: tuple[MaskSpec, ...] = ()
    alone: bool = False
    sort_out: bool = False
    mirrored: bool = False
    pack: StylePack | None = field(default=None, repr=False, compare=False)
    own: WayOptions | None = None

    @property
    def styles(self) -> StylePack:
        """The styles that the clip audit answers for."""
        return self.pack or load_named_pack(HEAD)

    def of(self, kind: type[_Own]) -> _Own:
        """Return the options of a way; by default its default options."""
        return self.own if isinstance(self.own, kind) else kind()
