"""`cockpit detect`: clouds in, boxes out, in words, as JSON and as the table that `track` reads."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import cloud_files as files
import jsonschema
import numpy as np
import pytest
from program import cockpit

from backend.shell.sim.lidar import Lidar, Person, scan
from backend.spatial.boxes import NO_BOXES

SENSOR = np.eye(4)
SENSOR[2, 3] = 2.0


def points(*people: tuple[float, float], seed: int = 0) -> np.ndarray:
    """A turn of a LiDAR 2 m above the ground."""
    everybody = tuple(Person(np.array(place)) for place in people)
    return scan(Lidar(), SENSOR, NO_BOXES, everybody, np.random.default_rng(seed)).points


def detected(*arguments: str) -> Any:
    done = cockpit("detect", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, json.loads(cockpit("schema", "detection").stdout))
    return document["scans"]


def test_two_people_in_a_cloud(tmp_path: Path) -> None:
    path = tmp_path / "a.pcd"
    path.write_bytes(files.pcd(points((5.0, 1.0), (-4.0, -3.0)), "binary", "0 0 2 1 0 0 0"))
    (found,) = detected(str(path))
    places = sorted(box["position"] for box in found["objects"])
    np.testing.assert_allclose([p[:2] for p in places], [[-4.0, -3.0], [5.0, 1.0]], atol=0.15)
    assert found["plane"]["slope"] < 0.02
    assert abs(found["plane"]["offset"]) < 0.05
    stages = found["stages"]
    assert stages["points"] == stages["numbers"] >= stages["near"] > stages["ground"] > 1000
    assert stages["clustered"] == sum(box["points"] for box in found["objects"])
    said = cockpit("detect", str(path)).stdout
    assert f"{stages['points']} points, {stages['near']} within 25 m" in said
    assert "in 2 objects" in said


def test_options_decide_what_counts(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    cloud = points((5.0, 1.0), (5.0, 2.2), (-9.0, -3.0))
    path.write_bytes(files.ply(cloud))
    (found,) = detected(str(path), "--reach", "7", "--link", "1.5")
    assert len(found["objects"]) == 1  # who is beside is linked, who is far is none
    (found,) = detected(str(path), "--origin=-9,-3,2", "--reach", "4")
    assert len(found["objects"]) == 1
    (found,) = detected(str(path), "--no-ground", "--reach", "7")
    assert found["plane"] is None
    assert found["stages"]["ground"] == 0
    far = cloud[cloud[:, 2] > 0.3]
    path.write_bytes(files.ply(far))
    (found,) = detected(str(path), "--no-ground")
    assert len(found["objects"]) == 3
    assert max(box["size"][2] for box in found["objects"]) < 1.8


def test_what_is_far_away_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    shifts = np.array([500_000.0, 4_000_000.0, 100.0])
    path.write_bytes(files.las(points((5.0, 1.0)) + shifts))
    (found,) = detected(str(path))
    assert found["objects"] == []
    assert "see --origin and --reach" in found["notes"][0]
    (found,) = detected(str(path), "--origin", "500000,4000000,102")
    np.testing.assert_allclose(
        found["objects"][0]["position"][:2], [500_005.0, 4_000_001.0], atol=0.15
    )


def walk(folder: Path, name: str) -> list[str]:
    """Ten files a tenth of a second apart; in the last but four nobody is seen."""
    paths = []
    for k in range(10):
        seen = [] if k == 5 else [(4.0 + 0.12 * k, 2.0)]
        path = folder / name.format(k=k, t=f"{1700000000 + 0.1 * k:.1f}")
        path.write_bytes(files.pcd(points(*seen, seed=k), "binary_compressed", "0 0 2 1 0 0 0"))
        paths.append(str(path))
    return paths


def test_scans_become_tracks(tmp_path: Path) -> None:
    out = tmp_path / "d.csv"
    done = cockpit("detect", *walk(tmp_path, "scan{k}.pcd"), "--out", str(out))
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(out.read_text())))
    assert [row["x"] for row in rows].count("") == 1
    done = cockpit("track", str(out))
    assert done.returncode == 0, done.stderr
    tracks = list(csv.DictReader(io.StringIO(done.stdout)))
    last = [row for row in tracks if row["status"] == "confirmed" and row["time"] == "0.9"]
    assert len(last) == 1
    assert float(last[0]["vx"]) == pytest.approx(1.2, abs=0.4)


def test_files_named_by_their_times(tmp_path: Path) -> None:
    paths = walk(tmp_path, "{t}.pcd")[:3]
    assert [s["time"] for s in detected(*paths, "--stamped")] == [1.7e9, 1.7e9 + 0.1, 1.7e9 + 0.2]
    assert [s["time"] for s in detected(*paths, "--period", "0.5")] == [0.0, 0.5, 1.0]
    done = cockpit("detect", *reversed(paths), "--stamped")
    assert (done.returncode, "in the order of their times" in done.stderr) == (2, True)


def test_what_became_of_every_point(tmp_path: Path) -> None:
    paths, out = walk(tmp_path, "scan{k}.pcd")[3:7], tmp_path / "stages.npz"
    done = cockpit("detect", *paths, "--stages", str(out), "--json", "--reach", "15")
    assert done.returncode == 0, done.stderr
    scans = json.loads(done.stdout)["scans"]
    with np.load(out) as told:
        arrays = dict(told)
    assert list(arrays["files"]) == paths
    np.testing.assert_allclose(arrays["times"], [0.0, 0.1, 0.2, 0.3])
    names = list(arrays["stage_names"])
    assert names == ["outside", "machine", "ground", "object", "left"]
    for k, scan_ in enumerate(scans):
        own = arrays["scan"] == k
        counted = dict(zip(names, np.bincount(arrays["stage"][own], minlength=5), strict=True))
        stages = scan_["stages"]
        assert own.sum() == stages["points"]
        assert counted["outside"] == stages["points"] - stages["near"]
        assert (counted["ground"], counted["object"]) == (stages["ground"], stages["clustered"])
        boxes = arrays["boxes"][arrays["box_scan"] == k]
        assert len(boxes) == len(scan_["objects"]) == (0 if k == 2 else 1)
        for box, model in zip(boxes, scan_["objects"], strict=True):
            np.testing.assert_allclose(box[:3], model["position"])
            np.testing.assert_allclose(box[3:], [model["yaw"], *model["size"]])
        plane = scan_["plane"]
        np.testing.assert_allclose(arrays["planes"][k], [*plane["normal"], plane["offset"]])
        assert list(arrays["origins"][k]) == [0.0, 0.0, 2.0]
    last = arrays["cluster"] == len(arrays["boxes"]) - 1
    assert set(arrays["scan"][last]) == {3}
    middle = arrays["points"][last].mean(axis=0)
    np.testing.assert_allclose(middle[:2], arrays["boxes"][-1, :2], atol=0.3)
    done = cockpit("detect", paths[0], "--stages", str(out), "--no-ground")
    assert done.returncode == 0, done.stderr
    with np.load(out) as told:
        assert np.isnan(told["planes"]).all()
    done = cockpit("detect", paths[0], "--stages", str(tmp_path / "none" / "s.npz"))
    assert (done.returncode, "cannot be written" in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("none.pcd",), "none.pcd: cannot be read (No such file or directory)."),
        ((".",), ".: cannot be read (Is a directory)."),
        (("none.pcd", "--origin", "1,2"), "--origin 1,2: allowed are three numbers"),
        (("none.pcd", "--origin", "1,2,inf"), "allowed are three numbers"),
        (("none.pcd", "--link", "3"), "link is 3.0 m; allowed is 0.1 to 2 m"),
        (("none.pcd", "--reach", "nan"), "reach must be above 0"),
        (("none.pcd", "--period", "0"), "--period 0.0: must be above 0"),
        (("none.pcd", "--stamped"), "its name is no time"),
    ],
)
def test_what_is_wrong_is_one_sentence(arguments: tuple[str, ...], says: str) -> None:
    done = cockpit("detect", *arguments)
    assert done.returncode == 2
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_damaged_file_and_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    path = tmp_path / "a.pcd"
    path.write_bytes(files.pcd(points((5.0, 1.0)))[:5_000])
    done = cockpit("detect", str(path))
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "bytes follow" in done.stderr
    path.write_bytes(files.pcd(points((5.0, 1.0))))
    done = cockpit("detect", str(path), "--out", str(tmp_path / "none" / "d.csv"))
    assert (done.returncode, "cannot be written" in done.stderr) == (2, True)
