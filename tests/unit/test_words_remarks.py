"""Remarks: each has words, and each comes back from a file as it was."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from enum import Enum
from inspect import getmembers, isclass
from pathlib import Path
from types import UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest

from app.core.base.remarks import PlainRemark, Remark
from app.core.measure.finish.remarks import ClippingSafe, RoughTurns, SunRestored
from app.core.places import remarks as place_remarks
from app.core.places.saved.saved_remarks import KINDS, facts_of, remarks_of
from app.core.storage.json_file import Unfit
from app.words.remarks import SENTENCES, remark_words

OF_PLACES = [
    kind
    for _, kind in getmembers(place_remarks, isclass)
    if issubclass(kind, Remark) and kind is not Remark
]
# Numbers of lists that belong together, and words that name something.
SPECIAL = {("LensesApart", "isos"): (64.0, 80.0), ("LensesApart", "shutters_s"): (0.1, 0.2)} | {
    ("CirclesStitched", "front"): "left",
    ("CirclesStitched", "up_deg"): 90.0,
    ("LostPart", "name"): "results",
}


def sample(hint: Any, owner: str = "", name: str = "") -> Any:
    if (owner, name) in SPECIAL:
        return SPECIAL[owner, name]
    arguments = get_args(hint)
    if get_origin(hint) is Literal:
        return arguments[0]
    if get_origin(hint) is tuple:
        return (sample(arguments[0]), sample(arguments[0]))
    if isinstance(hint, UnionType):
        return sample(arguments[0])
    if is_dataclass(hint) and isinstance(hint, type):
        hints = get_type_hints(hint)
        return hint(
            **{
                each.name: sample(hints[each.name], hint.__name__, each.name)
                for each in fields(hint)
            }
        )
    if isclass(hint) and issubclass(hint, Enum):
        return next(iter(hint))
    return {str: "R1.JPG", int: 2, float: 0.25, bool: True, Path: Path("places")}[hint]


@pytest.mark.parametrize("kind", [*KINDS.values(), *OF_PLACES], ids=lambda kind: kind.__name__)
def test_a_remark_is_written_with_its_fields(kind: type[Remark]) -> None:
    words = remark_words(sample(kind))
    assert words.endswith((".", "R1.JPG"))  # An error's message ends as it came.
    assert "{" not in words


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.__name__)
def test_a_remark_comes_back_from_a_file(kind: type[Remark]) -> None:
    remark = sample(kind)
    assert remarks_of(json.loads(json.dumps(facts_of([remark])))) == (remark,)


SAVED = Path(__file__).parents[1] / "data" / "saved-remarks.json"


def test_remarks_of_saved_places_are_still_read() -> None:
    """One of each kind, as a place of 0.1.0 holds it: a renamed class or field would lose it."""
    saved = json.loads(SAVED.read_text(encoding="utf-8"))
    remarks = remarks_of(saved)
    assert facts_of(remarks) == saved
    assert {each["kind"] for each in saved if isinstance(each, dict)} == {
        name for name, kind in KINDS.items() if kind is not PlainRemark
    }


def test_every_sentence_belongs_to_a_remark() -> None:
    assert set(SENTENCES) == {PlainRemark, *KINDS.values(), *OF_PLACES}


def test_sentences_of_earlier_files_are_read() -> None:
    sun = (
        "The sun (lamp A, 38° high) is clipped in every frame. It was given the 83 klx that it has "
        "at that height under a clear sky (IES RP-21); 70 to 95 klx are likely."
    )
    safe = "No style's turn depends on what is clipped, nor whether it is in reach."
    turns = "The turn depends on what is clipped: left-loop, butterfly."
    assert remarks_of(["Frame 2 moved.", sun, safe, turns]) == (
        PlainRemark("Frame 2 moved."),
        SunRestored("A", 38.0, "clear", 83_000.0, 70_000.0, 95_000.0),
        ClippingSafe(0, every=True),
        RoughTurns(("left-loop", "butterfly")),
    )


@pytest.mark.parametrize(
    "bad",
    [
        {"kind": "of a newer version", "much": 3},
        {"kind": "MuchMotion", "share": "half"},
        {"kind": "MuchMotion"},
        {"kind": "ForeignFrame", "name": "a.jpg", "reason": "unknown"},
    ],
)
def test_a_remark_that_is_unknown_or_unfit_is_passed_over(bad: dict[str, Any]) -> None:
    assert remarks_of([bad, "Kept."]) == (PlainRemark("Kept."),)


@pytest.mark.parametrize("bad", [None, "A sentence.", [3], [{"share": 1.0}], ["x" * 5000]])
def test_what_is_no_list_of_remarks_is_refused(bad: Any) -> None:
    with pytest.raises(Unfit):
        remarks_of(bad)
