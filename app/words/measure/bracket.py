"""Sentences for remarks about a bracket: files, exposures, tone curve and movement."""

from __future__ import annotations

from typing import Final

from app.core.base.phrases import listed
from app.core.measure.bracket.remarks import (
    Copies,
    CurveDoubtful,
    CurveRecovered,
    CurveUnchecked,
    FileLeftOut,
    ForeignFrame,
    FramesApart,
    FramesContradict,
    FramesRotated,
    FramesShifted,
    FramesUnfit,
    FramesUnlike,
    LensesApart,
    Levelled,
    Motion,
    MovedPart,
    MuchMotion,
    NoteContradiction,
    NotOfBracket,
    OwnCurves,
    PicturesTaken,
    Reason,
    RenderedByCamera,
    SameExposure,
    TagAssumed,
    TagIgnored,
    TagsUnstated,
    TimesAgainstExif,
    TimeUnstated,
    TwoFramesAlone,
    WrongTag,
)
from app.core.measure.read.remarks import FrameUnread, PhoneRendered, TwoApertures, TwoTimes
from app.core.text import tr, tr_plural
from app.words.phrases.quantities import upper_first
from app.words.sentences import Sentences

_FOREIGN: Final = {
    Reason.BLACK: tr("{name} is black and was left out."),
    Reason.OTHER_SCENE: tr(
        "{name} shows a different scene and was left out. Remove it from the bracket."
    ),
    Reason.TONE_MAPPED: tr(
        "{name} was left out: its tones have been edited, as in an HDR picture or a preview."
    ),
}


def _pictures_taken(remark: PicturesTaken) -> str:
    return tr_plural(
        "Used {count} picture from {folder}: {first} to {last}.",
        "Used {count} pictures from {folder}: {first} to {last}.",
        remark.count,
        folder=remark.folder,
        first=remark.first,
        last=remark.last,
    )


def _not_of_bracket(remark: NotOfBracket) -> str:
    return tr_plural(
        "Not part of the bracket, so left out: {names}.",
        "Not part of the bracket, so left out: {names}.",
        len(remark.names),
        names=listed(remark.names),
    )


def _rendered(remark: RenderedByCamera) -> str:
    words = tr_plural(
        "{names} was taken with the camera’s HDR or range compensation on.",
        "{names} were taken with the camera’s HDR or range compensation on.",
        len(remark.names),
        names=listed(remark.names),
    )
    return tr("Left out: {message}", message=words) if remark.left_out else words


def _copies(remark: Copies) -> str:
    if set(remark.copies) == {remark.name}:
        return tr("{name} is listed more than once but used only once.", name=remark.name)
    return tr_plural(
        "{names} is a copy of {name} and was left out.",
        "{names} are copies of {name} and were left out.",
        len(remark.copies),
        names=listed(remark.copies),
        name=remark.name,
    )


def _same_exposure(remark: SameExposure) -> str:
    return tr("{names} have the same exposure; all are used.", names=listed(remark.names))


def _unstated_tag(remark: TagAssumed | TagIgnored) -> str:
    if remark.tag == "iso":
        return tr_plural(
            "{names} does not record the ISO",
            "{names} do not record the ISO",
            len(remark.names),
            names=listed(remark.names),
        )
    return tr_plural(
        "{names} does not record the f-number",
        "{names} do not record the f-number",
        len(remark.names),
        names=listed(remark.names),
    )


def _assumed(remark: TagAssumed) -> str:
    return tr(
        "{start}; {sign}{stated:g} is assumed, as in the other frames.",
        start=_unstated_tag(remark),
        sign="f/" if remark.tag == "aperture" else "ISO ",
        stated=remark.value,
    )


def _ignored(remark: TagIgnored) -> str:
    return tr(
        "{start}, and the other frames differ. Only the exposure times you gave are used.",
        start=_unstated_tag(remark),
    )


def _unstated(remark: TagsUnstated) -> str:
    if remark.iso and remark.aperture:
        start = tr("The frames record neither ISO nor f-number; both are assumed to be constant")
    elif remark.iso:
        start = tr("The frames do not record the ISO, which is assumed to be constant")
    else:
        start = tr("The frames do not record the f-number, which is assumed to be constant")
    return tr("{start}. The brightness of the place in cd/m² is unknown.", start=start)


