"""A session of machines with stroke sensors: recorded as they came, judged again the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from backend.fusion.pose import Validity
from backend.fusion.samples import JointSample
from backend.shell.link.codec import decode
from backend.shell.session.cycles import Topics
from backend.shell.session.evaluate import evaluate
from backend.shell.session.reader import open_session
from backend.shell.session.synthetic import Script, synthesize
from backend.site.site import load_site
from cockpit.desk import load_models, make_config

SWITCH = '[machine.sim]\njoints = "strokes"'


def test_strokes_are_recorded_and_played_back(tmp_path: Path) -> None:
    path = tmp_path / "strokes.toml"
    path.write_text(load_site("demo").path.read_text().replace("[machine.sim]", SWITCH))
    site = load_site(str(path))
    config = make_config(site, load_models(site), (), "DEMO")
    made = synthesize(tmp_path / "s.mcap", site, config, Script(duration=1.0, begin=18.0))
    session = open_session(tmp_path / "s.mcap")
    message = next(m for m in session.messages() if m.topic == "/left/joint_states")
    sample = decode("left", "joint_states", message.data, 0.0)
    assert isinstance(sample, JointSample)
    assert sample.names[1:] == ("boom_cylinder", "stick_cylinder", "bucket_cylinder")
    assert (sample.position[1:] > 0.0).all()
    again = [s for _, s in evaluate(session, Topics.of(site), config)]
    for name, state in again[-1].machines.items():
        pose, once = state.pose, made.snapshots[-1].machines[name].pose
        assert pose.validity is Validity.VALID
        assert pose.streams["joints"].rejected == 0
        np.testing.assert_array_equal(pose.joints, once.joints)
        assert pose.joint_sigmas[3] > pose.joint_sigmas[0]
