"""Tipping over in the cycle: known, unknown, told, limited, in the document and back."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from backend.cspace.cells import FREE, TIP_OVER
from backend.documents.snapshot import snapshot_document
from backend.fusion.samples import AttitudeSample, Fix, FixSample, HeadingSample, JointSample
from backend.machine import kinematics
from backend.machine.inverse import inverse
from backend.machine.load import load_machine
from backend.machine.sun_map import sun_angles
from backend.pipeline.config import Config
from backend.pipeline.exact import ARM, Cells, own_image
from backend.pipeline.records import Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.safety import words
from backend.safety.arbiter import arbitrate
from backend.safety.partner import Limits
from backend.safety.record import Level
from backend.safety.tip_over import NAME, TipOver
from backend.shell.app.image_frames import exact_frame
from backend.shell.app.models import SnapshotModel
from backend.shell.app.wire import decode, dumps
from backend.shell.session.recorded_snapshot import recorded_snapshot
from backend.site.site import load_site
from backend.spatial import rotation, transform
from backend.stability.masses import mass_model
from backend.stability.polygon import shrunk, support_polygon
from backend.stability.zmp import edge_moments, margin, share, zmp

STRETCHED = np.radians([90.0, 15.0, -32.0, -20.0])
FOLDED = np.radians([0.0, 50.0, -130.0, -60.0])
STILL = np.zeros(4)


@pytest.fixture(scope="module")
def config() -> Config:
    site = load_site("sun2020-simulation")
    return Config(
        frame=site.frame,
        machines={"a": load_machine("ex13")},
        labels={"a": "LEFT"},
        own=("a",),
        limits=Limits(0.8, 0.2),
        eta=0.1,
        mode="LIVE",
        margins=False,
        stability=TipOver(payload={"a": 1000.0}),
    )


def run(config, q, rates=STILL, pitch=0.0, seconds=0.6, tilt=True, driven=(), bend=STILL):
    """The last snapshot of a machine that moves so that it is at q with these rates at the end."""
    machine, state, found = config.machines["a"], initial(config), None
    for k in range(round(seconds / 0.02)):
        now = 100.0 + 0.02 * k
        for stamp in (now - 0.02, now - 0.01):
            t = stamp - (100.0 + seconds - 0.03)
            values = q + rates * t + 0.5 * bend * t**2
            samples = _samples(config, machine, values, rates + bend * t, pitch, stamp, now, tilt)
            state, found = step(state, Inputs(samples, driven=driven), now, config)
    assert isinstance(found, Snapshot)
    return found


def _samples(config, machine, values, rates, pitch, stamp, now, tilt):
    R = rotation.from_attitude(0.0, pitch, 0.0)
    T = transform.make(R, np.zeros(3))
    poses = kinematics.link_poses(machine, values, T)
    antenna = transform.apply(poses[machine.antenna.link], machine.antenna.position[None])[0]
    ahead = R @ [math.cos(values[0]), math.sin(values[0]), 0.0]
    heading = math.atan2(ahead[1], ahead[0])
    names = tuple(joint.role for joint in machine.joints)
    samples = [
        JointSample("a", stamp, now, names, values, rates),
        FixSample(
            *("a", stamp, now, *config.frame.to_geodetic(antenna), np.eye(3) * 1e-4, Fix.RTK_FIXED)
        ),
        HeadingSample("a", stamp, now, heading, 1e-6),
    ]
    if tilt:
        samples.append(
            AttitudeSample(
                *("a", stamp, now, machine.links[0].name, rotation.to_quaternion(R), np.zeros(3)),
                1e-6,
            )
        )
    return tuple(samples)


def tip_over(snapshot):
    return next((c for c in snapshot.concerns if c.name == NAME), None)


def test_a_machine_at_rest_is_judged_by_its_zmp(config):
    machine = config.machines["a"]
    for pitch in (0.0, -0.12):
        found = run(config, STRETCHED, pitch=pitch).stability["a"]
        T = transform.make(rotation.from_attitude(0.0, pitch, 0.0), np.zeros(3))
        wanted = zmp(mass_model(machine, 1000.0), STRETCHED, STILL, STILL, T)
        support = support_polygon(machine)
        assert found.reason == ""
        np.testing.assert_allclose(found.zmp, wanted, atol=1e-4)
        assert found.margin == pytest.approx(margin(wanted, support), abs=1e-4)
        assert found.share == pytest.approx(share(wanted, support), abs=1e-4)
        assert found.edge == "left"
        assert 0.0 < found.sigma < 0.35
        assert 0.0 < found.critical_lift < math.inf
        assert 0.0 < found.critical_swing < math.inf


def test_the_rates_of_a_swing_and_its_acceleration_count(config):
    machine, rates = config.machines["a"], np.array([0.9, 0.0, 0.0, 0.0])
    bend = np.array([1.2, 0.0, 0.0, 0.0])
    model = mass_model(machine, 1000.0)
    found = run(config, STRETCHED, rates).stability["a"]
    wanted = zmp(model, STRETCHED, rates, STILL)
    assert np.linalg.norm(wanted - zmp(model, STRETCHED, STILL, STILL)) > 0.05
    np.testing.assert_allclose(found.zmp, wanted, atol=0.03)
    found = run(config, STRETCHED, rates, bend=bend).stability["a"]
    wanted = zmp(model, STRETCHED, rates, bend)
    assert np.linalg.norm(wanted - zmp(model, STRETCHED, rates, STILL)) > 0.05
    np.testing.assert_allclose(found.zmp, wanted, atol=0.06)


def test_the_curve_is_where_the_payload_leaves_what_must_be_kept(config):
    """In every direction the machine put there has that share left, or its arm ends there."""
    machine, support = config.machines["a"], support_polygon(config.machines["a"])
    heavy = dataclasses.replace(config, stability=TipOver(payload={"a": 2000.0}))
    holds = run(heavy, STRETCHED).stability["a"].holds
    assert holds.shape == (36,)
    height = kinematics.end_point(machine, STRETCHED)[2]
    shares = []
    for k in np.flatnonzero(np.isfinite(holds)):
        angle = -np.pi + k * np.pi / 18
        tip = np.array([holds[k] * math.cos(angle), holds[k] * math.sin(angle), height])
        attitude = float(sun_angles(machine, STRETCHED).sum())
        q = inverse(machine, tip, attitude).q
        shares.append(share(zmp(mass_model(machine, 2000.0), q, STILL, STILL), support))
    assert len(shares) == 36
    ends = holds > holds.max() - 0.01
    np.testing.assert_allclose(np.array(shares)[~ends], 0.1, atol=0.02)
    assert (np.array(shares)[ends] > 0.08).all()
    assert 5 < ends.sum() < 31
    assert holds[18] > holds[27] + 0.5  # farther ahead than to the left


def test_a_firm_machine_is_clear_and_free(config):
    concern = tip_over(run(config, FOLDED, driven=("a",)))
    assert concern.level is Level.CLEAR
    assert (concern.allowed == 1.0).all()
    assert (concern.travel == 1.0).all()


def test_near_the_edge_it_is_told_and_motions_away_stay_free(config):
    heavy = dataclasses.replace(config, stability=TipOver(payload={"a": 1450.0}))
    snapshot = run(heavy, STRETCHED)
    concern = tip_over(snapshot)
    percent = math.floor(100 * snapshot.stability["a"].share)
    assert concern.level is Level.SLOW
    assert words.line(concern, config.labels) == f"SLOW · LEFT tips over left · margin {percent} %"
    assert "stick out" in words.detail(concern, config.machines["a"], config.labels)
    allowed = arbitrate(snapshot.concerns, "a", 4)[1]
    assert allowed[2, 1] < 0.2  # stick out
    assert concern.allowed[2, 0] > concern.allowed[2, 1]  # in
    assert any(alarm.concern.name == NAME and alarm.active for alarm in snapshot.alarms)


def test_beyond_what_must_be_kept_it_stops_what_leads_on(config):
    heavy = dataclasses.replace(config, stability=TipOver(payload={"a": 2200.0}))
    concern = tip_over(run(heavy, STRETCHED))
    assert concern.level is Level.STOP
    assert concern.allowed[2, 1] == 0.0
    assert concern.allowed[2, 0] > 0.0
    told_only = dataclasses.replace(heavy, stability=TipOver(payload={"a": 2200.0}, limits=False))
    concern = tip_over(run(told_only, STRETCHED))
    assert concern.level is Level.STOP
    assert (concern.allowed == 1.0).all()


def test_without_a_stated_payload_the_rated_one_counts(config):
    rated = dataclasses.replace(config, stability=TipOver())
    assert run(rated, FOLDED).stability["a"].payload == config.machines["a"].payload > 0.0


@pytest.mark.parametrize(
    ("change", "tilt", "said"),
    [("masses", True, "not trusted"), ("slope", False, "slope is not measured")],
)
def test_what_is_not_known_is_told_and_limits_only_where_the_site_asks(config, change, tilt, said):
    machine = config.machines["a"]
    if change == "masses":
        machine = dataclasses.replace(machine, masses_trusted=False)
    doubted = dataclasses.replace(config, machines={"a": machine})
    snapshot = run(doubted, STRETCHED, tilt=tilt)
    assert said in snapshot.stability["a"].reason
    assert math.isnan(snapshot.stability["a"].share)
    assert tip_over(snapshot) is None
    asked = dataclasses.replace(doubted, stability=TipOver(required=True))
    concern = tip_over(run(asked, STRETCHED, tilt=tilt))
    assert concern.level is Level.UNKNOWN
    assert said in concern.reason
    assert not concern.allowed.any()
    assert not concern.travel.any()


def test_a_silent_machine_is_not_said_to_stand(config):
    machine, state = config.machines["a"], initial(config)
    samples = _samples(config, machine, FOLDED, STILL, 0.0, 99.98, 100.0, True)
    state, snapshot = step(state, Inputs(samples), 100.0, config)
    for k in range(100):
        state, snapshot = step(state, Inputs(), 100.0 + 0.02 * k, config)
    assert "old" in snapshot.stability["a"].reason


def test_a_config_without_it_judges_nothing(config):
    snapshot = run(dataclasses.replace(config, stability=None), STRETCHED)
    assert snapshot.stability == {}
    assert tip_over(snapshot) is None


@pytest.mark.parametrize("payload", [1000.0, 2e5])
def test_the_document_fits_its_schema_and_reads_back(config, payload):
    heavy = dataclasses.replace(config, stability=TipOver(payload={"a": payload}))
    snapshot = run(heavy, STRETCHED)
    document = json.loads(dumps(snapshot_document(snapshot, heavy)))
    SnapshotModel.model_validate(document)
    again = recorded_snapshot(document, heavy).stability["a"]
    for name, value in dataclasses.asdict(snapshot.stability["a"]).items():
        if name == "holds":
            np.testing.assert_allclose(again.holds, value, atol=6e-4)
        elif name != "support":
            np.testing.assert_array_equal(getattr(again, name), value, err_msg=name)
    assert again.support.names == snapshot.stability["a"].support.names
    assert 0.0 <= document["stability"]["a"]["percent"] <= 100.0


def test_rules_are_in_order():
    with pytest.raises(ValueError, match="less than slow"):
        TipOver(keep=0.3, slow=0.2)


def test_images_tell_where_the_resting_machine_tips(config):
    heavy = dataclasses.replace(config, stability=TipOver(payload={"a": 5000.0}, keep=0.1))
    machine, small = heavy.machines["a"], Cells(slice=24, bar=36, volume=10, reach=(24, 16))
    snapshot = run(heavy, FOLDED, pitch=0.05)
    image = own_image(snapshot, heavy, "a", small)
    assert image.tip_over == ""
    pose, body = snapshot.machines["a"].pose, snapshot.machines["a"].body
    kept = shrunk(support_polygon(machine), 0.1)
    model = mass_model(machine, 5000.0)

    def tip(q):
        still = np.zeros_like(q)
        return edge_moments(model, kept, q, still, still, body.link_poses[0]).min(axis=-1) < 0.0

    seen = set()
    for part in image.slices:
        i, j = ARM.index(part.across), ARM.index(part.up)
        q = np.broadcast_to(pose.joints, (*part.cells.shape, 4)).copy()
        q[..., i] = middles(part.x, 24)[:, None]
        q[..., j] = middles(part.y, 24)
        np.testing.assert_array_equal((part.cells & TIP_OVER) > 0, tip(q))
        assert not (part.cells[tip(q)] & FREE).any()
        seen |= set(np.unique(part.cells & TIP_OVER).tolist())
    for k, bar in enumerate(image.bars):
        q = np.tile(pose.joints, (36, 1))
        q[:, k] = middles(bar.edges, 36)
        np.testing.assert_array_equal((bar.cells & TIP_OVER) > 0, tip(q))
    assert seen == {0, TIP_OVER}
    assert image.reach.layers["tip-over"].any()
    header, arrays = decode(exact_frame(image))
    assert header["tip_over"] == {"judged": True, "reason": ""}
    assert ((arrays["reach"] & 128) > 0).sum() == image.reach.layers["tip-over"].sum()


def test_images_say_when_tipping_over_is_not_known(config):
    machine = dataclasses.replace(config.machines["a"], masses_trusted=False)
    snapshot = run(dataclasses.replace(config, machines={"a": machine}), FOLDED)
    unknown = dataclasses.replace(config, machines={"a": machine})
    image = own_image(snapshot, unknown, "a", Cells(slice=8, bar=8, volume=4, reach=(8, 8)))
    assert "not trusted" in image.tip_over
    assert "tip-over" not in image.reach.layers
    nobody = dataclasses.replace(config, stability=None)
    image = own_image(
        run(nobody, FOLDED), nobody, "a", Cells(slice=8, bar=8, volume=4, reach=(8, 8))
    )
    assert image.tip_over is None


def middles(edges, n):
    lower, upper = edges
    return lower + (np.arange(n) + 0.5) * (upper - lower) / n
