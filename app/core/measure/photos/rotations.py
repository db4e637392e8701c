"""Estimate the rotations and focal lengths of photos taken from one point.

Photos from a turning camera are related by homographies. Pairs are matched by RootSIFT points and
accepted as in M. Brown and D. Lowe, "Automatic Panoramic Image Stitching using Invariant Features",
IJCV 2007. The focal length is the one for which all pairs are related by rotations. All rotations
and focal lengths are then adjusted together, by Gauss-Newton with Cauchy's weights and without
outliers. Up is the direction for which the cameras' right vectors are level (section 5 of that
paper).

The camera axes point right, down and forward. Rotations convert them to a common coordinate system,
which in the end is that of a panorama.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float64
from app.core.base.progress import Progress, Report, Task, Token
from app.core.base.sphere import from_vector
from app.core.localization.features import Features, describe, pair, thinned
from app.core.localization.recapture_registration import fit_rotation
from app.core.localization.rotation import unit_rays

LONGEST: Final = 720
"""Longer side of the compared pictures, in pixels."""

_POINTS, _MOST, _TELLING = 700, 120, 24  # points per photo; points per pair; pairs for a lens
_APART, _CELL, _A_CELL = 8.0, 36.0, 2  # pixels between rivals; cell side; matches per cell
# Matches that must agree: Brown and Lowe require 8 and a fraction of all.
_FEWEST, _OF_MATCHES = 10, 0.3
_OFF, _ODD = 4.0, 5.0  # maximum error of a point, and median error of a pair, in pixels
# Minimum distance between the points of pairs that determine the focal length.
_FAR: Final = 0.1 * LONGEST
_FOCALS: Final = np.geomspace(0.25, 4.0, 97)
_SCALES: Final = np.maximum(60.0 * 0.75 ** np.arange(24), 1.5)  # pixels, of Cauchy's weights
_ALIKE: Final = 0.01  # deviation between the focal lengths of photos
_LEAN: Final = 0.005


@dataclass(frozen=True, slots=True, eq=False)
class PhotoPair:
    """Matching points in two photos, (M, 2) float64 each, relative to the picture centres."""

    numbers: tuple[int, int]
    points: tuple[Float64, Float64] = field(repr=False)

    def rays(self, focals: Float64 | Mapping[int, float]) -> list[Float64]:
        """Return unit vectors in the axes of both cameras, (M, 3) each.

        Args:
            focals: Focal length of each photo, in pixels. If the array is (N, K, 1), the results
                are (K, M, 3).
        """
        pairs = zip(self.points, self.numbers, strict=True)
        return [unit_rays(points, 1.0 / focals[k]) for points, k in pairs]


def points_of(picture: Bytes) -> Features:
    """Return the features of a photo, (h, w, 3) uint8, with positions relative to the centre."""
    features = describe(picture, _POINTS)
    return replace(
        features, places=(features.places - np.array(picture.shape[1::-1]) / 2.0).astype(np.float32)
    )


def find_links(
    views: Sequence[Features], pairs: Sequence[tuple[int, int]], token: Token, report: Report
) -> list[PhotoPair]:
    """Match pairs of photos.

    Raises:
        Cancelled: If the token is cancelled.
    """
    links = []
    with ThreadPoolExecutor(2) as pool:
        for count, link in enumerate(pool.map(partial(_link, views, token), pairs)):
            report(count / len(pairs), Progress(Task.COMPARING_PHOTOS))
            links += [] if link is None else [link]
    return links


def _link(views: Sequence[Features], token: Token, numbers: tuple[int, int]) -> PhotoPair | None:
    token.check()
    one, other = (views[number] for number in numbers)
    pairs = pair(one.descriptors, other.descriptors, other.places, _APART)
    pairs = thinned(pairs, one.places, _CELL, _A_CELL)
    if len(pairs.first) < _FEWEST:
        return None
    here = one.places[pairs.first].astype(np.float64)
    there = other.places[pairs.second].astype(np.float64)
    _, inside = cv2.findHomography(here, there, cv2.USAC_DEFAULT, _OFF)
    agree = np.flatnonzero(inside)
    if len(agree) < max(_FEWEST, 8.0 + _OF_MATCHES * len(here)):
        return None
    agree = agree[:: -(-len(agree) // _MOST)]
    return PhotoPair(numbers, (here[agree], there[agree]))


def groups(count: int, links: Iterable[PhotoPair]) -> list[list[int]]:
    """Return the connected groups of photos, largest group first."""
    name = np.arange(count)
    for link in links:
        first, second = name[list(link.numbers)]
        name[name == second] = first
    return sorted((np.flatnonzero(name == one).tolist() for one in set(name)), key=len)[::-1]


def turn(
    stated: Sequence[float | None], links: Sequence[PhotoPair]
) -> tuple[dict[int, Float64], dict[int, float], float]:
    """Return the rotations, (3, 3), and the focal lengths, in pixels, of matching photos.

    Args:
        stated: Focal length of each photo from EXIF, in pixels, or None if it is not recorded.

    Returns:
        The rotations and the focal lengths for the largest group, each keyed by the photos'
        numbers, and the typical error of matching points, in pixels.
    """
    good, focals = list(links), _focals(stated, links)
    while good:
        members = groups(len(stated), good)[0]
        inside = [link for link in good if link.numbers[0] in members]
        solution = _adjusted(members, inside, _chained(members, inside, focals), focals)
        off = [np.median(np.linalg.norm(_equations(n, *solution)[1], axis=1)) for n in inside]
        good = [link for link, miss in zip(inside, off, strict=True) if miss <= _ODD]
        if len(good) == len(inside):
            return *solution, float(np.median(off))
    return {}, {}, 0.0


def _focals(stated: Sequence[float | None], links: Sequence[PhotoPair]) -> Float64:
    """Return the focal lengths from EXIF, in pixels, scaled to make the pairs rotations."""
    usual = float(np.median([focal for focal in stated if focal] or [LONGEST]))
    base, cost = np.array([focal or usual for focal in stated]), np.abs(np.log(_FOCALS)) * 1e-6
    motions = [np.median(np.linalg.norm(np.subtract(*link.points), axis=1)) for link in links]
    telling = [link for link, far in zip(links, motions, strict=True) if far > _FAR]
    for link in sorted(telling, key=lambda link: -len(link.points[0]))[:_TELLING]:
        here, there = link.rays(base[:, None, None] * _FOCALS[:, None])
        rotated = np.einsum("kmi,kji->kmj", here, fit_rotation(there, here))
        miss = np.linalg.norm(rotated - there, axis=2) * base[link.numbers[1]] * _FOCALS[:, None]
        cost += np.minimum(np.median(miss, axis=1), 4.0 * _OFF)
    return np.asarray(base * _FOCALS[int(np.argmin(cost))])


def _chained(
    members: Sequence[int], links: Sequence[PhotoPair], focals: Float64
) -> dict[int, Float64]:
    """Chain the rotations of all photos along the pairs with the most matching points."""
    rotations = {members[0]: np.eye(3)}
    rest = sorted(links, key=lambda link: -len(link.points[0]))
    while len(rotations) < len(members):
        link = next(n for n in rest if (n.numbers[0] in rotations) != (n.numbers[1] in rotations))
        (first, second), between = link.numbers, fit_rotation(*link.rays(focals))
        if first in rotations:
            rotations[second] = rotations[first] @ between
        else:
            rotations[first] = rotations[second] @ between.T
    return rotations


def _adjusted(
    members: Sequence[int],
    links: Sequence[PhotoPair],
    rotations: dict[int, Float64],
    focals: Float64,
) -> tuple[dict[int, Float64], dict[int, float]]:
    """Adjust all rotations and focal lengths, with four unknowns per photo.

    The zoom is assumed to be nearly the same in all photos. A very weak prior fixes the overall
    rotation.
    """
    count, zooms = len(members), np.zeros(len(members))
    damping = np.eye(4 * count) * 1e-3
    damping[3::4, 3::4] += (np.eye(count) - 1.0 / count) / _ALIKE**2
    now = {member: float(focals[member]) for member in members}
    for scale in _SCALES:
        normal, right = damping.copy(), np.zeros(4 * count)
        right[3::4] -= damping[3::4, 3::4] @ zooms
        for link in links:
            places = np.concatenate([4 * members.index(k) + np.arange(4) for k in link.numbers])
            rows, off = _equations(link, rotations, now)
            weighted = rows / (1.0 + (off**2).sum(axis=1) / scale**2)[:, None, None]
            normal[np.ix_(places, places)] += np.einsum("mck,mcl->kl", weighted, rows)
            right[places] -= np.einsum("mck,mc->k", weighted, off)
        change = np.linalg.solve(normal, right).reshape(count, 4)
        zooms += change[:, 3].clip(-0.2, 0.2)
        for place, member in enumerate(members):
            step = from_vector(np.array(change[place, :3], np.float64))
            rotations[member] = np.asarray(rotations[member] @ step, np.float64)
            now[member] = float(focals[member] * np.exp(zooms[place]))
    return rotations, now


def _equations(
    link: PhotoPair, rotations: Mapping[int, Float64], focals: Mapping[int, float]
) -> tuple[Float64, Float64]:
    """Linearise the errors of a pair's points: slopes, (M, 3, 8), and errors, (M, 3), in pixels.

    The slope of R exp(w) u with respect to w is -R [u]x. With respect to the logarithm of the focal
    length, the slope is the part of -(x, y, 0) / f that is perpendicular to u.
    """
    off, rows = np.zeros((len(link.points[0]), 3)), []
    for member, rays, sign in zip(link.numbers, link.rays(focals), (1.0, -1.0), strict=True):
        scaled = sign * focals[link.numbers[0]] * rotations[member]
        inward = rays * np.array([-1.0, -1.0, 0.0])
        by_zoom = inward - (inward * rays).sum(axis=1, keepdims=True) * rays
        by_turn = np.cross(np.eye(3)[None], rays[:, None, :])  # row k is axis k x u
        slopes = np.concatenate([by_turn, by_zoom[:, None]], axis=1)
        rows.append(np.einsum("ij,mkj->mik", scaled, slopes))
        off += rays @ scaled.T
    return np.concatenate(rows, axis=2), off


def upright(rotations: Mapping[int, Float64], first: int) -> dict[int, Float64]:
    """Rotate all photos to make the mean camera level and put one photo at azimuth 0.

    Args:
        rotations: Rotation of each photo, (3, 3) float64, from camera axes to a common coordinate
            system.
        first: Number of the photo to put at azimuth 0.
    """
    every = np.array(list(rotations.values()))
    sides, mean = every[:, :, 0], -every[:, :, 1].mean(axis=0)
    mean /= np.linalg.norm(mean)
    leaning = sides.T @ sides / len(sides) + _LEAN * (np.eye(3) - np.outer(mean, mean))
    up = np.linalg.eigh(leaning)[1][:, 0]
    up *= np.sign(up @ mean)
    left = np.cross(up, rotations[first][:, 2])
    left /= np.linalg.norm(left)
    axes = np.stack([left, up, np.cross(left, up)])
    return {member: axes @ rotation for member, rotation in rotations.items()}
