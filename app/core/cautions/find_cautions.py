"""Find all cautions about the light of a place, with the styles that each of them affects."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Final

import numpy as np

from app.core.base.sphere import bounded
from app.core.cautions.caution import Caution, Hazard
from app.core.cautions.lens_step import evened, lens_step
from app.core.cautions.missing_light import missing_light
from app.core.cautions.near_light import near_light
from app.core.cautions.tilt import tilt_caution
from app.core.environment.environment import Environment, reduce_light
from app.core.measure.finish.clip_audit import choices
from app.core.measure.finish.doubtful_answers import doubt_of, has_changed
from app.core.solver.turn_choice import Objective
from app.core.styles.style_pack import StylePack

_COLUMNS: Final = 1024


def find_cautions(
    environment: Environment, pack: StylePack, objective: Objective = "picture"
) -> tuple[Caution, ...]:
    """Return the cautions about an environment."""
    return (
        *missing_light(environment, doubt_of(environment, pack, objective)),
        *camera_cautions(environment, pack, objective),
    )


def camera_cautions(
    environment: Environment, pack: StylePack, objective: Objective = "picture"
) -> tuple[Caution, ...]:
    """Return the cautions about the camera's lenses, its position and its tilt."""
    # The search for upright edges takes as long as the others together.
    with ThreadPoolExecutor(1) as pool:
        tilt = pool.submit(tilt_caution, environment, pack, objective)
        lenses = lens_cautions(environment, pack, objective)
        near = near_light(environment, pack, objective)
        return (*lenses, *near, *tilt.result())


def lens_cautions(
    environment: Environment, pack: StylePack, objective: Objective = "picture"
) -> tuple[Caution, ...]:
    """Return a caution if the lenses differ. It affects the styles that change without the step."""
    missing = [each for each in (environment.clipped, environment.unseen) if each is not None]
    ignored = np.maximum.reduce([each.astype(np.float32) for each in missing]) if missing else None
    step = lens_step(environment.radiance, ignored)
    if step is None:
        return ()
    radiance, shape = bounded(environment.radiance, _COLUMNS), pack.header.environment
    lights = [reduce_light(one, shape) for one in (radiance, evened(radiance, step))]
    changed = has_changed(choices(pack, lights, objective))
    styles = tuple(style.name for style, hit in zip(pack.styles, changed, strict=True) if hit)
    return (Caution(Hazard.LENS_STEP, step.stops, styles),)
