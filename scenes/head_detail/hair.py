"""The hair of the head in two cuts, grown from guides that gather it into locks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from scenes.head_detail.hairline import hair_weight, inside, unroll
from scenes.head_detail.heads import MM, Floats, Head, load
from scenes.head_detail.outline import step
from scenes.head_detail.strands import Heading, Strands, along_skin, both_sides, grow, unit
from scenes.head_detail.surface import Surface, scatter, surface

_WHORL = np.array([0.0, 0.90, -1.08])
"""Centre of the hair's whorl, at the back of the crown, in the frame of `Head.local`."""


@dataclass(frozen=True, slots=True)
class Cut:
    """Parameters of a haircut.

    Attributes:
        guides, strands: Number of locks, and of strands, on one half of the head.
        points: Points on each strand.
        gather: How far a lock's strands converge towards its tip, 0 to 1.
        frizz: Deviation of single strands at their tips, head units.
        radius: Mean radius of a strand, head units.
        stray: Share of strands that leave their lock.
        crosses: Whether locks cross the middle, where the cut has no parting.
    """

    guides: int
    strands: int
    points: int
    gather: float
    frizz: float
    radius: float
    stray: float
    crosses: bool


SHORT = Cut(700, 27000, 12, 0.85, 0.8 * MM, 0.062 * MM, 0.06, True)


def hair_short(name: str) -> Strands:
    """Return a short natural cut: 4 cm on top, swept up and back, with shorter sides and nape."""
    head, skin = load(name), surface(name)
    rng = np.random.default_rng(403)
    roots = _roots(head, skin, SHORT.guides, rng)
    lengths = _short_length(head, roots) * rng.uniform(0.7, 1.3, len(roots))
    body = _short_body(head, roots) * rng.uniform(0.15, 1.0, len(roots))
    heading = _short_heading(head, roots, body, rng)
    guides = grow(
        roots,
        lengths,
        SHORT.points,
        heading,
        skin,
        lambda done: body * np.sin(min(done * 1.5, 1.0) * np.pi / 2.0),
    )
    return _fill(head, skin, guides, SHORT, rng)


def _short_length(head: Head, roots: Floats) -> Floats:
    """Return lengths by position, (N,): 4 cm on top, 1 cm around the ears, less at the edge."""
    height = unroll(head, roots)[:, 1]
    front = step(head.local(roots)[:, 2], -0.5, 0.0)
    length = 7.0 + 34.0 * step(height, 0.36, 0.98)
    length += 8.0 * front * step(height, 0.45, 0.7)
    edge = step(inside(head, roots), 0.0, 0.16)
    return length * (0.5 + 0.5 * edge) * MM * head.scale


def _short_body(head: Head, roots: Floats) -> Floats:
    """Return the distance of the outermost strands from the skin, (N,)."""
    height = unroll(head, roots)[:, 1]
    front = step(head.local(roots)[:, 2], -0.4, 0.0) * step(height, 0.45, 0.65)
    body = 1.8 + 15.0 * np.maximum(step(height, 0.5, 1.02), 0.9 * front)
    rise = np.maximum(step(inside(head, roots), 0.0, 0.3), 0.8 * front)
    return body * (0.3 + 0.7 * rise) * MM * head.scale


def _short_heading(head: Head, roots: Floats, body: Floats, rng: np.random.Generator) -> Heading:
    local = head.local(roots)
    height, count = unroll(head, roots)[:, 1], len(roots)
    front = step(local[:, 2], -0.5, 0.0) * step(height, 0.4, 0.7)
    side = 1.0 - step(height, 0.35, 0.8)
    # At the front the hair is swept up and back, off the forehead.
    aside = 0.25 * front * step(local[:, 0], 0.1, 0.5)
    sweep = np.stack([aside, 0.35 * front - 0.7 * side, -1.3 * front - 0.2 * side], axis=1)
    # Near the middle hair runs along it: strays would meet their own mirror images there.
    turn = rng.normal(0.0, 0.25, (count, 3))
    turn[:, 0] *= 0.15 + 0.85 * step(local[:, 0], 0.05, 0.45)
    lift = (0.05 + 0.7 * step(height, 0.42, 0.92) + 0.4 * front) * rng.uniform(0.6, 1.3, count)

    def heading(points: Floats, normals: Floats, above: Floats, done: float) -> Floats:
        flow = unit(head.local(points) - _WHORL)
        flat = along_skin(flow + sweep + turn, normals)
        # Strands outside the cut's body bend back to the head.
        high = 0.9 * step(above, 0.7 * body, 1.6 * body) * (done > 0.2)
        return flat + (lift * (1.0 - 1.5 * done) - high)[:, None] * normals

    return heading


