"""Films of a turn: real people relit by places in front of them, and the results.

The camera moves around the sitter at a metre and looks at them: a hand that trembles by 3 degrees
and 3 cm, uneven speed, automatic exposure, noise, 8 bits and a video's compression. Each person is
lit by the place at the camera's current turn; light from beyond 110 degrees, where no lamp of these
people was, is removed.

    python -m benchmarks.faces.filmed_turn --people FOLDER --places FOLDER [FOLDER ...]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import wrap
from app.core.base.atomic_files import atomic_write_text
from app.core.base.colour import srgb_encode
from app.core.environment.environment import read_environment, reduce, solid_angles
from app.core.localization.views import Lens, look
from app.core.measure.film.film import MOST_FRAMES, WIDTH, read_film
from app.core.measure.film.frames import film_frames
from app.core.styles.style_pack_file import load_named_pack
from benchmarks.faces.people import (
    BEHIND_DEG,
    directions,
    judged,
    lamp_shares,
    load_people,
    relit,
    texel_grid,
)
from benchmarks.truth.stock import ROOT

Floats: TypeAlias = NDArray[np.float64]
Floats32: TypeAlias = NDArray[np.float32]
Row: TypeAlias = dict[str, Any]
LENS: Final = Lens(62.0, (1280, 720))
FPS: Final = 4.0
SECONDS: Final = 32.0
AROUND_DEG: Final = 375.0
GREY: Final = np.array([0.2126, 0.7152, 0.0722])
_FACE_M: Final = 0.165  # width of the pictures
_SKIN: Final = 0.6  # reflectance of white in the pictures
_FINE: Final = 256  # turns at which a face is relit
_SHAKE_DEG: Final = 3.0
_SHAKE_M: Final = 0.03
_TREMBLE_S: Final = 0.6


def relit_faces(person: Path, light: Floats) -> Floats:
    """Return a face at all turns, (256, rows, columns), linear, under luminance (H, W)."""
    with np.load(person, allow_pickle=False) as known:
        images, lamps = known["images"] / 255.0, known["lamps_deg"].astype(np.float64)
    shape = (light.shape[0], light.shape[1])
    azimuth, elevation = texel_grid(shape)
    front = (np.abs(azimuth) <= BEHIND_DEG) * solid_angles(shape)[:, None]
    parts = _FINE // shape[1]
    lit: dict[int, Floats] = {}
    for part in range(parts):
        toward = directions(azimuth + 360.0 / _FINE * part, elevation).reshape(-1, 3)
        shares = lamp_shares(lamps, toward)
        for texels in range(shape[1]):
            mixed = shares.T @ (np.roll(light, -texels, axis=1) * front).ravel()
            lit[texels * parts + part] = np.tensordot(mixed, images, 1)
    return np.stack([lit[number] for number in range(_FINE)]) * _SKIN / math.pi


def filmed(
    panorama: Floats32, faces: Floats, seed: int, way: float = 1.0, around_deg: float = AROUND_DEG
) -> Iterator[tuple[float, NDArray[np.uint8]]]:
    """Film a turn; yield the true turn of the lens, deg, and the picture of each frame.

    Args:
        panorama: (H, W, 3). Linear radiance of the place.
        faces: Result of `relit_faces`.
        way: 1 clockwise, -1 counter-clockwise.
    """
    chance = np.random.default_rng(seed)
    count = round(SECONDS * FPS)
    start, phase = chance.uniform(0, 360), chance.uniform(0, 2 * math.pi)
    shake = np.stack([_slow(chance, count) for _ in range(5)])
    exposure = 0.0
    for number in range(count):
        share = number / count
        uneven = 0.03 * (math.sin(4 * math.pi * share + phase) - math.sin(phase))
        turn = start + way * around_deg * (share + uneven)
        aim, moved = _SHAKE_DEG * shake[:3, number], _SHAKE_M * shake[3:, number]
        face = _face_at(faces, turn)
        picture = _with_sitter(_background(panorama, turn + 180, aim), face, aim, moved)
        # As phones do: half for the face, half for the whole frame.
        whole = float(np.exp(np.log(picture @ GREY + 1e-5).mean()))
        wanted = math.log(0.25 / max(math.sqrt(whole * float(face.mean())), 1e-6))
        exposure = wanted if number == 0 else exposure + 0.5 * (wanted - exposure)
        shown = np.float32(math.exp(exposure)) * picture
        noise = chance.standard_normal(shown.shape, np.float32)
        shown += np.float32(0.008) * noise * np.sqrt(shown + np.float32(0.01))
        yield turn, np.round(255 * srgb_encode(np.clip(shown, 0, 1))).astype(np.uint8)


def _slow(chance: np.random.Generator, count: int) -> Floats:
    """Return a tremble between -1 and 1 with a period of a few tenths of a second."""
    width = max(round(_TREMBLE_S * FPS), 1)
    noise = np.convolve(chance.uniform(-1, 1, count + width), np.ones(width) / width, "valid")
    return np.asarray(noise[:count] / np.abs(noise).max())


def _face_at(faces: Floats, turn_deg: float) -> Floats:
    place = turn_deg % 360 / 360 * len(faces)
    below, share = int(place), place % 1
    one, other = faces[below % len(faces)], faces[(below + 1) % len(faces)]
    return np.asarray((1 - share) * one + share * other)


def _background(panorama: Floats32, azimuth: float, aim_deg: Floats) -> Floats32:
    half = Lens(LENS.fov_deg, (LENS.size[0] // 2, LENS.size[1] // 2))
    view = look(panorama, azimuth + float(aim_deg[0]), half, float(aim_deg[1]))
    turned = cv2.getRotationMatrix2D((half.size[0] / 2, half.size[1] / 2), float(aim_deg[2]), 1.0)
    rolled = cv2.warpAffine(view, turned, half.size, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(cv2.resize(rolled, LENS.size, interpolation=cv2.INTER_LINEAR), np.float32)


def _with_sitter(view: Floats32, face: Floats, aim_deg: Floats, moved_m: Floats) -> Floats32:
    """Draw a face with hair and shoulders in front of the background."""
    focal = LENS.focal_px
    scale = focal * _FACE_M / face.shape[1]
    across = LENS.size[0] / 2 - focal * math.tan(math.radians(aim_deg[0])) + focal * moved_m[0]
    down = LENS.size[1] / 2 - 20 + focal * math.tan(math.radians(aim_deg[1])) + focal * moved_m[1]
    roll = math.radians(float(aim_deg[2]))
    c, s = scale * math.cos(roll), scale * math.sin(roll)
    way = np.array([[c, s, 0], [-s, c, 0]])
    way[:, 2] = np.array([across, down]) - way[:, :2] @ (face.shape[1] / 2, face.shape[0] / 2)
    skin = float(np.percentile(face, 60))
    x, y = round(across), round(down)
    picture = view.copy()
    cv2.ellipse(picture, (x, y + 330), (230, 210), 0, 0, 360, (0.3 * skin,) * 3, -1)
    cv2.ellipse(picture, (x, y - 12), (96, 128), 0, 0, 360, (0.12 * skin,) * 3, -1)
    shown = cv2.warpAffine(face.astype(np.float32), way, LENS.size)
    mask = cv2.warpAffine(np.ones(face.shape, np.float32), way, LENS.size) > 0.99
    picture[mask] = np.asarray(shown)[mask, None]
    return picture


def encoded(pictures: Sequence[NDArray[np.uint8]], path: Path) -> None:
    """Write a video like a phone, 8 bits and compressed."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), FPS, LENS.size)
    for picture in pictures:
        writer.write(np.ascontiguousarray(picture[..., ::-1]))
    writer.release()


