"""The options of a measurement: those that all methods share and those of a single method."""

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
"""Name of the head whose styles the clip audit checks by default."""

_Own = TypeVar("_Own", bound="WayOptions")


class WayOptions:
    """Base class for the options of one measuring method."""

    __slots__ = ()

    @property
    def more_files(self) -> tuple[Path, ...]:
        """Additional files to read."""
        return ()


@dataclass(frozen=True, slots=True)
class MeasureOptions:
    """The options of a measurement.

    Attributes:
        times: Exposure times in seconds that replace those in EXIF, in the order of the files.
        response: How to obtain the tone curve: choose automatically, assume sRGB, or recover it
            from the frames.
        weights: How to weight the frames in the merge.
        full: Whether to merge the frames at full size.
        sun: Sky to assume when restoring a clipped sun, or "leave" to leave the sun clipped.
        gains, lux: Stops by which to brighten each lamp, and the illuminance of each lamp in lux as
            measured with a light meter, respectively. Both are keyed by the lamp's letter.
        masks: Areas to fill.
        alone: Whether to accept a single panorama, which yields only a rough answer.
        sort_out: Whether to leave out files that do not belong to the bracket, as is done in a
            folder.
        mirrored: Whether the files are mirror images, as selfies from some phones are.
        pack: Styles that the clip audit checks, or None for those of the generic head.
        own: Options of the chosen measuring method, or None for its defaults.
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
        """The styles that the clip audit checks."""
        return self.pack or load_named_pack(HEAD)

    def of(self, kind: type[_Own]) -> _Own:
        """Return the options of one measuring method, or its defaults if none are set."""
        return self.own if isinstance(self.own, kind) else kind()
