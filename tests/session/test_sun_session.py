"""Sun's experiment: CAN log -> session -> pipeline -> the numbers that Section 5 prints."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from backend.cspace.sun import SunPose
from backend.cspace.sun_driving import length_samples, zone_distance
from backend.cspace.sun_images import sun_image
from backend.cspace.sun_manipulation import co_d, co_theta, contact_vectors, in_obstacle, joint_sets
from backend.cspace.sun_pose import sun_pose
from backend.fusion.pose import Validity
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.safety.partner import Limits
from backend.shell.session.cycles import Topics
from backend.shell.session.evaluate import evaluate
from backend.shell.session.format import METADATA, Header
from backend.shell.session.reader import open_session
from backend.shell.session.sun2020 import LOG, NAME, NOTE, SITE, frames, write_session
from backend.site.site import load_site
from backend.spatial.types import Array

FIG22_LINE = 3.7231  # length of A's line in Fig. 22, fitted to it (see test_sun_paper.py)


@dataclass(frozen=True)
class Replay:
    """snapshots: of the whole session; times: of each since the log's first row [s]."""

    folder: Path
    times: Array
    snapshots: list[Snapshot]

    def poses(self, at: float) -> tuple[SunPose, SunPose]:
        mini = load_machine("mini")
        snapshot = self.snapshots[int(np.searchsorted(self.times, at))]
        states = [snapshot.machines[name].pose for name in ("a", "b")]
        assert all(pose.validity is Validity.VALID for pose in states)
        a, b = (sun_pose(mini, pose) for pose in states)
        return a, b


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    folder = tmp_path_factory.mktemp("sun")
    done = write_session(folder)
    site, mini = load_site(SITE), load_machine("mini")
    config = Config(
        frame=site.frame,
        machines={"a": mini, "b": mini},
        labels={"a": "A", "b": "B"},
        own=("a", "b"),
        limits=Limits(site.safety.slow_below, site.safety.stop_below),
        eta=site.safety.eta,
        mode="PLAYBACK",
    )
    session = open_session(done.out)
    pairs = list(evaluate(session, Topics.of(site), config))
    times = np.array([portion.time - session.begin for portion, _ in pairs]) / 1e9
    return Replay(folder, times, [snapshot for _, snapshot in pairs])


def tables(replay: Replay) -> tuple[SunPose, SunPose]:
    """The posture of Tables 4 to 6, as the session ends."""
    return replay.poses(8.0)


def test_the_log_of_the_paper_is_in_it_row_by_row() -> None:
    printed = [f for f in frames() if f.logged]
    assert len(printed) == 24
    assert [f.identifier for f in printed[:8]] == [401, 403, 405, 407, 402, 404, 406, 408]
    assert LOG.read_text().count("Rx") == 24


def test_postures(replay: Replay) -> None:
    a, b = replay.poses(1.0)  # as logged
    assert np.degrees([a.pitch, a.boom, a.stick, a.bucket]) == pytest.approx(
        [-0.9, 26.8, -38.6, 42.2], abs=1e-6
    )
    assert np.degrees([b.pitch, b.boom, b.stick, b.bucket]) == pytest.approx(
        [-1.2, 79.0, -103.7, 14.6], abs=1e-6
    )
    a, b = tables(replay)
    origin = np.array(load_site(SITE).frame.origin)[:2]
    # Tables 4 and 6: positions to the millimetre, angles to a tenth or hundredth of a degree.
    assert a.position + origin == pytest.approx([308611.05, 4129957.348], abs=5e-4)
    assert b.position + origin == pytest.approx([308610.834, 4129952.567], abs=5e-4)
    assert np.degrees([a.yaw, b.yaw]) == pytest.approx([-36.7, 79.14], abs=5e-3)
    assert np.degrees([a.pitch, a.boom, a.stick, a.bucket]) == pytest.approx(
        [-0.9, 26.8, -38.6, 42.2], abs=1e-6
    )
    assert np.degrees([b.pitch, b.boom, b.stick, b.bucket]) == pytest.approx(
        [-1.2, 44.8, -80.1, -22.0], abs=1e-6
    )
    assert [a.d, b.d] == pytest.approx([4.08410, 3.37557], abs=5e-6)


def test_logged_reach_of_b_is_nearer_to_the_texts_than_table_6(replay: Replay) -> None:
    # Section 5.3: "the current d_B is 2.94". The logged posture gives 2.90, Table 6's 3.38.
    assert replay.poses(1.0)[1].d == pytest.approx(2.905, abs=1e-3)


def fig22(replay: Replay) -> tuple[Array, Array]:
    a, b = tables(replay)
    vectors = contact_vectors(a, b, length_samples(FIG22_LINE, 49)[::-1])
    theta = co_theta(vectors)
    return theta, co_d(vectors, theta)


def test_figure_22(replay: Replay) -> None:
    theta, d = fig22(replay)
    assert theta[:3] == pytest.approx([0.6738, 0.6919, 0.7101], abs=1e-4)
    assert theta[-3:] == pytest.approx([1.4989, 1.5124, 1.5256], abs=1e-4)
    assert d[:3] == pytest.approx([4.0963, 4.0777, 4.0604], abs=1e-4)


def test_figure_24(replay: Replay) -> None:
    theta, d = (values[:33] for values in fig22(replay))
    b = tables(replay)[1]
    level = SunPose(b.position, b.yaw, 0.0, b.boom, b.stick, b.bucket, b.lengths)
    sets = joint_sets(theta, d, level, eta=0.1, m=32)
    first = [[0.2659, 0.2793, 0.2911], [0.3150, 0.3284, 0.3402], [0.3641, 0.3775, 0.3893]]
    last = [[1.6929, 1.6705, 1.6434], [1.7420, 1.7195, 1.6925], [1.7911, 1.7686, 1.7416]]
    assert np.abs(sets.boom[:3, :3] - first).max() < 1e-4
    assert np.abs(sets.boom[-3:, -3:] - last).max() < 1e-4


def test_figures_21_and_23_no_collision(replay: Replay) -> None:
    a, b = tables(replay)
    image = sun_image(a, b, float(b.lengths.sum()), 0.1, 49, 49)
    yaw = np.linspace(0.0, 2.0 * np.pi, 3601)
    for length in (2.94, b.d):
        assert not in_obstacle(image.theta, image.d, yaw, length).any()
    assert not image.current.collides
    assert not image.current.in_joint_set
    assert zone_distance(a, b.d, 0.1, b.position) == pytest.approx(0.4868, abs=1e-3)


def test_the_outlier_moves_nothing(replay: Replay) -> None:
    pitches = [s.machines["a"].pose.pitch for s in replay.snapshots[2:]]
    assert np.degrees(pitches) == pytest.approx(-0.9, abs=1e-6)


def test_the_shipped_session_is_what_the_generator_writes(replay: Replay, repository: Path) -> None:
    shipped = repository / "scenes" / "sessions"
    assert (shipped / f"{NAME}.asc").read_bytes() == (replay.folder / f"{NAME}.asc").read_bytes()
    headers, contents = [], []
    for folder in (shipped, replay.folder):
        with (folder / f"{NAME}.mcap").open("rb") as file:
            reader = make_reader(file)
            texts = next(m.metadata for m in reader.iter_metadata() if m.name == METADATA)
            headers.append(Header.read(texts, str(folder)))
            contents.append([(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()])
    assert contents[0] == contents[1]
    assert headers[0].note == NOTE
    assert headers[0].origin == headers[1].origin
