"""Sentences on how a picture deviates from a style, one for each relation between areas."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.core.solver.shortfall import Aspect
from app.core.text import tr


class Wording(NamedTuple):
    """A sentence and its shorter forms, where those differ."""

    sentence: str
    card: str = ""
    line: str = ""


# By aspect: below the minimum, then above the maximum. {value} and {limit} are in stops.
AREA_REASONS: Final[dict[Aspect, tuple[Wording, Wording]]] = {
    Aspect.NOSE_SHADOW: (
        Wording(
            tr("The nose shadow is too shallow: {value}; {style} needs {limit}"),
            tr("The nose shadow is too shallow"),
        ),
        Wording(
            tr("The nose shadow is too deep: {value}; {style} allows {limit}"),
            tr("The nose shadow is too deep"),
        ),
    ),
    Aspect.CHEEKS: (
        Wording(
            tr("The cheeks differ too little: {value}; {style} needs {limit}"),
            tr("The cheeks differ too little"),
        ),
        Wording(
            tr("The cheeks differ too much: {value}; {style} allows {limit}"),
            tr("The cheeks differ too much"),
        ),
    ),
    Aspect.OPEN_SHADOW: (Wording(tr("The nose shadow runs into the cheek shadow")),) * 2,
    Aspect.PATCH: (Wording(tr("No patch of light under the far eye")),) * 2,
    Aspect.DARK_PATCH: (
        Wording(
            tr("Not dark enough below the far eye: {value}; {style} needs {limit}"),
            tr("Not dark enough below the far eye"),
        ),
        Wording(tr("The far eye is too dark")),
    ),
    Aspect.SHADOW_SIDE: (
        Wording(
            tr("The two sides differ too little: {value}; {style} needs {limit}"),
            tr("The two sides differ too little"),
        ),
        Wording(
            tr("The two sides differ too much: {value}; {style} allows {limit}"),
            tr("The two sides differ too much"),
        ),
    ),
    Aspect.EVENNESS: (
        Wording(
            tr(
                "The sitter’s right side is too bright: {value} over the left; {style} allows "
                "{limit}"
            ),
            tr("The sitter’s right side is too bright"),
        ),
        Wording(
            tr(
                "The sitter’s left side is too bright: {value} over the right; {style} allows "
                "{limit}"
            ),
            tr("The sitter’s left side is too bright"),
        ),
    ),
    Aspect.HEIGHT: (
        Wording(tr("The light is too low for {style}")),
        Wording(tr("The light is too high for {style}")),
    ),
    Aspect.DEPTH: (
        Wording(tr("The light is too high for {style}")),
        Wording(tr("The light is too low for {style}")),
    ),
    Aspect.ABOVE: (
        Wording(
            tr("The light is not high enough; {style} needs it above the head"),
            tr("The light is not high enough"),
        ),
        Wording(tr("The light is too high for {style}")),
    ),
    Aspect.BELOW: (
        Wording(
            tr("The light is too high; {style} needs it below the chin"),
            tr("The light is too high"),
        ),
        Wording(tr("The light is too low for {style}")),
    ),
    Aspect.UNDER_THE_CHIN: (
        Wording(
            tr("Too little light under the chin; {style} needs a lamp there"),
            tr("Too little light under the chin"),
        ),
        Wording(tr("The light is too low for {style}")),
    ),
    Aspect.THROAT: (
        Wording(tr("Too much light under the chin for {style}")),
        Wording(tr("Too little light under the chin for {style}")),
    ),
    Aspect.UNDER_THE_NOSE: (
        Wording(tr("No shadow under the nose; {style} needs one"), tr("No shadow under the nose")),
        Wording(tr("The shadow under the nose is too deep for {style}")),
    ),
    Aspect.TWO_LAMPS: (
        Wording(
            tr("Only one light; {style} needs one from above and one from below"),
            tr("Only one light"),
        ),
        Wording(tr("Too much light from above for {style}")),
    ),
    Aspect.FRONT: (
        Wording(
            tr("The light comes from behind; {style} needs it in front"),
            tr("The light comes from behind"),
        ),
        Wording(
            tr("The light comes from the front; {style} needs it behind"),
            tr("The light comes from the front"),
        ),
    ),
    Aspect.SIDE: (
        Wording(tr("Too much light from the front for {style}")),
        Wording(tr("Too much light from behind for {style}")),
    ),
    Aspect.RIM: (
        Wording(
            tr("The rim is too weak: {value} over the face; {style} needs {limit}"),
            tr("The rim is too weak"),
            tr("The rim is too weak"),
        ),
        Wording(
            tr("The rim is too bright: {value} over the face; {style} allows {limit}"),
            tr("The rim is too bright"),
        ),
    ),
    Aspect.ONE_RIM: (
        Wording(
            tr("Both edges of the face are bright; {style} needs only one"),
            tr("Both edges of the face are bright"),
        ),
    )
    * 2,
    Aspect.RIM_ONLY: (
        Wording(tr("The light comes from too far behind for {style}")),
        Wording(tr("The light comes from too far in front for {style}")),
    ),
    Aspect.TWO_RIMS: (
        Wording(
            tr("Only one light behind the head; {style} needs one on each side"),
            tr("Only one light behind the head"),
        ),
    )
    * 2,
    Aspect.GRAZED_CHEEK: (
        Wording(tr("Too much light from the side for {style}")),
        Wording(tr("The light comes from too far behind for {style}")),
    ),
    Aspect.SOFT_SHADOW: (
        Wording(
            tr(
                "The light is too small or in the wrong place; {style} needs a large one "
                "at the side"
            ),
            tr("The light is too small or in the wrong place"),
        ),
    )
    * 2,
    Aspect.EYE_LEVEL: (
        Wording(tr("The light is too high for {style}")),
        Wording(tr("The light is too low for {style}")),
    ),
    Aspect.HAIR: (
        Wording(
            tr("The hair is too dark: {value} over the face; {style} needs {limit}"),
            tr("The hair is too dark"),
        ),
        Wording(
            tr("The hair is too bright: {value} over the face; {style} allows {limit}"),
            tr("The hair is too bright"),
        ),
    ),
    Aspect.HAIR_ONLY: (
        Wording(
            tr("The light is too low or too far to the side; {style} needs it above and behind"),
            tr("The light is too low or too far to the side"),
        ),
        Wording(tr("The light is too high for {style}")),
    ),
    Aspect.HAIR_BEFORE_BACKGROUND: (
        Wording(tr("The background is too bright for {style}")),
        Wording(tr("The background is too dark for {style}")),
    ),
    Aspect.BACKGROUND: (
        Wording(
            tr("The background is too dark: {value} over the face; {style} needs {limit}"),
            tr("The background is too dark"),
        ),
        Wording(
            tr("The background is too bright: {value} over the face; {style} allows {limit}"),
            tr("The background is too bright"),
        ),
    ),
    Aspect.DARK_EDGE: (
        Wording(tr("The edges of the face are too dark for {style}")),
        Wording(tr("The edges of the face are too bright for {style}")),
    ),
    Aspect.BRIGHT_BACKGROUND: (
        Wording(tr("The background is no brighter than the rest of the place")),
        Wording(tr("The background is too bright for {style}")),
    ),
    Aspect.MIDDLE_LINE: (
        Wording(
            tr("The middle of the face is not dark enough: {value}; {style} needs {limit}"),
            tr("The middle of the face is not dark enough"),
            tr("The middle of the face is not dark enough"),
        ),
        Wording(tr("The middle of the face is too dark for {style}")),
    ),
}
