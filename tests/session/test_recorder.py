"""What is recorded of a live cockpit gives, replayed, the same snapshots bit by bit."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from recordings import read

from backend.documents.snapshot import snapshot_document
from backend.fusion.samples import ClockSample
from backend.pipeline.config import Config
from backend.pipeline.records import ImageStamp, Inputs, Notice, Snapshot
from backend.pipeline.step import initial, step
from backend.shell.app.wire import dumps
from backend.shell.hub import Hub
from backend.shell.link.codec import DecodeError, decode
from backend.shell.link.encode import (
    encode_clock,
    encode_fix,
    encode_heading,
    encode_joint_states,
)
from backend.shell.link.receiver import Receiver
from backend.shell.link.session import open_session, with_port
from backend.shell.link.source import LinkSource
from backend.shell.runner import Runner
from backend.shell.session.format import (
    ACTION,
    ALARM,
    CLOCK,
    CYCLE,
    MARKER,
    SCHEMAS,
    SNAPSHOT,
    Header,
    Message,
    seconds,
)
from backend.shell.session.keeper import Plan
from backend.shell.session.recorder import ACTIONS, NoRecorder, Recorder
from backend.shell.session.ring import Limits, parts_of
from backend.site.site import Site, load_site
from cockpit.desk import load_models, make_config


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site("demo")


@pytest.fixture(scope="module")
def config(site: Site) -> Config:
    return make_config(site, load_models(site), (), "LIVE")


@pytest.fixture
def recorder(tmp_path: Path, config: Config, site: Site) -> Iterator[Recorder]:
    header = Header(
        offset=time.time_ns() - time.monotonic_ns(),
        recording="now",
        part=0,
        site_file=str(site.path),
        site=site.path.read_text(),
        own="left,right",
        origin="live",
        software="test",
    )
    made = Recorder(Plan(tmp_path / "demo", header, Limits()), site.safety.stop_below)
    made.start()
    yield made
    made.close()


def replayed(found: list[Message], offset: int, config: Config) -> Iterator[str]:
    """Snapshots of a recording, cycle by cycle, as JSON."""
    state = initial(config)
    samples: list[Any] = []
    for message in found:
        if message.topic == CLOCK:
            samples.append(ClockSample(**json.loads(message.data)))
        elif message.topic == CYCLE:
            cycle = json.loads(message.data)
            inputs = Inputs(
                tuple(samples),
                tuple(ImageStamp(**image) for image in cycle.get("images", ())),
                tuple(map(tuple, cycle.get("malformed", ()))),  # type: ignore[arg-type]
                tuple(map(tuple, cycle.get("foreign", ()))),  # type: ignore[arg-type]
                cycle.get("lost", 0),
                tuple(Notice(n["key"], n["line"]) for n in cycle.get("notices", ())),
            )
            samples = []
            now = seconds(message.time, offset)
            assert now == cycle["time"]
            state, snapshot = step(state, inputs, now, config)
            assert snapshot.cycle == cycle["cycle"]
            yield dumps(snapshot_document(snapshot, config))
        elif not message.topic.startswith("/cockpit/"):
            machine, _, suffix = message.topic[1:].partition("/")
            if suffix in ("cmd", "points"):
                continue
            try:
                samples.append(decode(machine, suffix, message.data, seconds(message.time, offset)))
            except DecodeError:
                continue  # the cycle has counted it


def publish(endpoint: str, site: Site, stopping: threading.Event) -> None:
    """Two machines at full rate, with garbage now and then, until stopped."""
    rng = np.random.default_rng(0)
    with open_session(connect=[endpoint]) as wire:
        answering = [
            wire.declare_queryable(
                f"{m.name}/clock",
                lambda query: query.reply(query.key_expr, encode_clock(time.time() + 3.0)),
            )
            for m in site.machines
        ]
        tick = 0
        while not stopping.wait(0.005):
            tick += 1
            for m in site.machines:
                assert m.start is not None
                stamp = time.time() + 3.0
                angles = np.deg2rad(list(m.start.joints_deg.values())) + rng.normal(0, 0.01, 4)
                joints = encode_joint_states(stamp, list(m.start.joints_deg), angles, np.zeros(4))
                wire.put(f"{m.name}/joint_states", joints)
                if tick % 10 == 0:
                    base = site.frame.from_projected(np.array(m.start.position))
                    fix = encode_fix(stamp, *site.frame.to_geodetic(base), np.eye(3) * 1e-4)
                    wire.put(f"{m.name}/gnss/fix", fix)
                    yaw = np.deg2rad(m.start.yaw_deg)
                    wire.put(f"{m.name}/gnss/heading", encode_heading(stamp, yaw, 1e-6))
                if tick % 50 == 0:
                    wire.put(f"{m.name}/joint_states", rng.bytes(50))
                    wire.put(f"{m.name}/nonsense", b"?")
                    wire.put("stranger/gnss/fix", b"?")
                    wire.put(f"{m.name}/points", rng.bytes(2000))
                    wire.put(f"{m.name}/cmd", rng.bytes(20))
        for one in answering:
            one.undeclare()


def moved(message: Message) -> Message:
    """Joint angles a bit further, in the word's strict sense."""
    try:
        sample: Any = decode("left", "joint_states", message.data, 0.0)
    except DecodeError:
        return message
    angles = np.nextafter(sample.position, np.inf)
    data = encode_joint_states(sample.stamp, list(sample.names), angles, sample.velocity)
    return replace(message, data=data)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_a_replay_is_the_live_run_bit_by_bit(
    recorder: Recorder, config: Config, site: Site
) -> None:
    endpoint = with_port("tcp/127.0.0.1:0")
    live: list[str] = []
    hub = Hub()
    notices: list[Notice] = []

    def after_cycle(inputs: Inputs, snapshot: Snapshot) -> None:
        recorder.after_cycle(inputs, snapshot)
        live.append(dumps(snapshot_document(snapshot, config)))

    with open_session(listen=[endpoint], mode="router") as wire:
        receiver = Receiver(
            wire, {m.prefix: m.name for m in site.machines}, poll_period=0.1, everything=True
        )
        runner = Runner(
            *(config, (), LinkSource(receiver, recorder.hear), hub, 50.0),
            notices=lambda: tuple(notices),
            after_cycle=after_cycle,
        )
        stopping = threading.Event()
        machines = threading.Thread(target=publish, args=(endpoint, site, stopping))
        machines.start()
        runner.start()
        until(lambda: len(live) > 30 and '"validity":"VALID"' in live[-1])
        notices.append(Notice("recording", "RECORDING · something"))
        runner._done.append(ImageStamp("left<-right", "sun", 1.1, 2.2, 0.3))
        told = len(live)
        until(lambda: len(live) > told + 10)
        notices.clear()
        until(lambda: '"offset"' in live[-1] and '"stranger"' in live[-1])
        until(lambda: len(live) > told + 30)
        stopping.set()
        machines.join()
        runner.stop()
        receiver.close()
    recorder.close()
    (part,) = parts_of(recorder.plan.folder)
    found = read(part.path)
    topics = {m.topic for m in found}
    assert {"/left/points", "/left/cmd", "/right/gnss/fix", CLOCK, CYCLE} <= topics
    last = json.loads(live[-1])
    assert last["health"]["malformed"]["left/joint_states"] > 0
    assert any(json.loads(text)["notices"] for text in live)
    assert any(json.loads(text)["images"] for text in live)
    again = list(replayed(found, recorder.plan.header.offset, config))
    assert again == live
    # The test can tell: the lowest bit of the angles is a difference.
    changed = [moved(m) if m.topic == "/left/joint_states" else m for m in found]
    assert list(replayed(changed, recorder.plan.header.offset, config)) != live


