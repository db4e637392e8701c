"""A camera's own check of digest authentication (RFC 7616), as in somebody's network."""

from __future__ import annotations

import hashlib
import re
from typing import Final

from app.devices.simulated.exchange import Request

_LIFE_S: Final = 300.0
_PAIR: Final = re.compile(r'([a-zA-Z]+)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,"]+))')


class Guard:
    """Demands a password and checks it."""

    def __init__(self, user: str, password: str, realm: str, seed: int) -> None:
        self._user = user
        self._password = password
        self._realm = realm
        self._seed = seed
        self._issued: dict[str, float] = {}
        self._used: set[tuple[str, str, str]] = set()

    def challenge(self, now: float, *, stale: bool = False) -> str:
        """Make the WWW-Authenticate header, with a new nonce.

        `now`: time in seconds; a nonce is good for 300.
        """
        nonce = _md5(f"{self._seed}:{len(self._issued)}:{now}:nonce")
        self._issued[nonce] = now
        words = f'Digest realm="{self._realm}", nonce="{nonce}", qop="auth", algorithm=MD5'
        return words + (", stale=true" if stale else "")

    def check(self, request: Request, now: float) -> str:
        """Judge a request. `now`: time in seconds."""
        scheme, _, rest = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() != "digest":
            return "wrong"
        fields = {key.lower(): quoted or plain for key, quoted, plain in _PAIR.findall(rest)}
        if not self._proves(fields, request):
            return "wrong"
        use = (fields["nonce"], fields["nc"], fields["cnonce"])
        # The same fields twice: a replay.
        if now - self._issued.get(use[0], -_LIFE_S) >= _LIFE_S or use in self._used:
            return "stale"
        self._used.add(use)
        return "ok"

    def _proves(self, fields: dict[str, str], request: Request) -> bool:
        needed = ("username", "realm", "nonce", "uri", "response", "nc", "cnonce", "qop")
        if not all(fields.get(name) for name in needed):
            return False
        if fields["qop"] != "auth" or fields.get("algorithm", "MD5").upper() != "MD5":
            return False
        # Ricoh's own client leaves the query out of the URI.
        if fields["uri"] not in {request.target, request.target.partition("?")[0]}:
            return False
        if fields["username"] != self._user or fields["realm"] != self._realm:
            return False
        if fields["nonce"] not in self._issued:
            return False
        secret = _md5(f"{self._user}:{self._realm}:{self._password}")
        action = _md5(f"{request.method}:{fields['uri']}")
        parts = (secret, fields["nonce"], fields["nc"], fields["cnonce"], "auth", action)
        return fields["response"] == _md5(":".join(parts))


def _md5(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()