def judged_film(path: Path, turns_deg: Floats, truth: Floats, rows: Sequence[int]) -> list[Row]:
    """Read a film and compare its turns with the person's own curves.

    Args:
        turns_deg: True turn of the lens at each frame.
        truth: (styles, 64) match of the person's own pictures with their own target.
    """
    film = read_film(film_frames(path, MOST_FRAMES, WIDTH))
    results, found = film.results(load_named_pack("generic")), []
    for row, curve in zip(rows, truth, strict=True):
        turn = results[row].turn_refined_deg
        around = np.arange(len(curve)) * 360 / len(curve)
        own = np.interp((turns_deg[0] + turn) % 360, around, curve, period=360)
        frame = film.frame_at(turn)
        shot = round(float(film.times_s[frame]) * FPS)
        heading = turns_deg[0] + film.headings.turns_deg[frame]
        found.append(
            {
                "style": results[row].name,
                "grade": results[row].grade,
                "given_up": float(100 * (curve.max() - own) / np.ptp(curve)),
                "off_deg": abs(wrap(float(heading - turns_deg[shot]))),
            }
        )
    return found


def measured(people: Path, folders: Sequence[Path], per_place: int) -> dict[str, Any]:
    """Return all figures, and those of each film."""
    pack, known = load_named_pack("generic"), load_people(people)
    rows, files = judged(pack.styles), sorted(people.glob("*.npz"))
    films: list[dict[str, Any]] = []
    paths = [file for folder in folders for file in sorted(folder.glob("*.hdr"))]
    for number, place in enumerate(paths):
        environment = read_environment(place)
        light = reduce(environment).astype(np.float64) @ GREY
        for part in range(per_place):
            seed = number * per_place + part
            who = 5 * seed % len(files)
            faces = relit_faces(files[who], light)
            shots = list(filmed(environment.radiance, faces, seed, way=1.0 - 2.0 * (seed % 2)))
            truth = relit(known[who], light, pack.styles, rows).match
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "film.mp4"
                encoded([picture for _, picture in shots], path)
                turns = np.array([turn for turn, _ in shots])
                found = judged_film(path, turns, truth, rows)
            films.append({"place": place.stem, "person": known[who].name, "styles": found})
            print(place.stem, known[who].name, summary(films[-1:]), flush=True)
    return {"films": len(films), **summary(films), "each": films}


