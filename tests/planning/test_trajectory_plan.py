"""Tasks planned as a whole: over, under, beside; what blocks; and a judge of its own."""

from __future__ import annotations

import numpy as np
import pytest
from plan_tasks import judged

from backend.documents.plan import proven
from backend.errors import InputError
from backend.machine.kinematics import end_point
from backend.machine.load import load_machine
from backend.planning.trajectory.carry import attitude_of, carry_of
from backend.planning.trajectory.curve import curve_along
from backend.planning.trajectory.plan import plan, rehearse
from backend.planning.trajectory.recheck import recheck
from backend.planning.trajectory.records import Obstacles, Refusal, Task, Trajectory
from backend.planning.trajectory.rows import limit_rows
from backend.planning.trajectory.sweep import make_sweep
from backend.planning.trajectory.timing import toppra_timing
from backend.spatial.boxes import Boxes
from backend.stability.polygon import support_polygon
from cockpit.bench_tasks import random_task

MINI = load_machine("mini")
START = np.array([0.0, 0.6, -1.2, -0.4])


def cylinder_point(theta: float, r: float, z: float) -> np.ndarray:  # type: ignore[type-arg]
    return np.array([r * np.cos(theta), r * np.sin(theta), z])


def box(center: list[float], half: list[float]) -> Boxes:
    return Boxes(np.array([center]), np.eye(3)[None], np.array([half]))


def solved(task: Task, obstacles: Obstacles) -> Trajectory:
    made = plan(MINI, task, obstacles)
    assert isinstance(made, Trajectory), made
    found = judged(MINI, task, obstacles, made)
    assert not found.contact
    assert not found.tipped
    assert found.beyond <= 1.001
    assert found.missed < 1e-6
    assert np.abs(made.rates[[0, -1]]).max() < 1e-6
    return made


@pytest.mark.parametrize(
    ("center", "half"),
    [
        ([2.0, 2.6, 0.5], [0.3, 0.3, 0.5]),  # over, or in front of it
        ([2.2, 2.2, 2.6], [0.6, 0.6, 1.2]),  # under
        ([2.6, 2.6, 1.5], [0.3, 0.3, 1.5]),  # beside, drawn in
    ],
)
def test_over_under_and_beside(center: list[float], half: list[float]) -> None:
    task = Task(START, cylinder_point(1.6, 3.4, 0.6), payload=80.0, clearance=0.15)
    obstacles = Obstacles(box(center, half), ("thing",))
    made = solved(task, obstacles)
    assert made.checks.min_clearance >= 0.15 * 0.8
    assert made.checks.min_stability_margin > 0.0
    free = solved(task, Obstacles())
    assert made.way != free.way


@pytest.mark.parametrize("seed", [0, 1, 3, 6, 9, 11])
def test_random_tasks_judged(seed: int) -> None:
    task, obstacles = random_task(MINI, seed)
    solved(task, obstacles)


def test_the_check_alone_notices_a_way_through_the_ground() -> None:
    low = START.copy()
    low[1] = -0.6
    task = Task(START, end_point(MINI, low))
    curve = curve_along(np.stack([START, low]), 1.0 / MINI.max_velocity, 0.3)
    rows = limit_rows(MINI, task, curve, 160, None, support_polygon(MINI))
    time = toppra_timing(rows)
    assert time is not None
    for ground in (True, False):
        obstacles = Obstacles(ground=ground)
        sweep = make_sweep(MINI, obstacles, task.clearance)
        checks = recheck(MINI, task, obstacles, sweep, curve, time, None, support_polygon(MINI))
        assert (checks.min_ground < 0.0) == ground


@pytest.mark.parametrize("name", ["mini", "ex13", "rail6"])
def test_a_rehearsal_plans_to_the_end(name: str) -> None:
    assert isinstance(rehearse(load_machine(name)), Trajectory)


def test_a_search_is_the_same_every_time() -> None:
    task, obstacles = random_task(MINI, 6)
    first, second = solved(task, obstacles), solved(task, obstacles)
    np.testing.assert_array_equal(first.q, second.q)


