"""Passwords stay in the keyring; a keyring that fails is never the user's trouble."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import keyring
import pytest
from keyring.backend import KeyringBackend
from keyring.backends import fail, null
from keyring.errors import InitError, KeyringLocked, PasswordDeleteError

from app.core.base.errors import CoreError
from app.devices.passwords import (
    SERVICE,
    Passwords,
    default_password_hint,
    read_password_file,
)

USER = "THETAYL00105377"


class Memory(KeyringBackend):
    priority = 1

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.kept: dict[tuple[str, str], str] = {}

    def get_password(self, service: str, username: str) -> str | None:
        return self.kept.get((service, username))

    def set_password(self, service: str, username: str, password: str) -> None:
        self.kept[service, username] = password

    def delete_password(self, service: str, username: str) -> None:
        if (service, username) not in self.kept:
            raise PasswordDeleteError("no such password")
        del self.kept[service, username]


class Broken(KeyringBackend):
    priority = 1

    def __init__(self, error: Exception) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.error = error

    def get_password(self, service: str, username: str) -> str | None:
        raise self.error

    def set_password(self, service: str, username: str, password: str) -> None:
        raise self.error

    def delete_password(self, service: str, username: str) -> None:
        raise self.error


class Hanging(KeyringBackend):
    """Asks somebody who is not there to unlock it."""

    priority = 1

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.release = threading.Event()

    def get_password(self, service: str, username: str) -> str | None:
        self.release.wait(120.0)
        return "too late"

    def set_password(self, service: str, username: str, password: str) -> None:
        self.release.wait(120.0)

    def delete_password(self, service: str, username: str) -> None:
        self.release.wait(120.0)


@pytest.fixture(autouse=True)
def _own_keyring() -> Iterator[None]:
    before = keyring.get_keyring()
    try:
        yield
    finally:
        keyring.set_keyring(before)


def test_a_password_is_kept_found_and_forgotten() -> None:
    memory = Memory()
    keyring.set_keyring(memory)
    said: list[str] = []
    passwords = Passwords(said.append)
    assert passwords.get(USER) is None
    assert passwords.set(USER, "00105377")
    assert memory.kept == {(SERVICE, USER): "00105377"}
    assert passwords.get(USER) == "00105377"
    assert passwords.get("THETAYL00105378") is None
    assert said == []


@pytest.mark.parametrize(
    "backend",
    [
        fail.Keyring(),  # type: ignore[no-untyped-call]
        Broken(KeyringLocked("locked")),
        Broken(InitError("no session bus")),
        Broken(RuntimeError("anything")),
        Broken(OSError(13, "Permission denied")),
        Broken(UnicodeDecodeError("utf-8", b"\xff", 0, 1, "bad")),
    ],
    ids=["none", "locked", "no bus", "runtime", "os", "unicode"],
)
def test_a_keyring_that_fails_is_said_once_and_never_raised(backend: KeyringBackend) -> None:
    keyring.set_keyring(backend)
    said: list[str] = []
    passwords = Passwords(said.append)
    assert passwords.get(USER) is None
    assert not passwords.set(USER, "secret word")
    assert passwords.get(USER) is None
    assert len(said) == 1
    assert "not saved" in said[0]
    assert Passwords().get(USER) is None


def test_a_keyring_that_keeps_nothing_is_said() -> None:
    keyring.set_keyring(null.Keyring())  # type: ignore[no-untyped-call]
    said: list[str] = []
    passwords = Passwords(said.append)
    assert passwords.get(USER) is None
    assert said == []
    assert not passwords.set(USER, "secret word")
    assert len(said) == 1


def test_a_keyring_that_hangs_is_left_behind() -> None:
    hanging = Hanging()
    keyring.set_keyring(hanging)
    said: list[str] = []
    try:
        assert Passwords(said.append, patience_s=0.05).get(USER) is None
        assert len(said) == 1
    finally:
        hanging.release.set()
        for thread in threading.enumerate():
            if thread.name == "turnlight-keyring":
                thread.join(120.0)


@pytest.mark.parametrize("password", ["", "x" * 257, "two\nlines", "nul\0"])
def test_what_is_no_password_is_not_kept(password: str) -> None:
    memory = Memory()
    keyring.set_keyring(memory)
    assert not Passwords().set(USER, password)
    assert memory.kept == {}
    memory.kept[SERVICE, USER] = password
    assert Passwords().get(USER) is None


def test_nothing_is_asked_for_nobody() -> None:
    keyring.set_keyring(Broken(RuntimeError("must not be asked")))
    said: list[str] = []
    passwords = Passwords(said.append)
    assert passwords.get("") is None
    assert not passwords.set("", "x")
    assert said == []


def test_no_password_is_ever_written_or_logged(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    secret = "hush-hush-4711"
    with caplog.at_level(logging.DEBUG):
        backends: list[KeyringBackend] = [Memory(), Broken(RuntimeError(secret))]
        for backend in backends:
            keyring.set_keyring(backend)
            said: list[str] = []
            passwords = Passwords(said.append)
            passwords.set(USER, secret)
            passwords.get(USER)
            assert secret not in "".join(said)
            assert secret not in repr(vars(passwords))
    assert secret not in caplog.text
    out, err = capfd.readouterr()
    assert secret not in out + err
    assert list(tmp_path.rglob("*")) == []


# --- files ---


@pytest.mark.parametrize(
    ("data", "password"),
    [
        (b"00105377\n", "00105377"),
        (b"00105377", "00105377"),
        (b"00105377\r\nmore\r\n", "00105377"),
        (b"\xef\xbb\xbf00105377\n", "00105377"),
        (b" with spaces \n", " with spaces "),
        ("Grüße".encode(), "Grüße"),
        (b"x" * 256 + b"\n" + b"y" * 100000, "x" * 256),
    ],
)
def test_the_first_line_is_the_password(tmp_path: Path, data: bytes, password: str) -> None:
    file = tmp_path / "password.txt"
    file.write_bytes(data)
    assert read_password_file(file) == password


@pytest.mark.parametrize(
    "data", [b"", b"\n00105377\n", b"secret" + b"x" * 300, b"secret\x00", b"secret\xff\n"]
)
def test_a_file_without_a_password_is_refused_without_telling_it(
    tmp_path: Path, data: bytes
) -> None:
    file = tmp_path / "file.txt"
    file.write_bytes(data)
    with pytest.raises(CoreError) as caught:
        read_password_file(file)
    assert "secret" not in str(caught.value)
    assert caught.value.__cause__ is None


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match="no such file"):
        read_password_file(tmp_path / "nothing")
    with pytest.raises(CoreError, match="cannot be read"):
        read_password_file(tmp_path)
    with pytest.raises(CoreError, match="cannot be read"):
        read_password_file("a\0b")


@pytest.mark.skipif(os.name != "posix", reason="only POSIX states what others may do")
def test_a_file_that_others_can_read_is_said_and_taken(tmp_path: Path) -> None:
    file = tmp_path / "password.txt"
    file.write_text("00105377\n", "utf-8")
    warnings: list[str] = []
    file.chmod(0o600)
    assert read_password_file(file, warnings.append) == "00105377"
    assert warnings == []
    file.chmod(0o644)
    assert read_password_file(str(file), warnings.append) == "00105377"
    (warning,) = warnings
    assert "Other users can read" in warning
    assert "00105377" not in warning


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_a_pipe_does_as_well(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    def write() -> None:
        pipe.write_bytes(b"00105377\n")

    writer = threading.Thread(target=write)
    writer.start()
    warnings: list[str] = []
    assert read_password_file(pipe, warnings.append) == "00105377"
    writer.join()
    assert warnings == []


# --- what the password is when nobody has set one ---


@pytest.mark.parametrize(
    ("model", "serial", "digits"),
    [
        ("RICOH THETA V", "00105377", True),
        ("RICOH THETA V", "", True),
        ("RICOH THETA Z1", "00010104", True),
        ("RICOH THETA Z1", "10010104", False),
        ("RICOH THETA Z1", "THETAYN50010104", False),
        ("RICOH THETA Z1", "YN60010104", True),
        ("RICOH THETA X", "YR20010104", False),
        ("RICOH THETA X", "00010104", True),
        ("RICOH360 THETA A1", "10010104", False),
    ],
)
def test_the_hint_says_whether_there_is_a_first_password(
    model: str, serial: str, digits: bool
) -> None:
    hint = default_password_hint(model, serial)
    assert ("eight digits" in hint) is digits
    assert ("no password yet" in hint) is not digits
    assert not serial or serial not in hint


def test_the_hint_says_both_where_the_model_is_not_known() -> None:
    for model, serial in (("", ""), ("RICOH THETA Z1", ""), ("Whatever", "10010104")):
        hint = default_password_hint(model, serial)
        assert "eight digits" in hint
        assert "no password until one is set" in hint
