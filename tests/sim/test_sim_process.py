"""A simulated machine on a real session: streams, commands, cuts, clock, ending."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager

import numpy as np
import pytest

from backend.control.lease import Kind, Request
from backend.errors import InputError
from backend.fusion.rig import make_rig
from backend.fusion.samples import ClockSample, FixSample, JointSample
from backend.fusion.streams import Streams, ingest
from backend.machine.load import load_machine
from backend.shell.agent.gate import names_of
from backend.shell.link.encode import encode_command, encode_limits
from backend.shell.link.lease_codec import decode_answer, encode_request
from backend.shell.link.messages import Command, MotionLimits
from backend.shell.link.receiver import Receiver
from backend.shell.link.session import open_session, publisher, with_port
from backend.shell.sim.process import run
from backend.site.site import load_site

SITE = load_site("demo")
MACHINE = load_machine("mini")


class Cockpit:
    """A receiver that keeps everything, and a way to command."""

    def __init__(self, endpoint, name):
        self.session = open_session(listen=[endpoint], mode="router")
        self.receiver = Receiver(self.session, {name: name}, poll_period=0.1)
        self.out = publisher(self.session, "cmd", name)
        self.limits = publisher(self.session, "limits", name)
        self.token, self.refreshed = 0, -10.0
        self.samples = []
        self.name, self.sequence = name, 0

    def drain(self):
        drained = self.receiver.drain()
        assert drained.malformed == ()
        assert drained.lost == 0
        self.samples += drained.samples
        return drained.samples

    def until(self, condition, seconds=10.0, each=None):
        end = time.monotonic() + seconds
        while True:
            self.drain()
            if condition():
                return
            assert time.monotonic() < end, "nothing happened in time"
            if each:
                each()
            time.sleep(0.02)

    def count(self, kind):
        return sum(isinstance(s, kind) for s in self.samples)

    @property
    def mode(self):
        status = self.receiver.statuses().get(self.name)
        return status.mode if status else ""

    @property
    def swing(self):
        """True rate [rad/s]."""
        return self.receiver.truths()[self.name].velocity[0]

    def lease(self):
        """Asks for the machine's lease, or refreshes it."""
        kind = Kind.REFRESH if self.token else Kind.REQUEST
        asked = encode_request(Request(kind, "test", token=self.token))
        for reply in self.session.get(f"{self.name}/lease", payload=asked):
            answer = decode_answer(reply.ok.payload.to_bytes())
            assert answer.granted, answer.why
            self.token = answer.token
        self.refreshed = time.monotonic()

    def command(self, swing=0.3, travel=0.0):
        if time.monotonic() > self.refreshed + 0.3:
            self.lease()
        self.sequence += 1
        names, ones = names_of(MACHINE), np.ones(len(MACHINE.joints) + 2)
        stamp = self.name, time.time(), 0.0, self.sequence
        self.limits.put(encode_limits(MotionLimits(*stamp, 0.2, self.token, names, ones, ones)))
        self.out.put(
            encode_command(
                Command(
                    *(*stamp, 0.2, "test", self.token),
                    *(("swing",), np.array([swing]), travel, travel),
                )
            )
        )

    def close(self):
        self.receiver.close()
        self.session.close()


def heard(sample):
    return sample.received if isinstance(sample, ClockSample) else sample.arrival


@contextmanager
def simulated(name="left", began=0.0, skew=0.0, site=SITE):
    """A cockpit with one machine, `began` seconds into its schedule, in a thread of its own."""
    endpoint = with_port("tcp/127.0.0.1:0")
    cockpit = Cockpit(endpoint, name)
    until = threading.Event()
    arguments = (site, name, (endpoint,), time.time() - began, until, skew)
    thread = threading.Thread(target=run, args=arguments, daemon=True)
    thread.start()
    try:
        yield cockpit
    finally:
        until.set()
        thread.join(timeout=5.0)
        cockpit.close()
    assert not thread.is_alive()


