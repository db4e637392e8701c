"""What is found on the way: where paths come out of the skin, at which angle, and where they go.

A trace (`app.core.baking.walk`) tells its finder of every surface that its paths meet, and of those
that escape; the finder adds up what it is there for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from app.core.baking.lanes import Table, Tally

PROFILE_BINS = 64


@dataclass(frozen=True, slots=True)
class SceneTables:
    """What the tracer needs beside the Mitsuba scene.

    Attributes:
        picture: Pixels along one side.
    """

    scene: Any
    skin_shape: Any
    level: Table
    first: Table
    table: Table
    skin_faces: int
    points: int
    picture: int
    extinction: tuple[float, float, float]
    albedo: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Meeting:
    """A path that meets a surface, and what becomes of it there.

    Attributes:
        slot: Which of the pixels the path started from.
        leaves, glances: It comes out of the skin; it came from outside, not first from the camera,
            and stays there.
    """

    slot: Any
    found: Any
    cosine: Any
    aslant: Any
    value: Any
    leaves: Any
    glances: Any


class Finder(Protocol):
    """What a trace is made for: it takes note of what happens to the paths."""

    def met(self, at: Meeting) -> None:
        """Take note of a surface: the path leaves the skin, glances off, or neither."""
        ...

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """Take note of a path that is gone for good, after at least one surface."""
        ...


@dataclass(frozen=True, slots=True)
class Shares:
    """Adds paths to the points around the place where they left the skin."""

    tables: SceneTables
    share: Tally
    lean: Tally

    def met(self, at: Meeting) -> None:
        """See `Finder.met`."""
        # The camera's own first reflection is done exactly (`exposure.shine`). Later ones hold
        # half a per cent of the light: they count as light from their place, by the profile.
        self._deposit(at, at.leaves | at.glances)

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """Nothing to note."""

    def _deposit(self, at: Meeting, active: Any) -> None:
        """Share a value among the three points around the place that was hit, its lean to one."""
        import drjit as dr
        import mitsuba as mi

        found = at.found
        on_skin = found.shape == self.tables.skin_shape
        face = found.prim_index + dr.select(
            on_skin, mi.UInt32(0), mi.UInt32(self.tables.skin_faces)
        )
        level = self.tables.level.take(face, active)
        first = self.tables.first.take(face, active)
        steps = mi.Float(level)
        u, v = found.prim_uv.x * steps, found.prim_uv.y * steps
        i = dr.minimum(mi.UInt32(dr.maximum(u, 0)), level - 1)
        j = dr.minimum(mi.UInt32(dr.maximum(v, 0)), level - 1 - i)
        s, t = u - mi.Float(i), v - mi.Float(j)
        upper = s + t > 1
        shares = (
            (
                dr.select(upper, s + t - 1, 1 - s - t),
                i + dr.select(upper, 1, 0),
                j + dr.select(upper, 1, 0),
            ),
            (dr.select(upper, 1 - t, s), i + 1, j),
            (dr.select(upper, 1 - s, t), i, j + 1),
        )
        nearest, most = mi.UInt32(0), mi.Float(-1)
        for part, a, b in shares:
            entry = first + b * (level + 1) + a - dr.select(b > 0, b * (b - 1) // 2, 0)
            point = self.tables.table.take(entry, active)
            self.share.add(at.slot * self.tables.points + point, at.value * part, active)
            nearest, most = dr.select(part > most, point, nearest), dr.maximum(part, most)
        for axis, component in enumerate((at.aslant.x, at.aslant.y, at.aslant.z)):
            row = (at.slot * self.tables.points + nearest) * 3 + axis
            self.lean.add(row, at.value * component, active)


@dataclass(frozen=True, slots=True)
class Profile:
    """Adds paths by the angle at which they left the skin."""

    tally: Tally

    def met(self, at: Meeting) -> None:
        """See `Finder.met`."""
        import drjit as dr
        import mitsuba as mi

        bin_ = dr.minimum(mi.UInt32(at.cosine * PROFILE_BINS), PROFILE_BINS - 1)
        self.tally.add(bin_, at.value, at.leaves)

    def escaped(self, slot: Any, direction: Any, value: Any, active: Any) -> None:
        """Nothing to note."""
