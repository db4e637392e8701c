"""The words of a bracket's remarks: its files, exposures, tone curve, and what moved."""

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
        "{name} shows another scene and was left out. Remove it from the bracket."
    ),
    Reason.TONE_MAPPED: tr(
        "{name} is no exposure of this bracket and was left out: its tones were changed, as in "
        "an HDR picture or a preview."
    ),
}


def _pictures_taken(remark: PicturesTaken) -> str:
    return tr_plural(
        "Took {count} picture of {folder}: {first} to {last}.",
        "Took {count} pictures of {folder}: {first} to {last}.",
        remark.count,
        folder=remark.folder,
        first=remark.first,
        last=remark.last,
    )


def _not_of_bracket(remark: NotOfBracket) -> str:
    return tr_plural(
        "Left out: {names} does not belong to the bracket.",
        "Left out: {names} do not belong to the bracket.",
        len(remark.names),
        names=listed(remark.names),
    )


def _rendered(remark: RenderedByCamera) -> str:
    words = tr_plural(
        "{names} was taken with the camera's HDR or range compensation on.",
        "{names} were taken with the camera's HDR or range compensation on.",
        len(remark.names),
        names=listed(remark.names),
    )
    return tr("Left out: {message}", message=words) if remark.left_out else words


def _copies(remark: Copies) -> str:
    if set(remark.copies) == {remark.name}:
        return tr("{name} is listed more than once; it is used once.", name=remark.name)
    return tr_plural(
        "{names} is a copy of {name} and left out.",
        "{names} are copies of {name} and left out.",
        len(remark.copies),
        names=listed(remark.copies),
        name=remark.name,
    )


def _same_exposure(remark: SameExposure) -> str:
    return tr("{names} have the same exposure; all of them are used.", names=listed(remark.names))


def _unstated_tag(remark: TagAssumed | TagIgnored) -> str:
    if remark.tag == "iso":
        return tr_plural(
            "{names} states no ISO value",
            "{names} state no ISO value",
            len(remark.names),
            names=listed(remark.names),
        )
    return tr_plural(
        "{names} states no f-number",
        "{names} state no f-number",
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
        "{start} and the others differ in theirs: only the given exposure times count.",
        start=_unstated_tag(remark),
    )


def _unstated(remark: TagsUnstated) -> str:
    if remark.iso and remark.aperture:
        start = tr("No frame states its ISO value or f-number: the same ones are assumed for all")
    elif remark.iso:
        start = tr("No frame states its ISO value: the same one is assumed for all")
    else:
        start = tr("No frame states its f-number: the same one is assumed for all")
    return tr("{start}, and the brightness of the place in cd/m2 stays unknown.", start=start)


def _against_exif(remark: TimesAgainstExif) -> str:
    frames = zip(remark.names, remark.given_s, remark.stated_s, strict=True)
    words = [
        tr("{name} ({time:.4g} s, not {stated:.4g} s)", name=name, time=time, stated=stated)
        for name, time, stated in frames
    ]
    return tr("The given exposure times are used against EXIF: {listed}.", listed=listed(words))


def _lenses_apart(remark: LensesApart) -> str:
    (first, second), (one, two) = remark.isos, remark.shutters_s
    both = tr("ISO {first:g} and {second:g}", first=first, second=second)
    if one != two:
        both = tr("{isos}, {first:.4g} s and {second:.4g} s", isos=both, first=one, second=two)
    return tr(
        "{name}: the two lenses were exposed {gap:.1f} stops apart ({both}), so "
        "that the halves of the panorama do not agree. Shoot the bracket in "
        "manual mode.",
        name=remark.name,
        gap=remark.gap_stops,
        both=both,
    )


def _contradiction(remark: NoteContradiction) -> str:
    frames = list(zip(remark.names, remark.stated, remark.noted, strict=True))
    if remark.tag == "iso":
        words = [
            tr("{name} (ISO {stated:g} in EXIF, {noted:g})", name=name, stated=one, noted=two)
            for name, one, two in frames
        ]
        return tr("EXIF and maker note differ in ISO: {listed}.", listed=listed(words))
    words = [
        tr("{name} ({stated:.4g} s in EXIF, {noted:.4g} s)", name=name, stated=one, noted=two)
        for name, one, two in frames
    ]
    return tr("EXIF and maker note differ in the exposure time: {listed}.", listed=listed(words))


def _foreign(remark: ForeignFrame) -> str:
    return _FOREIGN[remark.reason].format(name=remark.name)


def _wrong_tag(remark: WrongTag) -> str:
    sentence = (
        tr(
            "{name} is {stops:.2f} stops brighter than its exposure tags say; the measured "
            "exposure is used."
        )
        if remark.stops > 0
        else tr(
            "{name} is {stops:.2f} stops darker than its exposure tags say; the measured "
            "exposure is used."
        )
    ).format(name=upper_first(remark.name), stops=abs(remark.stops))
    if not remark.suspects:
        return sentence
    names = remark.suspects[0]
    for other in remark.suspects[1:]:
        names = tr("{names} or {last}", names=names, last=other)
    return tr("{text} The tags of {names} may be wrong instead.", text=sentence, names=names)


