"""Merge the frames of a bracket into linear light and reduce the result in the same pass.

The last step removes coloured specks that errors in the codes can explain. Rounding, noise and
JPEG, which stores colour at half size, leave an error of several codes. In a channel that is weak
compared with the others, or near black, this amounts to a stop or more, which appears as coloured
speckle. A pixel's difference in colour from the median of its neighbours is reduced only as far as
such an error explains it. A small lamp therefore keeps its colour.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Final, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Float32, Indices
from app.core.base.colour import to_rec709
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.measure.bracket.curve.response import Response
from app.core.measure.bracket.half_size import HalfLight, half_lights, merge_halved
from app.core.measure.bracket.merge_band import Band, lift_black, merge_band
from app.core.measure.bracket.weighting import FrameLight, Scheme, agree, float_tables, frame_tables
from app.core.measure.read.decoding import Pixels, row_bands
from app.core.measure.read.frame import MergedLight
from app.core.measure.read.pixels import FrameStack, workers
from app.core.measure.read.resampling import Reduction

SIZE: Final = (1024, 2048)
"""The number of rows and columns of a merged panorama."""

# Pixels per band, enough to keep the interpreter's share of the work small, but few enough to keep
# the planes of a band in the cache.
_BAND_PIXELS: Final = 240_000
# Size in bytes of the rows of all frames that are read together if they are not in memory.
_READ_BYTES: Final = 48 << 20
# Maximum number of bands that are being merged or queued.
_WAITING: Final = 16
# Light that the brightest frame cannot distinguish from black, as a fraction of its saturation.
_BLACK: Final = 0.0045


@dataclass(slots=True)
class _Result:
    """The pictures that are filled band by band."""

    radiance: Float32
    clipped: Float32
    dark: Float32
    counts: list[int]


@dataclass(frozen=True, slots=True)
class _Band:
    """The contribution of a band of rows to the result, starting at row `first`."""

    first: int
    radiance: Float32 = field(repr=False)
    clipped: Float32 | None = field(repr=False)
    dark: Float32 | None = field(repr=False)
    counts: list[int]
    stop: int


@dataclass(frozen=True, slots=True)
class _Plan:
    """The data shared by all bands."""

    lights: tuple[FrameLight, ...]
    trusts: tuple[Float32 | None, ...]
    reduction: Reduction
    token: Token
    halves: tuple[HalfLight, ...] = ()
    black: float = 0.0
    doubts: tuple[float, ...] = ()


def reference_exposure(stops: Sequence[float]) -> float:
    """Return the middle frame's exposure in stops. Its saturation is the unit of the light."""
    return sorted(stops)[len(stops) // 2]


def merge(
    stack: FrameStack,
    response: Response,
    stops: Sequence[float],
    *,
    scheme: Scheme = "noise",
    exposures_known: bool = True,
    doubts: Sequence[float] = (),
    trust: Sequence[Float32 | None] | None = None,
    size: tuple[int, int] | None = SIZE,
    sphere: bool = True,
    token: Token | None = None,
    report: Report = silent,
) -> MergedLight:
    """Merge the frames into linear light.

    Each pixel is the weighted mean over the frames (`weighting`). A pixel that is clipped in every
    frame gets the darkest frame's value, which is a lower bound. A pixel that is black in every
    frame gets the brightest frame's value. The merged pixels, not those of the frames, are reduced
    by area and solid angle.

    Args:
        response: Response curve, which is not used for float frames. Its table, (3, 256), or (K, 3,
            256) with one curve per frame, contains the linear value of each code, 0 to 1.
        stops: The true exposures, in stops.
        doubts: How much each frame differs from its neighbours if the frames do not fit one
            another. This applies only to 8-bit frames at full size.
        trust: Trust map of each frame, (h, w) float32, 0 to 1 at the size of the proxies, or None
            for a frame that is trusted everywhere. The maps are interpolated bilinearly.
        size: Rows and columns of the resulting panorama, or None to keep the size of the frames, as
            is done for pictures that are not panoramas.

    Returns:
        The light, with `clipped_fractions` in the order of the stack.

    Raises:
        ProbeError: If a file has become damaged since it was first read.
        ValueError: If the numbers of frames, stops and trusts differ.
        Cancelled: If the token is cancelled.
    """
    if len(stops) != len(stack.frames) or not stops:
        raise ValueError(f"{len(stops)} exposures for {len(stack.frames)} frames")
    trusts = tuple(trust) if trust is not None else (None,) * len(stops)
    if len(trusts) != len(stops):
        raise ValueError(f"{len(trusts)} trust maps for {len(stops)} frames")
    # The kernel treats the last frame as the darkest, and corrected exposures may swap two frames.
    order = sorted(range(len(stops)), key=lambda index: -stops[index])
    reference = reference_exposure(stops)
    lights = _lights(stack, response, stops, scheme, reference, order, exposures_known)
    whole = [stack.whole[index] for index in order]
    halved = not all(whole)
    shape = (stack.shape[0] // 2, stack.shape[1] // 2) if halved else stack.shape
    ordered = [trusts[index] for index in order]
    plan = _Plan(
        lights=lights,
        # Leave out a map that trusts everything.
        trusts=tuple(t if t is not None and t.min() < 1.0 else None for t in ordered),
        reduction=_reduction(shape, size, sphere),
        token=token or Token(),
        halves=half_lights(lights, whole) if halved else (),
        black=_black(stack, exposures_known, sphere) * 2.0 ** (reference - max(stops)),
        doubts=_doubts(stack, doubts, scheme, order),
    )
    result = _run(stack, plan, order, report)
    if plan.black:
        quiet_colours(result.radiance, [light.tables.value for light in lights], plan.token)
    if stack.frames[0].primaries:
        # This comes last, because clipping applies to the camera's own colours.
        to_rec709(result.radiance, stack.frames[0].primaries)
        np.maximum(result.radiance, np.float32(0.0), out=result.radiance)
    return _merged_light(stack, stops, order, result)


def _merged_light(
    stack: FrameStack, stops: Sequence[float], order: Sequence[int], result: _Result
) -> MergedLight:
    """Return the light with its scale and the clipped fractions in the order of the stack."""
    reference, pixels = reference_exposure(stops), stack.shape[0] * stack.shape[1]
    fractions = [0.0] * len(order)
    for place, index in enumerate(order):
        fractions[index] = result.counts[place] / pixels
    exposures_known = all(f.exposure is not None and f.exposure.known for f in stack.frames)
    return MergedLight(
        radiance=result.radiance,
        clipped=result.clipped,
        dark=result.dark,
        reference_ev=reference,
        clip_level=2.0 ** (reference - min(stops)),
        # ISO 12232, for the exposure whose saturation is the unit.
        cd_m2=1.2 / 2.0**reference if exposures_known else None,
        clipped_fractions=tuple(fractions),
    )


def _lights(
    stack: FrameStack,
    response: Response,
    stops: Sequence[float],
    scheme: Scheme,
    reference: float,
    order: Sequence[int],
    exposures_known: bool,
) -> tuple[FrameLight, ...]:
    lights = []
    for index in order:
        kind = stack.frames[index].kind
        if kind in ("half", "float"):
            clips = math.isfinite(stack.top)
            unit = stack.top if clips else 1.0
            tables = float_tables(index, stops, clips=clips, scheme=scheme)
            scale = 2.0 ** (reference - stops[index]) / unit
            lights.append(FrameLight(tables, scale, unit, clips))
        else:
            fine = kind == "uint16"
            table = response.table if response.table.ndim == 2 else response.table[index]
            tables = frame_tables(
                table,
                index,
                stops,
                reference,
                scheme=scheme,
                fine=fine,
                exposures_known=exposures_known,
            )
            lights.append(FrameLight(tables))
    return tuple(lights)


def _doubts(
    stack: FrameStack, doubts: Sequence[float], scheme: Scheme, order: Sequence[int]
) -> tuple[float, ...]:
    """Return the doubts in order, or none unless all frames are 8-bit and weighted by noise.

    Frames at half size have no doubts either.
    """
    coded = all(stack.whole) and all(frame.kind == "uint8" for frame in stack.frames)
    return tuple(doubts[k] for k in order) if doubts and coded and scheme == "noise" else ()


def _black(stack: FrameStack, exposures_known: bool, sphere: bool) -> float:
    """Return the light below which the brightest frame is only black, or 0 for no limit."""
    precise = all(frame.kind != "uint8" for frame in stack.frames)
    return 0.0 if precise or (exposures_known and _panorama(stack.shape, sphere)) else _BLACK


def _panorama(shape: tuple[int, int], sphere: bool) -> bool:
    return sphere and shape[1] == 2 * shape[0]


def _reduction(shape: tuple[int, int], size: tuple[int, int] | None, sphere: bool) -> Reduction:
    panorama = _panorama(shape, sphere)
    target_shape = shape if size is None or (sphere and not panorama) else size
    smaller = min(target_shape[0], shape[0]), min(target_shape[1], shape[1])
    return Reduction.between(shape, smaller, panorama)


def _run(stack: FrameStack, plan: _Plan, order: Sequence[int], report: Report) -> _Result:
    height = plan.reduction.source[0]
    rows, columns = plan.reduction.target
    result = _Result(
        radiance=np.zeros((rows, columns, 3), np.float32),
        clipped=np.zeros((rows, columns), np.float32),
        dark=np.zeros((rows, columns), np.float32),
        counts=[0] * len(order),
    )
    sources = [stack.sources[index] for index in order]
    band = plan.reduction.band_rows(_BAND_PIXELS)
    slab = stack.shape[0] if stack.in_memory else _slab_rows(stack, band)

    with ThreadPoolExecutor(workers(height)) as pool:
        for top, bottom in row_bands(stack.shape[0], slab):
            plan.token.check()
            frames = list(pool.map(lambda source, a=top, b=bottom: source.rows(a, b), sources))
            merge_rows = partial(_merge_rows, plan, frames, top)
            # Frames at half size are all in memory, so there is only this slab.
            bands = [(top + a, top + b) for a, b in row_bands(min(bottom, height) - top, band)]
            for part in _flow(pool, merge_rows, bands):
                plan.token.check()
                _put(result, part)
                report(part.stop / height, Progress(Task.MERGING))
    return result


def _slab_rows(stack: FrameStack, band: int) -> int:
    """Return how many rows to read at a time, in whole bands, from frames not held in memory."""
    row_bytes = sum(frame.decoded_bytes // frame.shape[0] for frame in stack.frames)
    return max(1, _READ_BYTES // row_bytes // band) * band


def _flow(
    pool: ThreadPoolExecutor,
    work: Callable[[tuple[int, int]], _Band],
    bands: Iterable[tuple[int, int]],
) -> Iterator[_Band]:
    """Yield results in order, with only a few tasks running or queued at any time."""
    waiting: deque[Future[_Band]] = deque()
    try:
        for band in bands:
            waiting.append(pool.submit(work, band))
            if len(waiting) > _WAITING:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


def _merge_rows(plan: _Plan, frames: Sequence[Pixels], offset: int, rows: tuple[int, int]) -> _Band:
    """Merge some rows of the frames, the first of which is row `offset` of the picture."""
    plan.token.check()
    start, stop = rows
    shape = plan.reduction.source
    trusts = [None if t is None else _trust_rows(t, start, stop, shape) for t in plan.trusts]
    if plan.halves:
        sizes = [len(pixels) // shape[0] for pixels in frames]
        bands = [p[k * start : k * stop] for p, k in zip(frames, sizes, strict=True)]
        band = merge_halved(bands, plan.halves, trusts)
    else:
        bands = [pixels[start - offset : stop - offset] for pixels in frames]
        band = merge_band(bands, plan.lights, trusts)
        if plan.doubts:
            agree(bands, plan.lights, trusts, plan.doubts, band.radiance)
    if plan.black:
        lift_black(band.radiance, plan.black)
    return _reduced(band, plan.reduction, start, stop)


def _reduced(band: Band, reduction: Reduction, start: int, stop: int) -> _Band:
    """Reduce a band to its contribution to the result."""
    share = np.float32(1.0 / 255.0)
    clipped, dark = (
        None if mask is None else mask.astype(np.float32) * share
        for mask in (band.clipped, band.dark)
    )
    if reduction.whole:
        return _Band(start, _mixed(band.radiance), clipped, dark, band.clipped_counts, stop)
    first, shares = reduction.rows(start, stop)

    def small(plane: Float32 | None) -> Float32 | None:
        return None if plane is None else reduction.reduced(shares, plane)

    light = _mixed([reduction.reduced(shares, plane) for plane in band.radiance])
    return _Band(first, light, small(clipped), small(dark), band.clipped_counts, stop)


def _mixed(planes: Sequence[Float32]) -> Float32:
    return np.asarray(cv2.merge(planes))


def _put(result: _Result, part: _Band) -> None:
    """Add a band's contribution to the resulting pictures."""
    rows = slice(part.first, part.first + part.radiance.shape[0])
    result.radiance[rows] += part.radiance
    if part.clipped is not None:
        result.clipped[rows] += part.clipped
    if part.dark is not None:
        result.dark[rows] += part.dark
    for index, count in enumerate(part.counts):
        result.counts[index] += count


def _trust_rows(trust: Float32, start: int, stop: int, shape: tuple[int, int]) -> Float32 | None:
    """Interpolate rows ``start..stop`` of a trust map at full size, or return None if all are 1."""
    # With these pixel centres, the result equals one cv2.resize of the whole map.
    places = (np.arange(start, stop) + 0.5) * (trust.shape[0] / shape[0]) - 0.5
    places = np.clip(places, 0.0, trust.shape[0] - 1.0)
    above = places.astype(np.intp)
    below = np.minimum(above + 1, trust.shape[0] - 1)
    if trust[above[0] : below[-1] + 1].min() >= 1.0:
        return None
    share = (places - above).astype(np.float32)[:, None]
    rows = trust[above] * (1.0 - share) + trust[below] * share
    return np.asarray(cv2.resize(rows, (shape[1], stop - start), interpolation=cv2.INTER_LINEAR))


_Change: TypeAlias = tuple[Indices, Float32]

_AROUND: Final = 5  # side in pixels of the square for the median
_STOPS: Final = 0.15  # permitted difference of a colour from the median
_CODES: Final = 6.0  # possible error of a code at the edges of colours
_OPEN: Final = 235  # codes above this are less reliable than those of a darker frame
_LEAST: Final = 1e-12
_QUIET_PIXELS: Final = 1 << 20


def quiet_colours(radiance: Float32, values: Sequence[Float32], token: Token) -> None:
    """Reduce the colour noise of merged light, (h, w, 3), in place.

    Args:
        values: Light of each code, (3, 256) float32 for each frame, brightest first, in the unit of
            `radiance`.
    """
    height, width = radiance.shape[:2]
    bands = list(row_bands(height, max(_AROUND, _QUIET_PIXELS // width)))
    with ThreadPoolExecutor(workers(len(bands))) as pool:
        per_band = list(pool.map(partial(_changes, radiance, values, token), bands))
    flat = radiance.reshape(-1)
    for places, light in (change for changes in per_band for change in changes):
        flat[places] = light


def _changes(
    radiance: Float32, values: Sequence[Float32], token: Token, rows: tuple[int, int]
) -> list[_Change]:
    """Return, by channel, the flat indices and new values of the pixels to change in some rows."""
    token.check()
    start, stop = rows
    top = max(start - _AROUND // 2, 0)
    light = radiance[top : stop + _AROUND // 2]
    mean = np.maximum(light.mean(axis=-1), np.float32(_LEAST))
    inner = slice(start - top, stop - top)
    changes = []
    for channel in range(3):
        share = np.maximum(light[..., channel], np.float32(_LEAST)) / mean
        colour = np.log2(share)
        usual = np.asarray(cv2.medianBlur(colour, _AROUND), np.float32)
        over = (colour - usual)[inner]
        odd = np.flatnonzero(np.abs(over) > np.float32(_STOPS))
        log_ratio = usual[inner].take(odd) + np.clip(over.take(odd), -_STOPS, _STOPS)
        own = light[inner][..., channel].ravel().take(odd)
        most = light[inner].max(axis=-1).ravel().take(odd)
        leeway = _leeway(own, most, values, channel)
        target = mean[inner].ravel().take(odd) * np.exp2(log_ratio)
        new = own + np.clip(target - own, -leeway, leeway)
        changes.append(((start * radiance.shape[1] + odd) * 3 + channel, new.astype(np.float32)))
    return changes


def _leeway(own: Float32, most: Float32, values: Sequence[Float32], channel: int) -> Float32:
    """Return the light of a few codes in the brightest frame that does not clip a pixel."""
    leeway = np.zeros(own.shape, np.float32)
    rest = np.arange(own.size)
    for number, value in enumerate(values):
        open_here = most[rest] < value[:, _OPEN].min()
        here = rest if number == len(values) - 1 else rest[open_here]
        slope = np.gradient(value[channel])
        leeway[here] = np.interp(own[here], value[channel], slope)
        rest = rest[~open_here]
    return np.asarray(_CODES * leeway, np.float32)
