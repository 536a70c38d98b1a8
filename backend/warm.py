"""Prepare what is slow the first time: compile the kernels, fit the shipped machines' bodies."""

from __future__ import annotations

import numpy as np
from rich.progress import track

from backend.collision.closest import closest_pairs
from backend.machine.load import load_machine, shipped_machines
from backend.spatial.boxes import Boxes


def main() -> None:
    one = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 3)))
    for name in track(["kernels", *shipped_machines()], "Preparing", transient=True):
        if name == "kernels":
            closest_pairs(one, one)
        else:
            load_machine(name)


if __name__ == "__main__":
    main()
