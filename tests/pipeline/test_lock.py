"""Kernels of a cycle keep the interpreter's lock."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

ONCE = {
    *("backend.collision.tree_kernels.codes", "backend.collision.tree_kernels.node_boxes"),
    "backend.collision.corner_kernels.patches",
}
"""What sorts a site's bodies, in the first cycle alone."""

USED = """
import json, sys
from itertools import chain
from numba.core.dispatcher import Dispatcher
from backend.pipeline.step import initial, step
from backend.site.site import load_site
from cockpit.bench_input import cycles
from cockpit.desk import load_models, make_config

def used():
    names = {}
    for module in list(sys.modules.values()):
        for found in list(vars(module).values()):
            if isinstance(found, Dispatcher) and found.overloads:
                names[f"{found.__module__}.{found.__name__}"] = found.targetoptions
    return {name: bool(options.get("nogil")) for name, options in names.items()}

site = load_site(sys.argv[1])
config = make_config(site, load_models(site), tuple(m.name for m in site.machines), "LIVE")
state, before = initial(config), used()
for now, inputs in cycles(site, config, 60):
    state, snapshot = step(state, inputs, now, config)
print(json.dumps({name: nogil for name, nogil in used().items() if name not in before}))
"""


@pytest.mark.parametrize("site", ["demo", "step"])
def test_no_kernel_of_a_cycle_gives_its_turn_away(site: str) -> None:
    """Each takes less time than another thread keeps the lock once it has it."""
    done = subprocess.run(
        [sys.executable, "-c", USED, site], capture_output=True, text=True, check=True
    )
    used = json.loads(done.stdout)
    assert "backend.cspace.margins_kernel.advance" in used
    assert not [name for name, nogil in used.items() if nogil and name not in ONCE]
