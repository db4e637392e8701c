"""Sentences on how a picture deviates from a style, one for each relation between areas."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.core.solver.shortfall import Aspect
from app.core.text import tr


class Wording(NamedTuple):
    """A sentence, at most five words for a card, and a line where it differs from the sentence."""

    sentence: str
    card: str
    line: str = ""


# By aspect: below the minimum, then above the maximum. {value} and {limit} are in stops.
AREA_REASONS: Final[dict[Aspect, tuple[Wording, Wording]]] = {
    Aspect.NOSE_SHADOW: (
        Wording(
            tr("The nose shadow is too shallow: {value}; {style} needs {limit}"),
            tr("Nose shadow too shallow"),
        ),
        Wording(
            tr("The nose shadow is too deep: {value}; {style} allows {limit}"),
            tr("Nose shadow too deep"),
        ),
    ),
    Aspect.CHEEKS: (
        Wording(
            tr("The cheeks differ too little: {value}; {style} needs {limit}"),
            tr("Cheeks differ too little"),
        ),
        Wording(
            tr("The cheeks differ too much: {value}; {style} allows {limit}"),
            tr("Cheeks differ too much"),
        ),
    ),
    Aspect.OPEN_SHADOW: (
        Wording(
            tr("The nose shadow runs into the cheek shadow"),
            tr("Nose and cheek shadows meet"),
        ),
    )
    * 2,
    Aspect.PATCH: (Wording(tr("No patch of light under the far eye"), tr("No light patch")),) * 2,
    Aspect.DARK_PATCH: (
        Wording(
            tr("Not dark enough below the far eye: {value}; {style} needs {limit}"),
            tr("Far eye not dark enough"),
        ),
        Wording(tr("The far eye is too dark"), tr("Far eye too dark")),
    ),
    Aspect.SHADOW_SIDE: (
        Wording(
            tr("The two sides differ too little: {value}; {style} needs {limit}"),
            tr("Sides differ too little"),
        ),
        Wording(
            tr("The two sides differ too much: {value}; {style} allows {limit}"),
            tr("Sides differ too much"),
        ),
    ),
    Aspect.EVENNESS: (
        Wording(
            tr(
                "The sitter’s right side is too bright: {value} over the left; {style} allows "
                "{limit}"
            ),
            tr("Sitter’s right side too bright"),
        ),
        Wording(
            tr(
                "The sitter’s left side is too bright: {value} over the right; {style} allows "
                "{limit}"
            ),
            tr("Sitter’s left side too bright"),
        ),
    ),
    Aspect.HEIGHT: (
        Wording(tr("The light is too low for {style}"), tr("Light too low")),
        Wording(tr("The light is too high for {style}"), tr("Light too high")),
    ),
    Aspect.DEPTH: (
        Wording(tr("The light is too high for {style}"), tr("Light too high")),
        Wording(tr("The light is too low for {style}"), tr("Light too low")),
    ),
    Aspect.ABOVE: (
        Wording(
            tr("The light is not high enough; {style} needs it above the head"),
            tr("Light not high enough"),
        ),
        Wording(tr("The light is too high for {style}"), tr("Light too high")),
    ),
    Aspect.BELOW: (
        Wording(
            tr("The light is too high; {style} needs it below the chin"),
            tr("Light too high"),
        ),
        Wording(tr("The light is too low for {style}"), tr("Light too low")),
    ),
    Aspect.UNDER_THE_CHIN: (
        Wording(
            tr("Too little light under the chin; {style} needs a lamp there"),
            tr("Too dark under the chin"),
        ),
        Wording(tr("The light is too low for {style}"), tr("Light too low")),
    ),
    Aspect.THROAT: (
        Wording(tr("Too much light under the chin for {style}"), tr("Too bright under the chin")),
        Wording(tr("Too little light under the chin for {style}"), tr("Too dark under the chin")),
    ),
    Aspect.UNDER_THE_NOSE: (
        Wording(tr("No shadow under the nose; {style} needs one"), tr("No shadow under the nose")),
        Wording(
            tr("The shadow under the nose is too deep for {style}"), tr("Too dark under the nose")
        ),
    ),
    Aspect.TWO_LAMPS: (
        Wording(
            tr("Only one light; {style} needs one from above and one from below"),
            tr("Only one light"),
        ),
        Wording(tr("Too much light from above for {style}"), tr("Too much light from above")),
    ),
    Aspect.FRONT: (
        Wording(
            tr("The light comes from behind; {style} needs it in front"),
            tr("Light comes from behind"),
        ),
        Wording(
            tr("The light comes from the front; {style} needs it behind"),
            tr("Light comes from the front"),
        ),
    ),
    Aspect.SIDE: (
        Wording(tr("Too much light from the front for {style}"), tr("Too much light in front")),
        Wording(tr("Too much light from behind for {style}"), tr("Too much light from behind")),
    ),
    Aspect.RIM: (
        Wording(
            tr("The rim is too weak: {value} over the face; {style} needs {limit}"),
            tr("Rim too weak"),
            tr("The rim is too weak"),
        ),
        Wording(
            tr("The rim is too bright: {value} over the face; {style} allows {limit}"),
            tr("Rim too bright"),
        ),
    ),
    Aspect.ONE_RIM: (
        Wording(
            tr("Both edges of the face are bright; {style} needs only one"),
            tr("Both edges are bright"),
        ),
    )
    * 2,
    Aspect.RIM_ONLY: (
        Wording(tr("The light comes from too far behind for {style}"), tr("Light too far behind")),
        Wording(
            tr("The light comes from too far in front for {style}"), tr("Light too far in front")
        ),
    ),
    Aspect.TWO_RIMS: (
        Wording(
            tr("Only one light behind the head; {style} needs one on each side"),
            tr("Only one light behind"),
        ),
    )
    * 2,
    Aspect.GRAZED_CHEEK: (
        Wording(tr("Too much light from the side for {style}"), tr("Too much light beside")),
        Wording(tr("The light comes from too far behind for {style}"), tr("Light too far behind")),
    ),
    Aspect.SOFT_SHADOW: (
        Wording(
            tr(
                "The light is too small or in the wrong place; {style} needs a large one "
                "at the side"
            ),
            tr("Light too small or misplaced"),
        ),
    )
    * 2,
    Aspect.EYE_LEVEL: (
        Wording(tr("The light is too high for {style}"), tr("Light too high")),
        Wording(tr("The light is too low for {style}"), tr("Light too low")),
    ),
    Aspect.HAIR: (
        Wording(
            tr("The hair is too dark: {value} over the face; {style} needs {limit}"),
            tr("Hair too dark"),
        ),
        Wording(
            tr("The hair is too bright: {value} over the face; {style} allows {limit}"),
            tr("Hair too bright"),
        ),
    ),
    Aspect.HAIR_ONLY: (
        Wording(
            tr("The light is too low or too far to the side; {style} needs it above and behind"),
            tr("Light not above and behind"),
        ),
        Wording(tr("The light is too high for {style}"), tr("Light too high")),
    ),
    Aspect.HAIR_BEFORE_BACKGROUND: (
        Wording(tr("The background is too bright for {style}"), tr("Background too bright")),
        Wording(tr("The background is too dark for {style}"), tr("Background too dark")),
    ),
    Aspect.BACKGROUND: (
        Wording(
            tr("The background is too dark: {value} over the face; {style} needs {limit}"),
            tr("Background too dark"),
        ),
        Wording(
            tr("The background is too bright: {value} over the face; {style} allows {limit}"),
            tr("Background too bright"),
        ),
    ),
    Aspect.DARK_EDGE: (
        Wording(tr("The edges of the face are too dark for {style}"), tr("Edges too dark")),
        Wording(tr("The edges of the face are too bright for {style}"), tr("Edges too bright")),
    ),
    Aspect.BRIGHT_BACKGROUND: (
        Wording(
            tr("The background is no brighter than the rest of the place"),
            tr("Background no brighter"),
        ),
        Wording(tr("The background is too bright for {style}"), tr("Background too bright")),
    ),
    Aspect.MIDDLE_LINE: (
        Wording(
            tr("The middle of the face is not dark enough: {value}; {style} needs {limit}"),
            tr("Middle not dark enough"),
            tr("The middle of the face is not dark enough"),
        ),
        Wording(tr("The middle of the face is too dark for {style}"), tr("Middle too dark")),
    ),
}
