"""Remarks about a bracket: its files, exposures, tone curve, and motion."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark


class Reason(Enum):
    """Reason why a frame does not belong to the series."""

    BLACK = "black"
    OTHER_SCENE = "other-scene"
    TONE_MAPPED = "tone-mapped"


Tag: TypeAlias = Literal["shutter", "iso", "aperture"]


@dataclass(frozen=True, slots=True)
class PicturesTaken(Remark):
    """The pictures of a folder that form the bracket."""

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
    """Pictures of a folder with another size, kind or camera."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RenderedByCamera(Remark):
    """Pictures that HDR rendering or range compensation changed in every pixel."""

    names: tuple[str, ...]
    left_out: bool = False


@dataclass(frozen=True, slots=True)
class Copies(Remark):
    """Files with the same bytes as one in use; they have its name if it was named twice."""

    name: str
    copies: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SameExposure(Remark):
    """Frames of equal exposure, all of which are used."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TimeUnstated(Remark):
    """A photo without an exposure time."""

    name: str


@dataclass(frozen=True, slots=True)
class TagAssumed(Remark):
    """Frames without a tag, for which the value of the other frames is assumed."""

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
    """Tags that no frame states; they are assumed equal in all frames."""

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
    """A file that does not belong to the series and was left out."""

    name: str
    reason: Reason


@dataclass(frozen=True, slots=True)
class WrongTag(Remark):
    """A frame that is brighter than its tags state by `stops`, or darker; the measurement is used.

    Attributes:
        suspects: Frames whose tags may be wrong instead.
    """

    name: str
    stops: float
    suspects: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CurveUnchecked(Remark):
    """No two frames show the same area well exposed: sRGB is assumed."""

    recover: bool


@dataclass(frozen=True, slots=True)
class CurveDoubtful(Remark):
    """The steps between frames differ from the stated ones: the curve is probably not sRGB."""

    measured_stops: float
    stated_stops: float


@dataclass(frozen=True, slots=True)
class CurveRecovered(Remark):
    """The tone curve is not sRGB, and was recovered."""

    residual_stops: float


@dataclass(frozen=True, slots=True)
class OwnCurves(Remark):
    """Each frame has its own tone curve; all were recovered."""


@dataclass(frozen=True, slots=True)
class TwoFramesAlone(Remark):
    """With two frames, another tone curve and a wrong tag cannot be distinguished."""


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
    """Frames that have too little in common with the others to be aligned."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FramesShifted(Remark):
    """Frames of a moving camera that were aligned with the others."""

    names: tuple[str, ...]
    shifts_px: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Levelled(Remark):
    """Tilt of the camera, or its stated tilt if the camera levelled the picture itself."""

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
    """Position of a motion: azimuth and elevation, in degrees; or column and row, 0 to 1."""

    across: float
    up: float


@dataclass(frozen=True, slots=True)
class Motion(Remark):
    """Positions of motion between the frames, and the number of smaller ones."""

    places: tuple[MovedPart, ...]
    more: int
    panorama: bool


@dataclass(frozen=True, slots=True)
class MuchMotion(Remark):
    """Fraction of the picture, 0 to 1, with motion."""

    share: float
