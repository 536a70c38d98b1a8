"""What goes wrong while a machine is driven: each fault injected many times, into real processes.

Prints the expected and the measured figures. `FAULTS=10 pytest ...` makes a tenth of the default of
100; a busy computer measures itself, so run it alone.
"""

from __future__ import annotations

import itertools
import signal
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from faults import SITE, TIMES, machines, moving, show, spread
from live import Backend, all_valid, serve
from operators import Operator
from wiretap import Wiretap

from backend.shell.link.encode import encode_command
from backend.shell.link.session import with_port

pytestmark = pytest.mark.timeout(7_200)


@pytest.fixture(scope="module")
def tap() -> Iterator[Wiretap]:
    """Beside the backend, so that it hears the machines whatever becomes of the backend."""
    with Wiretap(with_port("tcp/127.0.0.1:0"), "left", listens=True) as listening:
        yield listening


@pytest.fixture(scope="module")
def station(tap: Wiretap) -> Iterator[Backend]:
    with (
        serve(SITE, "--no-record", "--connect", tap.endpoint) as running,
        machines(running.endpoint, tap.endpoint),
    ):
        running.wait_for(all_valid)
        yield running


@pytest.fixture(scope="module")
def operator(station: Backend) -> Iterator[Operator]:
    opened = Operator(station)
    opened.take("left")
    yield opened
    opened.close()


def zero_after(operator: Operator, tap: Wiretap, begun: float) -> float:
    operator.wait(lambda: tap.first_zero(begun) is not None)
    found = tap.first_zero(begun)
    assert found is not None
    return found - begun


def test_dead_man_released(operator: Operator, tap: Wiretap) -> None:
    times = []
    for _ in range(TIMES):
        moving(operator, tap)
        begun = time.monotonic()
        operator.move(enable=False)
        times.append(zero_after(operator, tap, begun))
    show("dead-man released → zero on the wire", "<= 100 ms", spread(times))
    assert sorted(times)[int(0.99 * len(times)) - 1] <= 0.1


def test_input_ceases(operator: Operator, tap: Wiretap) -> None:
    times = []
    for _ in range(TIMES):
        moving(operator, tap)
        operator.sending = False
        begun = time.monotonic()
        times.append(zero_after(operator, tap, begun))
        operator.sending = True
    show("page falls silent → zero on the wire", "<= 250 ms", spread(times))
    assert sorted(times)[int(0.99 * len(times)) - 1] <= 0.25


