"""User name and password, as a camera asks for them in another network than its own."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

from requests.auth import HTTPDigestAuth
from requests.utils import parse_dict_header

from app.devices.errors import PasswordNeeded

_SCHEME: Final = re.compile(r"(?:^|[\s,])digest\s+", re.IGNORECASE)
_LONGEST: Final = 2000
_TOKEN: Final = re.compile(r"[^\x00-\x1f\x7f\"\\]{0,300}")
_WHERE: Final = (
    'The user name is "THETA" and the full serial number on the camera\'s base, such as '
    "THETAYL00105377; the password is the digits of that number unless the owner has set another "
    "one. Newer cameras have none until one is set in Ricoh's app over the camera's own Wi-Fi."
)


@dataclass(frozen=True, slots=True)
class Credentials:
    """User name and password of a camera."""

    user: str
    password: str = field(repr=False)


def password_needed() -> PasswordNeeded:
    """Say that the camera wants a password and none was given."""
    return PasswordNeeded("The camera wants its user name and password.", _WHERE)


def password_refused() -> PasswordNeeded:
    """Say that the camera does not accept the password it was given."""
    return PasswordNeeded(
        "The camera does not accept this user name and password.", _WHERE, "password-refused"
    )


class Digest(HTTPDigestAuth):
    """Answers to a camera's challenges (RFC 7616 with MD5 and the others `requests` knows).

    Only the arithmetic of `requests` is used. Its own handling of a 401 reads a body of any size
    and sends again by itself, both of which need limits here.
    """

    def __init__(self, credentials: Credentials) -> None:
        super().__init__(credentials.user, credentials.password)
        self._challenge: dict[str, str] = {}

    @property
    def ready(self) -> bool:
        """Whether there is a challenge to answer."""
        return bool(self._challenge)

    def take(self, header: str) -> bool:
        """Keep a challenge.

        Returns
        -------
        bool
            Whether it says that only the last nonce was too old, and not the password wrong.

        Raises
        ------
        PasswordNeeded
            When it is no challenge that can be answered.
        """
        self._challenge = {}
        found = _SCHEME.search(header[:_LONGEST])
        items = parse_dict_header(header[found.end() : _LONGEST]) if found else {}
        fields = {str(key).lower(): value or "" for key, value in items.items()}
        if not {"realm", "nonce"} <= fields.keys() or not all(
            _TOKEN.fullmatch(value) and value.isascii() for value in fields.values()
        ):
            raise password_needed()
        # `requests` looks for a bare "auth" between the commas.
        if "qop" in fields:
            fields["qop"] = ",".join(word.strip().lower() for word in fields["qop"].split(","))
        self._challenge = fields
        return fields.get("stale", "").lower() == "true"

    def answer(self, method: str, url: str) -> str:
        """Give the Authorization header for a request.

        Raises
        ------
        PasswordNeeded
            When the camera wants an algorithm that nobody speaks.
        """
        self.init_per_thread_state()
        self._thread_local.chal = self._challenge
        header = self.build_digest_header(method, url)
        if header is None:
            raise password_needed()
        return header


def wants_digest(header: str) -> bool:
    """Tell whether a WWW-Authenticate header asks for a digest."""
    return _SCHEME.search(header[:_LONGEST]) is not None
