"""Remarks on a bracket's files, exposures, tone curve and motion."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

from app.core.base.remarks import Remark


class Reason(Enum):
    """The reason why a frame does not belong to the series."""

    BLACK = "black"
    OTHER_SCENE = "other-scene"
    TONE_MAPPED = "tone-mapped"


Tag: TypeAlias = Literal["shutter", "iso", "aperture"]


@dataclass(frozen=True, slots=True)
class PicturesTaken(Remark):
    """Only some of the pictures in a folder form the bracket."""

    count: int
    folder: str
    first: str
    last: str


@dataclass(frozen=True, slots=True)
class FileLeftOut(Remark):
    """A file in a folder cannot be read. `message` is the text of the error."""

    message: str


@dataclass(frozen=True, slots=True)
class NotOfBracket(Remark):
    """Some pictures in a folder differ in size, kind or camera from the bracket."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RenderedByCamera(Remark):
    """HDR rendering or range compensation has altered every pixel of some pictures."""

    names: tuple[str, ...]
    left_out: bool = False


@dataclass(frozen=True, slots=True)
class Copies(Remark):
    """Some files have the same bytes as a file in use, or were listed twice."""

    name: str
    copies: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SameExposure(Remark):
    """Some frames have equal exposures. All of these frames are used."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TimeUnstated(Remark):
    """A photo does not record its exposure time."""

    name: str


@dataclass(frozen=True, slots=True)
class TagAssumed(Remark):
    """Some frames lack a tag, whose value is assumed to be the same as in the other frames."""

    tag: Tag
    names: tuple[str, ...]
    value: float


@dataclass(frozen=True, slots=True)
class TagIgnored(Remark):
    """Some frames lack a tag that varies in the others, so only the given exposure times count."""

    tag: Tag
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TagsUnstated(Remark):
    """No frame records certain tags, which are assumed to be the same in all frames."""

    iso: bool
    aperture: bool


@dataclass(frozen=True, slots=True)
class TimesAgainstExif(Remark):
    """The exposure times given for some frames contradict EXIF and are used instead."""

    names: tuple[str, ...]
    given_s: tuple[float, ...]
    stated_s: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class LensesApart(Remark):
    """The two lenses of a frame were exposed differently."""

    name: str
    gap_stops: float
    isos: tuple[float, ...]
    shutters_s: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class NoteContradiction(Remark):
    """The maker note of some frames contradicts EXIF."""

    tag: Tag
    names: tuple[str, ...]
    stated: tuple[float, ...]
    noted: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ForeignFrame(Remark):
    """A file was left out because it does not belong to the series."""

    name: str
    reason: Reason


@dataclass(frozen=True, slots=True)
class WrongTag(Remark):
    """A frame was measured to be `stops` brighter than its tags state, or darker if negative.

    Attributes:
        suspects: Frames whose tags may be the wrong ones instead.
    """

    name: str
    stops: float
    suspects: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CurveUnchecked(Remark):
    """No two frames show the same area well exposed, so sRGB is assumed."""

    recover: bool


@dataclass(frozen=True, slots=True)
class CurveDoubtful(Remark):
    """The steps between frames differ from the nominal ones, so the curve is probably not sRGB."""

    measured_stops: float
    stated_stops: float


@dataclass(frozen=True, slots=True)
class CurveRecovered(Remark):
    """The tone curve is not sRGB and was recovered."""

    residual_stops: float


@dataclass(frozen=True, slots=True)
class OwnCurves(Remark):
    """Each frame has its own tone curve. All of these curves were recovered."""


@dataclass(frozen=True, slots=True)
class TwoFramesAlone(Remark):
    """With two frames, a different tone curve cannot be distinguished from a wrong tag."""


@dataclass(frozen=True, slots=True)
class FramesUnfit(Remark):
    """Neither a response curve nor a single wrong tag explains the frames."""

    residual_stops: float


@dataclass(frozen=True, slots=True)
class FramesRotated(Remark):
    """Some frames were rotated to match the others."""

    names: tuple[str, ...]
    angles_deg: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class FramesUnlike(Remark):
    """No small rotation aligns some frames with the others."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FramesApart(Remark):
    """Some frames have too little in common with the others to be aligned."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FramesShifted(Remark):
    """The camera moved, and some frames were aligned with the others."""

    names: tuple[str, ...]
    shifts_px: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Levelled(Remark):
    """The picture was levelled using the recorded tilt, or the camera had already levelled it."""

    name: str
    pitch_deg: float
    roll_deg: float
    by_camera: bool = False


@dataclass(frozen=True, slots=True)
class FramesContradict(Remark):
    """The frames differ over a large part of the picture.

    Attributes:
        share: Fraction of the picture over which they differ, 0 to 1.
        same_place: Whether they still seem to show the same place.
    """

    share: float
    same_place: bool


@dataclass(frozen=True, slots=True)
class MovedPart:
    """Position of a moved part: azimuth and elevation in degrees, or column and row, 0 to 1."""

    across: float
    up: float


@dataclass(frozen=True, slots=True)
class Motion(Remark):
    """Something moved between the frames, at these positions and at `more` minor ones."""

    places: tuple[MovedPart, ...]
    more: int
    panorama: bool


@dataclass(frozen=True, slots=True)
class MuchMotion(Remark):
    """There is motion in a large part of the picture, given as a fraction `share` from 0 to 1."""

    share: float