def _against_exif(remark: TimesAgainstExif) -> str:
    frames = zip(remark.names, remark.given_s, remark.stated_s, strict=True)
    words = [
        tr("{name} ({time:.4g} s, not {stated:.4g} s)", name=name, time=time, stated=stated)
        for name, time, stated in frames
    ]
    return tr("The exposure times you gave override the EXIF data: {listed}.", listed=listed(words))


def _lenses_apart(remark: LensesApart) -> str:
    (first, second), (one, two) = remark.isos, remark.shutters_s
    both = tr("ISO {first:g} and {second:g}", first=first, second=second)
    if one != two:
        both = tr("{isos}, {first:.4g} s and {second:.4g} s", isos=both, first=one, second=two)
    return tr(
        "{name}: the two lenses were exposed {gap:.1f} stops apart ({both}), so the two "
        "halves of the panorama do not match. Shoot the bracket in manual mode.",
        name=remark.name,
        gap=remark.gap_stops,
        both=both,
    )


def _contradiction(remark: NoteContradiction) -> str:
    frames = list(zip(remark.names, remark.stated, remark.noted, strict=True))
    if remark.tag == "iso":
        words = [
            tr(
                "{name} (ISO {stated:g} in EXIF, {noted:g} in the maker note)",
                name=name,
                stated=one,
                noted=two,
            )
            for name, one, two in frames
        ]
        return tr(
            "The EXIF data and the maker note give different ISO values: {listed}.",
            listed=listed(words),
        )
    words = [
        tr(
            "{name} ({stated:.4g} s in EXIF, {noted:.4g} s in the maker note)",
            name=name,
            stated=one,
            noted=two,
        )
        for name, one, two in frames
    ]
    return tr(
        "The EXIF data and the maker note give different exposure times: {listed}.",
        listed=listed(words),
    )


def _foreign(remark: ForeignFrame) -> str:
    return _FOREIGN[remark.reason].format(name=remark.name)


def _wrong_tag(remark: WrongTag) -> str:
    sentence = (
        tr(
            "{name} is {stops:.2f} stops brighter than its EXIF data say. The measured "
            "exposure is used."
        )
        if remark.stops > 0
        else tr(
            "{name} is {stops:.2f} stops darker than its EXIF data say. The measured "
            "exposure is used."
        )
    ).format(name=upper_first(remark.name), stops=abs(remark.stops))
    if not remark.suspects:
        return sentence
    names = remark.suspects[0]
    for other in remark.suspects[1:]:
        names = tr("{names} or {last}", names=names, last=other)
    return tr("{text} The EXIF data of {names} may be wrong instead.", text=sentence, names=names)


def _unchecked(remark: CurveUnchecked) -> str:
    if remark.recover:
        return tr(
            "The tone curve could not be recovered: no two frames show the same spot "
            "well exposed. sRGB is assumed."
        )
    return tr(
        "The tone curve could not be checked: no two frames show the same spot well "
        "exposed. sRGB is assumed."
    )


def _rotated(remark: FramesRotated) -> str:
    frames = zip(remark.names, remark.angles_deg, strict=True)
    words = ", ".join(
        tr("{name} by {angle:.2f}°", name=name, angle=angle) for name, angle in frames
    )
    return tr("Rotated to match the other frames: {listed}.", listed=words)


def _unlike(remark: FramesUnlike) -> str:
    return tr(
        "Could not be aligned by a small rotation, so left as shot: {listed}.",
        listed=", ".join(remark.names),
    )


def _apart(remark: FramesApart) -> str:
    return tr(
        "Too little in common with the other frames to align, so left as shot: {listed}.",
        listed=", ".join(remark.names),
    )


def _shifted(remark: FramesShifted) -> str:
    frames = zip(remark.names, remark.shifts_px, strict=True)
    words = ", ".join(
        tr("{name} by {pixels}", name=name, pixels=f"{shift:.{int(shift < 1.5)}f}")
        for name, shift in frames
    )
    return tr("The camera moved. Frames were shifted to match, in pixels: {names}.", names=words)


