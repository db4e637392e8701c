"""Plan a bracket, given a metered exposure and the limits of a camera.

ISO and aperture are fixed for the whole bracket, and only the shutter speed changes. Cameras offer
nominal thirds of a stop, so a target exposure is rounded to the logarithmically nearest setting.
From then on, the exposure actually sent is used, never the target.

A camera reports its own lists of settings in the manual program (`shutterSpeedSupport`,
`isoSupport` and `apertureSupport`). For cameras that cannot be queried, `app.core.camera_catalogue`
has the lists of Ricoh's Web API v2.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from app.core.base.errors import ProbeError
from app.core.base.remarks import Remark
from app.core.camera_catalogue import CameraLimits
from app.core.measure.plan.remarks import BracketShifted, DarkestExposure, OffsetMissed, WiderSteps
from app.core.measure.read.frame import Exposure
from app.core.text import tr

STEP_EV: Final = 2.0
"""Step between neighbouring frames, in stops, as in the paper."""

LONGEST_S: Final = 4.0
"""Default limit on a planned exposure time, in seconds."""

OVERHEAD_S: Final = 2.4
"""Time that a Theta Z1 takes for one frame of its bracket besides the exposure, in seconds."""

MAX_SHOTS: Final = 19
"""Maximum number of frames that any Theta can take in one bracket."""

_TOLERANCE_EV: Final = 1.0 / 6.0
_WORTH_EV: Final = 0.5


@dataclass(frozen=True, slots=True)
class PlannedShot:
    """One frame of a plan, with its target and actual offsets from the metered exposure."""

    exposure: Exposure
    wanted_ev: float
    ev_offset: float


@dataclass(frozen=True, slots=True)
class Plan:
    """A bracket to shoot, in order.

    The metered exposure comes first, since cameras apply the stitching and levelling of the first
    frame to all frames. The brighter frame follows, and then the darker ones, each darker than the
    last.

    Attributes:
        expected_s: Expected duration in seconds, including the camera's overhead.
    """

    kind: Literal["paper", "full"]
    shots: tuple[PlannedShot, ...]
    expected_s: float
    notes: tuple[Remark, ...] = ()


def plan(
    auto_exposure: Exposure,
    limits: CameraLimits,
    kind: Literal["paper", "full"],
    shots: int = 13,
    *,
    longest_s: float = LONGEST_S,
    overhead_s: float = OVERHEAD_S,
) -> Plan:
    """Plan a bracket around a metered exposure.

    "paper" is 0, +2 and -2 EV, at the aperture nearest to the metered one and the lowest ISO at
    which +2 EV takes no longer than `longest_s`. If even -2 EV would need a shorter exposure time
    than the camera offers, the lens is stopped down.

    "full" is 0, +2, and then darker in steps of 2 EV, down to the camera's darkest exposure. The
    ISO is the lowest at which +2 EV takes no longer than `longest_s`, and the aperture is the
    smallest for which this still holds. The last step is shorter if the range is not a multiple of
    2 EV, or up to 0.5 EV longer if one more frame would not be worth its time. If the range needs
    more frames than `shots`, the dark frames are spread evenly over the range, since a wider step
    only costs accuracy where two frames meet, whereas a missing dark frame loses the lamps.

    If the camera cannot make the metered exposure, the bracket is centred on the nearest exposure
    that it can make. An offset that is out of reach is replaced with the nearest possible one,
    which is reported in a remark. Identical frames are shot only once.

    Raises:
        ProbeError: If the metered exposure lacks an ISO or f-number, `shots` or `longest_s` is out
            of range, or the camera's lists do not allow two different exposures.
    """
    _check(auto_exposure, limits, shots, longest_s)
    times = tuple(sorted(time for time in set(limits.shutters_s) if time <= longest_s))
    settings = _Settings(auto_exposure, times, limits)
    iso, aperture = settings.for_paper() if kind == "paper" else settings.for_full()
    middle = settings.middle(iso, aperture)
    evs = [middle, middle + STEP_EV, middle - STEP_EV]
    notes: list[Remark] = [BracketShifted(middle)] if middle else []
    if kind == "full":
        evs, spread = _full_offsets(middle, settings.darkest(iso, aperture), shots)
        notes += spread
    new_shots = [settings.shot(iso, aperture, offset) for offset in evs]
    notes += [note for shot in new_shots if (note := settings.missed(shot))]
    different: dict[Exposure, PlannedShot] = {}
    for shot in new_shots:
        different.setdefault(shot.exposure, shot)
    if len(different) < 2:
        raise ProbeError(
            tr("The camera cannot take two different exposures here."),
            tr("Meter again, and check that the camera is in its manual program."),
        )
    total = sum(exposure.shutter_s + overhead_s for exposure in different)
    return Plan(kind, tuple(different.values()), total, tuple(notes))


@dataclass(frozen=True, slots=True)
class _Settings:
    """The settings of the camera, judged by their offsets from the metered exposure."""

    auto_exposure: Exposure
    times: tuple[float, ...]
    limits: CameraLimits

    def time(self, iso: float, aperture: float, offset: float) -> float:
        """Return the exact exposure time for an offset, whether or not the camera offers it."""
        gain = (self.auto_exposure.iso / iso) * (aperture / self.auto_exposure.aperture) ** 2
        return self.auto_exposure.shutter_s * gain * float(2.0**offset)

    def darkest(self, iso: float, aperture: float) -> float:
        """Return the offset, in stops, of the darkest exposure at these settings."""
        return Exposure(self.times[0], iso, aperture).ev - self.auto_exposure.ev

    def middle(self, iso: float, aperture: float) -> float:
        """Return the offset nearest to 0 that the camera can make."""
        if self.outside(iso, aperture, 0.0) <= _TOLERANCE_EV:
            return 0.0
        lightest = Exposure(self.times[-1], iso, aperture).ev - self.auto_exposure.ev
        return min(max(self.darkest(iso, aperture), 0.0), lightest)

    def outside(self, iso: float, aperture: float, offset: float) -> float:
        """Return by how many stops an offset is outside the camera's times, negative if inside."""
        time = self.time(iso, aperture, offset)
        return max(math.log2(time / self.times[-1]), math.log2(self.times[0] / time))

    def miss(self, iso: float, aperture: float, offsets: Sequence[float]) -> float:
        """Return by how many stops, in total, the offsets are out of reach after rounding."""
        total = 0.0
        for offset in offsets:
            total += max(self.outside(iso, aperture, offset) - _TOLERANCE_EV, 0.0)
        return round(total, 6)

    def for_paper(self) -> tuple[float, float]:
        """Choose the smallest miss, then the nearest aperture, then the lowest ISO."""

        def cost(setting: tuple[float, float]) -> tuple[float, ...]:
            iso, aperture = setting
            shift = abs(math.log2(aperture / self.auto_exposure.aperture))
            return self.miss(iso, aperture, (0.0, STEP_EV, -STEP_EV)), round(shift, 6), iso

        return min(self._all(), key=cost)

    def for_full(self) -> tuple[float, float]:
        """Choose the best reach to +2 EV, then to 0, then the lowest ISO, then the darkest shot."""

        def cost(setting: tuple[float, float]) -> tuple[float, ...]:
            iso, aperture = setting
            floor = self.darkest(iso, aperture)
            bright = self.miss(iso, aperture, (STEP_EV + max(floor, 0.0),))
            return bright, max(round(floor, 6), 0.0), iso, round(floor, 6)

        return min(self._all(), key=cost)

    def _all(self) -> list[tuple[float, float]]:
        return [
            (iso, aperture)
            for aperture in sorted(set(self.limits.apertures))
            for iso in sorted(set(self.limits.isos))
        ]

    def shot(self, iso: float, aperture: float, offset: float) -> PlannedShot:
        """Return a shot whose exposure time is the logarithmically nearest one.

        If two times are equally near, the shorter one is used.
        """
        log_time = math.log2(self.time(iso, aperture, offset))
        nearest = min(self.times, key=lambda time: round(abs(math.log2(time) - log_time), 9))
        exposure = Exposure(nearest, iso, aperture)
        return PlannedShot(exposure, offset, exposure.ev - self.auto_exposure.ev)

    def missed(self, shot: PlannedShot) -> OffsetMissed | None:
        """Report a target offset that was missed by more than the rounding to thirds of a stop."""
        iso, aperture = shot.exposure.iso, shot.exposure.aperture
        beyond = self.outside(iso, aperture, shot.wanted_ev) > _TOLERANCE_EV
        if not beyond and abs(shot.ev_offset - shot.wanted_ev) <= _WORTH_EV:
            return None
        return OffsetMissed(shot.wanted_ev, shot.ev_offset)


