"""``turnlight film``: list the styles seen in a video of a turning sitter."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.shared.arguments import add_json, argument, check_ending, check_outputs
from app.commands.shared.printing import ProgressPrinter, answer, fields, points, say, short
from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import ProbeError
from app.core.base.imaging.images import write_exr
from app.core.localization.features import build_index
from app.core.measure.film.comparison import GLANCES, beside, looks_mirrored
from app.core.measure.film.film import MOST_FRAMES, WIDTH, Film, FilmReader, flipped
from app.core.measure.film.frames import film_frames
from app.core.measure.film.movie_header import read_movie_header
from app.core.measure.options import MeasureOptions
from app.core.measure.ways import measure
from app.core.places.place_folder import light_at
from app.core.places.saved.saved_remarks import facts_of
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.core.text import tr
from app.words.measure.ways import beside_words, mirror_words
from app.words.phrases.directions import SHORT_SIDES
from app.words.phrases.turns import turn_words
from app.words.remarks import sentences
from app.words.why_out_of_reach import grade_words, reason_sentence

_EVERY_S: Final = 5.0  # seconds of video


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``film``."""
    parser.description = tr(
        "Read a film of one turn: the sitter turns on the spot in 20 to 60 seconds while "
        "the camera moves around with them. Shows when each style appeared and how far "
        "to turn from the first frame. The film stays on this computer and is not saved."
    )
    add = partial(argument, parser)
    add("video VIDEO", tr("the film: MP4, MOV, AVI, MKV or WebM"), type=Path)
    add("-o --output ENV", tr("also write the light seen on the face to an .exr file"), type=Path)
    add(
        "--place PLACE",
        tr("a place or its panorama to compare the film with"),
        type=Path,
    )
    add(
        "--mirrored",
        tr(
            "the film is mirrored, which is how some phones save selfies (default: decided by "
            "comparing it with the place)"
        ),
        action="store_true",
    )
    add("--live", tr("show results every few seconds while reading"), action="store_true")
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Read the video and print the styles it shows."""
    start_s = time.perf_counter()
    if args.output is not None:
        check_ending(args.output, (".exr",), tr("environments"))
        check_outputs([args.output], [args.video], (args.video.suffix,))
    pack, place = load_named_pack("generic"), None if args.place is None else light_at(args.place)
    index = None if place is None else build_index(place.display)
    fits = None
    if index is not None:
        # The place is a more reliable witness than the person who shot the video.
        fits = looks_mirrored(film_frames(args.video, GLANCES, WIDTH), index)
        say(*filter(None, [mirror_words(args.mirrored, fits)]))
    mirrored = args.mirrored if fits is None else fits
    if fits is None and not mirrored and read_movie_header(args.video).front_camera:
        say(
            tr(
                "This film was taken with a front camera. If text in it is backwards, add "
                "--mirrored."
            )
        )

    def frames_of(most: int) -> Iterator[tuple[float, float, Bytes]]:
        frames = film_frames(args.video, most, WIDTH)
        return flipped(frames) if mirrored else frames

    film = _live(frames_of(MOST_FRAMES), pack) if args.live else _measured(args.video, mirrored)
    say(*sentences(film.notes))
    if args.output is not None:
        write_exr(args.output, film.radiance)
    results = film.results(pack)
    other = None
    if place is not None:
        other = beside(film, results, frames_of(GLANCES), place, pack, index)
        say(beside_words(other))
    facts = {
        "place": None if other is None else asdict(other),
        "styles": [_facts(film, result) for result in results],
        **film.facts(),
        "mirrored": mirrored if args.mirrored or fits is not None else None,
        "notes": list(sentences(film.notes)),
        "remarks": {"notes": facts_of(film.notes)},
        "seconds": round(time.perf_counter() - start_s, 3),
    }
    return answer(args, facts, "\n".join(_line(film, result) for result in results))


def _measured(video: Path, mirrored: bool) -> Film:
    options = MeasureOptions(mirrored=mirrored)
    film = measure("film", [video], options, report=ProgressPrinter()).of(Film)
    assert film is not None
    return film


def _live(frames: Iterator[tuple[float, float, Bytes]], pack: StylePack) -> Film:
    """Read a video, printing interim results along the way."""
    due = _EVERY_S
    with FilmReader() as reader:
        for time_s, _, picture in frames:
            reader.add(time_s, picture)
            if time_s >= due:
                due = time_s + _EVERY_S
                say(_so_far(reader, pack, time_s))
        return reader.film()


def _so_far(reader: FilmReader, pack: StylePack, time_s: float) -> str:
    try:
        film = reader.film()
    except ProbeError as error:
        return tr("After {seconds:.0f} s: {message}", seconds=time_s, message=error.message)
    here = [one for one in film.results(pack) if one.attainable]
    best = sorted(here, key=lambda one: -one.match)[:3]
    there = ", ".join(f"{one.title} {film.clock_at(one.turn_refined_deg)}" for one in best)
    return tr("After {seconds:.0f} s: {words}", seconds=time_s, words=there or tr("no style yet"))


def _facts(film: Film, result: StyleResult) -> dict[str, Any]:
    frame = film.frame_at(result.turn_refined_deg)
    return {
        **fields(result, "name", "grade"),
        "match": short(result.match),
        "turn_deg": result.turn_deg,
        "turn_refined_deg": round(result.turn_refined_deg, 6),
        "time_s": round(float(film.times_s[frame]), 3),
        "heading_deg": round(wrap(float(film.headings.turns_deg[frame])), 3),
        "arc_deg": [round(end, 6) for end in result.arc_deg],
        "reason": reason_sentence(result.shortfall) if not result.attainable else None,
    }


def _line(film: Film, result: StyleResult) -> str:
    """Format a style with its turn and match."""
    grade = grade_words(result.grade, result.attainable)
    side = SHORT_SIDES.get(result.side, "")
    words = [f"{result.title:14} {side:14} {grade:10}", points(result.match).rjust(3)]
    if result.attainable:
        turn = result.turn_refined_deg
        words.append(tr("at {clock}, {turn} from the first frame", clock=film.clock_at(turn),
                        turn=turn_words(turn)))  # fmt: skip
    else:
        words.append(reason_sentence(result.shortfall))
    return "  ".join(words).rstrip()
