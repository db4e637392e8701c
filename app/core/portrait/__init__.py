"""What a portrait at a turn needs to know beyond its style.

The lighting ratio, where the light comes from and how strongly, whether a lamp shines into the
sitter's eyes, how old the light is, and how a second capture lies on the first.
"""

from app.core.portrait.age import Age, Kind, light_age
from app.core.portrait.glare import Flow, Glare, eye_light, glare, light_flow
from app.core.portrait.ratio import CONVENTION, LightingRatio, lighting_ratio
from app.core.portrait.recapture_registration import Registered, register_again

__all__ = [
    "CONVENTION",
    "Age",
    "Flow",
    "Glare",
    "Kind",
    "LightingRatio",
    "Registered",
    "eye_light",
    "glare",
    "light_age",
    "light_flow",
    "lighting_ratio",
    "register_again",
]
