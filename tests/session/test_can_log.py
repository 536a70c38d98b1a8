"""CAN logs, written by python-can, become sessions; Sun's Appendix A among them."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from mcap.reader import make_reader
from program import Done, cockpit

from backend.errors import InputError
from backend.fusion.rig import make_rig
from backend.fusion.streams import Streams, ingest
from backend.machine.load import load_machine
from backend.machine.strokes import position
from backend.machine.sun_map import sun_angles
from backend.shell.link.codec import decode
from backend.shell.session.can_map import CAN
from backend.shell.session.can_streams import Gate
from backend.shell.session.convert import convert
from backend.site.site import load_site

SITE = "sun2020-experiment"
LOG = CAN / "sun2020-appendix-a.asc"
PRINTED = {"a": [26.8, -38.6, 42.2], "b": [79.0, -103.7, 14.6]}


def samples(path: Path) -> list[tuple[str, str, float, Any]]:
    """(machine, suffix, log time [s], record) of a session."""
    found = []
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            if not channel.topic.startswith("/cockpit"):
                machine, suffix = channel.topic[1:].split("/", 1)
                time = message.log_time / 1e9
                found.append((machine, suffix, time, decode(machine, suffix, message.data, time)))
    return found


def frame(time: float, identifier: int, data: bytes, **more: Any) -> can.Message:
    return can.Message(
        timestamp=time, arbitration_id=identifier, data=data, is_extended_id=False, **more
    )


def angles(time: float, values: dict[int, float]) -> list[can.Message]:
    return [frame(time, i, struct.pack("<h", round(v * 10))) for i, v in values.items()]


def write(path: Path, frames: list[can.Message]) -> Path:
    with can.Logger(str(path)) as logger:
        for one in frames:
            logger(one)
    return path


def run(path: Path, out: Path, *more: str) -> Done:
    return cockpit("convert", str(path), "--site", SITE, "--out", str(out), *more)


def test_appendix_a_as_printed(tmp_path: Path) -> None:
    done = convert(LOG, load_site(SITE), tmp_path / "out.mcap")
    found = samples(done.out)
    mini = load_machine("mini")
    for machine, printed in PRINTED.items():
        joints = [(t, s) for m, suffix, t, s in found if m == machine and suffix == "joint_states"]
        assert len(joints) == 3
        for _, sample in joints:
            values = dict(zip(sample.names, sample.position, strict=True))
            assert values["swing"] == 0.0
            q = np.array([values[role] for role in ("swing", "boom", "stick", "bucket")])
            assert np.degrees(sun_angles(mini, q)) == pytest.approx(printed, abs=1e-9)
    # Times as printed, 20:14.375 is when B's last angle of the first round came.
    first = next(t for m, suffix, t, _ in found if (m, suffix) == ("b", "joint_states"))
    assert first == pytest.approx(20 * 60 + 14.375, abs=1e-6)
    # 408 = 26.8 is told, marked, and not a pitch of the base.
    (outlier,) = [p for p in done.problems if "kept out" in p.text]
    assert "408 A_Pitch.angle = 26.8" in outlier.text
    assert "frame 24, 1214.387 s" in outlier.where
    assert done.counts["/cockpit/marker"] == 1
    tilts = [s for m, suffix, _, s in found if (m, suffix) == ("a", "imu/base")]
    assert len(tilts) == 2
    for sample in tilts:
        w, x, y, z = sample.orientation
        assert np.degrees(np.arcsin(-2 * (w * y - x * z))) == pytest.approx(-0.9, abs=1e-9)
    assert "/a/gnss/fix" not in done.counts


@pytest.mark.parametrize("suffix", [".asc", ".blf", ".csv", ".log"])
def test_every_kind_of_log_gives_the_same(tmp_path: Path, suffix: str) -> None:
    start = 1_790_000_000.25
    frames: list[can.Message] = []
    for k in range(50):
        time = start + 0.02 * k
        frames += angles(time, {402: 20 + 0.1 * k, 404: -38.6, 406: 42.2, 408: -0.9})
        position = struct.pack("<ii", 296_559_292 + k, -159_294_429)
        frames.append(frame(time + 0.001, 601, position))
    frames.append(frame(start + 1.0, 0x123, b"\x01"))
    frames.append(frame(start + 1.0, 0x124, b"\x01"))
    frames.append(frame(start + 1.1, 0x124, b"\x01"))
    done = convert(write(tmp_path / f"log{suffix}", frames), load_site(SITE), tmp_path / "o.mcap")
    assert done.counts == {"/a/joint_states": 50, "/a/imu/base": 50, "/a/gnss/fix": 50}
    assert done.skipped == {"291 (0x123)": 1, "292 (0x124)": 2}
    assert done.end - done.begin == pytest.approx(0.981e9, abs=2e6)
    found = samples(done.out)
    fixes = [s for _, name, _, s in found if name == "gnss/fix"]
    assert fixes[7].latitude == pytest.approx(37.296559299, abs=1e-12)
    assert fixes[7].longitude == pytest.approx(126.840705571, abs=1e-12)
    assert np.diag(fixes[7].covariance) == pytest.approx([4e-4] * 3)
    booms = [s.position[1] for _, name, _, s in found if name == "joint_states"]
    assert np.degrees(booms) == pytest.approx(20 + 0.1 * np.arange(50), abs=1e-9)


def test_any_dbc_with_units_factors_and_the_machines_own_angles(tmp_path: Path) -> None:
    (tmp_path / "own.dbc").write_text(
        'VERSION ""\nNS_ :\nBS_:\nBU_: X\n'
        'BO_ 2566844672 Arm: 8 X\n SG_ boom : 0|16@1- (0.001,0) [0|0] "rad" X\n'
        ' SG_ stick : 16|16@1- (0.001,0) [0|0] "rad" X\n'
        ' SG_ bucket : 32|16@1- (0.01,0) [0|0] "deg" X\n'
        'BO_ 100 Compass: 2 X\n SG_ azimuth : 0|16@1+ (0.01,0) [0|360] "deg" X\n'
    )
    (tmp_path / "own.toml").write_text(
        'dbc = "own.dbc"\n[[machine]]\nname = "a"\n'
        'heading = { signal = "Compass.azimuth", unit = "deg", factor = -1.0, offset = 90.0 }\n'
        '[machine.joints]\nswing = { constant = 0.5, unit = "rad" }\n'
        'boom = { signal = "Arm.boom", unit = "rad" }\n'
        'stick = { signal = "Arm.stick", unit = "rad", factor = -1.0 }\n'
        'bucket = { signal = "Arm.bucket", unit = "deg", offset = 10.0 }\n'
    )
    arm = can.Message(
        timestamp=10.0, arbitration_id=2566844672 & 0x1FFFFFFF, is_extended_id=True,
        data=struct.pack("<hhhh", 300, 700, -2000, 0),
    )  # fmt: skip
    same_number = frame(10.0, 2566844672 & 0x7FF, b"\0" * 8)
    log = write(tmp_path / "own.blf", [arm, same_number, frame(10.5, 100, b"\x28\x23")])
    done = convert(log, load_site(SITE), tmp_path / "o.mcap", can_map=tmp_path / "own.toml")
    found = {suffix: s for _, suffix, _, s in samples(done.out)}
    joints = dict(
        zip(found["joint_states"].names, found["joint_states"].position.tolist(), strict=True)
    )
    assert joints == pytest.approx(
        {"swing": 0.5, "boom": 0.3, "stick": -0.7, "bucket": np.radians(-10.0)}
    )
    assert found["gnss/heading"].heading == pytest.approx(0.0, abs=1e-9)
    assert len(done.skipped) == 1


LVDT = """VERSION ""
NS_ :
BS_:
BU_: X
BO_ 9 Arm: 6 X
 SG_ boom : 0|16@1+ (0.1,0) [0|0] "mm" X
 SG_ stick : 16|16@1- (0.001,0) [0|0] "rad" X
 SG_ bucket : 32|16@1+ (0.01,0) [0|0] "cm" X
