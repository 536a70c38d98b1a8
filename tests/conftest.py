"""Shared fixtures."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import ARGUMENTS, executable
from hypothesis import settings
from playwright.sync_api import Browser, sync_playwright
from watched import watch

__all__ = ["watch"]

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"

# How long an example takes is no property of the code. The same examples every time, so that a
# change is judged by what it changes; HYPOTHESIS_PROFILE=random looks for new ones.
settings.register_profile("cockpit", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "cockpit"))

# Before any program under test starts: none may record into the home of who runs the tests.
RECORDINGS = tempfile.mkdtemp(prefix="cockpit-recordings-")
os.environ["EXCAVATOR_COCKPIT_RECORDINGS"] = RECORDINGS
# Nor may any see the users of who runs the tests, or write into their audit log.
HOME = tempfile.mkdtemp(prefix="cockpit-home-")
os.environ["XDG_CONFIG_HOME"] = str(Path(HOME) / "config")
os.environ["XDG_STATE_HOME"] = str(Path(HOME) / "state")


def pytest_sessionfinish() -> None:
    shutil.rmtree(RECORDINGS, ignore_errors=True)
    shutil.rmtree(HOME, ignore_errors=True)


@pytest.fixture(scope="session")
def repository() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Descriptions of real machines and tracks, kept outside the project."""
    return SHARED


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A real browser; one a module, because its event loop holds the thread while it lives."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=executable(), args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def artifacts() -> Path:
    """Where screenshots are kept for people to look at."""
    folder = ROOT / "artifacts"
    folder.mkdir(exist_ok=True)
    return folder


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests of real descriptions run where the descriptions are, and are deselected elsewhere."""
    if SHARED.is_dir():
        return
    absent = [i for i in items if _needs_shared(i)]
    items[:] = [i for i in items if i not in absent]
    config.hook.pytest_deselected(items=absent)


def _needs_shared(item: pytest.Item) -> bool:
    parameters = item.callspec.params.values() if hasattr(item, "callspec") else ()
    named = any(isinstance(value, str) and value == "zx200" for value in parameters)
    return named or "shared_data" in getattr(item, "fixturenames", ())


def pytest_report_header() -> str:
    here = "present" if SHARED.is_dir() else "absent: tests that need it are deselected"
    return f"descriptions of real machines (../shared/data): {here}"
