"""What a method is told of a snapshot: site, partners, what is uncertain."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.control.patterns import Method
from backend.fusion.pose import Validity
from backend.pipeline.config import Config
from backend.pipeline.place import place
from backend.pipeline.records import AS_THE_SITE_SAYS, GaugeInForce
from backend.planning.records import Thresholds
from backend.planning.stopping import threshold_warnings
from backend.safety.limiter import Wish
from backend.safety.partner import Limits
from backend.shell.driving import methods
from backend.shell.driving.methods import JUDGED_EVERY, Methods, Told, thresholds_of
from backend.site.site import load_site
from backend.spatial import transform
from cockpit.desk import load_models, make_config

WAYS = [Method.SCALING, Method.POTENTIAL, Method.CONSTRAINED]
Q = np.radians([0.0, 30.0, -80.0, -40.0])


@pytest.fixture(scope="module")
def config() -> Config:
    """LEFT and RIGHT of the demo, and nothing else."""
    site = load_site("demo")
    return replace(make_config(site, load_models(site), (), "LIVE"), eta=0.1)


def state(config: Config, name: str, x: float, **changes: Any) -> Any:
    pose = SimpleNamespace(machine=name, joints=Q, validity=Validity.VALID, reasons=())
    T = transform.make(np.eye(3), np.array([x, 0.0, 0.0]))
    body = place(config.machines[name], Q, T)
    return SimpleNamespace(**{"pose": pose, "body": body, "eta": 0.1, **changes})


def reach(config: Config, gap: float) -> float:
    """Where a partner stands `gap` [m] ahead of LEFT's bucket."""
    alone = state(config, "left", 0.0).body.boxes.corners().reshape(-1, 3)
    partner = state(config, "right", 0.0).body.boxes.corners().reshape(-1, 3)
    return float(alone[:, 0].max() - partner[:, 0].min() + gap)


def snapshot(config: Config, gap: float, time: float = 1.0, **partner: Any) -> Any:
    right = state(config, "right", reach(config, gap), **partner)
    machines = {"left": state(config, "left", 0.0), "right": right}
    return SimpleNamespace(time=time, machines=machines, gauge=AS_THE_SITE_SAYS, surmounting={})


def out(config: Config) -> Wish:
    """The stick out at full speed: the bucket goes ahead."""
    machine = config.machines["left"]
    joints = np.zeros(len(machine.joints))
    joints[2] = machine.max_velocity[2] * machine.sun.signs[1]
    return Wish(joints, np.array([0.2, 0.2]))


@pytest.mark.parametrize("way", WAYS)
def test_a_partner_counts_where_it_is(config: Config, way: Method) -> None:
    wish, acting = out(config), Methods(config)
    free, told = acting.shape("left", way, wish, snapshot(config, 14.0), False)
    np.testing.assert_array_equal(free.joints, wish.joints)
    assert (told.scale, told.why) == (1.0, ())
    shaped, told = acting.shape("left", way, wish, snapshot(config, 0.4), False)
    assert told.scale < 1.0
    assert shaped.joints[2] == pytest.approx(told.scale * wish.joints[2])
    assert told.why[0].startswith("bucket to right:")
    assert shaped.tracks is wish.tracks


def test_both_poses_doubt_counts(config: Config) -> None:
    wish, acting = out(config), Methods(config)
    sure = acting.shape("left", Method.SCALING, wish, snapshot(config, 0.6), False)[1]
    doubted = acting.shape("left", Method.SCALING, wish, snapshot(config, 0.6, eta=0.3), False)[1]
    assert doubted.scale == pytest.approx(sure.scale - 0.2 / 0.6, abs=1e-3)


def test_the_site_counts_by_its_full_name() -> None:
    site = load_site("ballast")
    made = make_config(site, load_models(site), (), "LIVE")
    machine = made.machines["rail"]
    q = np.radians([-10.0, 30.0, -85.0, -35.0, 0.0, 0.0])
    body = place(machine, q, np.eye(4))
    rail = SimpleNamespace(
        pose=SimpleNamespace(machine="rail", joints=q, validity=Validity.VALID, reasons=()),
        body=body,
        eta=made.eta,
    )
    far = state(made, "support", 200.0)
    gauge = GaugeInForce(own_tracks={"rail": ("T1",)})
    machines = {"rail": rail, "support": far}
    now = SimpleNamespace(time=1.0, gauge=gauge, machines=machines, surmounting={})
    wish = Wish(np.eye(6)[0] * -machine.max_velocity, np.zeros(2))  # to T2, at the right
    shaped, told = Methods(made).shape("rail", Method.CONSTRAINED, wish, now, False)
    assert abs(shaped.joints[0]) < machine.max_velocity[0]
    assert "gauge:T2" in told.why[0]
    assert "gauge:T2/" not in told.why[0]
    assert told.warnings == threshold_warnings(machine, q, Thresholds(), made.stop_latency)
    assert any("swing" in line for line in told.warnings)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("who", ["left", "right"])
def test_a_pose_that_is_not_valid_leaves_the_wish_to_the_limiter(
    config: Config, way: Method, who: str
) -> None:
    now = snapshot(config, 0.4)
    now.machines[who].pose.validity = Validity.STALE
    now.machines[who].pose.reasons = ("position is 0.6 s old",)
    wish = out(config)
    shaped, told = Methods(config).shape("left", way, wish, now, False)
    assert shaped is wish
    label = config.labels[who]
    assert told.why == (f"{way.value} is left out: {label} position is 0.6 s old",)


def test_a_machine_that_is_not_placed_is_not_certain(config: Config) -> None:
    now = snapshot(config, 0.4)
    now.machines["left"].body = None
    wish = out(config)
    shaped, told = Methods(config).shape("left", Method.SCALING, wish, now, False)
    assert shaped is wish
    assert "left out" in told.why[0]


def test_what_cannot_be_put_together_stops_the_joints(config: Config) -> None:
    now = snapshot(config, 0.4, eta=None)
    shaped, told = Methods(config).shape("left", Method.SCALING, out(config), now, False)
    assert not shaped.joints.any()
    assert told.why[0].startswith("STOP: scaling failed")
    assert told.scale == 0.0


def test_braking_and_an_override_leave_the_wish_alone(config: Config) -> None:
    wish, now, acting = out(config), snapshot(config, 0.3), Methods(config)
    shaped, told = acting.shape("left", Method.BRAKING, wish, now, False)
    assert shaped is wish
    assert told == Told(Method.BRAKING, Thresholds(), warnings=told.warnings)
    shaped, told = acting.shape("left", Method.SCALING, wish, now, True)
    assert shaped is wish
    assert told.why == ("scaling is left out: override",)


def test_thresholds_are_the_site_s_where_it_has_some(config: Config) -> None:
    assert thresholds_of(replace(config, limits=Limits(1.4, 0.5))) == Thresholds(1.4, 0.5)
    assert thresholds_of(replace(config, limits=Limits(0.5, 0.5))) == Thresholds()


def test_warnings_are_judged_now_and_then(config: Config, monkeypatch: pytest.MonkeyPatch) -> None:
    judged = []
    monkeypatch.setattr(
        methods, "threshold_warnings", lambda *given: (judged.append(1), ("swing",))[1]
    )
    acting = Methods(config)
    for time in (1.0, 1.5, 0.9 + JUDGED_EVERY, 1.1 + JUDGED_EVERY):
        now = snapshot(config, 0.4, time)
        assert acting.shape("left", Method.BRAKING, out(config), now, False)[1].warnings == (
            "swing",
        )
    assert len(judged) == 2
