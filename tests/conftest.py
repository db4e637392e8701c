"""No test touches what the person at this machine keeps: settings, cameras, passwords."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def nobodys_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A data folder and a keyring of the tests' own, for them and for what they start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TURNLIGHT_HOME", str(tmp_path_factory.mktemp("home")))
        patch.setenv("PYTHON_KEYRING_BACKEND", "keyring.backends.null.Keyring")
        yield
