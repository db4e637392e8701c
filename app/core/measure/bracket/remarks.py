"""Remarks about a bracket: its files, exposures, tone curve, and what moved."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark


class Reason(Enum):
    """Why a frame does not belong to the series."""

    BLACK = "black"
    OTHER_SCENE = "other-scene"
    TONE_MAPPED = "tone-mapped"


Tag: TypeAlias = Literal["shutter", "iso", "aperture"]


@dataclass(frozen=True, slots=True)
class PicturesTaken(Remark):
    """Which pictures of a folder are the bracket."""

    count: int
    folder: str
    first: str
    last: str


@dataclass(frozen=True, slots=True)
class FileLeftOut(Remark):
    """A file of a folder that cannot be read, with the message of its error."""

    message: str


@dataclass(frozen=True, slots=True)
class NotOfBracket(Remark):
    """Pictures of a folder that are of another size, kind or camera."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RenderedByCamera(Remark):
    """Pictures that HDR rendering or range compensation changed in every pixel."""

    names: tuple[str, ...]
    left_out: bool = False


@dataclass(frozen=True, slots=True)
class Copies(Remark):
    """Files with the same bytes as one that is used; all have its name where it is named twice."""

    name: str
    copies: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SameExposure(Remark):
    """Frames of one exposure, all of which are used."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TimeUnstated(Remark):
    """A photo that states no exposure time."""

    name: str


@dataclass(frozen=True, slots=True)
class TagAssumed(Remark):
    """Frames without a tag; the value of the other frames is assumed for them."""

    tag: Tag
    names: tuple[str, ...]
    value: float


@dataclass(frozen=True, slots=True)
class TagIgnored(Remark):
    """Frames without a tag that differs in the others: only the given exposure times count."""

    tag: Tag
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TagsUnstated(Remark):
    """Tags that no frame states; the same values are assumed for all."""

    iso: bool
    aperture: bool


@dataclass(frozen=True, slots=True)
class TimesAgainstExif(Remark):
    """Frames whose given exposure times contradict EXIF; the given ones count."""

    names: tuple[str, ...]
    given_s: tuple[float, ...]
    stated_s: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class LensesApart(Remark):
    """A frame whose two lenses were exposed differently."""

    name: str
    gap_stops: float
    isos: tuple[float, ...]
    shutters_s: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class NoteContradiction(Remark):
    """Frames whose maker note contradicts EXIF."""

    tag: Tag
    names: tuple[str, ...]
    stated: tuple[float, ...]
    noted: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ForeignFrame(Remark):
    """A file that is no exposure of the series and was left out."""

    name: str
    reason: Reason


@dataclass(frozen=True, slots=True)
class WrongTag(Remark):
    """A frame that is brighter than its tags say by `stops`, or darker; the measurement is used.

    `suspects`: frames whose tags may be wrong instead.
    """

    name: str
    stops: float
    suspects: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CurveUnchecked(Remark):
    """No two frames show the same place well exposed: sRGB is assumed."""

    recover: bool


@dataclass(frozen=True, slots=True)
class CurveDoubtful(Remark):
    """Frames lie apart by other steps than stated: the curve is probably not sRGB."""

    measured_stops: float
    stated_stops: float


@dataclass(frozen=True, slots=True)
class CurveRecovered(Remark):
    """The tone curve is not sRGB and was recovered."""

    residual_stops: float


@dataclass(frozen=True, slots=True)
class OwnCurves(Remark):
    """Each frame has a tone curve of its own, and they were recovered."""


@dataclass(frozen=True, slots=True)
class TwoFramesAlone(Remark):
    """Two frames cannot tell another tone curve from a wrong tag."""


@dataclass(frozen=True, slots=True)
class FramesUnfit(Remark):
    """No curve and no single wrong tag explains the frames."""

    residual_stops: float


@dataclass(frozen=True, slots=True)
class FramesRotated(Remark):
    """Frames that were rotated to match the others."""

    names: tuple[str, ...]
    angles_deg: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FramesUnlike(Remark):
    """Frames that no small rotation aligns with the others."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FramesApart(Remark):
    """Frames that share too little with the others to be aligned."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FramesShifted(Remark):
    """Frames of a moving camera that were laid on the others."""

    names: tuple[str, ...]
    shifts_px: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Levelled(Remark):
    """How far the camera was tilted; or states so, where it has levelled the picture itself."""

    name: str
    pitch_deg: float
    roll_deg: float
    by_camera: bool = False


@dataclass(frozen=True, slots=True)
class FramesContradict(Remark):
    """Frames that differ over a share of the picture, 0 to 1, of the same place or of another."""

    share: float
    same_place: bool


@dataclass(frozen=True, slots=True)
class MovedPart:
    """Where something moved: azimuth and elevation, deg; or column and row, 0 to 1."""

    across: float
    up: float


@dataclass(frozen=True, slots=True)
class Motion(Remark):
    """Where things moved between the frames, and at how many smaller places."""

    places: tuple[MovedPart, ...]
    more: int
    panorama: bool


@dataclass(frozen=True, slots=True)
class MuchMotion(Remark):
    """The share of the picture, 0 to 1, in which things moved."""

    share: float