def test_a_wall_all_around_is_proven_to_block() -> None:
    goal = START.copy()
    goal[0] = np.pi
    obstacles = Obstacles(
        Boxes(
            np.array([[0.0, s * 3.5, 3.0] for s in (-1, 1)]),  # the counterweight passes between
            np.repeat(np.eye(3)[None], 2, axis=0),
            np.array([[0.4, 2.0, 3.0]] * 2),
        ),
        ("left wall", "right wall"),
    )
    task = Task(START, end_point(MINI, goal), clearance=0.05)
    refusal = plan(MINI, task, obstacles)
    assert isinstance(refusal, Refusal)
    assert refusal.kind == "not found"
    assert {"left wall", "right wall"} <= set(refusal.blockers)
    sure = proven(MINI, task, obstacles, refusal, (72, 24, 24, 24))
    assert sure.proven
    assert sure.kind == "blocked"
    # One wall less, and there is a way round.
    solved(task, Obstacles(obstacles.boxes.take(np.array([0])), ("left wall",)))


@pytest.mark.parametrize(
    ("goal", "obstacles", "kind", "words"),
    [
        (cylinder_point(0.5, 9.0, 1.0), Obstacles(), "goal", "out of the arm's reach"),
        (
            cylinder_point(0.5, 3.4, 0.6),
            Obstacles(box([2.9, 1.6, 0.6], [0.2, 0.2, 0.6]), ("post",)),
            "goal",
            "touches post",
        ),
        (
            cylinder_point(0.5, 3.4, 0.6),
            Obstacles(box([3.4, 0.0, 0.6], [0.2, 0.2, 0.6]), ("post",)),
            "start",
            "touches post",
        ),
        (cylinder_point(0.5, 3.4, -0.3), Obstacles(), "goal", "touches the ground"),
    ],
)
def test_why_there_is_none(
    goal: np.ndarray,  # type: ignore[type-arg]
    obstacles: Obstacles,
    kind: str,
    words: str,
) -> None:
    made = plan(MINI, Task(START, goal), obstacles)
    assert isinstance(made, Refusal)
    assert made.kind == kind
    assert words in made.why
    assert made.proven


def test_a_load_that_tips_it_is_refused_with_the_edge() -> None:
    made = plan(MINI, Task(START, cylinder_point(1.57, 3.9, 1.0), payload=2_000.0), Obstacles())
    assert isinstance(made, Refusal)
    assert made.kind == "tips"
    assert "2000 kg" in made.why
    assert "edge" in made.why


def test_unknown_masses_are_told() -> None:
    from dataclasses import replace

    made = plan(
        replace(MINI, masses_trusted=False), Task(START, cylinder_point(0.8, 3.2, 0.8)), Obstacles()
    )
    assert isinstance(made, Trajectory)
    assert np.isnan(made.checks.min_stability_margin)
    assert any("tipping over was not judged" in note for note in made.notes)


def test_the_lift_is_carried_out() -> None:
    low = solved(Task(START, cylinder_point(1.2, 3.3, 0.6)), Obstacles())
    high = solved(Task(START, cylinder_point(1.2, 3.3, 0.6), lift=1.0), Obstacles())
    # Corners are rounded, so that the whole lift is reached between start and goal.
    assert end_point(MINI, high.q)[:, 2].max() > 1.4
    assert end_point(MINI, low.q)[:, 2].max() < 0.8
    np.testing.assert_allclose(attitude_of(MINI, high.q), attitude_of(MINI, START), atol=0.02)


def test_coordinates_that_keep_the_attitude() -> None:
    rng = np.random.default_rng(0)
    for name in ("mini", "ex13"):
        machine = load_machine(name)
        q = rng.uniform(-1, 1, (5, 4))
        carry = carry_of(machine, q[0])
        np.testing.assert_allclose(carry.q(carry.x(machine, q)), q, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"clearance": 0.0}, "clearance is 0"),
        ({"payload": -1.0}, "payload is -1"),
        ({"share": 1.0}, "share is 1"),
        ({"speeds": np.zeros(4)}, "speeds must be above 0"),
        ({"q": np.array([0.0, 9.0, -1.2, -0.4])}, "boom is beyond its ends"),
        ({"p_root": end_point(MINI, START)}, "where the machine is"),
    ],
)
def test_bad_tasks_are_one_sentence(change: dict[str, object], words: str) -> None:
    given: dict[str, object] = {"q": START, "p_root": cylinder_point(0.8, 3.2, 0.8), **change}
    with pytest.raises(InputError, match=words):
        plan(MINI, Task(**given), Obstacles())  # type: ignore[arg-type]