"""
STROKES = """dbc = "l.dbc"
[[machine]]
name = "a"
[machine.joints]
swing = { constant = 0.5, unit = "rad" }
boom_cylinder = { signal = "Arm.boom", unit = "mm", offset = -20.0 }
stick = { signal = "Arm.stick", unit = "rad" }
bucket_cylinder = { signal = "Arm.bucket", unit = "cm" }
"""


def test_stroke_sensors_are_signals_in_units_of_length(tmp_path: Path) -> None:
    (tmp_path / "l.dbc").write_text(LVDT)
    (tmp_path / "l.toml").write_text(STROKES)
    outlier = frame(1.1, 9, struct.pack("<HhH", 9000, -700, 1200))
    rest = [frame(1.0 + k / 10, 9, struct.pack("<HhH", 2200, -700, 1200)) for k in (0, 2)]
    log = write(tmp_path / "l.blf", [rest[0], outlier, rest[1]])
    site = load_site(SITE)
    done = convert(log, site, tmp_path / "o.mcap", can_map=tmp_path / "l.toml")
    sample = next(s for _, suffix, _, s in samples(done.out) if suffix == "joint_states")
    assert dict(zip(sample.names, sample.position.tolist(), strict=True)) == pytest.approx(
        {"swing": 0.5, "boom_cylinder": 0.2, "stick": -0.7, "bucket_cylinder": 0.12}
    )
    assert any("9 Arm.boom" in problem.text for problem in done.problems)  # 0.68 m in 0.1 s
    machine = load_machine("mini")
    rig = make_rig("a", machine, site.frame)
    (entry,) = ingest(rig, Streams(), sample).joints.entries
    for k, read in ((1, 0.2), (3, 0.12)):
        stroke = next(s for s in machine.strokes if s.joint == k)
        assert float(position(stroke, entry.value[k])) == pytest.approx(read, abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"Arm.boom", unit = "mm"', '"Arm.boom", unit = "deg"', "boom_cylinder.unit is deg"),
        ("boom_cylinder", "jib_cylinder", "jib_cylinder.*allowed are swing.*boom_cylinder"),
        ("boom_cylinder", "tilt_cylinder", "tilt_cylinder is no cylinder of its sidecar"),
        ("boom_cylinder", "swing_cylinder", "swing_cylinder"),
    ],
)
def test_strokes_that_cannot_be_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    (tmp_path / "l.dbc").write_text(LVDT)
    (tmp_path / "l.toml").write_text(STROKES.replace(old, new))
    log = write(tmp_path / "l.blf", [frame(1.0, 9, b"\0" * 6)])
    with pytest.raises(InputError, match=words):
        convert(log, load_site(SITE), tmp_path / "o.mcap", can_map=tmp_path / "l.toml")


def test_floats_that_are_no_numbers_are_told(tmp_path: Path) -> None:
    (tmp_path / "f.dbc").write_text(
        'VERSION ""\nNS_ :\nBS_:\nBU_: X\n'
        'BO_ 7 Swing: 4 X\n SG_ angle : 0|32@1- (1,0) [0|0] "rad" X\n'
        "SIG_VALTYPE_ 7 angle : 1;\n"
    )
    (tmp_path / "f.toml").write_text(
        'dbc = "f.dbc"\n[[machine]]\nname = "a"\n'
        'joints.swing = { signal = "Swing.angle", unit = "rad" }\n'
    )
    frames = [frame(1.0 + k, 7, struct.pack("<f", v)) for k, v in enumerate([0.5, np.nan, 0.6])]
    log = write(tmp_path / "f.blf", frames)
    done = convert(log, load_site(SITE), tmp_path / "o.mcap", can_map=tmp_path / "f.toml")
    assert done.counts["/a/joint_states"] == 2
    (problem,) = done.problems
    assert "7 Swing.angle = nan is kept out: not a number" in problem.text


def test_a_step_costs_one_value_and_an_outlier_is_one_value() -> None:
    gate = Gate(10.0)
    values = [0.0, 0.01, 1.0, 0.02, 2.0, 2.01, 2.02, -0.5, 2.03]
    taken = [gate.passes(0.005 * k, value) for k, value in enumerate(values)]
    assert taken == [True, True, False, True, False, True, True, False, True]
    wrap = Gate(10.0)
    assert wrap.passes(0.0, 3.14)
    assert wrap.passes(0.005, -3.14)


def test_nan_constants_and_lost_frames(tmp_path: Path) -> None:
    frames = angles(1.0, {402: 1.0, 404: 2.0, 406: 3.0})
    frames += angles(1.1, {402: 1.1, 404: 2.0})  # 406 is lost
    frames += angles(1.2, {402: 1.2, 404: 2.0, 406: 3.0})
    frames.append(frame(1.3, 402, b"\x01"))  # one byte short
    frames.append(can.Message(timestamp=1.4, is_error_frame=True))
    done = convert(write(tmp_path / "l.blf", frames), load_site(SITE), tmp_path / "o.mcap")
    booms = [s.position[1] for _, _, _, s in samples(done.out)]
    assert np.degrees(booms) == pytest.approx([1.0, 1.2])
    texts = [problem.text for problem in done.problems]
    assert any("402 (0x192) does not fit the DBC" in text for text in texts)
    assert any("error and remote frames" in text for text in texts)


def test_a_clock_that_goes_back_goes_on_in_the_session(tmp_path: Path) -> None:
    times = [100.0, 100.02, 100.04, 3.0, 3.02, 3.04]
    frames = [f for t in times for f in angles(t, {402: 26.8, 404: -38.6, 406: 42.2})]
    lines = ["date Thu Jan 01 00:00:00.000 1970", "base hex  timestamps absolute", ""]
    lines += [
        f"{f.timestamp:.6f} 1  {f.arbitration_id:X}             Rx   d 2 {f.data.hex(' ')}"
        for f in frames
    ]
    log = tmp_path / "log.asc"
    log.write_text("\n".join(lines))
    done = convert(log, load_site(SITE), tmp_path / "o.mcap")
    (problem,) = [p for p in done.problems if "clock" in p.text]
    assert "goes back by 97.040 s" in problem.text
    assert "frame 10" in problem.where
    stamps = [s.stamp for _, _, _, s in samples(done.out)]
    assert np.diff(stamps) == pytest.approx([0.02, 0.02, 0.0, 0.02, 0.02], abs=1e-6)


def test_times_that_are_none(tmp_path: Path) -> None:
    row = "{t},0x193,0,0,0,2,ARA="
    text = "timestamp,arbitration_id,extended,remote,error,dlc,data\n"
    for t in ("-5.0", "nan", "1.0", "inf", "2.0"):
        for identifier in (402, 404, 406):
            text += row.format(t=t).replace("0x193", hex(identifier)) + "\n"
    (tmp_path / "l.csv").write_text(text)
    done = convert(tmp_path / "l.csv", load_site(SITE), tmp_path / "o.mcap")
    assert (done.begin, done.end) == (0, 2_000_000_000)
    assert done.counts["/a/joint_states"] == 3
    assert {p.text: p.count for p in done.problems} == {
        "times before 1970 count as its beginning": 3,
        "frames without a time are left out": 6,
    }


@pytest.mark.parametrize("keep", [0.001, 0.02, 0.5, 0.9])
def test_cut_logs(tmp_path: Path, keep: float) -> None:
    frames = [f for k in range(2000) for f in angles(k * 0.02, {402: 1, 404: 2, 406: 3})]
    for suffix in (".asc", ".blf", ".csv"):
        log = write(tmp_path / f"log{suffix}", frames)
        data = log.read_bytes()
        log.write_bytes(data[: int(len(data) * keep)])
        out = tmp_path / f"{suffix}.mcap"
        done = run(log, out, "--json")
        assert "Traceback" not in done.stderr
        if done.returncode == 0:
            document = json.loads(done.stdout)
            assert 0 < document["messages"] < 2000
        else:
            assert done.returncode == 2
            assert done.stderr.count("\n") == 1
            assert not out.exists()


MAP = (CAN / "sun2020.toml").read_text()
MISTAKES = {
    "signal": (MAP.replace("A_Boom.angle", "A_Boom.angel"), '"A_Boom.angel", which sun2020.dbc'),
    "machine": (MAP.replace('name = "b"', 'name = "c"'), 'machine "c" is not of the site'),
    "twice": (MAP.replace('name = "b"', 'name = "a"'), '"a" twice'),
    "unit": (MAP.replace('A_Boom.angle", unit = "deg"', 'A_Boom.angle", unit = "m"'), "unit is m"),
    "field": (MAP.replace("latitude", "lattitude"), "lattitude is not a known field"),
    "swing": (MAP.replace("swing =", "tilt ="), "joints has no swing"),
    "toml": ("machine = [", "is not valid TOML"),
    "constant": (MAP.replace("constant = 0.0", "constant = nan"), "finite"),
    "dbc": (MAP.replace("sun2020.dbc", "none.dbc"), "none.dbc: cannot be read"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_wrong_maps_are_one_sentence(tmp_path: Path, mistake: str) -> None:
    text, words = MISTAKES[mistake]
    if mistake != "dbc":
        text = text.replace("sun2020.dbc", str(CAN / "sun2020.dbc"))
    (tmp_path / "m.toml").write_text(text)
    done = run(LOG, tmp_path / "o.mcap", "--map", str(tmp_path / "m.toml"))
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


def test_logs_and_dbcs_that_do_not_belong_together(tmp_path: Path) -> None:
    dbc = tmp_path / "other.dbc"
    dbc.write_text((CAN / "sun2020.dbc").read_text().replace("BO_ 40", "BO_ 50"))
    done = run(LOG, tmp_path / "o.mcap", "--dbc", str(dbc))
    assert done.returncode == 2
    assert "none of its 24 frames has an identifier of the map" in done.stderr
    assert "401 (0x191)" in done.stderr
    for text in ("no dbc at all", ""):
        dbc.write_text(text)
        done = run(LOG, tmp_path / "o.mcap", "--dbc", str(dbc))
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
    done = cockpit("convert", str(LOG), "--site", "demo", "--out", str(tmp_path / "o.mcap"))
    assert done.returncode == 2
    assert "needs a map" in done.stderr
    (tmp_path / "garbage.blf").write_bytes(b"garbage" * 100)
    done = run(tmp_path / "garbage.blf", tmp_path / "o.mcap")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
