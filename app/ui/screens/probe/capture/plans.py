"""The number of frames in each plan, and the time that each plan takes."""

from __future__ import annotations

from functools import lru_cache
from typing import Final, Literal

from app.core.base.errors import ProbeError
from app.core.measure.plan.planner import Plan, plan
from app.core.measure.read.frame import Exposure
from app.core.places.place import CaptureFacts
from app.core.text import tr
from app.devices.protocol_profiles import profile_for
from app.devices.theta.messages import Info
from app.ui.presenters.window_model import CameraSeen
from app.ui.screens.probe.capture.checklist import ChoiceRow

_USUAL: Final = Exposure(1.0 / 60.0, 100.0, 2.0)
"""Exposure for a bright room, used to estimate the length of a plan before metering."""

_LIKELY: Final = tuple(Exposure(1.0 / part, 100.0, 2.0) for part in (1000, 250, 60, 15, 4))
"""Exposures for light levels from full sun to a dim room."""

PLAN_TITLES: Final[dict[str, str]] = {"paper": tr("Quick"), "full": tr("Full range")}


def plan_parts(camera: CameraSeen | None, auto_exposure: Exposure | None) -> tuple[ChoiceRow, ...]:
    """Return a row for each plan, with details such as "3 frames, 9 s"."""
    model = camera.device.model if camera is not None else ""
    parts = []
    for kind in ("paper", "full"):
        # The number of frames depends on the metering; before that, show the maximum.
        unsure = auto_exposure is None and kind == "full"
        plans = [
            one
            for light in (_LIKELY if unsure else (auto_exposure or _USUAL,))
            if (one := _estimate(model, light, kind)) is not None
        ]
        words = ""
        if plans:
            count = max(len(one.shots) for one in plans)
            values = {"count": count, "seconds": round(max(one.expected_s for one in plans))}
            words = (
                tr("up to {count} frames, {seconds} s", **values)
                if unsure
                else tr("{count} frames, {seconds} s", **values)
            )
        parts.append(ChoiceRow(kind, PLAN_TITLES[kind], words))
    return tuple(parts)


@lru_cache(maxsize=32)
def _estimate(model: str, auto_exposure: Exposure, kind: Literal["paper", "full"]) -> Plan | None:
    profile = profile_for(Info(model))
    try:
        return plan(
            auto_exposure,
            profile.fallback,
            kind,
            profile.max_shots,
            overhead_s=profile.overhead_s,
        )
    except ProbeError:
        return None


def metered_of(capture: CaptureFacts | None) -> Exposure | None:
    """Return the metered exposure, taken from the frame at 0 EV, or None without such a frame."""
    for frame in () if capture is None else capture.frames:
        if abs(frame.ev) < 0.1 and frame.iso > 0 and frame.aperture > 0 and frame.shutter_s > 0:
            return Exposure(frame.shutter_s, frame.iso, frame.aperture)
    return None