def test_the_backend_stands_still(station: Backend, operator: Operator, tap: Wiretap) -> None:
    times, again = [], 0
    for _ in range(max(TIMES // 5, 1)):
        moving(operator, tap)
        time.sleep(0.3)
        station.process.send_signal(signal.SIGSTOP)
        begun = time.monotonic()
        try:
            operator.wait(lambda begun=begun: tap.stood(begun) is not None)
            stood = tap.stood(begun)
            assert stood is not None
            times.append(stood - begun)
            time.sleep(max(0.0, begun + 1.0 - time.monotonic()))
        finally:
            station.process.send_signal(signal.SIGCONT)
        resumed = time.monotonic()
        time.sleep(0.5)
        again += any(abs(c.velocity).any() for c in tap.commands if c.arrival > resumed + 0.3)
    show("all of the backend stalled 1 s → standstill", "<= 500 ms", spread(times))
    show("moved again by itself afterwards", "0", str(again))
    assert max(times) <= 0.5
    assert again == 0


def test_tokens_and_replays(operator: Operator, tap: Wiretap) -> None:
    moving(operator, tap)
    newest = tap.commands[-1]
    begun = time.monotonic()
    operator.move(enable=False)
    operator.wait(lambda: tap.stood(begun) is not None)
    count = 10 * TIMES
    ahead = newest.sequence + 1_000_000
    forged = {
        "no token": replace(newest, token=0, sequence=ahead),
        "an expired token": replace(newest, token=newest.token - 1, sequence=ahead),
        "a token never issued": replace(newest, token=newest.token + 1, sequence=ahead),
        "another's name": replace(newest, holder="eve", sequence=ahead),
        "a replayed command": newest,
        "endless speed": replace(newest, velocity=newest.velocity * float("inf"), sequence=ahead),
    }
    for name, command in forged.items():
        before = tap.statuses[-1].refused
        payload = encode_command(command)
        fastest = 0.0
        for _ in range(count):
            tap.session.put("left/cmd", payload)
            time.sleep(0.001)
            fastest = max(fastest, tap.speed())
        operator.wait(lambda before=before: tap.statuses[-1].refused >= before + count * 0.9)
        time.sleep(0.3)
        refused = tap.statuses[-1].refused - before
        show(f"{name}, {count} times", "all refused, 0 moved", f"{refused} refused, {fastest:.3f}")
        assert refused >= count  # none was lost on one computer
        assert fastest < 0.03


def test_pages_that_come_and_go(station: Backend, tap: Wiretap) -> None:
    times, regained = [], 0
    for k in range(max(TIMES // 2, 1)):
        gone = Operator(station)
        gone.take("left")
        if k % 5 == 0:
            moving(gone, tap)
        gone.close()
        begun = time.monotonic()
        back = Operator(station)
        times.append(time.monotonic() - begun)
        regained += bool(back.seat["consoles"])
        back.wait(lambda back=back: back.machine("left")["holder"] == "", timeout=2.0)
        back.close()
    show("page opened again → state on it", "<= 2 s", spread(times))
    show("control regained by itself", "0", str(regained))
    assert max(times) <= 2.0
    assert regained == 0


def test_two_operators_at_once(station: Backend) -> None:
    one, two = Operator(station), Operator(station)
    both = 0
    for _ in range(TIMES):
        threads = [threading.Thread(target=o.ask, args=("request", "right")) for o in (one, two)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        end = time.monotonic() + 0.3
        while time.monotonic() < end:
            held = [o.seat["consoles"].get("right", {}).get("held", False) for o in (one, two)]
            snapshot = one.snapshot["driving"]["seats"]
            now = [s["consoles"].get("right", {}).get("held", False) for s in snapshot.values()]
            both += sum(now) > 1
            time.sleep(0.01)
        assert any(held)
        for o in (one, two):
            o.ask("release", "right")
        one.wait(lambda: one.machine("right")["holder"] == "")
    show(f"{TIMES} requests of two pages at once, both held", "0", str(both))
    one.close()
    two.close()
    assert both == 0


def test_a_client_that_reads_slowly(station: Backend, operator: Operator) -> None:
    def intervals(seconds: float) -> list[float]:
        seen, cycle, end = [], -1, time.monotonic() + seconds
        while time.monotonic() < end:
            if operator.snapshot["cycle"] != cycle:
                cycle = operator.snapshot["cycle"]
                seen.append(time.monotonic())
            time.sleep(0.001)
        return sorted(b - a for a, b in itertools.pairwise(seen))

    def memory() -> float:
        text = Path(f"/proc/{station.process.pid}/status").read_text()
        return int(text.split("VmRSS:")[1].split()[0]) / 1024

    before, used = intervals(20.0), memory()
    address = station.url.removeprefix("http://").split(":")
    with socket.create_connection((address[0], int(address[1]))) as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        request = (
            f"GET /ws HTTP/1.1\r\nHost: {':'.join(address)}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n"
        )
        slow.sendall(request.encode())
        reading = threading.Event()

        def read() -> None:
            while not reading.wait(0.1):
                slow.recv(100)

        thread = threading.Thread(target=read, daemon=True)
        thread.start()
        after = intervals(20.0)
        more = memory() - used
        reading.set()
        thread.join()
    p99 = [values[int(0.99 * len(values))] for values in (before, after)]
    change = 100.0 * (p99[1] / p99[0] - 1.0)
    show("others' p99 beside one that reads 1 kB/s", "< +10 %", f"{change:+.0f} %")
    show("memory beside it", "< +50 MB", f"{more:+.1f} MB")
    assert more < 50.0
