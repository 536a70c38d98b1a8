"""The program `cockpit`: one command for everything."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from backend.errors import InputError
from cockpit.cli_along import along
from cockpit.cli_detect import detect
from cockpit.cli_entry import (
    Cert,
    InsecureHttp,
    Key,
    NoLogin,
    OneTimeLink,
    SelfSigned,
    UsersFile,
    users,
)
from cockpit.cli_formats import convert, export
from cockpit.cli_gauge import gauge
from cockpit.cli_keys import LinkConfig, keys
from cockpit.cli_plan import plan
from cockpit.cli_playback import add_commands
from cockpit.cli_recordings import recordings
from cockpit.cli_surmount import surmount
from cockpit.cli_track import track
from cockpit.cli_use_case import use_case
from cockpit.logs import LogJson, LogLevel

app = typer.Typer(
    name="cockpit",
    help="A cockpit for remote operators of several excavators. "
    "An operator aid, not a certified safety function.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Site = Annotated[str, typer.Option("--site", help="Shipped site's name or path of a site file.")]
Host = Annotated[str, typer.Option(help="Address of the page; loopback unless told otherwise.")]
Port = Annotated[int, typer.Option(help="Port of the page; 0 takes any free one.")]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")]
Listen = Annotated[
    list[str] | None, typer.Option(help="Zenoh endpoint to listen on, e.g. tcp/127.0.0.1:7447.")
]
Ground = Annotated[
    bool, typer.Option("--ground", help="The plane under the tracks is an obstacle, too.")
]
Connect = Annotated[
    list[str] | None, typer.Option(help="Zenoh endpoint to connect to: a router, another backend.")
]

NoRecord = Annotated[bool, typer.Option("--no-record", help="Record nothing.")]
Record = Annotated[
    Path | None,
    typer.Option(help="Folder of all recordings; default: the site file's, or the user's state."),
]
MetricsTokenFile = Annotated[
    Path | None,
    typer.Option(help="File (0600) with the bearer token for GET /metrics; without it, 404."),
]


@app.command()
def demo(
    site: Site = "demo",
    host: Host = "127.0.0.1",
    port: Port = 8000,
    no_browser: NoBrowser = False,
    no_record: NoRecord = False,
    record: Record = None,
    users: UsersFile = None,
    no_login: NoLogin = False,
    cert: Cert = None,
    key: Key = None,
    self_signed: SelfSigned = False,
    insecure_http: InsecureHttp = False,
    log_json: LogJson = False,
    log_level: LogLevel = None,
) -> None:
    """Run a site with simulated machines, each in its own process, and open the page."""
    from backend.control.person import SUPERVISOR, Person
    from cockpit.entry import EntryOptions, decide
    from cockpit.run import run_demo

    options = EntryOptions(users, no_login, False, cert, key, self_signed, insecure_http)
    run_demo(
        site,
        decide(options, host, link_for=Person("demo", SUPERVISOR)),
        port,
        open_browser=not no_browser,
        until=_interrupted(),
        recording=not no_record,
        record=record,
    )


@app.command()
def serve(
    site: Site,
    host: Host = "127.0.0.1",
    port: Port = 8000,
    no_browser: NoBrowser = False,
    listen: Listen = None,
    connect: Connect = None,
    machines: Annotated[
        str, typer.Option(help="Machines this backend answers for, e.g. left,right; default all.")
    ] = "",
    no_record: NoRecord = False,
    record: Record = None,
    users: UsersFile = None,
    no_login: NoLogin = False,
    one_time_link: OneTimeLink = False,
    cert: Cert = None,
    key: Key = None,
    self_signed: SelfSigned = False,
    insecure_http: InsecureHttp = False,
    link_config: LinkConfig = None,
    metrics_token_file: MetricsTokenFile = None,
    log_json: LogJson = False,
    log_level: LogLevel = None,
) -> None:
    """Run the cockpit on live machines, which publish to the Zenoh endpoint it listens on."""
    from backend.shell.app.metrics import read_token
    from cockpit.entry import EntryOptions, decide
    from cockpit.run import run_serve

    token = "" if metrics_token_file is None else read_token(metrics_token_file)
    way_in = users, no_login, one_time_link, cert, key, self_signed, insecure_http
    options = EntryOptions(*way_in, metrics_token=token)
    own = tuple(name.strip() for name in machines.split(",") if name.strip())
    run_serve(
        site,
        decide(options, host),
        port,
        open_browser=not no_browser,
        listen=tuple(listen or ()),
        connect=tuple(connect or ()),
        own=own,
        until=_interrupted(),
        recording=not no_record,
        record=record,
        link_config=link_config,
    )


@app.command()
def sim(
    site: Site,
    machine: Annotated[str, typer.Option(help="Name of one machine of the site.")],
    connect: Connect = None,
    start_at: Annotated[
        float | None, typer.Option(help="Epoch second at which the machine's program begins.")
    ] = None,
    link_config: LinkConfig = None,
    log_json: LogJson = False,
    log_level: LogLevel = None,
) -> None:
    """Simulate one machine: publish as its hardware does and obey velocity commands."""
    from cockpit.run import run_sim

    run_sim(site, machine, tuple(connect or ()), start_at, _interrupted(), link_config)


@app.command()
def agent(
    site: Site,
    machine: Annotated[str, typer.Option(help="Name of the machine of the site it runs on.")],
    driver: Annotated[str, typer.Option(help="What is driven: sim or can.")] = "sim",
    connect: Connect = None,
    interface: Annotated[
        str, typer.Option(help="python-can interface, e.g. socketcan, pcan, virtual.")
    ] = "socketcan",
    channel: Annotated[str, typer.Option(help="CAN channel, e.g. can0.")] = "can0",
    bitrate: Annotated[int, typer.Option(help="CAN bit rate [bit/s].")] = 250_000,
    dbc: Annotated[
        Path | None, typer.Option(help="CAN frames; scenes/can/agent.dbc unless told otherwise.")
    ] = None,
    link_config: LinkConfig = None,
    log_json: LogJson = False,
    log_level: LogLevel = None,
) -> None:
    """Run a machine's own agent: it grants the lease, obeys its holder and enforces limits."""
    from cockpit.run import run_agent

    can = (interface, channel, bitrate, dbc)
    run_agent(site, machine, driver, can, tuple(connect or ()), _interrupted(), link_config)