def test_what_operators_do_and_what_is_concluded_is_recorded(
    recorder: Recorder, config: Config
) -> None:
    at = time.monotonic()
    recorder.snapshot('{"time":1.5,"cycle":3,"machines":{"größe":null}}', at)
    for text in ("[]", "[]", '[{"level":"STOP"}]', "[]"):
        recorder.alarms(text, at)
    recorder.action("camera", "page1", {"type": "camera", "name": "plan"})
    recorder.action("ghost", None, {"joints": {"boom": float("nan")}})  # not a number: not kept
    recorder.mark("note", "größer " + "x" * 1000)
    _, snapshot = step(initial(config), Inputs(), at, config)
    near, far = (
        replace(snapshot.pairs[0], body_a="stick/0", body_b="bucket/1", distance=d, near=True)
        for d in (0.1, 2.0)
    )
    for pair in (near, far):
        recorder.after_cycle(Inputs(), replace(snapshot, pairs=(pair,)))
    recorder.after_cycle(Inputs(), replace(snapshot, pairs=(near,)))  # ends with the recording
    recorder.close()
    (part,) = parts_of(recorder.plan.folder)
    found: dict[str, list[Any]] = {}
    for message in read(part.path):
        document = json.loads(message.data)
        jsonschema.validate(document, SCHEMAS[message.topic])
        found.setdefault(message.topic, []).append(document)
        assert abs(seconds(message.time, recorder.plan.header.offset) - at) < 60.0
    assert found[SNAPSHOT] == [{"time": 1.5, "cycle": 3, "machines": {"größe": None}}]
    assert [d["alarms"] for d in found[ALARM]] == [[], [{"level": "STOP"}], []]
    assert [d["action"] for d in found[ACTION]] == ["camera"]
    kinds = [d["kind"] for d in found[MARKER]]
    assert kinds == ["note", "near miss", "near miss"]
    assert found[MARKER][0]["text"].startswith("größer xxx")
    miss = found[MARKER][1]
    assert miss["text"] == "LEFT stick ↔ RIGHT bucket 0.10 m"
    assert (miss["machine"], miss["details"]["distance"]) == ("left", 0.1)


