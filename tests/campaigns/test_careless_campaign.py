"""Careless drives: 200 times a minute of random sticks at full speed, two machines within reach.

Each drive is run twice with the same sticks: without the limiter until the first contact, and with
it. python-fcl judges the true poses at every step. `CARELESS=20 pytest ...` runs fewer.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import pytest

from backend.shell.sim.drives import Drive, Outcome, drive, twin

DRIVES = int(os.environ.get("CARELESS", "200"))
MODELS = (("mini", "mini"), ("mini", "ex13"), ("ex13", "mini"), ("ex13", "ex13"))


@dataclass
class Tally:
    """What a variant measured. path: joint travel up to the contact without the limiter [rad], of
    the unlimited and of the limited machines; whole: of the limited ones over the whole drive.
    """

    drives: int = 0
    contacts: list[int] = field(default_factory=list)
    unlimited: int = 0
    unlimited_path: float = 0.0
    limited_path: float = 0.0
    whole: float = 0.0
    nearest: float = float("inf")
    reasons: dict[str, int] = field(default_factory=dict)

    def add(self, plan: Drive, free: Outcome | None, limited: Outcome) -> None:
        self.drives += 1
        if limited.contact is not None:
            self.contacts.append(plan.seed)
        if free is not None:
            end = min(len(free.path), len(limited.path)) - 1
            self.unlimited += free.contact is not None
            self.unlimited_path += sum(free.path[end])
            self.limited_path += sum(limited.path[end])
        self.whole += sum(limited.path[-1])
        self.nearest = min(self.nearest, limited.nearest)
        for reason, count in limited.reasons.items():
            self.reasons[reason] = self.reasons.get(reason, 0) + count


def tally(count: int, compare: bool = True, **plan: float) -> Tally:
    """Drives on all processors; each is the same whichever process it runs in."""
    found = Tally()
    plans = [Drive(k, MODELS[k % len(MODELS)], **plan) for k in range(count)]  # type: ignore[arg-type]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        both = pool.map(_both if compare else _limited, plans)
        for one, (free, limited) in zip(plans, both, strict=True):
            found.add(one, free, limited)
            alone = "not driven" if free is None else f"contact {free.contact}"
            print(f"  drive {one.seed}: contact {limited.contact}; unlimited: {alone}", flush=True)
    return found


def _both(plan: Drive) -> tuple[Outcome | None, Outcome]:
    return drive(twin(plan)), drive(plan)


def _limited(plan: Drive) -> tuple[Outcome | None, Outcome]:
    return None, drive(plan)


def show(name: str, found: Tally) -> None:
    print(f"\n{name}: {found.drives} drives")
    print(f"  contacts with the limiter      expected 0        measured {len(found.contacts)}")
    print(f"  nearest to each other          expected > 0      measured {found.nearest:.3f} m")


@pytest.mark.timeout(20_000)
def test_careless_drives() -> None:
    found = tally(DRIVES)
    show("one minute, 100 ms each way", found)
    share = found.unlimited / found.drives
    part = found.limited_path / found.unlimited_path
    print(f"  contacts without the limiter   expected >= 50 %  measured {share:.0%}")
    print(f"  joint travel of the unlimited  expected >= 50 %  measured {part:.0%}")
    print(f"  joint travel in all            {found.whole:.0f} rad; stood for {found.reasons}")
    assert found.contacts == []
    assert share >= 0.5
    assert part >= 0.5


@pytest.mark.timeout(20_000)
@pytest.mark.parametrize(
    ("name", "plan"),
    [
        ("a radio of 40 ms, and 120 ms more each way", {"up": 0.16, "down": 0.16}),
        ("2 % of all messages lost", {"loss": 0.02}),
        ("both", {"up": 0.16, "down": 0.16, "loss": 0.02}),
    ],
)
def test_worse_radio(name: str, plan: dict[str, float]) -> None:
    found = tally(max(DRIVES // 5, 1), compare=False, **plan)
    show(name, found)
    print(f"  joint travel in all            expected > 0      measured {found.whole:.0f} rad")
    print(f"  stood for                      {found.reasons}")
    assert found.contacts == []
    assert found.whole > 0.0


@pytest.mark.timeout(20_000)
@pytest.mark.parametrize("way", [0.22, 0.3])
def test_a_radio_too_slow_locks_motion(way: float) -> None:
    found = tally(4, compare=False, up=way, down=way, seconds=20.0)
    show(f"{1e3 * way:.0f} ms each way", found)
    print(f"  joint travel in all            expected 0        measured {found.whole:.3g} rad")
    print(f"  stood for                      {found.reasons}")
    assert found.contacts == []
    assert found.whole == 0.0
    assert any("motion is locked above 400 ms" in reason for reason in found.reasons)
