"""The simulated camera's own check of digest authentication."""

from __future__ import annotations

import hashlib
import re

import pytest

from app.devices.simulated.exchange import Request
from tests.faulty_camera.digest import Guard

USER, PASSWORD, REALM = "THETAYL00112358", "geheimnis", "RICOH THETA V"


def _md5(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def _nonce(challenge: str) -> str:
    found = re.search(r'nonce="([0-9a-f]+)"', challenge)
    assert found is not None
    return found[1]


def _request(issued: str, *, target: str = "/osc/info", **changes: str) -> Request:
    fields = {
        "username": USER, "realm": REALM, "nonce": issued, "uri": target, "qop": "auth",
        "nc": "00000001", "cnonce": "0a4f113b",
    } | changes  # fmt: skip
    secret = _md5(f"{USER}:{REALM}:{changes.get('password', PASSWORD)}")
    action = _md5(f"GET:{fields['uri']}")
    middle = ":".join(fields[name] for name in ("nonce", "nc", "cnonce", "qop"))
    fields.setdefault("response", _md5(f"{secret}:{middle}:{action}"))
    words = ", ".join(f'{name}="{value}"' for name, value in fields.items() if name != "password")
    return Request("GET", target, {"authorization": f"Digest {words}"})


@pytest.fixture
def guard() -> Guard:
    return Guard(USER, PASSWORD, REALM, 0)


def test_the_example_of_the_rfc() -> None:
    """RFC 7616, section 3.9.1, MD5; its nonce stands for one that was issued."""
    guard = Guard("Mufasa", "Circle of Life", "http-auth@example.org", 0)
    nonce = "7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v"
    guard._issued[nonce] = 0.0
    words = (
        'Digest username="Mufasa", realm="http-auth@example.org", uri="/dir/index.html", '
        f'algorithm=MD5, nonce="{nonce}", nc=00000001, '
        'cnonce="f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ", qop=auth, '
        'response="8ca523f5e9506fed4657c9700eebdbec", '
        'opaque="FQhe/qaU925kfnzjCev0ciny7QMkPqMAFRtzCUYo5tdS"'
    )
    request = Request("GET", "/dir/index.html", {"authorization": words})
    assert guard.check(request, 1.0) == "ok"


def test_the_right_answer_once(guard: Guard) -> None:
    request = _request(_nonce(guard.challenge(0.0)))
    assert guard.check(request, 1.0) == "ok"
    assert guard.check(request, 2.0) == "stale"
    nonce = _nonce(guard.challenge(0.0))
    assert guard.check(_request(nonce), 1.0) == "ok"
    assert guard.check(_request(nonce, nc="00000002"), 1.0) == "ok"
    # As Ricoh's own client does it: the same count, another nonce of its own.
    assert guard.check(_request(nonce, cnonce="0b"), 1.0) == "ok"


def test_old_nonces_are_stale(guard: Guard) -> None:
    nonce = _nonce(guard.challenge(0.0))
    assert guard.check(_request(nonce), 299.0) == "ok"
    assert guard.check(_request(nonce, nc="00000002"), 301.0) == "stale"
    assert "stale=true" in guard.challenge(301.0, stale=True)


@pytest.mark.parametrize(
    "changes",
    [
        {"password": "falsch"},
        {"username": "THETA"},
        {"realm": "elsewhere"},
        {"nonce": "0" * 32},
        {"uri": "/osc/state"},
        {"qop": "auth-int"},
        {"algorithm": "SHA-256"},
        {"response": "0" * 32},
        {"cnonce": ""},
    ],
)
def test_wrong_answers(guard: Guard, changes: dict[str, str]) -> None:
    nonce = _nonce(guard.challenge(0.0))
    assert guard.check(_request(nonce, **changes), 1.0) == "wrong"


@pytest.mark.parametrize("header", ["", "Basic YTpi", "Digest", "Digest nonsense", "Digest ,,=="])
def test_no_answer_at_all(guard: Guard, header: str) -> None:
    request = Request("GET", "/osc/info", {"authorization": header})
    assert guard.check(request, 0.0) == "wrong"


def test_the_query_may_be_left_out(guard: Guard) -> None:
    target = "/files/R0010001.JPG?type=thumb"
    nonce = _nonce(guard.challenge(0.0))
    assert guard.check(_request(nonce, target=target), 1.0) == "ok"
    short = _request(nonce, target=target, uri="/files/R0010001.JPG", nc="00000002")
    assert guard.check(short, 1.0) == "ok"
