"""Accuracy of merged brackets, against OpenCV and colour-hdri on the same frames.

    python benchmarks/light/merge_accuracy.py [FOLDER] [--json FILE] [--memorial FOLDER]

For every environment of a folder (the bundled scenes by default) a simulated camera shoots the
paper's three frames and a full bracket: sRGB curve, shot and read noise, JPEG 95. Every method
merges the same decoded frames; the truth is the environment itself, at the frames' own size. The
error is that of the luminance and of the three channels, over all pixels that are unclipped (worst
channel) in at least one frame and not black in all of them. The peers' radiance is scaled to the
best common factor first (by the median ratio); ours is used as it is.

Needs colour-hdri, which is not installed with the program.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from app.core.base.colour import luminance, srgb_decode
from app.core.base.paths import resources
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.bracket.curve.response import Response
from app.core.measure.bracket.half_size import anchors
from app.core.measure.bracket.merge import SIZE, merge
from app.core.measure.bracket.weighting import doubts
from app.core.measure.read.frame import Bracket, Exposure, Frame, MergedLight
from app.core.measure.read.pixels import open_frames
from app.devices.simulated.cameras import SENSORS
from app.devices.simulated.optics import meter
from benchmarks.light.memorial_map import read_map
from benchmarks.light.shots.brackets import enlarged, make_bracket

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from app.core.measure.bracket.weighting import Scheme
    from app.devices.simulated.cameras import CameraModel

    Bytes = NDArray[np.uint8]
    Float64 = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]


BRACKETS = {"paper": (2.0, 0.0, -2.0), "full": (2.0, 0.0, -2.0, -4.0, -6.0, -8.0, -10.0)}
CLIPPED = 254
SCHEMES: Final[tuple[Scheme, ...]] = ("noise", "reinhard")


RESPONSE = Response(
    "sRGB", np.repeat(srgb_decode(np.arange(256) / 255.0).astype(np.float64)[None], 3, axis=0)
)
"""The true response of these brackets."""


def main() -> None:
    parser = argparse.ArgumentParser(description="accuracy of merging, against other programs")
    parser.add_argument("folder", nargs="?", type=Path, default=resources() / "demo" / "scenes")
    parser.add_argument("--camera", default="V", help="model to simulate")
    parser.add_argument("--width", type=int, default=2048, help="columns of the frames")
    parser.add_argument(
        "--whole", action="store_true", help="ours from the camera's full size to 2048 columns, too"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", nargs="*", help="only these")
    parser.add_argument("--memorial", type=Path, help="folder of the memorial church bracket")
    parser.add_argument("--json", type=Path, help="file for the results")
    options = parser.parse_args()
    result: dict[str, Any] = {"scenes": scenes(options)}
    if options.memorial:
        result["memorial"] = memorial(options.memorial)
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def scenes(options: argparse.Namespace) -> list[dict[str, Any]]:
    """Measure every scene with every bracket, printing a line for each method."""
    files = sorted(p for p in options.folder.iterdir() if p.suffix in (".exr", ".hdr"))
    rows = []
    print(f"{'scene':18}{'bracket':9}{'method':22}{'luminance, %':>16}{'channels, %':>16}")
    for file in files:
        environment = read_environment(file)
        if options.scenes and environment.name not in options.scenes:
            continue
        for name, stops in BRACKETS.items():
            with tempfile.TemporaryDirectory() as folder:
                row = one_bracket(environment.radiance, stops, Path(folder), options)
            rows.append({"scene": environment.name, "bracket": name, **row})
            for method, error in row["methods"].items():
                print(
                    f"{environment.name:18}{name:9}{method:22}"
                    f"{error['median']:8.2f}{error['p95']:8.2f}"
                    f"{error['channel_median']:8.2f}{error['channel_p95']:8.2f}",
                    flush=True,
                )
    print(verdict(rows))
    return rows


def one_bracket(
    radiance: NDArray[np.float32],
    stops: Sequence[float],
    folder: Path,
    options: argparse.Namespace,
) -> dict[str, Any]:
    """Shoot one bracket and let every method merge it."""
    camera = SENSORS[options.camera]
    shape = (options.width // 2, options.width)
    bracket = shoot(radiance, camera, stops, shape, folder, options.seed)
    truth = np.asarray(enlarged(radiance, shape, smooth=True), np.float64)
    pictures = [decoded(frame.path) for frame in bracket.frames]
    good = usable(pictures) & (truth.min(axis=-1) > 0.0)
    errors: dict[str, dict[str, float]] = {}
    for scheme in SCHEMES:
        errors[scheme] = error_of(in_cd_m2(ours(bracket, scheme, None)), truth, good, fit=False)
    times = np.exp2(np.array(bracket.stops, np.float32))
    for name, peer in PEERS.items():
        errors[name] = error_of(peer(pictures, times), truth, good, fit=True)
    if options.whole:
        whole = shoot(radiance, camera, stops, camera.shape, folder, options.seed)
        merged = ours(whole, "noise", SIZE)
        large = np.asarray(enlarged(radiance, camera.shape, smooth=True))
        truth = reduce_radiance(large, SIZE).astype(np.float64)
        good = (merged.clipped == 0.0) & (merged.dark == 0.0) & (truth.min(axis=-1) > 0.0)
        name = f"noise from {camera.shape[1]}"
        errors[name] = error_of(in_cd_m2(merged), truth, good, fit=False)
    return {"usable": float(good.mean()), "methods": errors}


def shoot(
    radiance: NDArray[np.float32],
    camera: CameraModel,
    stops: Sequence[float],
    shape: tuple[int, int],
    folder: Path,
    seed: int,
) -> Bracket:
    """Let the simulated camera write a bracket."""
    metered = meter(radiance, camera)
    shots = [
        Exposure(metered.shutter_s * 2.0**stop, metered.iso, metered.aperture) for stop in stops
    ]
    files = make_bracket(radiance, camera, shots, seed=seed, shape=shape, smooth=True)
    frames = []
    for index, (data, shot) in enumerate(zip(files, shots, strict=True)):
        path = folder / f"{shape[1]}_{index}.jpg"
        path.write_bytes(data)
        frames.append(Frame(path, shape, exposure=shot))
    return Bracket(tuple(frames), tuple(shot.ev for shot in shots))


def decoded(path: Path) -> Bytes:
    """Decode with OpenCV, RGB."""
    pixels = cv2.imread(str(path))
    assert pixels is not None, path
    return np.ascontiguousarray(pixels[..., ::-1], np.uint8)


def usable(pictures: Sequence[Bytes]) -> NDArray[np.bool_]:
    """Return a mask of pixels that are unclipped in some frame, and above black in some frame."""
    largest = [picture.max(axis=-1) for picture in pictures]
    unclipped = np.any([plane < CLIPPED for plane in largest], axis=0)
    return np.asarray(unclipped & np.any([plane > 0 for plane in largest], axis=0))


def ours(bracket: Bracket, scheme: Scheme, size: tuple[int, int] | None) -> MergedLight:
    """Merge like the program."""
    # As in `measure.bracket.merging`: decode at half size where the result is reduced anyway.
    halves = [not whole for whole in anchors(bracket.stops)] if size else ()
    with open_frames(bracket, halves=halves) as stack:
        return merge(stack, RESPONSE, stack.stops, scheme=scheme, size=size)


def in_cd_m2(merged: MergedLight) -> Float64:
    """Return the radiance in cd/m2 of the photographed light."""
    assert merged.cd_m2 is not None
    return merged.radiance.astype(np.float64) * merged.cd_m2


def true_response() -> NDArray[np.float32]:
    """Return the sRGB curve for OpenCV, whose Debevec takes its logarithm."""
    curve = np.maximum(RESPONSE.table.T, 0.5 * RESPONSE.table[0, 1])
    return np.asarray(curve[:, None, :], np.float32)


def debevec(pictures: Sequence[Bytes], times: NDArray[np.float32]) -> Float64:
    return np.asarray(
        cv2.createMergeDebevec().process(list(pictures), times, true_response()), np.float64
    )


def robertson(pictures: Sequence[Bytes], times: NDArray[np.float32]) -> Float64:
    return np.asarray(
        cv2.createMergeRobertson().process(list(pictures), times, true_response()), np.float64
    )


def debevec_calibrated(pictures: Sequence[Bytes], times: NDArray[np.float32]) -> Float64:
    response = cv2.createCalibrateDebevec(samples=200).process(list(pictures), times)
    return np.asarray(cv2.createMergeDebevec().process(list(pictures), times, response), np.float64)


def robertson_calibrated(pictures: Sequence[Bytes], times: NDArray[np.float32]) -> Float64:
    # A quarter of the size: calibrating at full size takes minutes and gains nothing.
    small = [np.ascontiguousarray(picture[::4, ::4]) for picture in pictures]
    response = cv2.createCalibrateRobertson().process(small, times)
    return np.asarray(
        cv2.createMergeRobertson().process(list(pictures), times, response), np.float64
    )


def colour_hdri(pictures: Sequence[Bytes], times: NDArray[np.float32]) -> Float64:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour_hdri as peer

        stack = peer.ImageStack()
        # It treats the first frame as the darkest.
        for picture, t in zip(pictures[::-1], times[::-1], strict=True):
            stack.append(
                peer.Image(data=picture / 255.0, metadata=peer.Metadata(1.0, float(t), 100.0))
            )
        merged = peer.image_stack_to_HDRI(
            stack,
            weighting_function=peer.weighting_function_Debevec1997,
            camera_response_functions=RESPONSE.table.T,
        )
    return np.asarray(merged, np.float64)


PEERS: dict[str, Callable[[Sequence[Bytes], NDArray[np.float32]], Float64]] = {
    "debevec": debevec,
    "debevec-calibrated": debevec_calibrated,
    "robertson": robertson,
    "robertson-calibrated": robertson_calibrated,
    "colour-hdri": colour_hdri,
}


def error_of(
    radiance: Float64, truth: Float64, good: NDArray[np.bool_], *, fit: bool
) -> dict[str, float]:
    """Return relative errors in percent."""
    mine, wanted = radiance[good], truth[good]
    if fit:
        mine = mine / np.median(luminance(mine) / luminance(wanted))
    light = np.abs(luminance(mine) - luminance(wanted)) / luminance(wanted)
    channels = np.abs(mine - wanted) / wanted
    return {
        "median": 100.0 * float(np.median(light)),
        "p95": 100.0 * float(np.percentile(light, 95)),
        "channel_median": 100.0 * float(np.median(channels)),
        "channel_p95": 100.0 * float(np.percentile(channels, 95)),
    }


def verdict(rows: Sequence[dict[str, Any]]) -> str:
    """Report the missed targets."""
    lines = []
    for row in rows:
        mine = row["methods"]["noise"]
        for key in ("median", "p95"):
            best = min(row["methods"][name][key] for name in PEERS)
            limit = 1.0 if key == "median" else 4.0
            if mine[key] > limit or mine[key] > best:
                lines.append(
                    f"{row['scene']} {row['bracket']}: {key} {mine[key]:.2f}, best peer {best:.2f}"
                )
    return "\n".join(lines) if lines else "Within the bars and best everywhere."


def memorial(folder: Path) -> dict[str, float]:
    """Merge the memorial church bracket and compare with the published radiance map.

    These are scans of film with unknown response: ours is recovered from the bracket, like the
    peers'. The error is the root mean square of the natural logarithm's difference after the best
    common scale, over the three channels of all pixels inside the pictures' common area (shifted
    borders are marked by pure blue) whose published value is not 0.
    """
    from app.core.measure.bracket.curve.response import choose_response

    listed = [
        line.split()
        for line in (folder / "image_list.txt").read_text().splitlines()
        if line.startswith("memorial")
    ]
    paths = [folder / words[0] for words in listed]
    seconds = np.array([float(words[1]) for words in listed], np.float32)
    pictures = [decoded(path) for path in paths]
    shape = (pictures[0].shape[0], pictures[0].shape[1])
    frames = tuple(
        Frame(path, shape, exposure=Exposure(float(t), known=False))
        for path, t in zip(paths, seconds, strict=True)
    )
    bracket = Bracket(frames, tuple(frame.exposure.ev for frame in frames if frame.exposure))
    truth, known = read_map(folder / "memorial.hdr")
    inside = ~np.any([border(picture) for picture in pictures], axis=0)
    inside &= known & (truth > 0.0).all(axis=-1)
    rows = {}
    with open_frames(bracket) as stack:
        for mode in ("auto", "srgb", "recover"):
            chosen = choose_response(stack.samples, stack.stops, mode)
            for scheme in SCHEMES:
                table = chosen.response.table
                sure = chosen.response.name == "sRGB"
                plain = sure or scheme != "noise"
                merged = merge(
                    stack,
                    chosen.response,
                    chosen.stops,
                    scheme=scheme,
                    exposures_known=sure,
                    doubts=() if plain else doubts(stack.samples, table, chosen.stops),
                    size=None,
                )
                name = f"{scheme}, {mode}"
                rows[name] = log_error(merged.radiance.astype(np.float64), truth, inside)
    for name, peer in PEERS.items():
        rows[name] = log_error(peer(pictures, seconds), truth, inside)
    print("memorial church, log-RMSE")
    for name, error in rows.items():
        print(f"{name:24}{error:9.4f}")
    return rows


def border(picture: Bytes) -> NDArray[np.bool_]:
    """Return the pixels that the scans' registration left empty, and their neighbours."""
    blue = (picture[..., 2] > 200) & (picture[..., :2].max(axis=-1) < 40)
    return cv2.dilate(blue.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def log_error(radiance: Float64, truth: Float64, inside: NDArray[np.bool_]) -> float:
    """Return the RMS difference of the logarithms, after the best common scale."""
    ratio = np.log(np.maximum(radiance[inside], 1e-12)) - np.log(truth[inside])
    return float(np.std(ratio))


if __name__ == "__main__":
    started = time.perf_counter()
    main()
    print(f"{time.perf_counter() - started:.0f} s")
