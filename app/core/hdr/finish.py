"""What is done to merged light: lamps found, sun and lamps put right, clutter filled, audited."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from app.core.base.colour import luminance
from app.core.base.errors import ProbeError
from app.core.hdr.audit import Audit, audit
from app.core.hdr.changes import Change, changes, sentence
from app.core.hdr.inpainting import fill
from app.core.hdr.lights import Light, LightGrid, find_lights, light_grid, upsampled
from app.core.hdr.sun import Restoration, restore, set_illuminance
from app.core.hdr.tripod_detection import NADIR, Clutter, resolve, union
from app.core.solver.environment import reduce_radiance
from app.core.solver.reach import LIMITS, Limits

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.core.hdr.frame import Merged
    from app.core.hdr.lights import Light
    from app.core.hdr.masks import MaskSpec
    from app.core.hdr.sky import SkyWord
    from app.core.solver.style_pack import StylePack


_MOST_STOPS = 20.0


def apply_gains(merged: Merged, lights: Sequence[Light], gains: Mapping[str, float]) -> Merged:
    """Make lamps brighter or darker by stops than they were measured.

    Of a clipped lamp only what is clipped changes, since the rest is known, and it no longer
    counts as clipped; of any other, what it has above its surroundings. ProbeError if there is
    no such lamp, or a gain is not a number between -20 and 20 stops.
    """
    known = {light.id: light for light in lights}
    radiance, clipped = merged.radiance.copy(), merged.clipped.copy()
    for name, stops in gains.items():
        light = known.get(name.strip().upper())
        if light is None:
            names = ", ".join(known) if known else "none was found"
            raise ProbeError(f"There is no lamp {name!r} in this place.", f"Lamps: {names}.")
        if not (math.isfinite(stops) and abs(stops) <= _MOST_STOPS):
            raise ProbeError(f"The gain of lamp {light.id} must be from -20 to 20 stops.")
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
class MergeOptions:
    """What the user wants of a merge; the defaults want nothing special.

    `times` are exposure times in seconds in the order of the files, instead of EXIF.
    """

    times: tuple[float, ...] | None = None
    response: Literal["auto", "srgb", "recover"] = "auto"
    weights: Literal["noise", "reinhard"] = "noise"
    full: bool = False
    sun: SkyWord | Literal["leave"] = "clear"
    gains: Mapping[str, float] = field(default_factory=dict)
    lux: Mapping[str, float] = field(default_factory=dict)
    masks: tuple[MaskSpec, ...] = ()
    limits: Limits = LIMITS


@dataclass(frozen=True, slots=True)
class Finished:
    """Merged light with everything done to it.

    `measured_clipped` is the share of the light in clipped texels as measured, a lower bound, 0
    to 1. `audit` is of the finished light; None for pictures that are not panoramas.
    """

    merged: Merged
    measured: Merged
    lights: tuple[Light, ...] = ()
    measured_clipped: float = 0.0
    restoration: Restoration | None = None
    clutter: tuple[Clutter, ...] = ()
    changes: tuple[Change, ...] = ()
    audit: Audit | None = None
    notes: tuple[str, ...] = ()


def finish(
    merged: Merged,
    pack: StylePack,
    wishes: MergeOptions,
    *,
    foot: tuple[float, float] = NADIR,
    room_stops: float | None = None,
) -> Finished:
    """Do to a merged panorama what the user wants, and audit the result.

    `foot` is azimuth and elevation of the camera's own foot, degrees; `room_stops` how many
    stops darker than its darkest frame the camera can go, None where unknown. ProbeError when a
    lamp is not there or a mask is of no use.
    """
    grid = light_grid(merged)
    lights = find_lights(merged, grid)
    right = _put_right(merged, lights, wishes, grid)
    clean = _cleaned(right.merged, pack, wishes, foot)
    last = grid if clean.merged is merged else light_grid(clean.merged)
    return Finished(
        merged=clean.merged,
        measured=merged,
        lights=lights,
        measured_clipped=float((grid.lost * grid.solid_angle).sum()) / grid.total,
        restoration=right.restoration if right.restored else None,
        clutter=clean.clutter,
        changes=clean.changes,
        audit=audit(
            clean.merged,
            still_clipped(lights, last),
            pack,
            restoration=right.restoration,
            room_stops=room_stops,
            grid=last,
            limits=wishes.limits,
        ),
        notes=(*right.notes, *clean.notes),
    )


@dataclass(frozen=True, slots=True)
class _Right:
    """Light with its sun and lamps put right; `restoration` says that the sun was looked for."""

    merged: Merged
    restoration: Restoration | None
    notes: tuple[str, ...]

    @property
    def restored(self) -> bool:
        return self.restoration is not None and self.restoration.light is not None


def _put_right(
    merged: Merged, lights: tuple[Light, ...], wishes: MergeOptions, grid: LightGrid
) -> _Right:
    """Put the sun back, and the lamps that the user knows better."""
    notes: list[str] = []
    restoration = None
    if wishes.sun != "leave" and grid.clipped.any():
        restoration = restore(merged, lights, wishes.sun, grid)
        chosen = {name.strip().upper() for name in (*wishes.gains, *wishes.lux)}
        # What the user says of a lamp is worth more than what a model says of it.
        if restoration.light in chosen:
            restoration = None
        elif restoration.light is not None:
            merged = restoration.merged
            notes.append(restoration.sentence)
    for name, lux in wishes.lux.items():
        metered = set_illuminance(merged, _named(lights, name), lux)
        merged = metered.merged
        notes.append(metered.sentence)
    if wishes.gains:
        merged = apply_gains(merged, lights, wishes.gains)
        notes += [
            f"Lamp {name.strip().upper()} was made {abs(stops):g} stops "
            f"{'brighter' if stops >= 0 else 'darker'}, as asked."
            for name, stops in wishes.gains.items()
        ]
    return _Right(merged, restoration, tuple(notes))


@dataclass(frozen=True, slots=True)
class _Clean:
    """Light without what should not be there."""

    merged: Merged
    clutter: tuple[Clutter, ...] = ()
    changes: tuple[Change, ...] = ()
    notes: tuple[str, ...] = ()


def _cleaned(
    merged: Merged, pack: StylePack, wishes: MergeOptions, foot: tuple[float, float]
) -> _Clean:
    """Fill what is masked, and say what that changes."""
    if not wishes.masks:
        return _Clean(merged)
    clutter = resolve(wishes.masks, merged, foot)
    if not clutter:
        note = "No tripod or photographer found below the camera."
        return _Clean(merged, notes=(note,))
    filled = fill(merged, union(clutter, merged.clipped.shape))
    shape = pack.header.environment
    changed = changes(
        reduce_radiance(merged.radiance, shape), reduce_radiance(filled.radiance, shape), pack
    )
    return _Clean(filled, clutter, changed, (sentence(changed),))


def still_clipped(lights: tuple[Light, ...], grid: LightGrid) -> tuple[Light, ...]:
    """Say of each lamp whether it is still clipped after something was done to the light."""
    clipped = grid.clipped.ravel()
    return tuple(
        replace(light, clipped=light.clipped and bool(clipped[light.texels].max(initial=0.0) > 0))
        for light in lights
    )


def _named(lights: tuple[Light, ...], name: str) -> Light:
    for light in lights:
        if light.id == name.strip().upper():
            return light
    known = ", ".join(light.id for light in lights) or "none was found"
    raise ProbeError(f"There is no lamp {name!r} in this place.", f"Lamps: {known}.")
