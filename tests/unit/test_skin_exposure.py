"""Skins side by side: pictures are exposed by the light, as with a grey card, not by the face."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.core.base import colour
from app.core.portrait.gallery_portraits import skin_gains
from app.core.solver.place_light import picture_at, turned
from app.core.solver.transport import render
from tests.helpers.styles_screen import head, scene_light

SKINS = ("generic-light", "generic", "generic-dark")
Light = NDArray[np.float32]


def _face(name: str, light: Light) -> NDArray[np.float32]:
    """Luminance of the face in some light, exposed as it is shown."""
    transport = head(name).transport
    seen = colour.luminance(render(transport, light))[transport.face]
    return np.asarray(seen * colour.face_exposure(seen) * skin_gains(transport, [light])[0])


@pytest.mark.parametrize("scene", ["interior", "sunset", "night"])
@pytest.mark.parametrize("turn", [0.0, 90.0, 180.0])
def test_one_exposure_for_all_skins(scene: str, turn: float) -> None:
    """All have the gain of medium skin; so they differ as the light on them does, to rounding."""
    light = turned(scene_light(scene), turn)
    shown = [float(_face(name, light).mean()) for name in SKINS]
    true = []
    for name in SKINS:
        transport = head(name).transport
        true.append(float(colour.luminance(render(transport, light))[transport.face].mean()))
    assert shown[0] > shown[1] > shown[2]
    for one, other in zip(shown, true, strict=True):
        assert one / shown[1] == pytest.approx(other / true[1], rel=1e-3)
    medium = _face("generic", light)
    assert colour.face_exposure(medium) == pytest.approx(1.0, rel=1e-5)


def test_portraits_on_the_screen_differ_as_skins_do() -> None:
    """In even light: dark skin at less than half of medium, light skin above it."""
    even = np.ones((32, 64, 3), np.float32)
    shown = []
    for name in SKINS:
        who = head(name)
        picture = np.zeros((who.transport.size**2, 3), np.float32)
        picture[who.transport.pixels] = render(who.transport, even)
        portrait = who.portrait(picture.reshape(who.transport.size, -1, 3), (100, 100), even)
        # Forehead and cheeks.
        shown.append(
            float(colour.luminance(colour.srgb_decode(portrait[35:60, 42:58] / 255)).mean())
        )
    assert 1.15 < shown[0] / shown[1] < 1.4
    assert 0.35 < shown[2] / shown[1] < 0.5


def test_targets_differ_too_and_rims_stay() -> None:
    """Under studio lamps as well; a rim is gloss, which all skins have alike."""
    pack, dark = head("generic").pack, head("generic-dark").transport
    gains = dict(zip([one.name for one in pack.styles], skin_gains(dark, pack.styles), strict=True))
    assert 0.4 < gains["butterfly"] < 0.5
    assert 0.85 < gains["left-rim"] < 1.0
    assert gains["left-rim"] == pytest.approx(gains["right-rim"], rel=1e-5)
    assert skin_gains(head("generic").transport, pack.styles) == [1.0] * len(pack.styles)


def test_the_light_decides_when_the_head_is_changed() -> None:
    light, turn = scene_light("interior"), 63.0
    means = [
        head(name)
        .portrait(picture_at(head(name).transport, light, turn), (80, 80), turned(light, turn))
        .mean()
        for name in SKINS
    ]
    assert means[0] > means[1] > means[2]
