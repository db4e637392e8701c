"""A capture in a process of its own, which a test may kill."""

from __future__ import annotations

import os
import sys
from multiprocessing.connection import Connection
from pathlib import Path

from app.core.base.progress import Token
from app.core.styles.style_pack_file import load_named_pack
from app.devices.capture.capture_steps import Capture
from app.devices.capture.session import Session
from app.devices.theta.client import OscClient
from app.devices.theta.endpoint import Endpoint
from app.devices.theta.link import Link
from tests.helpers.scaled_clock import ScaledClock


def capture_into(url: str, folder: Path, speed: float, home: Path, told: Connection) -> None:
    """Take a bracket into a folder, or go on with one there; says when it begins."""
    os.environ["HOME"] = str(home)
    os.chdir(home)
    sys.stderr.flush()
    clock = ScaledClock(speed)
    pack = load_named_pack("generic")
    told.send("begins")
    link = Link(Endpoint.parse(url), clock)
    session = Session.open_or_create(folder)
    if session.journal.finished:
        return
    Capture(
        OscClient(link, clock),
        session,
        clock,
        plan="paper",
        pack=pack,
        on_status=lambda status: None,
        token=Token(),
    ).run()
    link.close()
