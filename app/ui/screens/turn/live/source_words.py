"""The text for each kind of live source: webcam, network camera and video."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.core.text import tr


class SourceWords(NamedTuple):
    """The text for one kind of live source.

    Attributes:
        noun: Name of the source within a sentence, such as "webcam".
        starting, lost, missing: Text for each state of the source, such as "Starting the webcam",
            "Webcam disconnected" and "No webcam".
        remedy: What to do when the source is lost.
    """

    noun: str
    starting: str
    lost: str
    remedy: str
    missing: str

    @property
    def lost_sentence(self) -> str:
        """Text that reports the loss of the source and says what to do."""
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
    """Return the text for a `LiveSource.kind`, by default for a webcam."""
    return _SOURCES.get(kind, _WEBCAM)
