"""The mailbox: the latest wins, and nothing grows."""

from __future__ import annotations

import sys
import threading

from app.devices.latest_frame import Mailbox
from tests.helpers.waiting import PATIENCE_S


def test_newest_wins() -> None:
    box: Mailbox[int] = Mailbox()
    for number in range(1000):
        box.put(number)
    assert box.get() == 999
    assert box.get() is None


def test_nothing_is_kept_of_what_was_replaced() -> None:
    box: Mailbox[bytes] = Mailbox()
    item = bytes(64)
    before = sys.getrefcount(item)
    box.put(item)
    box.put(bytes(1))
    assert sys.getrefcount(item) == before
    box.put(item)
    assert box.get() is item
    assert sys.getrefcount(item) == before


def test_an_empty_mailbox_times_out() -> None:
    assert Mailbox[int]().get(0.05) is None


def test_a_waiting_reader_gets_what_comes() -> None:
    box: Mailbox[int] = Mailbox()
    timer = threading.Timer(0.05, box.put, (7,))
    timer.start()
    assert box.get(PATIENCE_S) == 7
    timer.join()


def test_many_writers_and_readers() -> None:
    box: Mailbox[int] = Mailbox()
    taken: list[int] = []

    over = threading.Event()

    def read() -> None:
        while not over.is_set():
            item = box.get(0.01)
            if item is not None:
                taken.append(item)

    def write(base: int) -> None:
        for number in range(500):
            box.put(base + number)

    readers = [threading.Thread(target=read) for _ in range(2)]
    writers = [threading.Thread(target=write, args=(base,)) for base in (0, 1000, 2000)]
    for thread in (*readers, *writers):
        thread.start()
    for writer in writers:
        writer.join()
    over.set()
    for reader in readers:
        reader.join(PATIENCE_S)
    taken += [item for item in [box.get()] if item is not None]
    assert len(taken) == len(set(taken))
    assert {499, 1499, 2499} & set(taken)
