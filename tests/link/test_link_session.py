"""Two sessions over TCP: samples arrive, clocks are asked, garbage is counted, closing is quick."""

from __future__ import annotations

import socket
import threading
import time

import numpy as np
import pytest

from backend.errors import InputError
from backend.fusion.samples import ClockSample, JointSample
from backend.shell.link.encode import encode_clock, encode_joint_states, encode_status
from backend.shell.link.messages import AgentStatus
from backend.shell.link.receiver import BESIDE_BYTES, QUEUE, Receiver
from backend.shell.link.session import open_session, publisher, with_port
from backend.shell.link.topics import key


def wait_until(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened in time"
        time.sleep(0.01)


@pytest.fixture
def wire():
    """(cockpit's session, machine's session, endpoint)."""
    endpoint = with_port("tcp/127.0.0.1:0")
    cockpit = open_session(listen=[endpoint], mode="router")
    machine = open_session(connect=[endpoint])
    yield cockpit, machine, endpoint
    machine.close()
    cockpit.close()


def joints(stamp, value=0.5):
    return encode_joint_states(stamp, ["swing", "boom"], np.array([value, 0.1]), np.zeros(2))


def collect(receiver, kind, count=1, seconds=5.0):
    found = []

    def enough():
        found.extend(s for s in receiver.drain().samples if isinstance(s, kind))
        return len(found) >= count

    wait_until(enough, seconds)
    return found


def test_samples_keep_their_order_and_name(wire):
    cockpit, machine, _ = wire
    receiver = Receiver(cockpit, {"plant/one": "left"})
    out = publisher(machine, "joint_states", "plant/one")
    wait_until(lambda: out.matching_status.matching)
    before = time.monotonic()
    for i in range(50):
        out.put(joints(100.0 + i))
    got = collect(receiver, JointSample, 50)
    assert [s.stamp for s in got] == [100.0 + i for i in range(50)]
    assert {s.machine for s in got} == {"left"}
    assert before <= got[0].arrival <= got[-1].arrival <= time.monotonic()
    receiver.close()


def test_clock_is_asked_by_round_trips(wire):
    cockpit, machine, _ = wire
    remote = 1.7e9
    row = key("clock", "left")
    answering = machine.declare_queryable(row, lambda q: q.reply(row, encode_clock(remote)))
    receiver = Receiver(cockpit, {"left": "left", "right": "right"}, poll_period=0.05)
    got = collect(receiver, ClockSample, 3)
    assert all(s.machine == "left" and s.remote == remote for s in got)  # the dead one is no matter
    assert all(0.0 <= s.received - s.sent < 1.0 for s in got)
    answering.undeclare()
    receiver.close()


def test_malformed_unknown_and_foreign_messages_are_counted(wire):
    cockpit, machine, _ = wire
    receiver = Receiver(cockpit, {"left": "left"})
    out = publisher(machine, "joint_states", "left")
    wait_until(lambda: out.matching_status.matching)
    out.put(b"\x00\x01\x00\x00garbage")
    out.put(b"x" * 1_000_000)  # larger than any JointState may be
    machine.put("left/secret/key", b"?")
    machine.put("left/cmd", b"not for us")
    machine.put("stranger/gnss/fix", b"anything")
    out.put(joints(1.0))
    malformed, foreign, samples = {}, {}, []

    def all_there():
        drained = receiver.drain()
        samples.extend(drained.samples)
        for label, n in drained.malformed:
            malformed[label] = malformed.get(label, 0) + n
        for label, n in drained.foreign:
            foreign[label] = foreign.get(label, 0) + n
        return samples and sum(malformed.values()) == 3 and foreign

    wait_until(all_there)
    assert malformed == {"left/joint_states": 2, "left/secret/key": 1}
    assert foreign == {"stranger": 1}
    assert len(samples) == 1
    receiver.close()


def test_full_queue_drops_the_oldest_and_says_so(wire):
    cockpit, _, _ = wire
    receiver = Receiver(cockpit, {"left": "left"})
    for i in range(QUEUE + 10):
        receiver._enqueue("left", "left/joint_states", 5, _Bytes(joints(float(i))), float(i))
    drained = receiver.drain()
    assert drained.lost == 10
    assert drained.samples[0].stamp == 10.0
    assert len(drained.samples) == QUEUE
    receiver.close()


class _Bytes(bytes):
    def to_bytes(self):
        return bytes(self)


def test_labels_do_not_grow_without_end(wire):
    cockpit, _, _ = wire
    receiver = Receiver(cockpit, {"left": "left"})
    for i in range(1000):
        receiver._enqueue("left", f"left/unknown/{i}", 5, _Bytes(b""), 0.0)
    labels = dict(receiver.drain().malformed)
    assert len(labels) <= 101
    assert sum(labels.values()) == 1000
    receiver.close()


def test_status_is_kept_by_machine(wire):
    cockpit, machine, _ = wire
    receiver = Receiver(cockpit, {"left": "left"})
    status = AgentStatus("left", 5.0, 0.0, "remote", "ann", 3, 7, 0.02, 1.0, 9, 1)
    out = publisher(machine, "status", "left")
    wait_until(lambda: out.matching_status.matching)
    out.put(encode_status(status))
    wait_until(lambda: receiver.drain() and receiver.statuses())
    got = receiver.statuses()["left"]
    assert (got.mode, got.holder, got.token, got.sequence) == ("remote", "ann", 3, 7)
    receiver.close()


def test_machine_started_first_is_heard_and_heard_again_after_a_restart():
    endpoint = with_port("tcp/127.0.0.1:0")
    machine = open_session(connect=[endpoint])  # nobody there yet
    out = publisher(machine, "joint_states", "left")
    stop = threading.Event()

    def send():
        while not stop.wait(0.02):
            out.put(joints(time.time()))

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    for _ in range(2):
        cockpit = open_session(listen=[endpoint], mode="router")
        receiver = Receiver(cockpit, {"left": "left"})
        collect(receiver, JointSample, 5, seconds=8.0)
        receiver.close()
        cockpit.close()
    stop.set()
    thread.join()
    machine.close()


def test_two_backends_share_machines_through_a_router():
    endpoint = with_port("tcp/127.0.0.1:0")
    router = open_session(listen=[endpoint], mode="router")
    sessions = [open_session(connect=[endpoint], mode="router") for _ in range(2)]
    receivers = [Receiver(s, {"left": "left"}) for s in sessions]
    machine = open_session(connect=[endpoint])
    out = publisher(machine, "joint_states", "left")
    got = [0, 0]

    def heard():
        out.put(joints(1.0))
        for i, receiver in enumerate(receivers):
            got[i] += len(receiver.drain().samples)
        return min(got) > 3

    wait_until(heard)
    for receiver in receivers:
        receiver.close()
    for session in (machine, *sessions, router):
        session.close()


def test_closing_takes_less_than_a_second_even_under_load(wire):
    cockpit, machine, _ = wire
    receiver = Receiver(cockpit, {"left": "left", "silent": "silent"}, poll_period=0.05)
    out = publisher(machine, "joint_states", "left")
    for _ in range(500):
        out.put(joints(1.0))
    time.sleep(0.1)
    start = time.monotonic()
    receiver.close()
    receiver.close()
    cockpit.close()
    assert time.monotonic() - start < 1.0
    assert not [t for t in threading.enumerate() if t.name == "clock-poll" and t.is_alive()]


def test_taken_port_is_one_clear_sentence():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=rf"{port} is taken"):
            open_session(listen=[f"tcp/127.0.0.1:{port}"])


