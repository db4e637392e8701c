"""The published radiance map of the memorial church, from a file that was stored as text.

The map that circulates with the bracket has had its line ends converted: every byte 10 and every
byte 13 of the compressed picture has become the pair 13, 10. Most of it can be recovered, since
each row must decode to exactly 512 values per channel; if a value is in doubt, or a row stays
ambiguous, the pixels are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["read_map"]

DOUBT = -1
ROW_START = (2, 2)
# No place exceeds this many stops on either side of 1; a misread row soon does.
MOST_STOPS = 30


def read_map(path: Path) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read the map.

    Args:
        path: A Radiance file, intact or with converted line ends.

    Returns:
        (H, W, 3) float64 radiance in the file's scale, 0 where unknown; and (H, W) bool, true where
        known.
    """
    data = path.read_bytes()
    converted = data.count(b"\n") == data.count(b"\r\n") == data.count(b"\r")
    start = data.index(b"-Y ")
    head = data[start : data.index(b"\n", start)].split()
    height, width = int(head[1]), int(head[3])
    codes = tokens(data[data.index(b"\n", start) + 1 :], converted)
    rgbe = np.zeros((height, width, 4), np.int64)
    known = np.zeros((height, width), bool)
    mark = (*ROW_START, width >> 8, width & 255)
    starts = [place for place in range(len(codes)) if tuple(codes[place : place + 4]) == mark]
    place = 0
    for row in range(height):
        values, place = decode_row(codes, place + 4, width, mark)
        if values is None:
            place = next((one for one in starts if one > place), len(codes))
            continue
        rgbe[row] = values
        known[row] = (values != DOUBT).all(axis=1) & (np.abs(values[:, 3] - 128) < MOST_STOPS)
    scale = np.where(rgbe[..., 3] > 0, 2.0 ** (np.clip(rgbe[..., 3], 0, 255) - 136.0), 0.0)
    radiance = (np.maximum(rgbe[..., :3], 0) + 0.5) * scale[..., None]
    return radiance * known[..., None], known


def tokens(data: bytes, converted: bool) -> list[int]:
    """Return bytes as numbers; a converted line end is `DOUBT`."""
    if not converted:
        return list(data)
    parts = data.split(b"\r\n")
    result = list(parts[0])
    for part in parts[1:]:
        result.append(DOUBT)
        result.extend(part)
    return result


def decode_row(
    codes: list[int], place: int, width: int, mark: tuple[int, ...]
) -> tuple[NDArray[np.int64] | None, int]:
    """Decode the four channels of a row; a row must end where the next begins.

    Depth first over the possible values of the few doubtful counts.
    """
    states: list[tuple[int, list[int]]] = [(place, [])]
    tried: set[tuple[int, int]] = set()
    while states:
        at, values = states.pop()
        if (at, len(values)) in tried:
            continue
        tried.add((at, len(values)))
        if len(values) == 4 * width:
            if at >= len(codes) or tuple(codes[at : at + 4]) == mark:
                return np.array(values).reshape(4, width).T, at
            continue
        for count in (10, 13) if at < len(codes) and codes[at] == DOUBT else codes[at : at + 1]:
            run = count - 128 if count > 128 else count
            room = width - len(values) % width
            if not 0 < run <= room:
                continue
            if count > 128:
                states.append((at + 2, [*values, *(codes[at + 1 : at + 2] * run)]))
            else:
                states.append((at + 1 + run, [*values, *codes[at + 1 : at + 1 + run]]))
    return None, place
