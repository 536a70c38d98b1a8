"""What `cockpit plan` reads and prints: the method, and a result that is only to compare with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.documents.plan import plan_document
from backend.documents.plan_document import PlanDocument, parse_plan_task
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.planning.trajectory.penalty import Iteration
from cockpit.bench_tasks import paper_task
from cockpit.plan import run_plan


def task(**more: Any) -> dict[str, Any]:
    """The paper's, with a post under the arm, which the end point passes but the arm does not."""
    machine, asked, _ = paper_task()
    joints = dict(zip((joint.role for joint in machine.joints), asked.q.tolist(), strict=True))
    swing_z = float(machine.arm.T_root_swing[2, 3])
    post = {
        "name": "post",
        "center": [0.0, 2.6, 0.5 * (3.0 + swing_z)],
        "rotation": np.eye(3).tolist(),
        "half_extents": [0.2, 0.2, 0.5 * (3.0 + swing_z)],
    }
    return {
        "state": {
            "machines": {
                "a": {
                    "model": "ex13",
                    "position": [0.0, 0.0, 0.0],
                    "yaw": 0.0,
                    "pitch": 0.0,
                    "roll": 0.0,
                    "joints": joints,
                }
            },
            "obstacles": [post],
        },
        "machine": "a",
        "goal": {"end_point": asked.p_root.tolist()},
        "payload": 1500.0,
        "clearance": 0.1,
        "limits": {
            "cylindrical": {
                "theta_velocity": 0.08,
                "r_velocity": 1.0,
                "z_velocity": 0.25,
                "theta_acceleration": 0.04,
                "r_acceleration": 5.0,
                "z_acceleration": 3.0,
            }
        },
        **more,
    }


def planned(data: dict[str, Any], *args: Any) -> PlanDocument:
    machines = {"a": load_machine("ex13")}
    return plan_document(parse_plan_task(data, "task"), machines, None, "task", *args)


def test_a_violated_result_is_not_ok_and_there_to_compare_with() -> None:
    told: list[Iteration] = []
    data = parse_plan_task(task(method="penalty"), "task")
    made = plan_document(data, {"a": load_machine("ex13")}, None, told=told.append)
    assert not made.ok
    assert made.kind == "check"
    assert made.method == "penalty"
    assert any("nearer to something" in found for found in made.violations)
    assert made.why is not None
    assert "penalty method's result is violated" in made.why
    assert made.proven is False
    assert len(made.joints) == len(made.time) > 100
    assert made.checks is not None
    assert made.checks.min_clearance is not None
    assert made.checks.min_clearance < 0.05
    assert len(told) > 1000


def test_ours_passes_over_the_same_post() -> None:
    made = planned(task())
    assert made.ok, made.why
    assert made.method == "toppra"
    assert not made.violations
    assert made.checks is not None
    assert made.checks.min_clearance is not None
    assert made.checks.min_clearance > 0.07


def test_the_command_lines_method_goes_before_the_tasks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "task.json"
    path.write_text(json.dumps(task(method="penalty")))
    run_plan(path, None, "toppra", as_json=True)
    printed = PlanDocument.model_validate_json(capsys.readouterr().out)
    assert printed.ok
    assert printed.method == "toppra"
    with pytest.raises(InputError, match="allowed are toppra, casadi, penalty"):
        run_plan(path, None, "rrt", as_json=True)


def test_a_method_that_is_not_known_is_one_sentence() -> None:
    with pytest.raises(InputError, match="method"):
        parse_plan_task(task(method="rrt"), "task")
