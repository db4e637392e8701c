"""The words for each kind of live source: webcam, network camera, video."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.core.text import tr


class SourceWords(NamedTuple):
    """The words for one kind of live source.

    Attributes:
        noun: "webcam".
        starting, lost, missing: Its states: "Starting the webcam", "Webcam disconnected",
            "No webcam".
        remedy: What to do when it is lost.
    """

    noun: str
    starting: str
    lost: str
    remedy: str
    missing: str

    @property
    def lost_sentence(self) -> str:
        """That the source is lost, and what to do."""
        return f"{self.lost}. {self.remedy}"


_WEBCAM: Final = SourceWords(
    tr("webcam"),
    tr("Starting the webcam"),
    tr("Webcam disconnected"),
    tr("Plug it back in to continue."),
    tr("No webcam"),
)
_SOURCES: Final = {
    "network": SourceWords(
        tr("network camera"),
        tr("Connecting to the network camera"),
        tr("Network camera lost"),
        tr("Turnlight reconnects by itself."),
        tr("No network camera"),
    ),
    "video": SourceWords(
        tr("video"),
        tr("Opening the video"),
        tr("The video stopped"),
        tr("Choose it again."),
        tr("No video"),
    ),
}


def source_words(kind: str) -> SourceWords:
    """Return the words for a `LiveSource.kind`; those for a webcam by default."""
    return _SOURCES.get(kind, _WEBCAM)
