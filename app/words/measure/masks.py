"""Names of the masked areas in a panorama, and the reasons for masking them."""

from __future__ import annotations

from typing import Final

from app.core.measure.finish.masks import MaskSpec
from app.core.measure.finish.tripod_detection import Clutter, Suggestion
from app.core.text import tr

_AREAS: Final = {
    "box": tr("masked box"),
    "suggested": tr("suggested masks"),
}


def clutter_name(clutter: Clutter) -> str:
    """Name a masked area."""
    origin = clutter.origin
    if isinstance(origin, Suggestion):
        person = origin.azimuth_deg is not None
        return tr("someone close to the camera") if person else tr("stick, tripod or hand")
    return _mask_name(origin)


def clutter_reason(clutter: Clutter) -> str:
    """Explain why an area is masked."""
    origin = clutter.origin
    if not isinstance(origin, Suggestion):
        return tr("Masked by hand.")
    if origin.azimuth_deg is None:
        return tr(
            "This area reaches {far:.0f}° from the foot of the stand and does not look like "
            "the ground around it.",
            far=origin.reach_deg,
        )
    return tr(
        "This area reaches {far:.0f}° from the foot of the stand, around azimuth "
        "{azimuth:.0f}°, and does not look like the ground around it.",
        far=origin.reach_deg,
        azimuth=origin.azimuth_deg,
    )


def _mask_name(spec: MaskSpec) -> str:
    if spec.kind == "nadir":
        return tr("everything below {elevation:g}°", elevation=spec.numbers[0])
    if spec.kind == "zenith":
        return tr("everything above {elevation:g}°", elevation=spec.numbers[0])
    if spec.path is not None:
        return tr("mask {name}", name=spec.path.name)
    return _AREAS[spec.kind]
