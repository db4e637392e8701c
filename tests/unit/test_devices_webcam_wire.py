"""Addresses of network cameras, as users type them."""

from __future__ import annotations

import pytest

from app.devices.webcam import WebcamError
from app.devices.webcam.network_connection import Address


@pytest.mark.parametrize(
    ("typed", "whole"),
    [
        ("192.168.1.20:8080/video", "http://192.168.1.20:8080/video"),
        (" HTTP://Phone.Local:8080 ", "http://phone.local:8080/"),
        ("http://10.0.0.7:80/", "http://10.0.0.7/"),
        ("https://10.0.0.7:8443/video?fps=15", "https://10.0.0.7:8443/video?fps=15"),
        ("https://10.0.0.7", "https://10.0.0.7/"),
        ("https://10.0.0.7:80/", "https://10.0.0.7:80/"),
        ("rtsp://10.0.0.7/live", "rtsp://10.0.0.7/live"),
        ("rtsp://10.0.0.7:554/live", "rtsp://10.0.0.7/live"),
        ("rtsp://10.0.0.7:8554?x=1", "rtsp://10.0.0.7:8554/?x=1"),
        ("http://[fe80::1%eth0]:8080/video", "http://[fe80::1%25eth0]:8080/video"),
    ],
)
def test_what_is_typed_becomes_an_address(typed: str, whole: str) -> None:
    address = Address.parse(typed)
    assert str(address) == whole
    assert Address.parse(str(address)) == address


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ("", "empty"),
        ("   ", "empty"),
        ("http://", "no host"),
        ("http:///video", "no host"),
        ("file:///etc/passwd", "“file”"),
        ("ftp://10.0.0.7/x", "“ftp”"),
        ("rtmp://10.0.0.7/x", "“rtmp”"),
        ("concat://a|b", "“concat”"),
        ("http://anna:geheim@10.0.0.7/video", "user name or password"),
        ("rtsp://anna@10.0.0.7/video", "user name or password"),
        ("http://10.0.0.7:0/", "port"),
        ("http://10.0.0.7:70000/", "not"),
        ("http://10.0.0.7:abc/", "not the address"),
        ("http://300.0.0.7/", "not the address"),
        ("http://a b/", "not the address"),
        ("http://10.0.0.7/a b", "invalid characters"),
        ("http://10.0.0.7/../x", "invalid characters"),
        ("http://10.0.0.7/a\r\nHost: b", "invalid characters"),
        ("http://10.0.0.7/#x", "invalid characters"),
        ("http://" + "a" * 600, "too long"),
        ("-rtsp_flags listen", "not the address"),
    ],
)
def test_what_is_no_address_is_said(typed: str, words: str) -> None:
    with pytest.raises(WebcamError, match=words) as caught:
        Address.parse(typed)
    assert caught.value.code == "bad-address"
    assert caught.value.hint
    assert "geheim" not in str(caught.value)


def test_a_password_in_the_query_is_noticed_and_never_shown() -> None:
    address = Address.parse("http://10.0.0.7:81/video?user=anna&PWD=geheim")
    assert address.secret
    assert address.host == "10.0.0.7:81"
    assert not Address.parse("http://10.0.0.7/video?channel=1").secret
