"""What can go wrong with a simulated camera, by name, and how often it does.

Everything is drawn from the seed: the same names, seed and requests give the same troubles.
Troubles that a patient client can outlast go away after a few times; the others stay.
"""

from __future__ import annotations

from random import Random
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

FAULTS: Final = MappingProxyType(
    {
        "drop-during-download": "The connection is cut in the middle of a file, a few times.",
        "drop-during-exposure": (
            "The camera cannot be reached for some seconds while it shoots; it goes on shooting."
        ),
        "truncated-jpeg": "A file arrives shorter than listed, with a length that fits, at first.",
        "503-bursts": "Several requests in a row are answered with 503, now and then.",
        "disabledcommand-while-preview-is-open": (
            "The camera takes the preview to be open for a while after it was closed."
        ),
        "disabledcommand-too-soon-after-setoptions": (
            "Shooting is refused for longer than the usual second after options were set."
        ),
        "401": "The camera wants a password although nobody has set one.",
        "storage-full": "There is no room, or not for all frames.",
        "battery-low": "The battery is nearly empty; the camera refuses to shoot.",
        "overheating": "The camera is too hot to shoot, from the start or after a while.",
        "sleep": "The camera sleeps, at first and again when idle, unless sleepDelay forbids it.",
        "error-in-a-200": "Errors come with HTTP status 200, some of them for no reason.",
        "equal-exposures": "All frames of a bracket get the exposure of the first.",
        "unequal-lens-iso": "The two lenses use different ISO even in the manual program.",
        "slow-status": "Asking how a command does takes many seconds, once too many.",
        "never-done": "The command that takes the bracket never reports that it is done.",
        "404-router-in-place-of-the-camera": "A home router answers, with web pages.",
        "hostile-file-names": "Files are listed whose names lead out of any folder.",
        "hostile-urls": "URLs of files point to other hosts, to local files, or are huge.",
        "endless-response": "An answer never ends.",
        "wrong-content-length": "Content-Length is larger or smaller than what is sent.",
        "clock-unset": "The camera's date was never set.",
    }
)
"""Name and a sentence of each."""

_BOTH: Final = MappingProxyType(
    {
        "hostile-file-names-and-urls": ("hostile-file-names", "hostile-urls"),
        "disabledcommand": (
            "disabledcommand-while-preview-is-open",
            "disabledcommand-too-soon-after-setoptions",
        ),
    }
)


_TIMES: Final = {
    "drop-during-download": (1, 3),
    "drop-during-exposure": (1, 1),
    "truncated-jpeg": (1, 2),
    "503-bursts": (2, 3),
    "disabledcommand-while-preview-is-open": (1, 3),
    "disabledcommand-too-soon-after-setoptions": (1, 3),
    "sleep": (1, 2),
    "error-in-a-200": (2, 4),
    "equal-exposures": (1, 2),
    "slow-status": (4, 8),
    "hostile-file-names": (2, 6),
    "hostile-urls": (2, 8),
    "endless-response": (1, 2),
    "wrong-content-length": (1, 3),
    "clock-unset": (1, 1),
}


def faults_named(names: Iterable[str]) -> tuple[str, ...]:
    """Find faults by what a user writes: any case, and one word for two of a kind.

    `names`: keys of `FAULTS`, "hostile-file-names-and-urls" or "disabledcommand". Raises
    `ValueError` for a name that is not known.

    Examples:
        >>> faults_named(["Truncated-JPEG", "hostile-file-names-and-urls"])
        ('truncated-jpeg', 'hostile-file-names', 'hostile-urls')
    """
    found: dict[str, None] = {}
    for name in names:
        plain = name.strip().casefold()
        for each in _BOTH.get(plain, (plain,)):
            if each not in FAULTS:
                raise ValueError(f"there is no fault {name!r}; known: {', '.join(FAULTS)}")
            found[each] = None
    return tuple(found)


class Faults:
    """The troubles of one camera.

    Raises `ValueError` for a name that is not known.
    """

    def __init__(self, names: Collection[str], seed: int) -> None:
        names = faults_named(names)
        self._dice = {name: Random(f"{seed}/{name}") for name in names}  # noqa: S311
        self._fired: dict[str, int] = {}
        self._left = {
            name: dice.randint(*_TIMES[name]) if name in _TIMES else -1
            for name, dice in self._dice.items()
        }

    def on(self, name: str) -> bool:
        """Whether a fault was asked for and is not over."""
        return self._left.get(name, 0) != 0

    def asked(self, name: str) -> bool:
        """Whether a fault was asked for, over or not."""
        return name in self._dice

    def dice(self, name: str) -> Random:
        """Source of a fault's chances; only for those that were asked for."""
        return self._dice[name]

    def fire(self, name: str) -> None:
        """Note that a fault has shown, and count it down where it goes away."""
        self._fired[name] = self._fired.get(name, 0) + 1
        if self._left[name] > 0:
            self._left[name] -= 1

    def spend(self, name: str) -> bool:
        """Fire a fault if it is on."""
        if not self.on(name):
            return False
        self.fire(name)
        return True

    def fired(self, name: str) -> int:
        """How often a fault has shown."""
        return self._fired.get(name, 0)
