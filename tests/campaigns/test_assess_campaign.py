"""1,000 random pairs of states through `cockpit assess`, judged by coal on every pair of bodies."""

from __future__ import annotations

from pathlib import Path

import pytest
from assess_states import assess_lines, disagreements, random_states

ALLOWED = 1e-6


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("models", [["mini"], ["mini", "ex13"], ["zx200"]], ids="+".join)
def test_closest_distances(models: list[str], tmp_path: Path, shared_data: Path) -> None:
    real = {"zx200": str(shared_data / "zx200" / "zx200.xacro")}
    named = [real.get(model, model) for model in models]
    found = disagreements(assess_lines(random_states(named, 1000, seed=1), tmp_path))
    print(f"\n{'+'.join(models)}: {found['states']} states, {found['apart']} apart")
    for what in ("over", "under"):
        print(f"  {what}-estimate [m]   expected <= {ALLOWED:g}   measured {found[what]:.3g}")
    print(f"  overlaps called free  expected 0   measured {found['overlaps called free']}")
    assert max(found["over"], found["under"]) <= ALLOWED
    assert found["overlaps called free"] == 0