def _levelled(remark: Levelled) -> str:
    tilt = tr(
        "pitch {pitch_deg:+.1f}°, roll {roll_deg:+.1f}°",
        pitch_deg=remark.pitch_deg,
        roll_deg=remark.roll_deg,
    )
    if remark.by_camera:
        return tr(
            "{name} records a tilt ({tilt}), but the camera has already levelled the "
            "picture, which was left unchanged.",
            name=remark.name,
            tilt=tilt,
        )
    return tr("The camera was tilted ({tilt}). The panorama was levelled.", tilt=tilt)


def _contradict(remark: FramesContradict) -> str:
    share = 100.0 * remark.share
    if remark.same_place:
        return tr(
            "The frames differ over {share:.0f}% of the picture, so motion was not "
            "removed. Their exposures or tone curves may be wrong.",
            share=share,
        )
    return tr(
        "The frames show different things over {share:.0f}% of the picture. Shoot the "
        "bracket again if you can.",
        share=share,
    )


def _motion(remark: Motion) -> str:
    places = [_part(each, remark.panorama) for each in remark.places]
    if remark.more:
        places.append(tr_plural("at {count} smaller spot", "at {count} smaller spots", remark.more))
    words = places[0]
    if len(places) > 1:
        words = tr("{places}; and {last}", places="; ".join(places[:-1]), last=places[-1])
    return tr(
        "Something moved between frames {listed}. Only frames that agree are used there.",
        listed=words,
    )


def _part(part: MovedPart, panorama: bool) -> str:
    if panorama:
        return tr(
            "at azimuth {azimuth_deg:.0f}°, elevation {elevation_deg:.0f}°",
            azimuth_deg=part.across,
            elevation_deg=part.up,
        )
    return tr(
        "at {across:.0f}% from the left, {down:.0f}% from the top",
        across=100.0 * part.across,
        down=100.0 * part.up,
    )


def _much_motion(remark: MuchMotion) -> str:
    return tr(
        "That is {share:.0f}% of the picture. If you can, shoot the bracket again when "
        "less is moving.",
        share=100.0 * remark.share,
    )


SENTENCES: Final[Sentences] = {
    PicturesTaken: _pictures_taken,
    FileLeftOut: tr("Left out: {message}"),
    FrameUnread: tr("{message} The frame was left out."),
    NotOfBracket: _not_of_bracket,
    RenderedByCamera: _rendered,
    PhoneRendered: tr(
        "{name} was rendered by the phone’s HDR mode, which alters every pixel differently."
    ),
    TwoTimes: tr("{name} records two exposure times: {shutter_s:.4g} s and {apex_s:.4g} s."),
    TwoApertures: tr("{name} records two f-numbers: f/{aperture:.3g} and f/{apex:.3g}."),
    Copies: _copies,
    SameExposure: _same_exposure,
    TimeUnstated: tr("{name} does not record its exposure time."),
    TagAssumed: _assumed,
    TagIgnored: _ignored,
    TagsUnstated: _unstated,
    TimesAgainstExif: _against_exif,
    LensesApart: _lenses_apart,
    NoteContradiction: _contradiction,
    ForeignFrame: _foreign,
    WrongTag: _wrong_tag,
    CurveUnchecked: _unchecked,
    CurveDoubtful: tr(
        "The frames are {measured_stops:.2f} stops apart, but the files record "
        "{stated_stops:.2f}. The camera’s tone curve is probably not sRGB: recover it "
        "from the bracket."
    ),
    CurveRecovered: tr(
        "The camera’s tone curve is not sRGB. It was recovered from the bracket, to "
        "within {residual_stops:.2f} stops."
    ),
    OwnCurves: tr(
        "The camera used a different tone curve for each frame, as phones do. The curves "
        "were recovered from the bracket; highlights and shadows are less exact."
    ),
    TwoFramesAlone: tr(
        "With only two frames, an unusual tone curve looks like a wrong exposure time, so the "
        "EXIF data are trusted. Add a third frame."
    ),
    FramesUnfit: tr(
        "The frames do not match: they are {residual_stops:.2f} stops off. The light "
        "changed between them, or several exposures are not as recorded."
    ),
    FramesRotated: _rotated,
    FramesUnlike: _unlike,
    FramesApart: _apart,
    FramesShifted: _shifted,
    Levelled: _levelled,
    FramesContradict: _contradict,
    Motion: _motion,
    MuchMotion: _much_motion,
}
"""Sentence for each type of remark: text with field names, or a function that returns it."""