def test_streams_clock_and_commands():
    with simulated(skew=5.0) as cockpit:
        cockpit.until(lambda: cockpit.count(FixSample) > 20 and cockpit.count(ClockSample) > 2)
        counts = Counter(type(s).__name__ for s in cockpit.samples)
        assert counts["JointSample"] / counts["FixSample"] == pytest.approx(10.0, rel=0.2)
        stamps = [s.stamp for s in cockpit.samples if isinstance(s, JointSample)]
        steps = np.diff(stamps)
        assert (steps > 0.0).all()
        assert np.median(steps) == pytest.approx(0.005, abs=1e-5)
        # The machine's clock is 5 s ahead, and its answers and stamps say so.
        local = time.time() - time.monotonic()
        for s in cockpit.samples:
            if isinstance(s, ClockSample):
                assert s.sent + local + 4.9 < s.remote < s.received + local + 5.1
        assert cockpit.mode == "program"

        cockpit.until(lambda: cockpit.mode == "remote", each=lambda: cockpit.command(travel=0.2))
        cockpit.until(lambda: abs(cockpit.swing - 0.3) < 0.02, 5.0, each=cockpit.command)
        truth = cockpit.receiver.truths()["left"]
        start = SITE.machine("left").start.position
        assert np.linalg.norm(truth.base - start) > 1e-3  # the tracks turned, too
        # Commands cease: the machine stops by itself.
        cockpit.until(lambda: cockpit.mode == "stopped", 3.0)
        cockpit.until(lambda: abs(cockpit.receiver.truths()["left"].velocity[0]) < 0.01, 3.0)
        status = cockpit.receiver.statuses()["left"]
        assert status.token == cockpit.token
        assert status.refused == 0
        assert 0 < status.accepted <= cockpit.sequence


def test_a_machine_with_stroke_sensors_has_the_same_joints(tmp_path):
    """Strokes over the wire, and what they tell of the joints, against the simulated truth."""
    path = tmp_path / "strokes.toml"
    text = SITE.path.read_text().replace("[machine.sim]", '[machine.sim]\njoints = "strokes"')
    path.write_text(text.replace('program = "dig-swing-dump"', 'program = "hold"'))
    site = load_site(str(path))
    rig, streams = make_rig("left", MACHINE, site.frame), Streams()
    with simulated(site=site) as cockpit:
        cockpit.until(lambda: cockpit.count(JointSample) > 50 and cockpit.receiver.truths())
        truth = cockpit.receiver.truths()["left"]
    for sample in cockpit.samples:
        if isinstance(sample, JointSample):
            assert sample.names[1:] == ("boom_cylinder", "stick_cylinder", "bucket_cylinder")
            streams = ingest(rig, streams, sample)
    assert streams.joints.rejected == 0
    mean = np.mean([entry.value for entry in streams.joints.entries], axis=0)
    np.testing.assert_allclose(mean, truth.position, atol=1e-3)


def test_cut_silences_everything_and_ends():
    with simulated("right", began=49.5) as cockpit:
        cockpit.until(lambda: cockpit.count(JointSample) > 10, 5.0)
        # Silence for two seconds, with the clock unanswered too.
        cockpit.until(lambda: time.monotonic() > heard(cockpit.samples[-1]) + 2.0)
        quiet = len(cockpit.samples)
        time.sleep(0.5)
        cockpit.drain()
        assert len(cockpit.samples) == quiet
        cockpit.until(lambda: len(cockpit.samples) > quiet + 100, 10.0)
        stamps = np.array([s.stamp for s in cockpit.samples if isinstance(s, JointSample)])
        gap = float(np.diff(stamps).max())
        assert gap == pytest.approx(5.0, abs=0.2)


@pytest.mark.processes
def test_own_process_ends_cleanly_on_sigterm():
    endpoint = with_port("tcp/127.0.0.1:0")
    cockpit = Cockpit(endpoint, "left")
    code = (
        "import signal, threading\n"
        "from backend.site.site import load_site\n"
        "from backend.shell.sim.process import run\n"
        "until = threading.Event()\n"
        "signal.signal(signal.SIGTERM, lambda *_: until.set())\n"
        f"run(load_site('demo'), 'left', ('{endpoint}',), None, until)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE)
    try:
        cockpit.until(lambda: cockpit.count(JointSample) > 50, 60.0)
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=10.0)
        assert process.returncode == 0
        assert errors == b""
    finally:
        process.kill()
        cockpit.close()


def test_unknown_machine_and_endpoint_are_one_sentence():
    with pytest.raises(InputError, match="allowed are left, right"):
        run(SITE, "middle", ("tcp/127.0.0.1:1",), None, threading.Event())
    with pytest.raises(InputError, match="not an endpoint"):
        run(SITE, "left", ("nowhere",), None, threading.Event())