@pytest.mark.parametrize(
    "bad", ["foo", "tcp/127.0.0.1", "tcp/127.0.0.1:99999", "carrier/pigeon:1", "tcp/:7447", ""]
)
def test_malformed_endpoints_are_one_clear_sentence(bad):
    with pytest.raises(InputError, match="allowed is PROTOCOL/HOST:PORT"):
        open_session(connect=[bad])
    with pytest.raises(InputError, match="allowed is PROTOCOL/HOST:PORT"):
        open_session(listen=[bad])


def test_unknown_host_and_mode():
    with pytest.raises(InputError, match="not an address of this computer"):
        open_session(listen=["tcp/no-such-host.invalid:7447"])
    with pytest.raises(InputError, match="allowed are peer, router"):
        open_session(mode="server")


def test_bad_prefix(wire):
    for bad in ("", "left/", "l*ft", "a b"):
        with pytest.raises(InputError, match="not a key prefix"):
            Receiver(wire[0], {bad: "left"})


def test_all_that_is_to_be_recorded_is_handed_on_as_it_came(wire):
    cockpit, machine, _ = wire
    row = key("clock", "plant/one")
    answering = machine.declare_queryable(row, lambda q: q.reply(row, encode_clock(5.0)))
    receiver = Receiver(cockpit, {"plant/one": "left"}, poll_period=0.05, everything=True)
    out = publisher(machine, "joint_states", "plant/one")
    wait_until(lambda: out.matching_status.matching)
    sent = {
        "joint_states": joints(1.0),
        "cmd": b"a command, not decoded here",
        "points": b"many points",
        "gnss/fix": b"broken, and evidence all the same",
        "truth": b"only for tests",
    }
    for suffix, payload in sent.items():
        machine.put(f"plant/one/{suffix}", payload)
    heard, malformed, samples = [], {}, []

    def all_there():
        drained = receiver.drain()
        heard.extend(drained.heard)
        samples.extend(drained.samples)
        malformed.update(dict(drained.malformed))
        clocks = [h for h in heard if isinstance(h, ClockSample)]
        return len(clocks) >= 2 and len(heard) - len(clocks) >= 4

    wait_until(all_there)
    raw = [h for h in heard if not isinstance(h, ClockSample)]
    del sent["truth"]
    assert {h.suffix: h.payload for h in raw} == sent
    assert {h.key for h in raw} == {f"plant/one/{suffix}" for suffix in sent}
    assert {h.machine for h in raw} == {"left"}
    assert malformed == {"left/gnss/fix": 1, "left/truth": 1}
    # What the fusion got stands in the same order in the recording.
    arrivals = [s.received if isinstance(s, ClockSample) else s.arrival for s in samples]
    of_fusion = [h for h in heard if isinstance(h, ClockSample) or h.suffix == "joint_states"]
    told = [h.received if isinstance(h, ClockSample) else h.arrival for h in of_fusion]
    assert told == arrivals
    answering.undeclare()
    receiver.close()


def test_commands_and_points_are_dropped_when_nobody_records(wire):
    cockpit, _, _ = wire
    receiver = Receiver(cockpit, {"left": "left"})
    receiver._enqueue("left", "left/cmd", 5, _Bytes(b"command"), 1.0)
    receiver._enqueue("left", "left/points", 5, _Bytes(b"points"), 1.0)
    assert receiver.drain().heard == ()
    receiver.close()


def test_points_that_nobody_fetches_do_not_fill_the_memory(wire):
    cockpit, _, _ = wire
    receiver = Receiver(cockpit, {"left": "left"}, everything=True)
    cloud = _Bytes(bytes(BESIDE_BYTES // 8))
    for _ in range(11):
        receiver._enqueue("left", "left/points", 5, cloud, 1.0)
    drained = receiver.drain()
    assert len(drained.heard) == 8
    assert drained.lost == 3
    receiver.close()
