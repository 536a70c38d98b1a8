"""Shared fixtures."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"


@pytest.fixture(scope="session")
def repository() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Descriptions of real machines and tracks, kept outside the project."""
    return SHARED


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests of real descriptions run where the descriptions are, and are deselected elsewhere."""
    if SHARED.is_dir():
        return
    absent = [i for i in items if "shared_data" in getattr(i, "fixturenames", ())]
    items[:] = [i for i in items if i not in absent]
    config.hook.pytest_deselected(items=absent)


def pytest_report_header() -> str:
    here = "present" if SHARED.is_dir() else "absent: tests that need it are deselected"
    return f"descriptions of real machines (../shared/data): {here}"
