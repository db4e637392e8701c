"""Sentences about what has been lost or changed in a place's folder and files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.core.base.remarks import Remark
from app.core.places.remarks import (
    CopyFailed,
    CopyKept,
    FolderUnreadable,
    FromNewer,
    JudgedAnew,
    LightChanged,
    LightFoundAgain,
    LightMissing,
    LostPart,
    PartLost,
    PhotosLost,
    PlaceUnreadable,
    Unfinished,
)
from app.core.text import tr, tr_plural
from app.words.sentences import Sentences, sentence_of

_PARTS: Final = {
    "name": tr("its name"),
    "made_at": tr("its time"),
    "environment": tr("its light"),
    "fingerprint": tr("the light’s checksum"),
    "measured_at": tr("when the light was measured"),
    "front_deg": tr("where the photographer stands"),
    "head": tr("the head"),
    "notes": tr("the notes"),
    "tags": tr("the tags"),
    "location": tr("the location"),
    "asked": tr("the options for the results"),
    "results": tr("the results"),
    "before": tr("the earlier results"),
    "chosen": tr("the chosen style"),
    "needle_deg": tr("the turn on display"),
    "goal_deg": tr("the turn to go to"),
    "capture": tr("how the light was measured"),
    "said_white_cd_m2": tr("the brightness of the place"),
    "spot": tr("the spot"),
    "studios": tr("the studio’s lamps"),
    "lens": tr("the camera position"),
}


def trouble_words(trouble: Remark) -> str:
    """Describe a problem with a place, as shown in a list of places."""
    return sentence_of(_TROUBLES if type(trouble) in _TROUBLES else SENTENCES, trouble)


def _damage(remark: PartLost) -> str:
    return tr(
        "Part of this place cannot be read: {why}. Open the place to check it, or capture it "
        "again.",
        why=remark.why or _names(remark.parts),
    )


def _part_lost(remark: PartLost) -> str:
    words = [
        tr("Part of this place could not be read: {why}.", why=remark.why)
        if remark.why
        else tr("Part of this place could not be read.")
    ]
    if remark.parts:
        words.append(tr("Lost: {names}.", names=_names(remark.parts)))
    if remark.empty:
        words.append(tr("Only the files in its folder remain."))
    return " ".join(words)


def _names(parts: Sequence[LostPart]) -> str:
    return ", ".join(dict.fromkeys(map(_name, parts)))


def _name(part: LostPart) -> str:
    if part.total:
        return tr("{lost} of {all} results", lost=part.count, all=part.total)
    return _PARTS[part.name]


def _photos_lost(remark: PhotosLost) -> str:
    if remark.count:
        return tr_plural(
            "The results for {count} photo taken here could not be read. The photo itself "
            "is in {folder}.",
            "The results for {count} photos taken here could not be read. The photos "
            "themselves are in {folder}.",
            remark.count,
            folder=remark.folder,
        )
    return tr(
        "The results for some photos taken here could not be read. The photos themselves "
        "are in {folder}.",
        folder=remark.folder,
    )


SENTENCES: Final[Sentences] = {
    LightChanged: tr(
        "{name} has changed since the results were computed. They are being recomputed."
    ),
    LightFoundAgain: tr("The light measurement for this place was found in {name}."),
    JudgedAnew: tr(
        "Turnlight now judges styles by the face. The results for this place are being "
        "recomputed; the earlier ones are kept."
    ),
    Unfinished: tr("This place is not finished. You can resume it."),
    PartLost: _part_lost,
    FromNewer: tr(
        "This place was saved by a newer version of Turnlight. Data that this version "
        "cannot read is kept."
    ),
    CopyKept: tr("The damaged file was saved as {name}."),
    CopyFailed: tr("The damaged file could not be copied and is still named {name}."),
    FolderUnreadable: tr("The places folder {folder} cannot be read: {reason}."),
    PlaceUnreadable: tr("This place cannot be read: {why}."),
    LightMissing: tr("The light measurement for this place is missing. Capture the place again."),
    PhotosLost: _photos_lost,
}
"""Sentence for each type of remark: text with field names, or a function that returns it."""
_TROUBLES: Final[Sentences] = {
    Unfinished: tr("This place is not finished. Everything captured so far is saved."),
    PartLost: _damage,
    FromNewer: tr("This place was saved by a newer version of Turnlight. Update to see all of it."),
}
