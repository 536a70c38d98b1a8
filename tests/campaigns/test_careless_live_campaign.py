"""Careless drives in real time over Zenoh: two pages throw their sticks at full deflection.

`LIVE_DRIVES=2 pytest ...` runs fewer. Contacts are judged by python-fcl on the true states.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from live_drives import drive

DRIVES = int(os.environ.get("LIVE_DRIVES", "10"))


@pytest.mark.timeout(3_600)
def test_careless_drives_in_real_time(tmp_path: Path) -> None:
    found = []
    for seed in range(DRIVES):
        one = drive(seed, tmp_path, 60.0)
        found.append(one)
        print(
            f"  drive {seed}: contact {one.contact}, nearest {one.nearest:.3f} m, joint travel "
            f"{one.path:.0f} rad, sticks counted {one.moved:.0%}, judged {one.compared} times",
            flush=True,
        )
    contacts = sum(one.contact for one in found)
    print(f"  {DRIVES} drives of a minute: contacts expected 0, measured {contacts}")
    assert contacts == 0
    assert all(one.compared > 1_000 and one.path > 5.0 for one in found)
