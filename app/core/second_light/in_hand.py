"""A lamp in hand: a head and a lamp, prepared for the search for the lamp's best position."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from app.core.base.progress import Report, Token, span
from app.core.portrait.head import Head
from app.core.second_light.added_light import (
    AddedLight,
    NearField,
    from_captured,
    from_numbers,
    prepare_near,
)
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, grey_lamp, place_lamp
from app.core.second_light.contrast import FaceBasis, prepare_face
from app.core.second_light.lamp_presets import NumbersLamp
from app.core.second_light.lamp_tables import LampTables, lamp_tables
from app.core.solver.head_shape import HeadShape, load_shape_of

Lamp: TypeAlias = "NumbersLamp | CapturedLamp"


@dataclass(frozen=True, slots=True, eq=False)
class LampHead:
    """A head prepared for lamps. It takes about 60 MB."""

    head: Head
    shape: HeadShape = field(repr=False)
    near: NearField = field(repr=False)
    face: FaceBasis = field(repr=False)


@dataclass(frozen=True, slots=True, eq=False)
class InHand:
    """A lamp prepared for placement around a head.

    Attributes:
        grey: Whether the search ignores the lamp's colours, as the paper does.
    """

    base: LampHead
    lamp: Lamp
    lamp_light: AddedLight = field(repr=False)
    tables: LampTables = field(repr=False)
    grey: bool = False

    @property
    def head(self) -> Head:
        """The head around which the lamp is placed."""
        return self.base.head


def prepare_head(head: Head, token: Token) -> LampHead:
    """Prepare a head for lamps. This takes about a second, and serves any number of lamps.

    Raises:
        CoreError: If the head's shape is missing.
        Cancelled: If the token is cancelled.
    """
    shape = load_shape_of(head.transport, head.name)
    token.check()
    near = prepare_near(head.transport, shape)
    token.check()
    face = prepare_face(head.transport, head.pack.region_on(head.transport))
    return LampHead(head, shape, near, face)


def take_in_hand(
    base: LampHead, lamp: Lamp, token: Token, report: Report, grey: bool = False
) -> InHand:
    """Prepare a lamp for placement around a head.

    Raises:
        CoreError: If the lamp cannot be used.
        Cancelled: If the token is cancelled.
    """
    token.check()
    head, transport = base.head, base.head.transport
    if isinstance(lamp, NumbersLamp):
        lamp_light = from_numbers(
            transport, base.shape, lamp, token, report, near=base.near, face=base.face
        )
    else:
        capture = grey_lamp(lamp) if grey else lamp
        around = place_lamp(capture, token=token, report=span(report, 0.0, 0.3))
        lamp_light = from_captured(transport, around, token, report, face=base.face)
    tables = lamp_tables(head.pack, transport, lamp_light)
    return InHand(base, lamp, lamp_light, tables, grey)
