"""Compute the weight and the radiance of each code in each frame.

All three channels of a pixel share one weight, so the weighting cannot tint the pixel. The weight
is the product of two table entries, one indexed by the largest of the three codes (since a pixel is
clipped when its worst channel is) and one by the smallest (for the noise of the channel with the
least light). The default weights have one exception: in a pixel with one clipped channel, the
channels well below clipping keep most of their weight and count alongside darker frames. A blue sky
is clipped in blue long before red and green lose their information.

**Noise-aware weights** (the default). The linear estimate x = g(z) / t of a frame with response g
and exposure t has the variance

    v(z) / t^2,   v(z) = g(z) / W + (r / W)^2 + (g'(z) c)^2 + b^2

from shot noise with a full well of W electrons, read noise of r electrons, an error of c codes from
quantisation and JPEG, scaled by the slope of the response, and an uncertainty b in the level of
black (from glare in the lens, the film base or a black level that is not 0). The mean with the
least noise has weights t^2 / v (Granados et al. 2010, "Optimal HDR reconstruction with linear
digital cameras"; Hasinoff, Durand and Freeman 2010, "Noise-optimal capture for high dynamic range
photography"). v is evaluated at the frame's own noisy code, which lowers the mean slightly where v
rises with z (Aguerrebere et al. 2014, "Best algorithms for HDR image generation", section 4). v is
flattest at the smallest of the three codes. Weights proportional to t instead of t^2 would avoid
the bias, but then additions to black would count in the dark frames, which triples the median error
on the memorial church bracket.

A recovered response also has an error of a few per cent that differs from frame to frame, and these
weights rely almost entirely on one frame. So if the response is not known, a code with a relative
error e = sqrt(v) / g has the additional weight d^-2 / (1 + (e / e0)^4), which keeps the darker
frames in use. The closer the frames are, the more the darker ones count, since d grows with the
square of the steps between the frames.

**Reinhard's weights**, as in the paper: w(z) = 1 - (2 z / 255 - 1)^12 (Reinhard et al. 2010, "High
Dynamic Range Imaging", 2nd edition), with codes outside 2 to 98% of the range excluded as in
Matlab's makehdr.

**Frames that do not fit one another** are merged by their agreement. Examples are warped scans of
film, motion of a hand that a homography does not undo, and tone curves that vary across the
picture. With weights based on noise, hardly any frame but the brightest unclipped one would count.
At an edge that is one pixel off, the light would then be wrong by stops, although all darker frames
contradict it. So if frames differ by more than noise in most places, each frame's log light has the
weight

    1 / (e^2 + d^2) / (1 + r^2 / s^2 / (e^2 + d^2))

where e is the relative error of the frame's code, d is the frame's measured difference from its
neighbours in exposure, and r is its distance from the mean of all frames (Cauchy's weights, in a
few rounds).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, Literal, TypeAlias

import cv2
import numpy as np

from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.colour import largest_channel, smallest_channel, srgb_encode
from app.core.measure.read.decoding import Pixels

Scheme: TypeAlias = Literal["noise", "reinhard"]

CLIPPED_CODE: Final = 254
"""First code that counts as clipped, since JPEG may change a code of 255 by one."""

# In electrons, for a small sensor at base sensitivity. Twice or half as many change no weight by
# more than a third, since the error of the codes dominates an 8-bit picture's noise.
_FULL_WELL: Final = 20_000.0
_READ_NOISE: Final = 4.0
_BLACK_ERROR: Final = 0.0015
# Error in the codes of 8-bit pictures, from rounding (0.29) and JPEG at usual qualities (0.6 to 2).
_CODE_ERROR: Final = 1.0
# The same for 16-bit files, which come from raw converters.
_FINE_CODE_ERROR: Final = 0.1
# The ramp ends this many codes below clipping and is this wide, since ringing around clipped areas
# changes JPEG codes by a few there.
_RAMP_END: Final = 4.0
_RAMP_WIDTH: Final = 40.0
# Weight of an unclipped channel in a clipped pixel, and the codes over which the weight fades.
_OWN_WEIGHT: Final = 0.7
_OWN_FADE: Final = (200.0, 240.0)
# Relative error of a recovered response for steps of one stop, and the relative error of a code at
# which its additional weight fades.
_CURVE_ERROR: Final = 0.065
_TELLING_ERROR: Final = 0.2
_LEAST_DOUBT: Final = 0.03
_HAT_LIMITS: Final = (0.02 * 255.0, 0.98 * 255.0)
_PLATEAU: Final = 0.9995
# Weights of last resort, far below every regular weight, so that they matter only where all frames
# are clipped (and the darkest decides) or black (and the brightest decides).
_CLIPPED_DARKEST: Final = 1e-6
_CLIPPED_OTHERS: Final = 1e-10
_BLACK: Final = 1e-6


@dataclass(frozen=True, slots=True)
class FrameTables:
    """The look-up tables of one frame, where n is 256, or 65,536 for 16-bit and float frames.

    A pixel's weight is the product of `bright`, indexed by the largest of its three codes, and
    `faint`, indexed by the smallest. All arrays are float32.

    Attributes:
        bright, faint: (n,) each. Weights for the largest and the smallest code, respectively.
        own: (n,). Weight for a channel's own code. It replaces `bright` for that channel where it
            is larger.
        full: Code below which `bright` is 1.
        ramp: Code below which `bright` is at least 1 wherever `own` is not 0, which makes `own`
            unnecessary.
        value: (3, n). Radiance of each code.
        clipped: First code that counts as clipped.
        spent: First code that may be clipped, since JPEG may change a code of 255 by several steps
            next to a lamp. Such codes have no weight, and a pixel that a darker frame clips is
            clipped in this frame. In the darkest frame, `spent` equals `clipped`.
    """

    bright: Float32 = field(repr=False)
    faint: Float32 = field(repr=False)
    own: Float32 = field(repr=False)
    full: int
    ramp: int
    value: Float32 = field(repr=False)
    clipped: int
    spent: int


@dataclass(frozen=True, slots=True)
class FrameLight:
    """The tables that convert a frame's pixels to weights and radiance.

    The tables are indexed by codes or, for float frames, by the square root of the value as a
    fraction of `unit`.
    """

    tables: FrameTables
    scale: float = 1.0
    unit: float = 1.0
    clips: bool = True


def clipped_code(table: Float64) -> int:
    """Return the first code that counts as clipped in a response, (3, 256).

    The code is 254, or lower if a channel's response reaches its end earlier.
    """
    flat = (table >= _PLATEAU * table[:, -1:]).any(axis=0)
    return min(CLIPPED_CODE, int(np.argmax(flat)))


def frame_tables(
    table: Float64,
    index: int,
    stops: Sequence[float],
    reference_ev: float,
    *,
    scheme: Scheme = "noise",
    fine: bool = False,
    exposures_known: bool = True,
) -> FrameTables:
    """Return the look-up tables of a frame.

    Args:
        table: (3, 256) float64. Response, given as the linear value of each code, which increases
            from 0 to 1.
        stops: Exposures of all frames, in stops.
        reference_ev: Exposure, in stops, whose saturation is the unit of the light.
        fine: Whether to use 65,536 codes, as is done for 16-bit frames.
    """
    count = 65536 if fine else 256
    codes = np.linspace(0.0, 255.0, count)
    linear = np.stack([np.interp(codes, np.arange(256.0), row) for row in neutral_end(table)])
    first = clipped_code(table)
    exposure = 2.0 ** (np.asarray(stops, np.float64) - max(stops))
    mean = linear.mean(axis=0)
    if scheme == "reinhard":
        bright, faint = _reinhard(codes)
        own = np.zeros(count)
    else:
        step = float(np.median(np.diff(np.sort(stops)))) if len(stops) > 1 else 0.0
        doubt = math.inf if exposures_known else _CURVE_ERROR * step**2
        bright, faint = _ramp(codes, first), _noise(mean, codes, fine, doubt) * exposure[index] ** 2
        own = _own(codes, first)
    bright = np.where(codes >= first, 0.0, bright)
    floors = _floors(exposure, index)
    return FrameTables(
        bright=np.maximum(bright, floors[0]).astype(np.float32),
        faint=np.maximum(faint, floors[1]).astype(np.float32),
        own=own.astype(np.float32),
        full=_first(bright < 1.0),
        ramp=_first(bright < own.max()),
        value=(linear * 2.0 ** (reference_ev - stops[index])).astype(np.float32),
        clipped=int(np.searchsorted(codes, first)),
        spent=int(np.searchsorted(codes, first - _RAMP_END * (index != np.argmin(exposure)))),
    )


def float_tables(
    index: int, stops: Sequence[float], *, clips: bool, scheme: Scheme = "noise"
) -> FrameTables:
    """Return the tables of a linear frame, with 65,536 entries indexed by the value's square root.

    Do not use the `value` table of the result, since the frame's own values are finer.
    """
    places = np.linspace(0.0, 1.0, 65536)
    linear = places * places
    exposure = 2.0 ** (np.asarray(stops, np.float64) - max(stops))
    codes = 255.0 * srgb_encode(linear).astype(np.float64)
    own = np.zeros_like(codes)
    if scheme == "reinhard":
        bright, faint = _reinhard(codes)
    else:
        variance = _variance(linear, 0.0)
        bright = _ramp(codes, CLIPPED_CODE)
        faint = np.asarray(variance.min() / variance) * exposure[index] ** 2
        own = _own(codes, CLIPPED_CODE)
    if not clips:
        bright = np.ones_like(bright)
    floors = _floors(exposure, index)
    return FrameTables(
        bright=np.maximum(bright, floors[0]).astype(np.float32),
        faint=np.maximum(faint, floors[1]).astype(np.float32),
        own=own.astype(np.float32),
        full=_first(bright < 1.0),
        ramp=_first(bright < own.max()),
        value=np.stack([linear] * 3).astype(np.float32),
        clipped=65536,
        spent=65536,
    )


def relative_error(value: Float32) -> Float64:
    """Return the relative noise, (256,), of the 8-bit codes that represent this light, (3, 256).

    The noise is infinite for codes without light.
    """
    linear = value.mean(axis=0, dtype=np.float64) / float(value.max())
    variance = _variance(linear, np.gradient(linear) * _CODE_ERROR)
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(variance) / linear)


def neutral_end(table: Float64) -> Float64:
    """Scale the channels of a response, (3, 256), so that they end at the same value.

    A lamp that clips all three channels must come out neutral. A recovered response can end at a
    different value in each channel, since it is least certain at its end, which no darker frame
    shows. The correction is spread over the codes above 235 and increases towards the highest code.
    No value is lowered.
    """
    share = np.clip((np.arange(256.0) - 235.0) / 20.0, 0.0, 1.0)
    gain = table[:, -1].max() / table[:, -1:]
    return np.asarray(table * (1.0 + (gain - 1.0) * share * share * (3.0 - 2.0 * share)))


def _first(codes: Bools) -> int:
    """Return the first code for which a condition holds, or one past the last code."""
    return int(np.argmax(codes)) if codes.any() else codes.size


def _floors(exposure: Float64, index: int) -> tuple[float, float]:
    """Return a frame's fallback weights, for when all frames are clipped and when all are black."""
    if index == int(np.argmin(exposure)):
        clipped = _CLIPPED_DARKEST
    else:
        clipped = _CLIPPED_OTHERS * float(exposure.min() / exposure[index]) ** 2
    return clipped, _BLACK * float(exposure[index]) ** 2


