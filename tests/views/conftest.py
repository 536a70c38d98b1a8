"""A scene's server on the loopback, one for each test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import viser

from cockpit.views.server import open_server


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = open_server()
    yield made
    made.stop()