def summary(films: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the row of the table, over the turns offered."""
    offered = [one for film in films for one in film["styles"] if one["grade"] in ("yes", "soft")]
    lost = np.array([one["given_up"] for one in offered])
    off = np.array([one["off_deg"] for one in offered])
    return {
        "offered": len(offered),
        "within_3_percent": round(100.0 * float((lost <= 3).mean()), 1),
        "within_10_percent": round(100.0 * float((lost <= 10).mean()), 1),
        "mean_percent": round(float(lost.mean()), 2),
        "within_4_deg": round(100.0 * float((off <= 4).mean()), 1),
        "worst_deg": round(float(off.max(initial=0)), 1),
    }


def main() -> None:
    """Measure, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    shared = Path(os.environ.get("TURNLIGHT_SHARED", ROOT.parent / "shared" / "data"))
    parser.add_argument("--people", type=Path, default=shared / "people")
    parser.add_argument("--places", type=Path, nargs="*", default=[shared / "hdri"])
    parser.add_argument("--per-place", type=int, default=2)
    parser.add_argument("-o", type=Path)
    args = parser.parse_args()
    if not args.people.is_dir():
        print("People: not present.")
        return
    started = time.monotonic()
    facts = measured(args.people, args.places, args.per_place)
    facts["seconds"] = round(time.monotonic() - started, 1)
    print(json.dumps({key: value for key, value in facts.items() if key != "each"}, indent=1))
    if args.o:
        atomic_write_text(args.o, json.dumps(facts, indent=1) + "\n")


if __name__ == "__main__":
    main()
