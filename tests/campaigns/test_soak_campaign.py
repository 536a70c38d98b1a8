"""Two browsers at once for ten minutes: memory stays flat and the consoles stay silent."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest
from live import all_valid, backend
from watched import Watch

from cockpit.memory import memory_of

MINUTES = float(os.environ.get("SOAK_MINUTES", "10"))
ALLOWED = 1.0  # MiB per minute after the first minute


@pytest.mark.timeout(1800)
def test_two_browsers(watch: Watch) -> None:
    with backend("demo") as station:
        station.wait_for(all_valid)
        pages = [watch(station.url, (1920, 1080)), watch(station.url, (1366, 768))]
        minutes, memory, heaps = [], [], []
        begun = time.monotonic()
        while (elapsed := (time.monotonic() - begun) / 60.0) < MINUTES:
            time.sleep(5.0)
            minutes.append(elapsed)
            memory.append(memory_of(station.process.pid))
            heaps.append([p.page.evaluate("performance.memory.usedJSHeapSize") for p in pages])
            assert station.process.poll() is None
        later = np.array(minutes) > 1.0
        growth = float(np.polyfit(np.array(minutes)[later], np.array(memory)[later], 1)[0])
        heap = np.array(heaps, dtype=float)[later] / 2**20
        errors = [error for page in pages for error in page.errors]
        print(f"\n{MINUTES:g} minutes, two pages")
        print(f"  backend memory [MiB]         {memory[0]:.0f} at first, {memory[-1]:.0f} at last")
        print(f"  growth [MiB/min]             expected < {ALLOWED}   measured {growth:.3f}")
        print(f"  page heaps at most [MiB]     {heap.max(axis=0).round(1).tolist()}")
        print(f"  console errors               expected 0   measured {len(errors)}")
        assert growth < ALLOWED
        assert errors == []
