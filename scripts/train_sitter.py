"""Teach the network of `app.core.localization.sitter` to find heads, and write ``heads.onnx``.

Usage::

    pip install jax onnx
    python scripts/sitter_people.py ...
    python scripts/train_sitter.py --people people --places PANORAMA... --minutes 30 -o heads.onnx

People from `scripts/sitter_people.py` are put in front of views of the panoramas, in grey, and
disturbed as a phone disturbs its pictures. Each cell of 8 x 8 pixels learns whether the middle of a
head lies in it (focal loss: T. Lin et al., ICCV 2017), how far from the cell's middle it is, and
how tall the head is. It learns by Adam with a cosine schedule, for as long as it is told to.

Run it several times, each time from the last network (``--start``): then three pictures in five are
made of places where that one saw heads that are none. What ships was learnt in six runs, some
12,000 steps in all, from 940 pictures of people.
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.environment.environment import read_environment
from app.core.localization.sitter import heads_in, prepared
from app.core.localization.views import Lens, look
from app.core.measure.finish.display import display_panorama

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Chance: TypeAlias = np.random.Generator

SIDE: Final = 96
CELLS: Final = SIDE // 8
BATCH: Final = 48
VIEWS: Final = 36  # of each panorama
HARD_SIDE: Final = 120
HARD_SHARE: Final = 0.6
LAYERS: Final = (
    (5, 1, 8, 2, 1), (3, 8, 24, 2, 1), (3, 24, 48, 2, 1), (3, 48, 64, 1, 1),
    (3, 64, 64, 1, 2), (1, 64, 64, 1, 1), (1, 64, 4, 1, 1),
)  # fmt: skip
"""Side of the kernel, channels, features, stride, dilation."""


@dataclass(frozen=True)
class Material:
    """What pictures are made of.

    Attributes:
        places: (N, H, W) uint8. Views without people, grey.
        people: (M, 224, 160, 2) uint8. Grey and coverage.
        labels: (M, 3) float32. Column of the middle of the head, rows of crown and chin, pixels.
        hard: (K, 120, 120) uint8. Parts of places that were taken for heads; possibly none.
    """

    places: Bytes
    people: Bytes
    labels: Float32
    hard: Bytes


def read_places(files: list[Path]) -> Bytes:
    """Take views of panoramas in all directions."""
    chance, views = np.random.default_rng(1), []
    for file in files:
        shown = display_panorama(np.asarray(read_environment(file).radiance, np.float32), 0.0)
        for _ in range(VIEWS):
            lens = Lens(float(chance.uniform(35, 90)), (384, 288))
            azimuth, pitch = float(chance.uniform(0, 360)), float(chance.normal(-3, 14))
            views.append(cv2.cvtColor(look(shown, azimuth, lens, pitch), cv2.COLOR_RGB2GRAY))
    return np.array(views, np.uint8)


def read_people(folders: list[Path]) -> tuple[Bytes, Float32]:
    """Read what `scripts/sitter_people.py` wrote."""
    pictures, labels = [], []
    for file in sorted(file for folder in folders for file in folder.glob("p*.npz")):
        with np.load(file) as stored:
            pictures.append(stored["i"])
            labels.append(stored["l"])
    colours = np.concatenate(pictures)
    grey = colours[..., :3].astype(np.float32) @ np.array([0.299, 0.587, 0.114], np.float32)
    both = np.stack([grey, colours[..., 3].astype(np.float32)], -1)
    return both.astype(np.uint8), np.concatenate(labels)


def read_hard(places: Bytes, start: Path) -> Bytes:
    """Collect what a network takes for heads in places without people."""
    network = cv2.dnn.readNetFromONNX(str(start), cv2.dnn.ENGINE_CLASSIC)
    chance, found = np.random.default_rng(77), []
    for place in np.repeat(places, 5, axis=0):
        scale = float(np.exp(chance.uniform(np.log(0.42), np.log(1.6))))
        how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
        sized = np.asarray(cv2.resize(place, None, fx=scale, fy=scale, interpolation=how), np.uint8)
        shown = _disturbed(sized.astype(np.float32) / 255.0, chance)
        for head in heads_in(shown, network)[:5]:
            column = int(np.clip(head.x - HARD_SIDE / 2, 0, sized.shape[1] - HARD_SIDE))
            row = int(np.clip(head.y - HARD_SIDE / 2, 0, sized.shape[0] - HARD_SIDE))
            found.append(sized[row : row + HARD_SIDE, column : column + HARD_SIDE])
    return np.array(found, np.uint8).reshape(-1, HARD_SIDE, HARD_SIDE)


def _place(material: Material, chance: Chance, hard: bool) -> Float32:
    if hard:
        whole = material.hard[chance.integers(len(material.hard))]
        cut = int(chance.integers(80, HARD_SIDE + 1))
    else:
        whole = material.places[chance.integers(len(material.places))]
        cut = min(int(SIDE / np.exp(chance.uniform(np.log(0.36), np.log(1.6)))), whole.shape[0])
    y, x = chance.integers(whole.shape[0] - cut + 1), chance.integers(whole.shape[1] - cut + 1)
    how = cv2.INTER_AREA if cut > SIDE else cv2.INTER_LINEAR
    part = cv2.resize(whole[y : y + cut, x : x + cut], (SIDE, SIDE), interpolation=how)
    grey = part.astype(np.float32) / 255.0
    grey = grey[:, ::-1] if chance.random() < 0.5 else grey
    return np.asarray(grey ** np.exp(chance.normal(0, 0.3)), np.float32)


def _put(
    grey: Float32, material: Material, head: tuple[float, float, float], chance: Chance
) -> Float32:
    """Put somebody in front, with the head at a place (x, y) and of a height."""
    x, y, tall = head
    who = chance.integers(len(material.people))
    person, label = material.people[who], material.labels[who]
    scale = tall / (label[2] - label[1])
    angle, side = np.radians(chance.normal(0, 5)), -1 if chance.random() < 0.5 else 1
    turn = np.array([[np.cos(angle) * side, -np.sin(angle)], [np.sin(angle) * side, np.cos(angle)]])
    middle = np.array([label[0], (label[1] + label[2]) / 2])
    move = np.c_[scale * turn, np.array([x, y]) - scale * turn @ middle]
    if scale < 0.7:
        size = int(np.ceil(0.7 / scale))
        person = np.asarray(cv2.blur(person, (size, size)), np.uint8)
    moved = cv2.warpAffine(
        person, move, (SIDE, SIDE), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    cover = moved[..., 1].astype(np.float32) / 255.0
    cover[: max(0, int(y - tall * 1.3))] = 0.0
    front = (moved[..., 0].astype(np.float32) / 255.0) ** np.exp(chance.normal(0, 0.35))
    return np.asarray(grey * (1 - cover) + front * np.exp(chance.normal(0, 0.35)) * cover)


def _disturbed(grey: Float32, chance: Chance) -> Bytes:
    light = np.clip(grey, 0, 1) ** 2.2 * 2 ** chance.normal(0, 1)
    grey = np.asarray(np.clip(light, 0, 1) ** (1 / 2.2), np.float32)
    if chance.random() < 0.5:
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), chance.uniform(0.3, 1.3)), np.float32)
    if chance.random() < 0.15:
        size = int(chance.integers(2, 6))
        along = np.zeros((size, size), np.float32)
        along[size // 2] = 1 / size
        grey = np.asarray(cv2.filter2D(grey, -1, along), np.float32)
    grey = grey + chance.normal(0, chance.uniform(0, 0.035), grey.shape).astype(np.float32)
    codes = np.asarray(np.clip(grey * 255, 0, 255), np.uint8)
    if chance.random() < 0.4:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(chance.integers(30, 90))]
        codes = np.asarray(cv2.imdecode(cv2.imencode(".jpg", codes, quality)[1], 0), np.uint8)
    return codes


def sample(material: Material, chance: Chance) -> tuple[Float32, Float32]:
    """Make a picture (96, 96) and its answers (12, 12, 5): is a head, x, y, size, counts."""
    hard = len(material.hard) > 0 and bool(chance.random() < HARD_SHARE)
    grey = _place(material, chance, hard)
    wanted = 0 if chance.random() < (0.55 if hard else 0.25) else 2 if chance.random() < 0.12 else 1
    heads: list[tuple[float, float, float]] = []
    for _ in range(wanted):
        tall = float(np.exp(chance.uniform(np.log(11), np.log(64))))
        head = float(chance.uniform(4, SIDE - 4)), float(chance.uniform(0.4 * tall, SIDE - 4)), tall
        if heads and abs(head[0] - heads[0][0]) < 0.7 * (tall + heads[0][2]):
            continue
        grey = _put(grey, material, head, chance)
        heads.append(head)
    if chance.random() < 0.25:  # somebody whose head is above the picture
        tall, x = float(chance.uniform(15, 60)), float(chance.uniform(0, SIDE))
        if not heads or abs(x - heads[0][0]) > tall + heads[0][2]:
            grey = _put(grey, material, (x, -0.65 * tall, tall), chance)
    return prepared(_disturbed(grey, chance)), _wanted(heads)


def _wanted(heads: list[tuple[float, float, float]]) -> Float32:
    middles = (np.arange(CELLS) + 0.5) * 8
    answers = np.zeros((CELLS, CELLS, 5), np.float32)
    answers[..., 4] = 1
    for x, y, tall in heads:
        away = np.hypot(middles[None] - x, middles[:, None] - y) / tall
        answers[(away < 0.62) & (answers[..., 0] == 0), 4] = 0
        if 14 <= tall <= 46:
            here = (away < 0.3) | (away == away.min())
            row, column = np.nonzero(here)
            answers[here, 0] = answers[here, 4] = 1
            answers[here, 1] = (x - middles[column]) / 8
            answers[here, 2] = (y - middles[row]) / 8
            answers[here, 3] = np.log(tall / 26)
    return answers


def _work(queue: Any, folders: list[Path], places: Bytes, hard: Bytes, seed: int) -> None:
    cv2.setNumThreads(1)
    chance = np.random.default_rng(seed)
    material = Material(places, *read_people(folders), hard)
    while True:
        made = [sample(material, chance) for _ in range(BATCH)]
        queue.put(tuple(np.array(part) for part in zip(*made, strict=True)))


def begun(start: Path | None) -> list[tuple[Any, Any]]:
    """Return random layers, or those of a file."""
    if start is not None:
        onnx = importlib.import_module("onnx")
        stored = {a.name: onnx.numpy_helper.to_array(a) for a in onnx.load(start).graph.initializer}
        return [
            (np.float32(stored[f"w{k}"].transpose(2, 3, 1, 0)), np.float32(stored[f"b{k}"]))
            for k in range(len(LAYERS))
        ]
    chance, layers = np.random.default_rng(0), []
    for size, channels, features, _, _ in LAYERS:
        spread = np.sqrt(2 / (size * size * channels))
        weights = chance.normal(0, spread, (size, size, channels, features))
        layers.append((weights.astype(np.float32), np.zeros(features, np.float32)))
    last = layers[-1][0] * np.float32(0.1)
    layers[-1] = last, np.array([-4, 0, 0, 0], np.float32)
    return layers


def make_step(jax: Any) -> Any:
    """Return the compiled function that learns from one batch."""
    jnp = jax.numpy

    def net(layers: Any, x: Any) -> Any:
        for k, ((w, b), (size, _, _, stride, gap)) in enumerate(zip(layers, LAYERS, strict=True)):
            edge = gap * (size - 1) // 2
            x = b + jax.lax.conv_general_dilated(
                x, w, (stride, stride), [(edge, edge)] * 2, rhs_dilation=(gap, gap),
                dimension_numbers=("NHWC", "HWIO", "NHWC"),
            )  # fmt: skip
            x = jax.nn.relu(x) if k < len(LAYERS) - 1 else x
        return x

    def loss(layers: Any, pictures: Any, wanted: Any) -> Any:
        got, is_head = net(layers, pictures[..., None]), wanted[..., 0]
        z, likely = got[..., 0], jax.nn.sigmoid(got[..., 0])
        yes = -2 * jax.nn.log_sigmoid(z) * (1 - likely) ** 2
        focal = jnp.where(is_head > 0, yes, -jax.nn.log_sigmoid(-z) * likely**2)
        off = jnp.abs(got[..., 1:4] - wanted[..., 1:4])
        off = jnp.where(off < 0.5, off * off, off - 0.25) * jnp.array([1.5, 0.7, 1.5])
        total = 2 * jnp.sum(focal * wanted[..., 4]) + jnp.sum(off.sum(-1) * is_head)
        return total / (jnp.sum(is_head) + 1)

    def step(layers: Any, m: Any, v: Any, batch: Any, rate: Any, k: Any) -> Any:
        value, slope = jax.value_and_grad(loss)(layers, *batch)
        m = jax.tree.map(lambda a, b: 0.9 * a + 0.1 * b, m, slope)
        v = jax.tree.map(lambda a, b: 0.999 * a + 0.001 * b * b, v, slope)

        def moved(a: Any, b: Any, c: Any) -> Any:
            return a - rate * (
                (b / (1 - 0.9**k)) / (jnp.sqrt(c / (1 - 0.999**k)) + 1e-8) + 1e-4 * a
            )

        return jax.tree.map(moved, layers, m, v), m, v, value

    return jax.jit(step)


def learn(queue: Any, layers: Any, minutes: float, rate: float) -> Any:
    """Learn for some minutes and return the layers."""
    jax = importlib.import_module("jax")
    step = make_step(jax)
    m = v = jax.tree.map(lambda a: 0 * a, layers)
    start, k, recent = time.monotonic(), 0, 0.0
    while (share := (time.monotonic() - start) / (60 * minutes)) < 1:
        k += 1
        now = rate * min(1, k / 100) * (0.5 + 0.5 * np.cos(np.pi * share)) + 2e-5
        layers, m, v, value = step(layers, m, v, queue.get(), now, k)
        recent = 0.99 * recent + 0.01 * float(value)
        if k % 100 == 0:
            sys.stdout.write(f"{k} steps, {share:.0%}, loss {recent:.3f}\n")
            sys.stdout.flush()
    return layers


def write(out: Path, layers: Any) -> None:
    """Write layers, (k, k, channels, features) and (features,), as ONNX with half floats."""
    onnx = importlib.import_module("onnx")
    node, floats = onnx.helper.make_node, onnx.TensorProto.FLOAT
    nodes, stored, value = [], [], "grey"
    for k, ((w, b), (size, _, _, stride, gap)) in enumerate(zip(layers, LAYERS, strict=True)):
        for name, array in ((f"w{k}", np.transpose(w, (3, 2, 0, 1))), (f"b{k}", np.asarray(b))):
            half = np.ascontiguousarray(array, np.float16)
            stored.append(onnx.numpy_helper.from_array(half, name))
            nodes.append(node("Cast", [name], [f"{name}f"], to=floats))
        last, edge = k == len(LAYERS) - 1, gap * (size - 1) // 2
        there = "answers" if last else f"y{k}"
        nodes.append(
            node("Conv", [value, f"w{k}f", f"b{k}f"], [there], kernel_shape=[size] * 2,
                 strides=[stride] * 2, dilations=[gap] * 2, pads=[edge] * 4)
        )  # fmt: skip
        if not last:
            value = f"r{k}"
            nodes.append(node("Relu", [there], [value]))
    grey = onnx.helper.make_tensor_value_info("grey", floats, [1, 1, "rows", "columns"])
    answers = onnx.helper.make_tensor_value_info("answers", floats, [1, 4, "down", "across"])
    graph = onnx.helper.make_graph(nodes, "heads", [grey], [answers], stored)
    opset = onnx.helper.make_opsetid("", 13)
    onnx.save(onnx.helper.make_model(graph, opset_imports=[opset], ir_version=8), out)


def main(argv: list[str] | None = None) -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Teach the network that finds heads.")
    parser.add_argument("--people", type=Path, nargs="+", required=True, help="folders")
    parser.add_argument("--places", type=Path, nargs="+", required=True, help="panoramas")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--start", type=Path, help="go on from this network")
    parser.add_argument("-o", "--out", type=Path, required=True)
    args = parser.parse_args(argv)
    places = read_places(args.places)
    none = np.zeros((0, HARD_SIDE, HARD_SIDE), np.uint8)
    hard = none if args.start is None else read_hard(places, args.start)
    context = multiprocessing.get_context("spawn")
    queue = context.Queue(12)
    seed = int(time.time())
    worker = context.Process(
        target=_work, args=(queue, args.people, places, hard, seed), daemon=True
    )
    worker.start()
    layers = learn(queue, begun(args.start), args.minutes, args.rate)
    worker.terminate()
    write(args.out, layers)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