LONG = Cut(360, 24000, 24, 0.75, 3.0 * MM, 0.060 * MM, 0.06, False)


def hair_long(name: str) -> Strands:
    """Return a longer cut to the collar, parted in the middle, behind and beside the face."""
    head, skin = load(name), surface(name)
    rng = np.random.default_rng(404)
    roots = _roots(head, skin, LONG.guides, rng)
    # Grown longer than needed, then cut at the height of the collar.
    lengths = roots[:, 1] - head.cut + 0.5 * head.scale
    floor = head.cut + (0.30 + 0.05 * rng.normal(0.0, 1.0, len(roots))) * head.scale
    # Hair from the top covers hair from below.
    layer = step(unroll(head, roots)[:, 1], -0.2, 1.0)
    body = (1.0 + 6.5 * layer + rng.uniform(0.0, 3.5, len(roots))) * MM * head.scale
    guides = grow(
        roots,
        lengths,
        LONG.points,
        _long_heading(head, roots, rng),
        skin,
        lambda done: body * np.sin(min(done * 3.0, 1.0) * np.pi / 2.0),
    )
    return _fill(head, skin, _trim(guides, floor), LONG, rng)


def _trim(guides: Floats, floor: Floats) -> Floats:
    """Return strands (N, K, 3) cut where they fall below `floor` (N,), again with K points each."""
    count = guides.shape[1]
    low = guides[:, :, 1] < floor[:, None]
    end = np.where(low.any(axis=1), low.argmax(axis=1), count - 1)
    at = end[:, None] * np.linspace(0.0, 1.0, count)
    first = np.floor(at).astype(int).clip(0, count - 2)
    part = (at - first)[..., None]
    row = np.arange(len(guides))[:, None]
    cut: Floats = (1.0 - part) * guides[row, first] + part * guides[row, first + 1]
    return cut


def _long_heading(head: Head, roots: Floats, rng: np.random.Generator) -> Heading:
    """Return directions from the parting outward, then down and behind the face."""
    local = head.local(roots)
    ear = head.local(head.ear)
    # Each lock has a different curtain line: the front ones hang just before the ears.
    curtain = ear[:, 2].max() + rng.uniform(-0.15, 0.16, len(roots))
    lift = rng.uniform(0.25, 0.55, len(roots))
    turn = rng.normal(0.0, 0.07, (len(roots), 3))
    wave = rng.uniform(0.0, 2.0 * np.pi, len(roots))
    back = step(-local[:, 2], 0.6, 1.1)

    def heading(points: Floats, normals: Floats, above: Floats, done: float) -> Floats:
        at = head.local(points)
        across = np.maximum(0.0, 1.0 - at[:, 0] / 0.62) * (1.0 - back)
        behind = -step(at[:, 2] - curtain, -0.1, 0.5) * 1.3
        sway = 0.16 * np.sin(9.0 * done + wave) * done
        # Below the ears it moves in to the neck, from the front backward.
        low = step(-at[:, 1], 0.0, 0.9)
        inward = -0.55 * low * step(at[:, 0], 0.35, 0.75)
        behind = behind + 0.35 * low * step(-at[:, 2], 1.0, 1.5)
        # At the parting strands rise before they turn aside, which keeps it narrow.
        across = across * (1.0 if done > 0.06 else 0.4)
        flow = np.stack([1.1 * across + inward + sway, -np.ones(len(at)), behind], axis=1)
        # On the head, hair follows the skin; further down it hangs.
        cling = step(at[:, 1], -0.35, 0.25)[:, None]
        flat = along_skin(flow + turn, normals)
        way = cling * flat + (1.0 - cling) * unit(flow + turn)
        return way + (lift * max(0.0, 1.0 - 5.0 * done))[:, None] * normals

    return heading


