"""The long-running commands: demo, serve, sim, agent."""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from backend.errors import InputError
from backend.machine.model import Machine
from backend.shell.link.session import with_port
from backend.shell.priority import going_first
from backend.site.site import Site, load_site
from cockpit.announce import announce
from cockpit.entry import Entry

log = logging.getLogger(__name__)

LOOPBACK = "tcp/127.0.0.1:0"
LIVE = "tcp/127.0.0.1:7447"
SETTLE = 6.0
"""Seconds between starting the simulated machines and the beginning of their programs."""


@going_first()
def run_demo(
    site_name: str,
    entry: Entry,
    port: int,
    open_browser: bool,
    until: threading.Event,
    recording: bool = True,
    record: Path | None = None,
) -> None:
    """Simulated machines, one process each, and a backend, until interrupted."""
    from cockpit.options import Options
    from cockpit.station import Station

    site = load_site(site_name)
    endpoint = with_port(LOOPBACK)
    began = [float("inf")]
    station = Station(
        site,
        Options(entry, port, (endpoint,), (), (), "DEMO", record, recording),
        demo_began=(lambda: began[0]) if tells_a_story(site) else None,
    )
    with contextlib.closing(station):
        began[0] = time.time() + SETTLE
        with _machines(site_name, site, endpoint, began[0]) as processes:
            announce(site, entry, station.access, station.web.port, open_browser)
            print(f"Simulated machines talk to {endpoint}.", flush=True)
            gone: set[str] = set()
            while not until.wait(0.5):
                for name, process in processes.items():
                    if process.poll() is not None and name not in gone:
                        gone.add(name)
                        print(
                            f"{name}'s simulation ended ({process.returncode}). To restart it: "
                            f"cockpit sim --site {site_name} --machine {name} "
                            f"--connect {endpoint} --start-at {began[0]:.3f}",
                            flush=True,
                        )


def tells_a_story(site: Site) -> bool:
    """Whether the site's machines act out a scripted first minute, which the page explains."""
    return any("script" in machine.sim.details for machine in site.machines)


@going_first()
def run_serve(
    site_name: str,
    entry: Entry,
    port: int,
    open_browser: bool,
    listen: tuple[str, ...],
    connect: tuple[str, ...],
    own: tuple[str, ...],
    until: threading.Event,
    recording: bool = True,
    record: Path | None = None,
    link_config: Path | None = None,
) -> None:
    """The cockpit on live machines, until interrupted. link_config: a Zenoh configuration file;"""
    from cockpit.options import Options
    from cockpit.station import Station

    site = load_site(site_name)
    listen = listen or site.link.listen
    if not (listen or connect or site.link.connect or link_config):
        listen = (LIVE,)
    listen = tuple(with_port(endpoint) for endpoint in listen)
    connect = connect or site.link.connect
    options = Options(*(entry, port, listen, connect, own, "LIVE", record, recording, link_config))
    station = Station(site, options)
    with contextlib.closing(station):
        announce(site, entry, station.access, station.web.port, open_browser)
        where = [f"listening on {e}" for e in listen] + [f"connected to {e}" for e in connect]
        log.info("serving", extra={"site": site.name, "port": station.web.port})
        where = where or [f"as {link_config} says"]
        print(f"Machines: {', '.join(where)}.", flush=True)
        until.wait()


@going_first()
def run_sim(
    site_name: str,
    machine: str,
    connect: tuple[str, ...],
    start_at: float | None,
    until: threading.Event,
    link_config: Path | None = None,
) -> None:
    """One simulated machine, until interrupted."""
    from backend.shell.sim.process import run

    site = load_site(site_name)
    site.machine(machine)
    run(site, machine, _partners(connect, link_config), start_at, until, link_config=link_config)


@going_first()
def run_agent(
    site_name: str,
    machine: str,
    driver: str,
    can: tuple[str, str, int, Path | None],
    connect: tuple[str, ...],
    until: threading.Event,
    link_config: Path | None = None,
) -> None:
    """One machine's agent, until interrupted. can: interface, channel, bit rate, DBC file."""
    from backend.shell.agent.drivers.driver import Driver
    from backend.shell.agent.drivers.simulation import SimDriver
    from backend.shell.agent.process import run

    if driver not in ("sim", "can"):
        raise InputError(f'--driver "{driver}" is unknown; allowed are sim, can.')

    def make(description: Machine, clock: Callable[[], float]) -> Driver:
        if driver == "sim":
            return SimDriver(description, clock)
        from backend.shell.agent.drivers.bus import DBC, CanDriver, open_bus

        interface, channel, bitrate, dbc = can
        return CanDriver(description, open_bus(interface, channel, bitrate), clock, dbc or DBC)

    site = load_site(site_name)
    site.machine(machine)
    run(site, machine, _partners(connect, link_config), until, make, link_config)


def _partners(connect: tuple[str, ...], link_config: Path | None) -> tuple[str, ...]:
    """Endpoints to connect to; none where the configuration says it."""
    return connect or (() if link_config else (LIVE,))


@contextlib.contextmanager
def _machines(
    site_name: str, site: Site, endpoint: str, start_at: float
) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """One process per machine of the site, ended with the demo."""
    # One machine needs no parallel linear algebra; threads would only fight the backend.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    processes = {}
    try:
        for machine in site.machines:
            processes[machine.name] = subprocess.Popen(
                [
                    *(sys.executable, "-m", "cockpit.cli", "sim", "--site", site_name),
                    *("--machine", machine.name, "--connect", endpoint),
                    *("--start-at", f"{start_at:.6f}"),
                ],
                env=environment,
            )
        yield processes
    finally:
        for process in processes.values():
            process.terminate()
        for process in processes.values():
            try:
                process.wait(timeout=3.0)
            except subprocess.TimeoutExpired:
                process.kill()
