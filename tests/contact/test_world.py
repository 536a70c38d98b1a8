"""The contact world against what is known of bodies on the ground."""

from __future__ import annotations

import numpy as np
import pytest

from backend.contact.crawler import crawler_of
from backend.contact.spec import Options
from backend.contact.world import ContactWorld
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import to_attitude
from backend.stability.dynamics import centre_of_mass
from backend.stability.masses import GRAVITY
from backend.surmount.machine import climber
from backend.surmount.plan import demands_of

UP = np.array([0.0, 0.9, -1.6, -0.7])


def stood(
    name: str, q: np.ndarray, seconds: float, belts: float = 0.0, terrain: Boxes | None = None
):
    machine = load_machine(name)
    boxes = () if terrain is None else (terrain,)
    world = ContactWorld(machine, 0.0, *boxes, options=Options(step=0.004))
    world.reset(np.eye(4), q)
    control = world.control(q, np.zeros(len(q)), np.array([belts, belts]))
    for _ in range(round(seconds / 0.004)):
        world.step(control)
    return world


@pytest.mark.parametrize("name", ["shovel", "mini", "ex13"])
def test_it_weighs_what_its_description_says_and_stands(name: str) -> None:
    world = stood(name, UP, 1.5)
    touches = world.touches()
    assert touches.forces[:, 2].sum() == pytest.approx(world.masses.total * GRAVITY, rel=0.01)
    centre = (touches.points * touches.forces[:, 2:]).sum(axis=0) / touches.forces[:, 2].sum()
    com = centre_of_mass(world.masses, world.q)
    assert centre[:2] == pytest.approx(com[:2], abs=0.02 * world.crawler.half_base)
    assert world.deepest() < 1e-3
    assert np.abs(np.array(to_attitude(world.T_world_root[:3, :3]))).max() < np.radians(0.2)


@pytest.mark.parametrize("name", ["shovel", "ex13"])
def test_belts_drive_it(name: str) -> None:
    speed = 0.05 if name == "shovel" else 0.5
    world = stood(name, UP, 4.0, speed)
    # The first moments are lost to starting.
    assert world.T_world_root[0, 3] == pytest.approx(4.0 * speed, rel=0.06)
    assert world.velocity[0] == pytest.approx(speed, rel=0.02)
    assert world.belts == pytest.approx([speed, speed], rel=0.02)


def test_turning_belts_turn_it() -> None:
    machine = load_machine("ex13")
    world = ContactWorld(machine, options=Options(step=0.004))
    world.reset(np.eye(4), UP)
    control = world.control(UP, np.zeros(4), np.array([-0.3, 0.3]))
    for _ in range(1000):
        world.step(control)
    yaw = float(to_attitude(world.T_world_root[:3, :3])[0])
    # Tracks slide sideways when they turn: less than without, and to the left.
    assert 0.3 < yaw < 2.0 * 0.3 / machine.tracks.gauge * 4.0 + 1e-6


def test_a_machine_that_reaches_too_far_falls() -> None:
    machine = load_machine("mini")
    world = ContactWorld(machine, 1500.0, options=Options(step=0.004))
    q = np.array([0.0, 0.4, -0.5, -0.4])
    world.reset(np.eye(4), q)
    control = world.control(q, np.zeros(4), np.zeros(2))
    least = 0.0
    for _ in range(500):
        world.step(control)
        least = min(least, float(to_attitude(world.T_world_root[:3, :3])[1]))
    assert least < -np.radians(5.0)


def test_it_climbs_what_its_round_ends_are_higher_than() -> None:
    low = Boxes(np.array([[6.0, 0.0, 0.05]]), np.eye(3)[None], np.array([[2.5, 3.0, 0.05]]))
    world = stood("ex13", UP, 12.0, 0.5, low)
    assert world.T_world_root[2, 3] == pytest.approx(0.1, abs=2e-3)


def test_the_crawler_is_read_from_the_bodies() -> None:
    shovel = crawler_of(load_machine("shovel"))
    assert shovel.radius == pytest.approx(0.033)
    assert 2.0 * (shovel.half_base + shovel.radius) == pytest.approx(0.2902)
    with pytest.raises(InputError, match="no body of its own"):
        crawler_of(load_machine("rail6"))


def test_runs_are_the_same_to_the_last_bit() -> None:
    first, second = (stood("mini", UP, 0.6, 0.3) for _ in range(2))
    assert (first.data.qpos == second.data.qpos).all()


def test_a_climber_needs_masses() -> None:
    machine = load_machine("mini")
    made = climber(machine, demands_of(machine))
    assert made.masses.total == pytest.approx(1809.0)