def _roots(head: Head, skin: Surface, count: int, rng: np.random.Generator) -> Floats:
    """Return roots, (count, 3), on the left half, thinning out towards the hairline."""
    wide = (inside(head, head.vertices) > -0.05).astype(np.float64)
    spots = scatter(head, wide, 2 * count, rng)
    while True:
        kept = spots[rng.random(len(spots)) < hair_weight(head, spots)]
        if len(kept) >= count:
            roots, _ = skin.nearest(kept[:count])
            return roots
        spots = np.concatenate([spots, scatter(head, wide, count, rng)])


def _fill(head: Head, skin: Surface, guides: Floats, cut: Cut, rng: np.random.Generator) -> Strands:
    """Return strands between the guides: each follows its nearest one and converges to it."""
    roots = _roots(head, skin, cut.strands, rng)
    # Across the middle, a strand may follow a lock of the other side.
    other = guides[guides[:, 0, 0] < 0.12] * np.array([-1.0, 1.0, 1.0])
    guides = np.concatenate([guides, other]) if cut.crosses else guides
    gap, near = cKDTree(guides[:, 0]).query(roots, k=3, workers=2)
    share = 1.0 / (gap + 1.0 * MM) ** 2
    # Strays are spread evenly over three guides; the others belong to one.
    stray = rng.random(len(roots)) < cut.stray
    share = np.where(stray[:, None], share, share**2)
    share /= share.sum(axis=1, keepdims=True)
    shape = guides - guides[:, :1]
    shape = np.einsum("ij,ijkl->ikl", share, shape[near])
    done = np.linspace(0.0, 1.0, cut.points)[None, :, None]
    together = np.einsum("ij,ijk->ik", share, guides[near, 0]) - roots
    # Locks are least distinct in the middle, where each would be beside its twin.
    gather = cut.gather * (0.3 + 0.7 * step(head.local(roots)[:, 0], 0.05, 0.45))
    shape = shape + gather[:, None, None] * done**1.3 * together[:, None]
    length = rng.uniform(0.80, 1.04, (len(roots), 1, 1)) * np.where(stray, 1.08, 1.0)[:, None, None]
    points = roots[:, None] + shape * length
    points = points + _frizz(len(roots), cut, rng) * np.where(stray, 2.6, 1.0)[:, None, None]
    # Hair that reaches the collar lies on the cloth, and none goes below it.
    points[..., 1] = np.maximum(points[..., 1], head.cut + 0.2 * head.scale)
    low = step((head.cut - points[..., 1]) / head.scale, -0.50, -0.40)
    clearance = 0.3 * MM + 1.0 * MM * done[..., 0] + 7.5 * MM * low
    flat = skin.push_out(points.reshape(-1, 3), clearance.reshape(-1))
    points = flat.reshape(points.shape)
    points[:, 0] = roots
    return both_sides(points, cut.radius * rng.uniform(0.75, 1.25, len(points)))


def _frizz(count: int, cut: Cut, rng: np.random.Generator) -> Floats:
    """Return smooth deviations of single strands, (count, K, 3), increasing from the root."""
    done = np.linspace(0.0, 1.0, cut.points)[None, :, None]
    total = np.zeros((count, cut.points, 3))
    for waves in (0.5, 1.3):
        phase = rng.uniform(0.0, 2.0 * np.pi, (count, 1, 3))
        size = rng.normal(0.0, 1.0, (count, 1, 3)) * cut.frizz / (0.6 + waves)
        total += size * (np.sin(2.0 * np.pi * waves * done + phase) - np.sin(phase))
    return total * done
