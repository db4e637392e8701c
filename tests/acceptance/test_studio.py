"""Targets, signatures and answers under the photographer's own lamps, on the shipped heads."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from app.core.environment.environment import SHAPE
from app.core.solver.head_shape import load_shape_of
from app.core.solver.solve import solve_all
from app.core.solver.style_signature import YES
from app.core.solver.style_verdict import measure_picture
from app.core.solver.transport import render
from app.core.styles.lamps import AS_PUBLISHED, RATIOS, SOFTNESS_DEG, Studio, studio_light
from app.core.styles.style_pack_build import StudioPacks
from app.core.styles.style_pack_file import load_named_pack, load_transport_of, pack_names
from app.core.styles.styles import mirror_name
from tests.helpers.cases import sample_first

CHOICES = [
    Studio(softness, ratio)
    for softness in (None, *SOFTNESS_DEG.values())
    for ratio in (None, *RATIOS)
]


@cache
def _packs(head: str) -> StudioPacks:
    pack = load_named_pack(head)
    transport = load_transport_of(pack, head)
    return StudioPacks(pack, transport, load_shape_of(transport, head))


@pytest.mark.parametrize("head", sample_first(pack_names(), 2))
@pytest.mark.parametrize("studio", CHOICES, ids=str)
def test_every_target_shows_its_own_style_where_it_is_offered(head: str, studio: Studio) -> None:
    """By the picture of the head under these very lamps, judged as any picture is."""
    packs = _packs(head)
    pack = packs.pack_for(studio)
    for row, (style, plain) in enumerate(zip(pack.styles, packs.pack.styles, strict=True)):
        used = pack.studio(style.name)
        if used == AS_PUBLISHED:
            continue
        picture = render(packs.transport, studio_light(plain, used, SHAPE))
        found = measure_picture(pack, packs.transport, picture)
        assert found.grade[row] == YES, style.name
        assert found.match[row] > 99.0, style.name


@pytest.mark.parametrize("studio", CHOICES[1:], ids=str)
def test_a_style_and_its_mirror_image_get_the_same_lamps(studio: Studio) -> None:
    pack = _packs("generic").pack_for(studio)
    assert sum(each != AS_PUBLISHED for each in pack.studios) >= 0.8 * len(pack.styles)
    for style in pack.styles:
        assert pack.studio(style.name) == pack.studio(mirror_name(style.name)), style.name


@pytest.mark.usefixtures("best_turns")
def test_the_place_with_those_lamps_gives_the_style_there() -> None:
    """Turn 0 in each studio itself, whole and to half a degree."""
    packs, studio = _packs("generic"), Studio(30.0, 4.0)
    pack = packs.pack_for(studio)
    for style, plain in zip(pack.styles, packs.pack.styles, strict=True):
        light = studio_light(plain, pack.studio(style.name), SHAPE)
        (result,) = solve_all(pack, light, styles=[style.name])
        assert result.grade == "yes", style.name
        start, stop = result.arc_deg
        # A match by areas is much the same all over its arc.
        turn = (start + stop) / 2 if style.signature.areas else result.turn_refined_deg
        assert abs(turn) <= 0.5, style.name


def test_more_fill_makes_shallower_targets() -> None:
    """Split by light and dark halves: the ratio of its target falls as the lighting ratio does."""
    packs, depths = _packs("generic"), []
    for ratio in (*RATIOS[::-1],):
        pack = packs.pack_for(Studio(30.0, ratio))
        picture = pack.target("left-split").mean(axis=2)
        half = picture.shape[1] // 2
        depths.append(np.log2(picture[30:70, half:].sum() / picture[30:70, :half].sum()))
    assert (np.diff(depths) < 0).all()
    # A face is no incident meter: skin lets light through, and curves.
    assert depths == pytest.approx(np.log2(RATIOS[::-1]), abs=0.75)


def test_as_in_the_paper_is_the_pack_itself() -> None:
    packs = _packs("generic")
    assert packs.pack_for(AS_PUBLISHED) is packs.pack


def test_a_choice_for_one_style_leaves_the_others() -> None:
    packs = _packs("generic")
    pack = packs.pack_for(AS_PUBLISHED, {"butterfly": Studio(45.0, None)})
    assert pack.studio("butterfly") == Studio(45.0, None)
    assert pack.studio("left-loop") == AS_PUBLISHED
    row = pack.index("left-loop")
    np.testing.assert_array_equal(pack.face_rows[row], packs.pack.face_rows[row])
