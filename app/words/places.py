"""The words of a place's folder and files: what was lost of it, and what became of it."""

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
from app.core.text import tr
from app.words.sentences import Sentences, sentence_of

_PARTS: Final = {
    "name": tr("its name"),
    "made_at": tr("its time"),
    "environment": tr("its light"),
    "fingerprint": tr("the light's checksum"),
    "measured_at": tr("when the light was measured"),
    "front_deg": tr("where the photographer stands"),
    "head": tr("the head"),
    "notes": tr("the notes"),
    "tags": tr("the tags"),
    "location": tr("where the place is"),
    "asked": tr("what the results were asked with"),
    "results": tr("the results"),
    "before": tr("the earlier results"),
    "chosen": tr("the chosen style"),
    "needle_deg": tr("the turn looked at"),
    "goal_deg": tr("the turn to go to"),
    "capture": tr("how the light was measured"),
    "said_white_cd_m2": tr("how bright it is there"),
    "spot": tr("the spot"),
    "studios": tr("the studio’s lamps"),
    "lens": tr("where the lens may stand"),
}


def trouble_words(trouble: Remark) -> str:
    """Write what is wrong with a place, for a list of places."""
    return sentence_of(_TROUBLES if type(trouble) in _TROUBLES else SENTENCES, trouble)


def _damage(remark: PartLost) -> str:
    return tr(
        "A part of this place cannot be read: {why}. Open it and look, or capture here again.",
        why=remark.why or _names(remark.parts),
    )


def _part_lost(remark: PartLost) -> str:
    words = [
        tr("A part of this place could not be read: {why}.", why=remark.why)
        if remark.why
        else tr("A part of this place could not be read.")
    ]
    if remark.parts:
        words.append(tr("Lost: {names}.", names=_names(remark.parts)))
    if remark.empty:
        words.append(tr("Only the files in its folder are left."))
    return " ".join(words)


def _names(parts: Sequence[LostPart]) -> str:
    return ", ".join(dict.fromkeys(map(_name, parts)))


def _name(part: LostPart) -> str:
    if part.total:
        return tr("{lost} of {all} results", lost=part.count, all=part.total)
    return _PARTS[part.name]


def _photos_lost(remark: PhotosLost) -> str:
    if remark.count:
        return tr(
            "What is known of {count} photos taken here could not be read. The photos themselves "
            "are in {folder}.",
            count=remark.count,
            folder=remark.folder,
        )
    return tr(
        "What is known of some photos taken here could not be read. The photos themselves are "
        "in {folder}.",
        folder=remark.folder,
    )


SENTENCES: Final[Sentences] = {
    LightChanged: tr(
        "{name} has changed since the results were computed. They are computed again."
    ),
    LightFoundAgain: tr("Its light was found again in {name}."),
    JudgedAnew: tr(
        "Turnlight now judges a style by what the face shows. This place is computed "
        "again; its earlier answers are kept with it."
    ),
    Unfinished: tr("This place is not finished; it can be resumed."),
    PartLost: _part_lost,
    FromNewer: tr("A newer Turnlight saved this place; what this one does not know is kept."),
    CopyKept: tr("The damaged file is saved as {name}."),
    CopyFailed: tr("The damaged file could not be copied; it is still {name}."),
    FolderUnreadable: tr("The folder of places {folder} cannot be read: {reason}."),
    PlaceUnreadable: tr("This place cannot be read: {why}."),
    LightMissing: tr("The light of this place is missing. Capture here again."),
    PhotosLost: _photos_lost,
}
"""By remark: its sentence with the names of its fields, or what writes it."""
_TROUBLES: Final[Sentences] = {
    Unfinished: tr("This place is not finished. What was captured is saved."),
    PartLost: _damage,
    FromNewer: tr("A newer Turnlight saved this place. Update to see all of it."),
}
