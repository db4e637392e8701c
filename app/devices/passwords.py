"""Camera passwords: stored only in the system keyring, and sent only as a digest.

No password is ever written to a file or a log. If the keyring is missing, locked or broken, the
user has to type the password again next time.
"""

from __future__ import annotations

import os
import re
import stat
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

from requests.auth import HTTPDigestAuth
from requests.utils import parse_dict_header

from app.core.base.errors import CoreError
from app.core.text import tr
from app.devices.errors import PasswordNeeded

_SCHEME: Final = re.compile(r"(?:^|[\s,])digest\s+", re.IGNORECASE)
_LONGEST_CHALLENGE: Final = 2000
_TOKEN: Final = re.compile(r"[^\x00-\x1f\x7f\"\\]{0,300}")
_WHERE: Final = tr(
    "The user name is “THETA” followed by the full serial number on the camera’s "
    "base, such as THETAYL00105377; the password is the digits of that "
    "number unless the owner has set a different one. Newer cameras have no password "
    "until one is set in Ricoh’s app over the camera’s own Wi-Fi."
)

SERVICE: Final = "Turnlight camera"
"""Service name under which passwords are stored in the keyring."""

_LONGEST: Final = 256
_MOST_BYTES: Final = 4096
_PATIENCE_S: Final = 30.0
_NOT_KEPT: Final = tr(
    "No keyring is available on this computer, so the camera’s password is not saved."
)
_NO_DEFAULT: Final = {"RICOH THETA Z1": range(10, 51), "RICOH THETA X": range(10, 31)}
_SET_FIRST: Final = tr(
    "This camera has no password yet: set one in Ricoh’s app "
    "over the camera’s own Wi-Fi, then switch its Wi-Fi off and on."
)
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Credentials:
    """The user name and password for a camera."""

    user: str
    password: str = field(repr=False)


def password_needed() -> PasswordNeeded:
    """Return the error for a camera that requires a password."""
    return PasswordNeeded(tr("The camera requires a user name and password."), _WHERE)


def password_refused() -> PasswordNeeded:
    """Return the error for a camera that rejects the password."""
    return PasswordNeeded(
        tr("The camera does not accept this user name and password."), _WHERE, "password-refused"
    )


class Digest(HTTPDigestAuth):
    """Responses to a camera's challenges (RFC 7616), using the algorithms in `requests`.

    Only the digest computation of `requests` is used, because its handling of a 401 reads a body of
    any size and repeats the request on its own.
    """

    def __init__(self, credentials: Credentials) -> None:
        super().__init__(credentials.user, credentials.password)
        self._challenge: dict[str, str] = {}

    @property
    def ready(self) -> bool:
        """Whether there is a challenge to answer."""
        return bool(self._challenge)

    def take(self, header: str) -> bool:
        """Store a challenge.

        Returns:
            Whether a stale nonce was the only problem, in which case the password may still be
            right.

        Raises:
            PasswordNeeded: If the challenge is invalid.
        """
        self._challenge = {}
        match = _SCHEME.search(header[:_LONGEST_CHALLENGE])
        items = parse_dict_header(header[match.end() : _LONGEST_CHALLENGE]) if match else {}
        fields = {str(key).lower(): value or "" for key, value in items.items()}
        if not {"realm", "nonce"} <= fields.keys() or not all(
            _TOKEN.fullmatch(value) and value.isascii() for value in fields.values()
        ):
            raise password_needed()
        # `requests` searches for a bare "auth" between the commas.
        if "qop" in fields:
            fields["qop"] = ",".join(word.strip().lower() for word in fields["qop"].split(","))
        self._challenge = fields
        return fields.get("stale", "").lower() == "true"

    def answer(self, method: str, url: str) -> str:
        """Return the Authorization header for a request.

        Raises:
            PasswordNeeded: If the algorithm is unknown.
        """
        self.init_per_thread_state()
        self._thread_local.chal = self._challenge
        header = self.build_digest_header(method, url)
        if header is None:
            raise password_needed()
        return header


