"""Programs: smooth, within limits, reproducible, and refused with a clear sentence when wrong."""

from __future__ import annotations

import copy
import tomllib

import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.kinematics import end_point
from backend.machine.load import load_machine
from backend.shell.sim.agent import entry_posture
from backend.shell.sim.program import is_cut, motions, next_entry, reference
from backend.shell.sim.program_file import load_program
from backend.shell.sim.simulate import simulate
from backend.site.site import SITES, load_site, parse_site

MINI = load_machine("mini")
DEMO = SITES / "demo.toml"


def demo_data():
    return tomllib.loads(DEMO.read_text(encoding="utf-8"))


def program_of(data, name="left", machine=MINI):
    return load_program(machine, parse_site(data, DEMO), name)


def changed(**sim):
    data = copy.deepcopy(demo_data())
    data["machine"][0]["sim"].update(sim)
    return data


LEFT = program_of(demo_data())


def test_reference_is_smooth_and_within_limits():
    """Rates are the derivative of the angles, and both keep to the actuators' limits."""
    dt = 0.01
    times = np.arange(0.0, 145.0, dt)
    q, qd, qdd = (np.array(rows) for rows in zip(*(reference(LEFT, t) for t in times), strict=True))
    np.testing.assert_allclose(np.gradient(q, dt, axis=0)[1:-1], qd[1:-1], atol=0.01)
    assert (np.abs(qd) <= LEFT.limits.velocity).all()
    assert (np.abs(qdd) <= LEFT.limits.acceleration).all()
    assert (q >= LEFT.limits.lower - 1e-9).all()
    assert (q <= LEFT.limits.upper + 1e-9).all()


def test_machine_follows_its_reference_closely():
    done = simulate(MINI, LEFT, 30.0, 0.01)
    wanted = np.array([reference(LEFT, t)[0] for t in done.times])
    assert np.degrees(np.abs(done.q - wanted).max()) < 0.3


def test_digging_reaches_below_the_ground_and_dumping_above():
    program = program_of(changed(script=[], cycle=[], dump={"height": 1.0}))
    lap = motions(program, 0)
    heights = [end_point(MINI, m.path(np.linspace(0, 1, 50)))[:, 2] for m in lap]
    assert min(heights[1]) < -0.3
    assert heights[2][-1] == pytest.approx(1.0, abs=1e-6)


def test_cycles_vary_by_seed_and_repeat_exactly():
    digs = [motions(LEFT, lap)[1].goal for lap in range(4)]
    assert not np.allclose(digs[1], digs[2])
    again = program_of(demo_data())
    other = program_of(changed(seed=77))
    np.testing.assert_array_equal(motions(again, 2)[1].goal, digs[2])
    assert not np.allclose(motions(other, 2)[1].goal, digs[2])
    still = program_of(changed(variation=0.0))
    np.testing.assert_array_equal(motions(still, 1)[1].goal, motions(still, 2)[1].goal)


def test_laps_join_without_a_jump():
    for t in (60.0, 100.0, 140.0):
        before, after = reference(LEFT, t - 1e-6)[0], reference(LEFT, t + 1e-6)[0]
        np.testing.assert_allclose(before, after, atol=1e-5)


def test_entries_are_at_home_and_at_rest():
    for t in (-5.0, 0.0, 30.0, 60.0, 60.1, 99.0, 1234.5):
        entry = next_entry(LEFT, t)
        assert entry >= t
        assert entry - t <= max(60.0 - t, 40.0)
        q, qd, _ = reference(LEFT, entry)
        np.testing.assert_allclose(q, entry_posture(LEFT), atol=1e-9)
        np.testing.assert_allclose(qd, 0.0, atol=1e-9)


def test_cut_is_on_the_schedule():
    right = program_of(demo_data(), "right")
    assert [is_cut(right, t) for t in (49.9, 50.0, 54.9, 55.1, 110.0)] == [
        False,
        True,
        True,
        False,
        False,
    ]
    assert not any(is_cut(LEFT, t) for t in np.arange(0.0, 120.0, 0.5))


def test_hold_holds():
    program = program_of(changed(program="hold"))
    for t in (0.0, 10.0, 1e6):
        np.testing.assert_array_equal(reference(program, t)[0], program.start)


@pytest.mark.parametrize("model", ["mini", "ex13"])
def test_every_shipped_machine_works_without_stated_spots(model):
    machine = load_machine(model)
    data = demo_data()
    data["machine"][0]["sim"] = {"program": "dig-swing-dump"}
    program = program_of(data, machine=machine)
    assert len(motions(program, 5)) == 5


STEP = {"t": 0.0, "action": "dig"}
HOME = {"t": 30.0, "action": "go", "to": "home"}


@pytest.mark.parametrize(
    ("sim", "words"),
    [
        ({"program": "dance"}, r'"dance" is no program; allowed are hold, dig-swing-dump'),
        ({"digg": {}}, r'"digg" is not a field; allowed are cycle, dig'),
        ({"period": -1.0}, r"period is -1.0; allowed is a number of 0 or more"),
        ({"dig": {"reach": 9.0}}, r"reach 9 m .* out of the machine's reach"),
        ({"dig": {"radius": 2.0}}, r"allowed are the fields azimuth_deg, reach, depth"),
        ({"dig": {"reach": "far"}}, r"dig.reach is 'far'; allowed is a number"),
        ({"postures": {"home": {"boom": 200.0}}}, r"boom is 200 deg; allowed are -50 to 80 deg"),
        ({"postures": {"home": {"arm": 2.0}}}, r'"arm" is not a joint; allowed are swing'),
        ({"cycle": [STEP]}, r"the last motion is not a 'go'"),
        ({"cycle": [{"t": 0.0, "action": "jump"}]}, r"'jump'; allowed are dig, dump, go"),
        ({"cycle": [{"t": 0.0, "action": "go", "to": "moon"}]}, r'"moon"; allowed are home, carry'),
        ({"cycle": [HOME, STEP]}, r"t = 0 follows 30"),
        ({"cycle": [{"t": 0.0, "action": "cut"}]}, r'a cut lasts "for" some seconds'),
        (
            {"cycle": [STEP, {**HOME, "t": 3.0}]},
            r"step 'dig' at t = 0 s takes .* an end by t = 3 s",
        ),
        (
            {"cycle": [STEP, {**HOME, "for": 0.1}], "script": []},
            r"step 'go' at t = 30 s takes .* allowed are .* s or more",
        ),
        ({"script": [STEP]}, r"it must end with a 'go' to the posture that the cycle ends with"),
    ],
)
def test_bad_programs_are_one_clear_sentence(sim, words):
    with pytest.raises(InputError, match=words) as error:
        program_of(changed(**sim))
    text = str(error.value)
    assert text.startswith("demo.toml: machine 'left': sim")
    assert "\n" not in text


def test_bad_start_is_named():
    data = demo_data()
    data["machine"][0]["start"]["joints_deg"]["stick"] = 10.0
    with pytest.raises(InputError, match=r"start.joints_deg: stick is 10 deg; allowed are -150"):
        program_of(data)


def test_every_shipped_site_has_programs():
    for path in sorted(SITES.glob("*.toml")):
        site = load_site(path)
        for entry in site.machines:
            load_program(load_machine(entry.model, entry.sidecar, site.folder), site, entry.name)
