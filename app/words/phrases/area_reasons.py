"""What a picture lacks of a style, by the relation of areas that fails."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.core.solver.shortfall import Aspect
from app.core.text import tr


class Wording(NamedTuple):
    """A sentence, and its shorter forms if they differ."""

    sentence: str
    card: str = ""
    line: str = ""


# By aspect: below the least value, and above the most. {value} and {limit} are in stops.
AREA_REASONS: Final[dict[Aspect, tuple[Wording, Wording]]] = {
    Aspect.NOSE_SHADOW: (
        Wording(
            tr("The nose’s shadow is {value} deep; {style} needs {limit}"),
            tr("The nose’s shadow is {value} deep"),
        ),
        Wording(
            tr("The nose’s shadow is {value} deep; {style} bears {limit}"),
            tr("The nose’s shadow is {value} deep"),
        ),
    ),
    Aspect.CHEEKS: (
        Wording(
            tr("The cheeks are {value} apart; {style} needs {limit}"),
            tr("The cheeks are {value} apart"),
        ),
        Wording(
            tr("The cheeks are {value} apart; {style} bears {limit}"),
            tr("The cheeks are {value} apart"),
        ),
    ),
    Aspect.OPEN_SHADOW: (Wording(tr("The nose’s shadow runs into the shadow on the cheek")),) * 2,
    Aspect.PATCH: (Wording(tr("The patch under the far eye is missing")),) * 2,
    Aspect.DARK_PATCH: (
        Wording(
            tr("Under the far eye it is {value} darker; {style} needs {limit}"),
            tr("Under the far eye it is {value} darker"),
        ),
        Wording(tr("The far eye is too dark")),
    ),
    Aspect.SHADOW_SIDE: (
        Wording(
            tr("The two sides are {value} apart; {style} needs {limit}"),
            tr("The two sides are {value} apart"),
        ),
        Wording(
            tr("The two sides are {value} apart; {style} bears {limit}"),
            tr("The two sides are {value} apart"),
        ),
    ),
    Aspect.EVENNESS: (
        Wording(
            tr("The sitter’s right is {value} brighter; {style} bears {limit}"),
            tr("The sitter’s right is {value} brighter"),
        ),
        Wording(
            tr("The sitter’s left is {value} brighter; {style} bears {limit}"),
            tr("The sitter’s left is {value} brighter"),
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
            tr("The light is too high; {style} needs it under the chin"),
            tr("The light is too high"),
        ),
        Wording(tr("The light is too low for {style}")),
    ),
    Aspect.UNDER_THE_CHIN: (
        Wording(
            tr("Too little light under the chin; {style} needs its lamp there"),
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
            tr("One light alone; {style} needs one from above and one from below"),
            tr("One light alone"),
        ),
        Wording(tr("The light comes too much from above for {style}")),
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
        Wording(tr("The light comes too much from the front for {style}")),
        Wording(tr("The light comes too much from behind for {style}")),
    ),
    Aspect.RIM: (
        Wording(
            tr("The rim is too weak: {value} over the face, {style} needs {limit}"),
            tr("The rim is too weak"),
            tr("The rim is too weak"),
        ),
        Wording(
            tr("The rim is {value} over the face; {style} bears {limit}"),
            tr("The rim is {value} over the face"),
        ),
    ),
    Aspect.ONE_RIM: (
        Wording(
            tr("Both edges of the face are bright; {style} needs one"),
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
            tr("One light behind the head alone; {style} needs one behind each side"),
            tr("One light behind the head alone"),
        ),
    )
    * 2,
    Aspect.GRAZED_CHEEK: (
        Wording(tr("The light comes too much from the side for {style}")),
        Wording(tr("The light comes from too far behind for {style}")),
    ),
    Aspect.SOFT_SHADOW: (
        Wording(
            tr(
                "The light is too small or comes from elsewhere; "
                "{style} needs a large one at the side"
            ),
            tr("The light is too small or comes from elsewhere"),
        ),
    )
    * 2,
    Aspect.EYE_LEVEL: (
        Wording(tr("The light is too high for {style}")),
        Wording(tr("The light is too low for {style}")),
    ),
    Aspect.HAIR: (
        Wording(
            tr("The hair is {value} over the face; {style} needs {limit}"),
            tr("The hair is {value} over the face"),
        ),
        Wording(
            tr("The hair is {value} over the face; {style} bears {limit}"),
            tr("The hair is {value} over the face"),
        ),
    ),
    Aspect.HAIR_ONLY: (
        Wording(
            tr("The light is too low or too far aside; {style} needs it above and behind"),
            tr("The light is too low or too far aside"),
        ),
        Wording(tr("The light is too high for {style}")),
    ),
    Aspect.HAIR_BEFORE_BACKGROUND: (
        Wording(tr("The background is too bright for {style}")),
        Wording(tr("The background is too dark for {style}")),
    ),
    Aspect.BACKGROUND: (
        Wording(
            tr("The background is {value} over the face; {style} needs {limit}"),
            tr("The background is {value} over the face"),
        ),
        Wording(
            tr("The background is {value} over the face; {style} bears {limit}"),
            tr("The background is {value} over the face"),
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
            tr("The middle of the face is not dark enough: {value}, {style} needs {limit}"),
            tr("The middle of the face is not dark enough"),
            tr("The middle of the face is not dark enough"),
        ),
        Wording(tr("The middle of the face is too dark for {style}")),
    ),
}
