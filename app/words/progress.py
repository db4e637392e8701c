"""Text of a `Progress`: the current step of a long task, with no full stop at the end."""

from __future__ import annotations

from typing import Final

from app.core.base.progress import Progress, Task
from app.core.text import tr

_TASKS: Final = {
    Task.READING: tr("Reading {name}"),
    Task.COPYING: tr("Copying {number} of {count}"),
    Task.COPIED: tr("Copied"),
    Task.DELETING: tr("Deleting {name}"),
    Task.SAVING_PLACE: tr("Saving the place"),
    Task.READING_FRAMES: tr("Reading frames"),
    Task.ALIGNING_FRAMES: tr("Aligning frames"),
    Task.CHECKING_EXPOSURES: tr("Checking the exposures"),
    Task.MERGING: tr("Merging"),
    Task.STITCHING: tr("Stitching"),
    Task.FINDING_LAMPS: tr("Finding lamps"),
    Task.READING_PHOTOS: tr("Reading photos"),
    Task.COMPARING_PHOTOS: tr("Comparing photos"),
    Task.WATCHING_FILM: tr("Reading the film"),
    Task.FINDING_LIGHT: tr("Finding the light"),
    Task.LEARNING_BACKGROUND: tr("Learning the background"),
    Task.FINDING_BACKGROUND: tr("Looking for the background"),
    Task.FINDING_LAMP: tr("Finding the lamp"),
    Task.TURNING_LAMP: tr("Turning the lamp"),
    Task.TRYING_LAMP: tr("Trying every lamp position"),
    Task.SORTING_SHADOWS: tr("Sorting the lamp’s shadows"),
    Task.HOLDING_LAMP: tr("Placing {name} at every position"),
    Task.VIEWING_HEAD: tr("Looking at the head"),
    Task.MEASURING_SKIN: tr("Measuring where light reaches the skin"),
    Task.FOLLOWING_LIGHT: tr("Following light through the skin"),
    Task.DONE: tr("Done"),
}
_SORTING_NAMED: Final = tr("Sorting the shadows of {name}")


def progress_words(progress: Progress | str) -> str:
    """Return the name of a task. A phrase that a device reported is returned unchanged.

    Examples:
        >>> progress_words(Progress(Task.COPYING, number=2, count=3)), progress_words("Filming")
        ('Copying 2 of 3', 'Filming')
    """
    if isinstance(progress, str):
        return progress
    words = _TASKS[progress.task]
    if progress.task is Task.SORTING_SHADOWS and progress.name:
        words = _SORTING_NAMED
    return words.format(name=progress.name, number=progress.number, count=progress.count)
