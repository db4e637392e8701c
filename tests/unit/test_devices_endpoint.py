from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.devices.errors import BadReply, DeviceError
from app.devices.theta.endpoint import ACCESS_POINT, LONGEST_URL, Endpoint


@pytest.mark.parametrize(
    ("typed", "base"),
    [
        ("192.168.1.1", "http://192.168.1.1"),
        ("  192.168.1.1/ ", "http://192.168.1.1"),
        ("http://cam.local:8080/", "http://cam.local:8080"),
        ("HTTP://Cam.Local", "http://cam.local"),
        ("THETAYL00105377.local", "http://thetayl00105377.local"),
        ("camera:80", "http://camera"),
        ("http://192.168.1.1/osc/info", "http://192.168.1.1"),
        ("[fe80::1]", "http://[fe80::1]"),
        ("fe80::1", "http://[fe80::1]"),
        ("http://[FE80::1]:81", "http://[fe80::1]:81"),
        ("[fe80::1%25eth0]", "http://[fe80::1%25eth0]"),
        ("fe80::1%eth0", "http://[fe80::1%25eth0]"),
    ],
)
def test_what_users_type_is_understood(typed: str, base: str) -> None:
    endpoint = Endpoint.parse(typed)
    assert endpoint.base == base
    assert Endpoint.parse(endpoint.base) == endpoint


@pytest.mark.parametrize(
    "typed",
    [
        "",
        "   ",
        "http://",
        "https://192.168.1.1",
        "ftp://192.168.1.1",
        "user:secret@192.168.1.1",
        "192.168.1",
        "192.168.1.256",
        "192.168.1.1:0",
        "192.168.1.1:65536",
        "192.168.1.1:",
        "192.168.1.1:٣",
        "cam era",
        "cam/path",
        "-cam",
        "a..b",
        "[fe80::1",
        "[fe80::1]x",
        "[cam]",
        "fe80::zz",
        "kamera\u00e4",
        "cam\n",
        "x" * 64,
        ".".join(["x" * 60] * 5),
        "192.168.1.1?x",
        "192.168.1.1#x",
        "c\x00m",
    ],
)
def test_nonsense_is_refused_with_a_hint(typed: str) -> None:
    if typed == "cam\n":
        typed = "ca\nm"
    with pytest.raises(DeviceError) as caught:
        Endpoint.parse(typed)
    assert caught.value.code == "bad-address"
    assert caught.value.hint
    assert "secret" not in str(caught.value)
    assert str(caught.value).isprintable()


def test_the_parts_are_checked_too() -> None:
    with pytest.raises(DeviceError):
        Endpoint("a b")
    with pytest.raises(DeviceError):
        Endpoint("cam", 70000)
    assert ACCESS_POINT.base == "http://192.168.1.1"


@pytest.mark.parametrize(
    "url",
    [
        "http://192.168.1.1/files/a1/100RICOH/R0010015.JPG",
        "http://evil.example:81/files/a1/100RICOH/R0010015.JPG",
        "http://[::1]/files/a1/100RICOH/R0010015.JPG",
        "HTTP://192.168.1.1/files/a1/100RICOH/R0010015.JPG",
        "/files/a1/100RICOH/R0010015.JPG",
    ],
)
def test_only_path_and_query_of_a_returned_url_are_used(url: str) -> None:
    here = Endpoint("cam.local", 8080)
    want = "http://cam.local:8080/files/a1/100RICOH/R0010015.JPG"
    assert here.rewrite(url) == want
    assert here.rewrite(url + "?type=thumb&x=a%20b") == want + "?type=thumb&x=a%20b"
    assert here.rewrite(here.rewrite(url)) == want


@pytest.mark.parametrize(
    "url",
    [
        "",
        "R0010015.JPG",
        "http://192.168.1.1",
        "https://192.168.1.1/a",
        "file:///private/notes",
        "ftp://192.168.1.1/a",
        "//evil.example/a",
        "http://cam//evil.example/a",
        "http:///a",
        "http:a",
        "http://user:pw@cam/a",
        "http://cam/../a",
        "http://cam/a/..",
        "http://cam/./a",
        "http://cam/%2e%2e/a",
        "http://cam/%2E./a",
        "http://cam/%252e%252e/a",
        "http://cam/a%2fb",
        "http://cam/a%5cb",
        "http://cam/a\\b",
        "http://cam/a%00",
        "http://cam/a%zz",
        "http://cam/a b",
        "http://cam/a\tb",
        "http://cam/a\r\nX: y",
        "http://cam/a%0d%0aX",
        "http://cam/a#b",
        "http://cam/a#",
        "http://cam/ä",
        "http://cam/a?b\x7f",
        "http://cam/a?<b>",
        "http://[cam/a",
        "http://cam/" + "a" * LONGEST_URL,
    ],
)
def test_urls_that_lead_elsewhere_are_refused(url: str) -> None:
    with pytest.raises(BadReply) as caught:
        Endpoint("cam").rewrite(url)
    assert caught.value.code == "bad-url"
    assert str(caught.value).isprintable()


@given(st.text(max_size=80) | st.text("/.%2eEfF5cC\\?#@:htp", max_size=40))
def test_no_text_leads_away(text: str) -> None:
    here = Endpoint("cam", 8080)
    for given_url in (text, f"http://other/{text}", f"/{text}"):
        try:
            url = here.rewrite(given_url)
        except BadReply:
            continue
        assert url.startswith("http://cam:8080/")
        assert url.isascii()
        assert url.isprintable()
        assert ".." not in url.partition("?")[0].split("/")
        assert here.rewrite(url) == url


@given(st.text(max_size=60))
def test_parsing_ends_in_an_endpoint_or_an_error(text: str) -> None:
    try:
        endpoint = Endpoint.parse(text)
    except DeviceError:
        return
    assert Endpoint.parse(endpoint.base) == endpoint