def _ramp(codes: Float64, first: int) -> Float64:
    """Return a ramp that falls from 1 to 0 just below clipping."""
    return _fade(codes, first - _RAMP_END - _RAMP_WIDTH, first - _RAMP_END)


def _own(codes: Float64, first: int) -> Float64:
    """Return the weight of a single channel where another channel is clipped."""
    shift = first - CLIPPED_CODE
    return _OWN_WEIGHT * _fade(codes, _OWN_FADE[0] + shift, _OWN_FADE[1] + shift)


def _fade(codes: Float64, start: float, stop: float) -> Float64:
    """Return a smooth ramp that falls from 1 to 0."""
    share = np.clip((stop - codes) / (stop - start), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def _noise(linear: Float64, codes: Float64, fine: bool, doubt: float) -> Float64:
    """Return 1 / v(z), plus the term for a doubtful response, in units of the smallest v."""
    error = _FINE_CODE_ERROR if fine else _CODE_ERROR
    variance = _variance(linear, np.gradient(linear, codes) * error)
    weight = np.asarray(variance.min() / variance)
    if math.isfinite(doubt):
        square = np.maximum(linear, 1e-9) ** 2
        fades = 1.0 + (variance / square / _TELLING_ERROR**2) ** 2
        weight += variance.min() / (max(doubt, _LEAST_DOUBT) ** 2 * square * fades)
    return weight


def _variance(linear: Float64, error: Float64 | float) -> Float64:
    """Return v, combining all the errors described above with a given error in the codes."""
    floor = (_READ_NOISE / _FULL_WELL) ** 2 + _BLACK_ERROR**2
    return np.asarray(linear / _FULL_WELL + np.square(error) + floor)


def _reinhard(codes: Float64) -> tuple[Float64, Float64]:
    """Return Reinhard's hat: its upper half for the largest code, its lower for the smallest."""
    hat = 1.0 - (2.0 * codes / 255.0 - 1.0) ** 12
    hat[(codes < _HAT_LIMITS[0]) | (codes > _HAT_LIMITS[1])] = 0.0
    upper = codes > 127.5
    return np.where(upper, hat, 1.0), np.where(upper, 1.0, hat)


# Usable codes start here, and end as far below clipping.
_DARKEST: Final = 32
_UNDER_WHITE: Final = 19
_FEWEST: Final = 300
_USUAL: Final = 0.8  # fraction of the positions that determines the frames' typical difference
# Frames with one curve, or with a curve each, differ by 0.03 to 0.08 (natural logarithm), and scans
# of film by 0.1 to 0.6. Frames that differ by less than this count as fitting.
_MISFIT: Final = 0.1
# With wider steps, hardly any position is well exposed in three frames, so there is no majority.
_WIDE_STOPS: Final = 1.5
_ODD: Final = 1.4  # standard errors from which a frame loses its weight
_ROUNDS: Final = 3
_ENOUGH_WEIGHT: Final = 0.25  # fraction of a frame's weight that is enough for a mean
_LEAST: Final = 1e-12


def doubts(samples: Bytes, table: Float64, stops: Sequence[float]) -> tuple[float, ...]:
    """Return how much each frame differs from its neighbours, as a natural logarithm.

    The result is empty if the frames fit one another, cannot be compared or are too far apart to
    outvote one another.

    Args:
        samples: (K, N, 3) uint8. Encoded values at the same positions in all frames.
        table: (3, 256) or (K, 3, 256) float64. Linear light of each code.
        stops: True exposures, in stops.
    """
    if len(stops) < 3 or np.median(np.abs(np.diff(np.sort(stops)))) > _WIDE_STOPS:
        return ()
    tables = np.broadcast_to(table, (len(stops), 3, 256))
    order = sorted(range(len(stops)), key=lambda k: -stops[k])
    off = np.full(len(stops) - 1, np.nan)
    for pair, (bright, dark) in enumerate(pairwise(order)):
        both = _telling(samples[bright], tables[bright]) & _telling(samples[dark], tables[dark])
        places, channels = np.nonzero(both)
        if places.size >= _FEWEST:
            light = [tables[k][channels, samples[k, places, channels]] for k in (bright, dark)]
            ratio = np.log(light[1] / light[0]) + np.log(2.0) * (stops[bright] - stops[dark])
            off[pair] = np.quantile(np.abs(ratio), _USUAL)
    rows = np.flatnonzero(np.isfinite(off))
    if not rows.size or off[rows].max() < _MISFIT:
        return ()
    off = np.interp(np.arange(off.size), rows, off[rows])
    by_order = 0.5 * (np.append(off, off[-1]) + np.append(off[0], off))
    return tuple(float(by_order[order.index(k)]) for k in range(len(stops)))


def _telling(codes: Bytes, table: Float64) -> Bools:
    return np.asarray((codes >= _DARKEST) & (codes < clipped_code(table) - _UNDER_WHITE))


def agree(
    bands: Sequence[Pixels],
    lights: Sequence[FrameLight],
    trusts: Sequence[Float32 | None],
    doubt: Sequence[float],
    radiance: Sequence[Float32],
) -> None:
    """Replace merged light with the mean of the frames that agree, where they are not clipped.

    Args:
        bands: The same rows of each frame, (rows, W, 3) uint8 each.
        radiance: Red, green and blue planes of the merged light, (rows, W) float32 each, which are
            changed in place.
    """
    logs, says, sure = [], [], []
    weights = np.zeros(radiance[0].shape, np.float32)
    for pixels, light, trust, own in zip(bands, lights, trusts, doubt, strict=True):
        error = relative_error(light.tables.value) ** 2 + own**2
        precision = cv2.LUT(smallest_channel(pixels), (1.0 / error).astype(np.float32))
        use = cv2.LUT(largest_channel(pixels), light.tables.bright)
        use = use if trust is None else use * trust
        weights += use
        says.append(use * precision)
        sure.append(precision)
        logs.append(_logs(pixels, light))
    mean = _mean(logs, says)
    for _ in range(_ROUNDS):
        rest = []
        for log, say, precision in zip(logs, says, sure, strict=True):
            off = np.square(log - mean).mean(axis=-1) * precision
            rest.append(say / (np.float32(1.0) + off * np.float32(_ODD**-2)))
        mean = _mean(logs, rest)
    share = np.minimum(weights * np.float32(1.0 / _ENOUGH_WEIGHT), np.float32(1.0))
    for channel, plane in enumerate(radiance):
        plain = np.log(np.maximum(plane, np.float32(_LEAST)))
        plane[...] = np.exp(plain + share * (mean[..., channel] - plain))


def _logs(pixels: Pixels, light: FrameLight) -> Float32:
    """Return the logarithm of the light, (rows, W, 3)."""
    table = np.log(np.maximum(light.tables.value, np.float32(_LEAST)))
    return np.asarray(cv2.LUT(pixels, np.ascontiguousarray(table.T[None])), np.float32)


def _mean(logs: Sequence[Float32], says: Sequence[Float32]) -> Float32:
    total = np.maximum(np.add.reduce(says), np.float32(_LEAST))
    some = [log * say[..., None] for log, say in zip(logs, says, strict=True)]
    return np.asarray(np.add.reduce(some) / total[..., None], np.float32)