@app.command()
def assess(
    state: Annotated[Path, typer.Option(help="State document (.json), or one per line (.jsonl).")],
    site: Annotated[
        str | None, typer.Option(help="Site of the positions' CRS; omitted: a local frame.")
    ] = None,
    every_pair: Annotated[
        bool, typer.Option("--all", help="Every pair of bodies in `closest`, not only the nearest.")
    ] = False,
    ground: Ground = False,
    json_: Annotated[
        bool, typer.Option("--json", help="Print JSON; this command always does.")
    ] = True,
) -> None:
    """Judge one set of machine states: bodies, distances, sets, zones, margins; as JSON."""
    del json_
    from cockpit.assess import run_assess

    run_assess(state, site, every_pair, ground)


@app.command()
def cspace(
    state: Annotated[Path, typer.Option(help="State document (.json).")],
    machine: Annotated[str, typer.Option(help="The machine of the document that must avoid.")],
    out: Annotated[Path, typer.Option(help="The .npz file to write.")],
    kind: Annotated[
        str, typer.Option(help="joint4, joint3 (at the present swing) or reach (swing x reach).")
    ] = "joint4",
    shape: Annotated[str, typer.Option(help="Cells along each axis, e.g. 72,64,64,64.")] = "",
    site: Annotated[
        str | None, typer.Option(help="Site of the positions' CRS and of more obstacles.")
    ] = None,
    certified: Annotated[
        bool, typer.Option("--certified", help="Also what holds for every configuration in a cell.")
    ] = False,
    layers: Annotated[
        bool, typer.Option("--layers", help="Also what is hit: partner, site, self, ground.")
    ] = False,
    ground: Ground = False,
    height: Annotated[
        float | None,
        typer.Option(help="Reach: height of the tip above the swing joint [m]; else as it is."),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Write one exact C-space image with axes, units and layers to an .npz file."""
    from backend.documents.cspace import KINDS, Request
    from cockpit.cspace import run_cspace

    chosen = next((known for known in KINDS if known == kind), None)
    if chosen is None:
        raise InputError(f'--kind "{kind}" is unknown; allowed are {", ".join(KINDS)}.')
    try:
        cells = tuple(int(n) for n in shape.split(",")) if shape else None
    except ValueError:
        raise InputError(
            f'--shape "{shape}" is not a shape; allowed are whole numbers like 72,64,64,64.'
        ) from None
    request = Request(chosen, cells, certified, layers, ground, height)
    run_cspace(state, site, machine, request, out, json_)


@app.command()
def fit(
    model: Annotated[str, typer.Argument(help="Shipped machine's name or path of a URDF, xacro.")],
    sidecar: Annotated[
        str | None, typer.Option(help="Its sidecar; without it the one that loading would take.")
    ] = None,
    link: Annotated[
        list[str] | None, typer.Option(help="Only this link, may be repeated; default all.")
    ] = None,
    starts: Annotated[
        int, typer.Option(min=1, help="Searches for each link, about a minute each.")
    ] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Another number makes other searches.")] = 0,
) -> None:
    """Search long for boxes around a machine's meshes; prints TOML for its sidecar."""
    from cockpit.fit import run_fit

    run_fit(model, sidecar, tuple(link or ()), starts, seed)


@app.command()
def schema(
    name: Annotated[
        str, typer.Argument(help="Document's name; without it the names are listed.")
    ] = "",
) -> None:
    """Print the JSON Schema of a document that the program reads or prints."""
    from cockpit.schemas import print_schema

    print_schema(name)


@app.command()
def bench(
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Length of the live measurements [s].")
    ] = 10.0,
    only: Annotated[str, typer.Option(help="Only parts with this in their names.")] = "",
) -> None:
    """Measure speed and memory, against peers in the same run."""
    from cockpit.bench import run_bench

    run_bench(json_, seconds, only)


@app.command()
def recover(
    path: Annotated[Path, typer.Argument(help="A cut or damaged .mcap file, or a recording.")],
    out: Annotated[
        Path | None, typer.Option(help="The .mcap file to write; default: beside the original.")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON instead of words.")] = False,
) -> None:
    """Write a whole file of what can be read of a damaged recording; the original stays."""
    from cockpit.recover import run_recover

    run_recover(path, out, json_)


app.add_typer(recordings, name="recordings")
app.add_typer(users, name="users")
app.command()(keys)
app.command()(convert)
app.command()(export)
app.command()(gauge)
app.command()(detect)
app.command()(track)
app.command()(along)
app.command()(plan)
app.command()(surmount)
app.command(name="use-case")(use_case)


def _interrupted() -> threading.Event:
    """Set by Ctrl-C or SIGTERM."""
    event = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: event.set())
    return event


add_commands(app, _interrupted)


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point. Mistakes of the user are one sentence and exit code 2, never a traceback."""
    try:
        app(args=None if arguments is None else list(arguments))
    except InputError as error:
        print(f"cockpit: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    except BrokenPipeError:
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
