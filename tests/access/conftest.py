"""Fixtures of the access tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from gatehouse import House, house, make_users


@pytest.fixture(scope="session")
def users_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_users(tmp_path_factory.mktemp("users"))


@pytest.fixture(scope="module")
def closed(users_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    """An app that asks for passwords."""
    with house(tmp_path_factory.mktemp("house"), users_file, metrics_token="m3trics") as running:
        yield running
