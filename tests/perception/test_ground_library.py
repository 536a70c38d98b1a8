"""The ground by scikit-learn's RANSAC: the same plane as ours, and as honest about none."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from backend.errors import InputError
from backend.perception.ground import find_ground
from backend.perception.ground_library import find_ground_by_library
from cockpit.detect import Times, run_detect


def hill(slope_deg: float, seed: int, clutter: int = 400) -> np.ndarray:
    """A plane through (0, 0, 1.5) with noise, and things that stand on it."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-10.0, 10.0, (2000, 2))
    z = 1.5 + np.tan(np.radians(slope_deg)) * xy[:, 0] + rng.normal(scale=0.02, size=2000)
    ground = np.column_stack([xy, z])
    things = rng.uniform([-10.0, -10.0, 0.3], [10.0, 10.0, 3.0], (clutter, 3))
    things[:, 2] += 1.5 + np.tan(np.radians(slope_deg)) * things[:, 0]
    return rng.permutation(np.concatenate([ground, things]))


@pytest.mark.parametrize("slope", [0.0, 5.0, 20.0])
@pytest.mark.parametrize("seed", range(3))
def test_both_find_the_same_plane(slope: float, seed: int) -> None:
    points = hill(slope, seed)
    ours, theirs = find_ground(points), find_ground_by_library(points)
    assert ours is not None
    assert theirs is not None
    for plane in (ours, theirs):
        tilt = np.degrees(np.arccos(plane.normal @ [0.0, 0.0, 1.0]))
        assert tilt == pytest.approx(slope, abs=0.3)
        assert abs(plane.heights(np.array([[0.0, 0.0, 1.5]]))[0]) < 0.02
        assert 0.75 < plane.share < 0.95


def test_what_is_too_steep_or_too_little_is_no_ground() -> None:
    assert find_ground_by_library(hill(60.0, 0, clutter=0)) is None
    assert find_ground_by_library(hill(0.0, 0)[:40]) is None


def test_without_the_library_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sklearn.linear_model", None)
    with pytest.raises(InputError, match=r"a.pcd: scikit-learn is not installed; pip install '"):
        find_ground_by_library(hill(0.0, 0), where="a.pcd")


def test_cockpit_detect_takes_either(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(1)
    person = rng.uniform([3.8, -0.2, 1.6], [4.2, 0.2, 3.2], (300, 3))
    points = np.concatenate([hill(0.0, 1, clutter=0), person])
    file = tmp_path / "scan.pcd"
    rows = "\n".join(" ".join(f"{v:.4f}" for v in point) for point in points)
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    n = len(points)
    file.write_text(f"{head}WIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA ascii\n{rows}\n")
    said = []
    for way in ("msac", "scikit-learn"):
        run_detect([file], False, None, True, 0.4, "0,0,3", 25.0, Times(), None, way)
        said.append(capsys.readouterr().out)
        assert "1 object" in said[-1]
    with pytest.raises(InputError, match="--ground-by pca: allowed are msac and scikit-learn"):
        run_detect([file], False, None, True, 0.4, "0,0,3", 25.0, Times(), None, "pca")
