"""People who walk into the swing range of a machine that is driven by a careless operator.

200 times twenty seconds of random sticks at full speed, from the LiDAR's rays to the machine's
agent, in simulated time; python-fcl judges true bodies. A contact counts while the machine moves:
nobody walks into a machine here, but everybody stays where it is swung to. `PEOPLE=20 pytest ...`
runs fewer.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import pytest

from backend.shell.sim.people_drives import PeopleDrive, PeopleOutcome, people_drive

DRIVES = int(os.environ.get("PEOPLE", "200"))
MODELS = ("mini", "ex13")


def driven(plans: list[PeopleDrive]) -> list[PeopleOutcome]:
    """On all processors; each drive is the same whichever process it runs in."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = []
        for plan, one in zip(plans, pool.map(people_drive, plans), strict=True):
            found.append(one)
            print(
                f"  {plan.model} {plan.seed}: contact {one.contact}, hidden {one.hidden}, nearest "
                f"{one.nearest:.2f} m, {one.path:.0f} rad, {one.levels}",
                flush=True,
            )
    return found


def plans(count: int, people: int, limited: bool = True) -> list[PeopleDrive]:
    return [
        PeopleDrive(k, MODELS[k % len(MODELS)], people=people, limited=limited)
        for k in range(count)
    ]


@pytest.mark.timeout(20_000)
def test_careless_drives_among_people() -> None:
    found = driven(plans(DRIVES, 1 + (DRIVES > 1)))
    free = driven([replace(p, limited=False) for p in plans(DRIVES, 1 + (DRIVES > 1))])
    contacts = sum(one.contact is not None for one in found)
    hidden = sum(one.hidden is not None for one in found)
    without = sum(one.contact is not None for one in free) / len(free)
    nearest = min(one.nearest for one in found)
    print(f"\n  {DRIVES} drives among two people who walk about")
    print(f"  contacts of a moving machine, visible  expected 0        measured {contacts}")
    print(f"  of somebody whom no LiDAR saw          expected -        measured {hidden}")
    print(f"  nearest to a moving machine            expected > 0      measured {nearest:.2f} m")
    print(f"  contacts without the limiter           expected >= 50 %  measured {without:.0%}")
    assert contacts == 0
    assert without >= 0.5


@pytest.mark.timeout(20_000)
def test_false_stops_with_nobody_in_range() -> None:
    found = driven(plans(max(DRIVES // 10, 2), 0))
    cycles = sum(sum(one.levels.values()) for one in found)
    false = cycles - sum(one.levels.get("CLEAR", 0) for one in found)
    print(f"\n  {len(found)} drives with nobody in range: {cycles} cycles")
    print(f"  cycles in which people slowed or stopped  measured {false} ({false / cycles:.2%})")
    assert cycles > 500 * len(found)
