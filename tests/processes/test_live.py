"""The real processes over Zenoh: what the backend concludes, and what it does when one dies."""

from __future__ import annotations

import json
import signal
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from live import Backend, all_valid, backend, end, frames, serve, simulate, simulated
from program import cockpit
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from backend.shell.app.wire import decode
from backend.shell.link.codec import decode as decode_message
from backend.shell.link.session import open_session

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]
SITE = "demo"
MACHINES = ("left", "right")


@pytest.fixture(scope="module")
def running() -> Iterator[tuple[Backend, dict[str, Any]]]:
    with serve(SITE) as station, simulated(SITE, station.endpoint, *MACHINES) as processes:
        station.wait_for(all_valid)
        yield station, processes


def test_poses_agree_with_the_machines_own_truth(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    truths: dict[str, list[Any]] = {name: [] for name in MACHINES}

    def listener(name: str) -> Callable[[Any], None]:
        return lambda sample: truths[name].append(
            decode_message(name, "truth", sample.payload.to_bytes(), time.monotonic())
        )

    errors, angles = [], []
    with open_session(connect=[station.endpoint], mode="router") as session:
        subscribers = [session.declare_subscriber(f"{n}/truth", listener(n)) for n in MACHINES]
        deadline = time.monotonic() + 10.0
        while not all(truths.values()):
            assert time.monotonic() < deadline, "no machine told its true state"
            time.sleep(0.05)
        for _ in range(10):
            document = station.get("/api/snapshot")
            for name in MACHINES:
                machine = document["machines"][name]
                # Truth comes without the radio's delay: what was true at the fused time.
                then = document["state_time"]
                truth = min(truths[name], key=lambda t, at=then: abs(t.arrival - at))
                errors.append(np.linalg.norm(np.array(machine["position_projected"]) - truth.base))
                q = np.array(list(machine["joints"].values()))
                angles.append(np.abs(q - truth.position).max())
            time.sleep(0.2)
        for subscriber in subscribers:
            subscriber.undeclare()
    assert max(errors) < 0.15  # 0.02 m GNSS noise and the antenna's lever arm
    assert max(angles) < 0.1
    assert np.median(angles) < 0.03


def test_the_snapshot_is_what_its_schema_says(running: tuple[Backend, dict[str, Any]]) -> None:
    station, _ = running
    document = station.get("/api/snapshot")
    jsonschema.validate(document, json.loads(cockpit("schema", "snapshot").stdout))
    jsonschema.validate(station.get("/api/health"), json.loads(cockpit("schema", "health").stdout))
    jsonschema.validate(station.get("/api/site"), json.loads(cockpit("schema", "site").stdout))
    assert set(document["machines"]) == set(MACHINES)
    assert station.get("/api/machines")["left"]["lengths"] == [1.0, 1.72, 0.951, 0.7]
    paths = station.get("/api/openapi.json")["paths"]
    assert {"/api/health", "/api/site", "/api/machines", "/api/snapshot"} <= set(paths)


def test_snapshots_and_images_come_at_their_rates(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    cycles, stamps = [], {"left<-right": set(), "right<-left": set()}
    with station.socket() as client:
        until = time.monotonic() + 3.0
        while time.monotonic() < until:
            header, arrays = decode(client.recv(timeout=5))
            if header["type"] == "snapshot":
                cycles.append(header["cycle"])
            elif header["type"] == "sun":
                stamps[header["key"]].add(header["state_time"])
                assert len(arrays["zone"]) > 8
    assert cycles == sorted(cycles)
    assert len(cycles) > 30
    # The script brings the machines close enough for images within its first seconds.
    assert all(len(s) >= 10 for s in stamps.values())


def test_a_killed_machine_is_stale_and_comes_back(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, processes = running
    station.wait_for(all_valid)
    with station.socket() as client:
        for _ in frames(client, 0.5):
            pass
        processes["right"].send_signal(signal.SIGKILL)
        seen = [f for _, f in frames(client, 3.0)]
    # By the snapshot's own clock: nothing older than 0.2 s is called valid.
    right = [f["machines"]["right"] for f in seen]
    assert all(m["validity"] != "VALID" for m in right if m["ages"]["joints"] > 0.2)
    first = next(m for m in right if m["validity"] != "VALID")
    assert first["ages"]["joints"] < 1.0
    pair = seen[-1]["pairs"][0]
    assert pair["distance"] is None
    assert "RIGHT" in pair["reason"]
    document = station.get("/api/snapshot")
    assert document["machines"]["right"]["reasons"]
    assert {a["level"] for a in document["alarms"]} == {"UNKNOWN"}
    assert not station.get("/api/health")["ok"]
    processes["right"].wait()
    processes["right"] = simulate(SITE, "right", station.endpoint)
    back = station.wait_for(all_valid)
    assert back["pairs"][0]["distance"] is not None or back["pairs"][0]["at_least"] is not None


def test_garbage_on_the_wire_is_counted_and_ignored(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    rng = np.random.default_rng(0)
    counters: dict[str, Any] = {}
    with open_session(connect=[station.endpoint], mode="router") as session:
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            for _ in range(10):
                session.put("left/joint_states", rng.bytes(int(rng.integers(0, 400))))
                session.put("left/gnss/fix", b"\xff" * 64)
                session.put("nobody/gnss/fix", b"hello")
            time.sleep(0.05)
            counters = station.get("/api/health")["counters"]
            if counters["foreign"] and counters["malformed"].get("left/joint_states", 0) >= 100:
                break
    assert counters["malformed"]["left/joint_states"] >= 100
    assert counters["malformed"]["left/gnss/fix"] >= 100
    assert "nobody" in counters["foreign"]
    assert station.wait_for(all_valid)


def test_a_foreign_page_is_refused_before_it_is_accepted(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    for path in ("/ws", "/view"):
        with pytest.raises(InvalidStatus) as refused:
            connect(station.url.replace("http", "ws") + path, origin="http://evil.example")
        assert refused.value.response.status_code == 403


def test_a_second_backend_sees_the_same_machines_through_the_first(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    arguments = ("--site", SITE, "--connect", station.endpoint, "--machines", "left")
    with backend("serve", *arguments) as second:
        snapshot = second.wait_for(all_valid)
        assert {c["machine"] for c in snapshot["concerns"]} == {"left"}
        assert second.get("/api/site")["own"] == ["left"]
        first = station.get("/api/snapshot")
        np.testing.assert_allclose(
            snapshot["machines"]["right"]["position"],
            first["machines"]["right"]["position"],
            atol=0.1,
        )


def test_conclusions_are_published_for_other_hosts(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    heard: dict[str, list[bytes]] = {"cockpit/snapshot": [], "cockpit/image/sun": []}

    def listener(key: str) -> Callable[[Any], None]:
        return lambda sample: heard[key].append(sample.payload.to_bytes())

    with open_session(connect=[station.endpoint], mode="router") as session:
        subscribers = [session.declare_subscriber(key, listener(key)) for key in heard]
        deadline = time.monotonic() + 20.0
        while not all(heard.values()) and time.monotonic() < deadline:
            time.sleep(0.05)
        for subscriber in subscribers:
            subscriber.undeclare()
    document = json.loads(heard["cockpit/snapshot"][0])
    jsonschema.validate(document, json.loads(cockpit("schema", "snapshot").stdout))
    assert decode(heard["cockpit/image/sun"][0])[0]["key"] in ("left<-right", "right<-left")


def test_a_taken_port_is_said_in_one_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = cockpit("demo", "--port", str(port), "--no-browser")
    assert done.returncode == 2
    assert f"{port} is taken" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["serve", "--no-login", "--site", "nowhere"], "nowhere"),
        (["serve", "--no-login", "--site", "demo", "--machines", "middle"], "middle"),
        (["serve", "--no-login", "--site", "demo", "--listen", "tcp/nonsense"], "tcp/nonsense"),
        (["serve", "--no-login", "--site", "demo", "--port", "99999"], "99999"),
        (["sim", "--site", "demo", "--machine", "middle"], "middle"),
        (["schema", "nothing"], "nothing"),
        (["demo", "--site", "nowhere"], "nowhere"),
    ],
)
def test_mistakes_are_one_sentence(arguments: list[str], word: str) -> None:
    done = cockpit(*arguments)
    assert done.returncode == 2
    assert word in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_ctrl_c_ends_everything_quickly() -> None:
    with backend("demo") as station:
        begun = time.monotonic()
        station.process.send_signal(signal.SIGINT)
        station.process.wait(timeout=15)
        assert time.monotonic() - begun < 10
        assert station.process.returncode == 0
        end(station.process)


def test_a_foreign_name_for_the_loopback_leads_nowhere(
    running: tuple[Backend, dict[str, Any]],
) -> None:
    station, _ = running
    request = urllib.request.Request(station.url + "/api/health", headers={"Host": "evil.example"})
    with pytest.raises(urllib.error.HTTPError, match="400"):
        urllib.request.urlopen(request, timeout=10)


def test_a_site_with_an_unknown_model_names_file_and_machine(
    repository: Path, tmp_path: Path
) -> None:
    text = (repository / "scenes" / "sites" / "demo.toml").read_text()
    site = tmp_path / "bad.toml"
    site.write_text(text.replace('model = "mini"', 'model = "nosuch"', 1))
    done = cockpit("demo", "--site", str(site), "--port", "0", "--no-browser")
    assert done.returncode == 2
    assert all(word in done.stderr for word in ("bad.toml", "left", "nosuch", "mini"))
