"""The mailbox: latest wins, nothing grows, closing wakes everybody."""

from __future__ import annotations

import sys
import threading
import time

from app.devices.mailbox import Mailbox


def test_newest_wins() -> None:
    box: Mailbox[int] = Mailbox()
    for number in range(1000):
        box.put(number)
    assert box.get() == 999
    assert box.get() is None
    assert box.replaced == 999


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
    start = time.monotonic()
    assert Mailbox[int]().get(0.05) is None
    assert 0.04 < time.monotonic() - start < 2.0


def test_a_waiting_reader_gets_what_comes() -> None:
    box: Mailbox[int] = Mailbox()
    timer = threading.Timer(0.05, box.put, (7,))
    timer.start()
    assert box.get(5.0) == 7
    timer.join()


def test_closing_wakes_all_who_wait() -> None:
    box: Mailbox[int] = Mailbox()
    found: list[int | None] = []
    readers = [threading.Thread(target=lambda: found.append(box.get(30.0))) for _ in range(3)]
    for reader in readers:
        reader.start()
    time.sleep(0.05)
    start = time.monotonic()
    box.close()
    for reader in readers:
        reader.join(5.0)
    assert found == [None] * 3
    assert time.monotonic() - start < 5.0
    assert box.closed


def test_a_closed_mailbox_gives_its_last_item_and_takes_no_more() -> None:
    box: Mailbox[int] = Mailbox()
    box.put(1)
    box.close()
    box.close()
    box.put(2)
    assert box.get(5.0) == 1
    assert box.get(5.0) is None


def test_many_writers_and_readers() -> None:
    box: Mailbox[int] = Mailbox()
    taken: list[int] = []

    def read() -> None:
        while True:
            item = box.get(5.0)
            if item is not None:
                taken.append(item)
            elif box.closed:
                return

    def write(base: int) -> None:
        for number in range(500):
            box.put(base + number)

    readers = [threading.Thread(target=read) for _ in range(2)]
    writers = [threading.Thread(target=write, args=(base,)) for base in (0, 1000, 2000)]
    for thread in (*readers, *writers):
        thread.start()
    for writer in writers:
        writer.join()
    box.close()
    for reader in readers:
        reader.join(10.0)
    assert len(taken) == len(set(taken))
    assert len(taken) + box.replaced == 1500