def test_a_page_that_floods_does_not_flood_the_recording(recorder: Recorder) -> None:
    for k in range(1000):
        recorder.action("camera", None, {"k": k})
    recorder.close()
    (part,) = parts_of(recorder.plan.folder)
    assert ACTIONS <= len(read(part.path)) <= 3 * ACTIONS


def test_a_pin_ends_now_with_a_whole_file(recorder: Recorder) -> None:
    recorder.mark("note", "before")
    deadline = time.monotonic() + 30.0
    while not parts_of(recorder.plan.folder):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    folder = recorder.pin("what happened", 60.0)
    recorder.mark("note", "after")
    (part,) = parts_of(folder)
    texts = [json.loads(m.data)["text"] for m in read(part.path)]
    assert texts == ["before", "what happened"]


def test_recording_costs_the_fast_loop_little(recorder: Recorder, config: Config) -> None:
    """A cycle of two machines at 200 Hz: 12 messages."""
    from backend.shell.link.receiver import Heard
    from backend.shell.link.topics import topic

    joints = encode_joint_states(1.0, ["a", "b", "c", "d"], np.ones(4), np.ones(4))
    items = tuple(
        Heard(m, f"{m}/joint_states", "joint_states", topic("joint_states"), joints, 1000.0 + k)
        for m in ("left", "right")
        for k in range(6)
    )
    _, snapshot = step(initial(config), Inputs(), 1.0, config)
    images = tuple(ImageStamp("left<-right", kind, 1.1, 2.2, 0.3) for kind in ("sun", "exact"))
    taken = []
    for _ in range(500):
        begun = time.thread_time()
        recorder.notices()
        recorder.hear(items)
        recorder.after_cycle(Inputs(images=images), snapshot)
        taken.append(time.thread_time() - begun)
        time.sleep(0.002)
    print(
        f"per cycle: p50 {1e6 * np.median(taken):.0f}, p95 {1e6 * np.percentile(taken, 95):.0f} us"
    )
    assert np.median(taken) < 4e-4  # 0.03 ms where nothing else runs


def test_without_a_recorder_it_is_said_why() -> None:
    none = NoRecorder("started with --no-record")
    assert (none.state().state, none.state().text) == ("off", "started with --no-record")
    assert none.notices() == ()
    for ask in (lambda: none.pin("x", 60.0), lambda: none.mark("note", "x")):
        with pytest.raises(Exception, match="nothing is recorded: started with --no-record"):
            ask()
