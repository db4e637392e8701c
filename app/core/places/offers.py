"""What a place offers: one entry for the two sides of a style and for styles of equal pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from app.core.solver.solve import merit
from app.core.solver.style_result import StyleAnswer
from app.core.styles.styles import NAMES, mirror_name

A = TypeVar("A", bound=StyleAnswer)


@dataclass(frozen=True, slots=True)
class Offer:
    """The styles that share one place in a list.

    Attributes:
        name: The style to show: of all members, the best in grade and match.
        members: Names of all members, `name` first: a style, its other side, and the styles that
            have the same picture and grade.
    """

    name: str
    members: tuple[str, ...]


def pairs(names: Iterable[str]) -> tuple[Offer, ...]:
    """Group the left and the right form of each built-in style, in the order of the names."""
    groups: dict[str, list[str]] = {}
    for name in names:
        twin = mirror_name(name) if name in NAMES else name
        groups.setdefault(min(name, twin), []).append(name)
    return tuple(Offer(group[0], tuple(group)) for group in groups.values())


def offers(results: Sequence[A], is_within: Callable[[A], bool]) -> tuple[Offer, ...]:
    """Group the styles and sort the groups: within reach first, then common, grade and match.

    Of two styles within reach that have the same picture, the lesser one joins the better one if
    both have the same grade. Otherwise the lesser one names the better one (`looks_more_like`).

    Args:
        is_within: Whether a result is within reach by the rule in force.
    """
    by_name = {one.name: one for one in results}

    def rank(name: str) -> tuple[bool, ...] | tuple[float, ...]:
        return is_within(by_name[name]), *merit(by_name[name])

    groups = []
    for pair in pairs(by_name):
        members = sorted(pair.members, key=rank, reverse=True)
        groups.append(Offer(members[0], tuple(members)))
    groups.sort(key=lambda offer: rank(offer.name), reverse=True)
    merged: list[Offer] = []
    for offer in groups:
        result = by_name[offer.name]
        index = None
        if is_within(result):
            index = _host(result, [by_name[one.name] for one in merged])
        if index is None:
            merged.append(offer)
        else:
            host = merged[index]
            merged[index] = replace(host, members=(*host.members, *offer.members))
    return tuple(merged)


def _host(result: StyleAnswer, others: Sequence[StyleAnswer]) -> int | None:
    """Return the index of the first result with the same picture and grade, or None."""
    for index, other in enumerate(others):
        if other.name in result.same_picture and other.grade == result.grade:
            return index
    return None