def _unchecked(remark: CurveUnchecked) -> str:
    if remark.recover:
        return tr(
            "No two frames show the same place well exposed, so that the tone curve is taken as "
            "sRGB; it could not be recovered."
        )
    return tr(
        "No two frames show the same place well exposed, so that the tone curve is taken as "
        "sRGB; it could not be checked."
    )


def _rotated(remark: FramesRotated) -> str:
    frames = zip(remark.names, remark.angles_deg, strict=True)
    words = ", ".join(
        tr("{name} by {angle:.2f}°", name=name, angle=angle) for name, angle in frames
    )
    return tr("Rotated to match the other frames: {listed}.", listed=words)


def _unlike(remark: FramesUnlike) -> str:
    return tr(
        "No small rotation matches the other frames, left as shot: {listed}.",
        listed=", ".join(remark.names),
    )


def _apart(remark: FramesApart) -> str:
    return tr(
        "Shares too little with the other frames to be aligned, left as shot: {listed}.",
        listed=", ".join(remark.names),
    )


def _shifted(remark: FramesShifted) -> str:
    frames = zip(remark.names, remark.shifts_px, strict=True)
    words = ", ".join(
        tr("{name} by {pixels}", name=name, pixels=f"{shift:.{int(shift < 1.5)}f}")
        for name, shift in frames
    )
    return tr(
        "The camera moved. Shifted to match the other frames, in pixels: {names}.", names=words
    )


def _levelled(remark: Levelled) -> str:
    tilt = tr(
        "pitch {pitch_deg:+.1f}°, roll {roll_deg:+.1f}°",
        pitch_deg=remark.pitch_deg,
        roll_deg=remark.roll_deg,
    )
    if remark.by_camera:
        return tr(
            "{name} states a tilt ({tilt}), but the camera has levelled the picture itself; it "
            "is left as it is.",
            name=remark.name,
            tilt=tilt,
        )
    return tr("Levelled: the camera was tilted ({tilt}).", tilt=tilt)


def _contradict(remark: FramesContradict) -> str:
    share = 100.0 * remark.share
    if remark.same_place:
        return tr(
            "The frames do not match over {share:.0f} % of the picture, so motion was not removed. "
            "Exposures or tone curves are not as stated.",
            share=share,
        )
    return tr(
        "The frames show different things over {share:.0f} % of the picture. "
        "Shoot the bracket again if you can.",
        share=share,
    )


def _motion(remark: Motion) -> str:
    places = [_part(each, remark.panorama) for each in remark.places]
    if remark.more:
        places.append(
            tr_plural("at {count} smaller place", "at {count} smaller places", remark.more)
        )
    words = places[0]
    if len(places) > 1:
        words = tr("{places}; and {last}", places="; ".join(places[:-1]), last=places[-1])
    return tr(
        "Something moved between the frames {listed}. Only frames that agree are used there.",
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
        "at {across:.0f} % from the left, {down:.0f} % from the top",
        across=100.0 * part.across,
        down=100.0 * part.up,
    )


def _much_motion(remark: MuchMotion) -> str:
    return tr(
        "That is {share:.0f} % of the picture. Shoot the bracket again when less moves, if you "
        "can.",
        share=100.0 * remark.share,
    )


SENTENCES: Final[Sentences] = {
    PicturesTaken: _pictures_taken,
    FileLeftOut: tr("Left out: {message}"),
    FrameUnread: tr("{message} The frame is left out."),
    NotOfBracket: _not_of_bracket,
    RenderedByCamera: _rendered,
    PhoneRendered: tr(
        "{name} was rendered by the phone's HDR, which changes every pixel in its own way."
    ),
    TwoTimes: tr("{name} states both {shutter_s:.4g} s and {apex_s:.4g} s as its exposure time."),
    TwoApertures: tr("{name} states both f/{aperture:.3g} and f/{apex:.3g}."),
    Copies: _copies,
    SameExposure: _same_exposure,
    TimeUnstated: tr("{name} states no exposure time."),
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
        "The frames are {measured_stops:.2f} stops apart where the files say "
        "{stated_stops:.2f}: the camera's tone curve is probably not sRGB. Let it be "
        "recovered from the bracket."
    ),
    CurveRecovered: tr(
        "The camera's tone curve is not sRGB; recovered from the bracket, "
        "residual {residual_stops:.2f} stops."
    ),
    OwnCurves: tr(
        "The camera gave each frame a tone curve of its own, as phones do. They "
        "were recovered from the bracket; bright and dark places are less exact "
        "than from a camera with one curve."
    ),
    TwoFramesAlone: tr(
        "With two frames, another tone curve and a wrong exposure tag look the same; the tags "
        "are trusted. Add a third frame."
    ),
    FramesUnfit: tr(
        "The frames do not fit each other ({residual_stops:.2f} stops off): the light "
        "changed between them, or more than one exposure is not as stated."
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
"""By remark: its sentence with the names of its fields, or what writes it."""