def wants_digest(header: str) -> bool:
    """Return whether a WWW-Authenticate header requests a digest."""
    return _SCHEME.search(header[:_LONGEST_CHALLENGE]) is not None


class Passwords:
    """The stored passwords, keyed by the camera's user name or serial number.

    Args:
        patience_s: Timeout in real seconds for the keyring, which may ask the user to unlock it.
    """

    def __init__(
        self, say: Callable[[str], None] | None = None, *, patience_s: float = _PATIENCE_S
    ) -> None:
        self._say = say
        self._patience_s = patience_s

    def get(self, account: str) -> str | None:
        """Return a password, or None if none is stored or the keyring is unavailable."""
        password = self._try(lambda ring: ring.get_password(SERVICE, account)) if account else None
        return password if isinstance(password, str) and _sound(password) else None

    def set(self, account: str, password: str) -> bool:
        """Store a password, and return whether that succeeded."""

        def keep(ring: Any) -> bool:
            ring.set_password(SERVICE, account, password)
            # Some backends accept everything and store nothing.
            return bool(ring.get_password(SERVICE, account) == password)

        if not account or not _sound(password):
            return False
        ok = self._try(keep)
        if not ok:
            self._tell()
        return bool(ok)

    def _try(self, work: Callable[[Any], _T]) -> _T | None:
        """Access the keyring, returning None after a timeout or any failure."""
        results: list[_T] = []

        def run() -> None:
            try:
                import keyring

                results.append(work(keyring))
            except Exception:  # noqa: BLE001 - backends raise anything, and it may contain a password
                return

        thread = threading.Thread(target=run, name="turnlight-keyring", daemon=True)
        thread.start()
        thread.join(self._patience_s)
        if not results:
            self._tell()
        return results[0] if results else None

    def _tell(self) -> None:
        say, self._say = self._say, None
        if say is not None:
            say(_NOT_KEPT)


def read_password_file(path: Path | str, warn: Callable[[str], None] | None = None) -> str:
    """Read a password from the first line of a file.

    Error messages never contain the content of the file.

    Raises:
        CoreError: If the file cannot be read, is empty, or has no printable password.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            mode = os.fstat(stream.fileno()).st_mode
            data = stream.read(_MOST_BYTES)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or tr("not a file name")).lower()
        raise CoreError(
            tr("The password file {file} cannot be read: {reason}.", file=file, reason=reason)
        ) from None
    line = data.removeprefix(b"\xef\xbb\xbf").split(b"\n", 1)[0].removesuffix(b"\r")
    if not line:
        raise CoreError(
            tr("There is no password in {file}.", file=file), tr("Put it on the first line.")
        )
    try:
        password = line.decode("utf-8")
    except UnicodeDecodeError:
        password = ""
    if not _sound(password):
        raise CoreError(
            tr("The first line of {file} is not a password.", file=file),
            tr("It must be plain text of at most {longest} characters.", longest=_LONGEST),
        )
    # Only POSIX reports the permissions of other users.
    if warn is not None and os.name == "posix" and stat.S_ISREG(mode) and mode & 0o077:
        warn(
            tr(
                "Other users can read the password file {file}. Protect it with chmod 600.",
                file=file,
            )
        )
    return password


def default_password_hint(model: str, serial: str) -> str:
    """Return one or two sentences about the factory password, without the password itself."""
    name = model.strip().upper()
    digits = serial.strip().upper().removeprefix("THETA").lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ")
    digits_rule = tr(
        "Unless the owner has set a different one, the password is the eight digits "
        "of the serial number on the camera’s base, without the letters."
    )
    if name.startswith("RICOH360 THETA A1"):
        return _SET_FIRST
    if name == "RICOH THETA V":
        return digits_rule
    newer = _NO_DEFAULT.get(name)
    if newer is None or not digits[:2].isdecimal():
        return tr(
            "{digits_rule} Newer cameras have no password until one is set in Ricoh’s app.",
            digits_rule=digits_rule,
        )
    return _SET_FIRST if int(digits[:2]) in newer else digits_rule


def _sound(password: str) -> bool:
    return 0 < len(password) <= _LONGEST and password.isprintable()
