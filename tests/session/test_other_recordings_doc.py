"""The page on other programs' recordings names what the code knows."""

from __future__ import annotations

import re
from pathlib import Path

from backend.machine.model import ROLES
from backend.shell.session.can_log import SUFFIXES as CAN_SUFFIXES
from backend.shell.session.export import FORMATS
from backend.shell.session.export_rows import POSES, TABLES
from backend.shell.session.pose_columns import COLUMNS, MACHINE, TIMES, VALIDITY
from backend.site.others import MachineTopics


def test_every_column_is_described(repository: Path) -> None:
    text = (repository / "docs" / "other-recordings.md").read_text()
    named = set(re.findall(r"`([a-z_]+)`", text))
    known = {*COLUMNS, *TIMES, MACHINE, VALIDITY}
    in_degrees = {f"{name}_deg" for name in (*ROLES, "pitch", "roll")}  # "or `_deg`"
    assert known - in_degrees <= named
    assert {name for name in named if name.endswith(("_m", "_rad", "_s"))} <= known


def test_every_topic_format_and_table_is_named(repository: Path) -> None:
    text = (repository / "docs" / "other-recordings.md").read_text()
    for name in ("joint_states", "gnss_fix", "gnss_heading", "imu"):
        assert f"\n{name}" in text
        assert name in MachineTopics.model_fields
    for word in (*CAN_SUFFIXES, *FORMATS, *TABLES):
        assert f"`{word}`" in text


def test_exported_poses_are_columns_that_convert_reads() -> None:
    not_read = {"elapsed_s", "sigma_joints_rad", "eta_m", "fix"}
    assert set(POSES) - not_read <= {*COLUMNS, *TIMES, MACHINE, VALIDITY}


def test_files_of_the_page_exist(repository: Path) -> None:
    for page in ("docs/other-recordings.md", "scenes/can/README.md", "scenes/sessions/README.md"):
        text = (repository / page).read_text()
        for target in re.findall(r"\]\(([^)#:]+)\)", text):
            assert ((repository / page).parent / target).exists(), (page, target)
