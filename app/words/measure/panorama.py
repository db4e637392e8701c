"""Sentences about a panorama file: its missing parts and its repairs."""

from __future__ import annotations

from typing import Final

from app.core.base.phrases import small_percent
from app.core.environment.remarks import (
    ClippedFile,
    FromOnePhoto,
    LayerChosen,
    PartUnseen,
    Repaired,
)
from app.core.text import tr, tr_plural
from app.words.sentences import Sentences


def _repaired(remark: Repaired) -> str:
    parts = []
    if remark.nan:
        parts.append(
            tr_plural("{count} NaN texel (set to 0)", "{count} NaN texels (set to 0)", remark.nan)
        )
    if remark.infinite:
        parts.append(
            tr_plural(
                "{count} infinite texel (set to {level:g})",
                "{count} infinite texels (set to {level:g})",
                remark.infinite,
                level=remark.level,
            )
        )
    if remark.negative:
        parts.append(
            tr_plural(
                "{count} negative texel (set to 0)",
                "{count} negative texels (set to 0)",
                remark.negative,
            )
        )
    return tr("{name}: repaired {what}.", name=remark.name, what=", ".join(parts))


def _layer(remark: LayerChosen) -> str:
    return tr(
        "{name}: using layer {layer}; the file also has {others}.",
        name=remark.name,
        layer=remark.layer,
        others=", ".join(remark.others),
    )


def _unseen(remark: PartUnseen) -> str:
    return tr(
        "{name} leaves {share} of the sphere empty. The gap was filled from its surroundings.",
        name=remark.name,
        share=small_percent(remark.share),
    )


SENTENCES: Final[Sentences] = {
    Repaired: _repaired,
    LayerChosen: _layer,
    FromOnePhoto: tr("{name} was made from one photo: its clipped light is an estimate."),
    ClippedFile: tr("{name} is clipped: its highlights may be brighter than recorded."),
    PartUnseen: _unseen,
}
"""Sentence for each type of remark: text with field names, or a function that returns it."""
