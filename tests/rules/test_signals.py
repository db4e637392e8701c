"""The Qt binding survives many signals.

PySide6 6.12.0 drops one reference to ``True`` for every emission of a signal declared in Python,
and so ends Python 3.11 after some 550 of them. Newer Pythons keep ``True`` for ever and show
nothing, so there only the count is checked.
"""

from __future__ import annotations

import subprocess
import sys

EMISSIONS = 2000

CODE = f"""
import sys
from PySide6.QtCore import QObject, Signal, Slot

class Sender(QObject):
    plain = Signal()
    flag = Signal(bool)
    thing = Signal(object)

class Receiver(QObject):
    def __init__(self):
        super().__init__()
        self.count = 0

    @Slot()
    def on_plain(self):
        self.count += 1

    @Slot(bool)
    def on_flag(self, value):
        self.count += value

    @Slot(object)
    def on_thing(self, value):
        self.count += value is None

sender, receiver = Sender(), Receiver()
sender.plain.connect(receiver.on_plain)
sender.flag.connect(receiver.on_flag)
sender.thing.connect(receiver.on_thing)
before = sys.getrefcount(True), sys.getrefcount(None)
for _ in range({EMISSIONS}):
    sender.plain.emit()
    sender.flag.emit(True)
    sender.thing.emit(None)
after = sys.getrefcount(True), sys.getrefcount(None)
print(receiver.count, max(abs(b - a) for a, b in zip(before, after)))
"""


def test_two_thousand_emissions() -> None:
    # In a process of its own: a fault here ends the interpreter without a trace.
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, f"ended with {done.returncode}: {done.stderr}"
    count, drift = map(int, done.stdout.split())
    assert count == 3 * EMISSIONS
    assert drift < 50
