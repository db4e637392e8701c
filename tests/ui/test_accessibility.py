"""A walk through the accessibility tree, as a screen reader takes it: name, role and focus."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtGui import QAccessible, QAccessibleInterface
from PySide6.QtWidgets import QWidget

from app.ui.shell.start import App
from benchmarks.ui.screenshots.command import Robot
from tests.ui.test_window_reach import OVERLAYS, SCREENS, bring, dress, running, window

__all__ = ["running", "window"]

TELLS_NOTHING = {QAccessible.Role.NoRole, QAccessible.Role.Client}


def tree(root: QWidget) -> Iterator[QAccessibleInterface]:
    """Everything in sight that a screen reader comes to."""
    first = QAccessible.queryAccessibleInterface(root)
    assert first is not None
    waiting = [first]
    while waiting:
        one = waiting.pop()
        if one.state().invisible:
            continue
        yield one
        waiting += [one.child(number) for number in range(one.childCount())]


def told(one: QAccessibleInterface) -> str:
    widget = one.object()
    return f"{type(widget).__name__} {one.text(QAccessible.Text.Name)!r} {one.role().name}"


@pytest.mark.parametrize("running", ["empty", "place"], indirect=True)
def test_who_cannot_see_the_screen_hears_what_each_control_is(window: tuple[App, Robot]) -> None:
    app, robot = window
    dress(app, robot, "dark", 1.0, (1440, 900))
    nameless, shapeless = [], []
    for what in (*SCREENS, *OVERLAYS):
        for one in tree(bring(app, robot, what)):
            if not one.state().focusable or one.state().disabled:
                continue
            if not one.text(QAccessible.Text.Name).strip():
                nameless.append(f"{what}: {told(one)}")
            if one.role() in TELLS_NOTHING:
                shapeless.append(f"{what}: {told(one)}")
    app.commands.close_overlay()

    assert not nameless + shapeless, "\n" + "\n".join(nameless + shapeless)
