"""Prepare what is slow the first time: fit and keep the bodies of the shipped machines."""

from __future__ import annotations

from rich.progress import track

from backend.machine.load import load_machine, shipped_machines


def main() -> None:
    for name in track(shipped_machines(), description="Preparing machines", transient=True):
        load_machine(name)


if __name__ == "__main__":
    main()
