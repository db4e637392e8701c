"""Correct the sun, the lamps and masked areas in merged light, then run the clip audit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from app.core.base.arrays import Bools, Float32
from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.base.remarks import Remark
from app.core.environment.environment import reduce_radiance
from app.core.measure.finish.clip_audit import Audit, audit
from app.core.measure.finish.clipped_light import brightened, rough_audit, told_clipped
from app.core.measure.finish.inpainting import fill
from app.core.measure.finish.lamp_detection import (
    Light,
    LightGrid,
    find_lights,
    light_grid,
    upsampled,
)
from app.core.measure.finish.remarks import LampGained, NoClutter
from app.core.measure.finish.restoration import Restoration, restore, set_illuminance
from app.core.measure.finish.tripod_detection import NADIR, Clutter, resolve, union
from app.core.measure.finish.turn_changes import Change, changes, masking_changes
from app.core.measure.options import MeasureOptions
from app.core.measure.read.frame import MergedLight
from app.core.styles.style_pack import StylePack
from app.core.text import tr

_MOST_STOPS = 20.0
_HALF: Final = 0.5  # filled fraction at and above which a texel counts as a gap


def apply_gains(
    merged: MergedLight, lights: Sequence[Light], gains: Mapping[str, float]
) -> MergedLight:
    """Brighten or darken lamps by the given numbers of stops.

    In a clipped lamp, only the clipped part changes, since the rest is known, and that part no
    longer counts as clipped. In any other lamp, only its excess over the surroundings changes.

    Raises:
        ProbeError: If there is no such lamp, or a gain is not between -20 and 20 stops.
    """
    radiance, clipped = merged.radiance.copy(), merged.clipped.copy()
    for name, stops in gains.items():
        light = _light_named(lights, name)
        if not (math.isfinite(stops) and abs(stops) <= _MOST_STOPS):
            raise ProbeError(tr("The gain of lamp {id} must be from -20 to 20 stops.", id=light.id))
        inside = upsampled(light, clipped.shape)
        part = radiance[inside]
        if light.clipped:
            factor = 1.0 + (2.0**stops - 1.0) * merged.clipped[inside]
            clipped[inside] = 0.0
        else:
            above = 1.0 - light.surround / np.maximum(luminance(part), 1e-30)
            factor = 1.0 + (2.0**stops - 1.0) * np.clip(above, 0.0, 1.0)
        radiance[inside] = part * factor[:, None]
    return replace(merged, radiance=radiance, clipped=clipped)


@dataclass(frozen=True, slots=True)
class FinishedLight:
    """The finished light and its audit.

    Attributes:
        measured_clipped: Fraction of the light in clipped texels as measured, a lower bound, 0 to
            1.
        audit: Audit of the finished light, or None for pictures that are not panoramas.
        unseen: (H, W) bool. Mask of the light that was filled in because no frame shows it, or
            None.
    """

    merged: MergedLight
    measured: MergedLight
    lights: tuple[Light, ...] = ()
    measured_clipped: float = 0.0
    restoration: Restoration | None = None
    clutter: tuple[Clutter, ...] = ()
    changes: tuple[Change, ...] = ()
    audit: Audit | None = None
    notes: tuple[Remark, ...] = ()
    unseen: Bools | None = field(default=None, repr=False)


def finish(
    merged: MergedLight,
    pack: StylePack,
    options: MeasureOptions,
    *,
    foot: tuple[float, float] = NADIR,
    room_stops: float | None = None,
    alone: str = "",
    blind: Float32 | None = None,
) -> FinishedLight:
    """Apply the user's corrections to a merged panorama and audit the result.

    Args:
        foot: Azimuth and elevation, in degrees, of the camera's own downward direction.
        room_stops: How many stops below its darkest frame the camera can go, or None if unknown.
        alone: Name of the photo if there is only one.
        blind: (H, W). Mask that is 1 where the light was filled in because no frame shows it.

    Raises:
        ProbeError: If a lamp does not exist or a mask is unusable.
    """
    merged = told_clipped(merged, alone) if alone else merged
    grid = light_grid(merged)
    lights = find_lights(merged, grid)
    light, restoration, notes = _put_right(merged, lights, options, grid)
    finished = FinishedLight(
        merged=light,
        measured=merged,
        lights=lights,
        measured_clipped=float((grid.loss * grid.solid_angle).sum()) / grid.total,
        restoration=None if restoration is None or restoration.light is None else restoration,
        notes=tuple(notes),
        unseen=None if blind is None or not (blind > _HALF).any() else blind > _HALF,
    )
    finished = _cleaned(finished, pack, options, foot)
    looks = finished.merged
    if alone:
        finished = replace(finished, merged=brightened(looks))
    last = grid if finished.merged is merged else light_grid(finished.merged)
    remaining = still_clipped(lights, last)
    if alone:
        verdict = rough_audit(looks, finished.merged, remaining, last, pack)
        return replace(finished, audit=verdict)
    verdict = audit(
        finished.merged,
        remaining,
        pack,
        restoration=restoration,
        room_stops=room_stops,
        grid=last,
        blind=blind,
    )
    return replace(finished, audit=verdict)


def _put_right(
    merged: MergedLight, lights: tuple[Light, ...], options: MeasureOptions, grid: LightGrid
) -> tuple[MergedLight, Restoration | None, list[Remark]]:
    """Restore the sun, and correct the lamps for which the user has provided better values.

    A restoration is returned whenever the sun was searched for, whether or not it was found.
    """
    notes: list[Remark] = []
    restoration = None
    if options.sun != "leave" and grid.clipped.any():
        restoration = restore(merged, lights, options.sun, grid)
        wishes = {name.strip().upper() for name in (*options.gains, *options.lux)}
        # The user's value for a lamp takes precedence over the model's.
        if restoration.light in wishes:
            restoration = None
        elif restoration.remark is not None:
            merged = restoration.merged
            notes.append(restoration.remark)
    for name, lux in options.lux.items():
        metering = set_illuminance(merged, _light_named(lights, name), lux)
        merged = metering.merged
        if metering.remark is not None:
            notes.append(metering.remark)
    if options.gains:
        merged = apply_gains(merged, lights, options.gains)
        notes += [LampGained(name.strip().upper(), stops) for name, stops in options.gains.items()]
    return merged, restoration, notes


def _cleaned(
    finished: FinishedLight, pack: StylePack, options: MeasureOptions, foot: tuple[float, float]
) -> FinishedLight:
    """Fill masked areas and report the effect."""
    if not options.masks:
        return finished
    merged = finished.merged
    clutter = resolve(options.masks, merged, foot)
    if not clutter:
        return replace(finished, notes=(*finished.notes, NoClutter()))
    filled_light = fill(merged, union(clutter, merged.clipped.shape))
    shape = pack.header.environment
    style_changes = changes(
        reduce_radiance(merged.radiance, shape), reduce_radiance(filled_light.radiance, shape), pack
    )
    notes = (*finished.notes, masking_changes(style_changes))
    return replace(
        finished, merged=filled_light, clutter=clutter, changes=style_changes, notes=notes
    )


def still_clipped(lights: tuple[Light, ...], grid: LightGrid) -> tuple[Light, ...]:
    """Return the lamps, with their `clipped` updated after the corrections."""
    clipped = grid.clipped.ravel()
    return tuple(
        replace(light, clipped=light.clipped and bool(clipped[light.texels].max(initial=0.0) > 0))
        for light in lights
    )


def _light_named(lights: Sequence[Light], name: str) -> Light:
    for light in lights:
        if light.id == name.strip().upper():
            return light
    names = ", ".join(light.id for light in lights) or tr("none")
    raise ProbeError(
        tr("There is no lamp {name!r} in this place.", name=name),
        tr("Lamps: {names}.", names=names),
    )