def _check(auto_exposure: Exposure, limits: CameraLimits, shots: int, longest_s: float) -> None:
    values = (auto_exposure.shutter_s, auto_exposure.iso, auto_exposure.aperture)
    if not auto_exposure.known or not all(0.0 < value < math.inf for value in values):
        raise ProbeError(
            tr("The metered picture does not record its exposure time, ISO and f-number."),
            tr("Meter again."),
        )
    if not 2 <= shots <= MAX_SHOTS:
        raise ProbeError(
            tr(
                "A bracket has 2 to {max_shots} frames, not {shots}.",
                max_shots=MAX_SHOTS,
                shots=shots,
            )
        )
    if not min(limits.shutters_s) <= longest_s < math.inf:
        raise ProbeError(
            tr("The camera cannot expose for {longest_s:g} s or less.", longest_s=longest_s)
        )


def _full_offsets(middle: float, floor: float, shots: int) -> tuple[list[float], list[Remark]]:
    """Return the offsets in shooting order: the middle, 2 EV above it, then down to the floor."""
    notes: list[Remark] = []
    if -STEP_EV + _TOLERANCE_EV < floor <= 0.0:
        notes.append(DarkestExposure(floor))
    deep = middle - floor
    if deep < _TOLERANCE_EV:
        return [middle, middle + STEP_EV], notes
    bright = [middle, middle + STEP_EV] if shots > 2 else [middle]
    room = shots - len(bright)
    step, steps = STEP_EV, max(math.ceil((deep - _WORTH_EV) / STEP_EV), 1)
    if steps > room:
        step, steps = deep / room, room
        notes.append(WiderSteps(shots, step, STEP_EV))
    return [*bright, *(middle - step * k for k in range(1, steps)), floor], notes
