"""Identifying, recording and deleting the surplus photos that this program took on the camera.

A photo is deleted only if this program certainly took it, so the photographer's own photos are
never touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Final

from app.core.places.journal import SessionFrame, ShotStart
from app.devices.capture.reconnection import NOT_NOW, Contact, find_frames
from app.devices.capture.session import Session, camera_time
from app.devices.capture.status import Stage
from app.devices.errors import CameraRefused, DeviceError
from app.devices.theta.messages import FileEntry

_MOST_ENTRIES: Final = 8
_MOST_LISTED: Final = 100
_CLOCK_S: Final = 2.0
_CLAIM_S: Final = 60.0


def delete_pictures(contact: Contact, session: Session) -> None:
    """Delete the photos taken by this program that are not needed.

    These are the metering photo and, once another bracket is complete, the photos of an interrupted
    one, even if the program ended before it recorded their URLs. If the camera refuses to delete
    the photos, they stay in the journal until the next attempt.
    """
    with suppress(DeviceError):
        if session.journal.stage == Stage.METERING.value:
            _claim_shot(contact, session)
        debt = session.journal.picture_to_delete
        if debt is not None:
            _delete(contact, debt)
            session.update(picture_to_delete=None)
        while session.journal.exposed and session.journal.surplus:
            first, *others = session.journal.surplus
            _delete(contact, first)
            session.update(surplus=tuple(others))


def set_aside(contact: Contact, session: Session, frames: Sequence[SessionFrame]) -> None:
    """Record the photos of an interrupted bracket as surplus, since the bracket will be shot again.

    Args:
        frames: The frames already taken when the bracket stopped.
    """
    _claim_shot(contact, session)
    journal = session.journal
    late = () if journal.picture_to_delete is None else (journal.picture_to_delete,)
    pictures = {frame.url: frame for frame in (*journal.surplus, *frames, *journal.singles, *late)}
    session.update(surplus=tuple(pictures.values()), singles=(), picture_to_delete=None)


def _claim_shot(contact: Contact, session: Session) -> None:
    """Find the photo requested before the program ended, and record it.

    To ensure that the photographer's own photos are never touched, the photo must be the only new
    one, the camera's newest, and dated within a minute of the request by the camera's own clock.
    """
    start = session.journal.shot_start
    if start is None:
        return
    newer = find_frames(contact, 2, previous=start.previous)
    latest = contact.ask(contact.client.state).latest_file_url
    alone = len(newer) == 1 and latest in ("", newer[0].url)
    ours = _noted(newer[0]) if alone and in_time(start, newer[0]) else None
    session.update(shot_start=None, picture_to_delete=ours or session.journal.picture_to_delete)


def in_time(start: ShotStart, entry: FileEntry) -> bool:
    """Return whether, by the camera's own clock, a photo was taken at the time of the request."""
    began, shot_time = camera_time(start.camera_time), camera_time(entry.date_time)
    if began is None or shot_time is None:
        return False
    return -_CLOCK_S <= (shot_time - began).total_seconds() <= _CLAIM_S


def _delete(contact: Contact, debt: SessionFrame) -> None:
    """Delete a photo, but only if its date and size are unchanged, since cameras reuse names.

    Raises:
        DeviceError: If the camera refuses.
    """
    url = contact.client.link.endpoint.rewrite(debt.url)
    there = find_listed(contact, url)
    if there is None or (there.taken, there.size) != (debt.taken, debt.size):
        return
    try:
        contact.ask(lambda: contact.client.delete([url]), NOT_NOW)
    except CameraRefused:
        # A command whose reply was lost may already have deleted the photo.
        if find_listed(contact, url) is not None:
            raise


def find_listed(contact: Contact, url: str) -> SessionFrame | None:
    """Search the camera's list for a file, newest first, and return None if it is missing."""
    for count in (_MOST_ENTRIES, _MOST_LISTED):
        entries = contact.ask(partial(contact.client.list_files, count))
        for entry in entries:
            if entry.url == url:
                return _noted(entry)
        if len(entries) < count:
            break
    return None


def _noted(entry: FileEntry) -> SessionFrame:
    return SessionFrame(entry.name, entry.url, max(entry.size, 0), entry.date_time)
