"""Small samples of the campaigns: certificates, exact cells and margins against other judges."""

from __future__ import annotations

import numpy as np
import pytest
from engines import Coal, Fcl, judged_by
from exact_checks import certificates, exact_cells, swept_margins
from random_scenes import Scene, configurations, random_scene
from separating_axes import placed, touching

from backend.cspace import joint_image
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine

SHAPE = (48, 24, 24, 32)
WRONG = ("yet", "displaced: SAT", "within eta", "free and colliding", "eta changes")


@pytest.fixture(scope="module", params=[0, 1, 7])
def scene(request: pytest.FixtureRequest) -> Scene:
    """Even ones are of the mini excavator, odd ones of the one with a bent boom."""
    return random_scene(request.param, [load_machine("mini"), load_machine("ex13")])


def wrong(counts: dict[str, int]) -> dict[str, int]:
    return {k: v for k, v in counts.items() if v and any(word in k for word in WRONG)}


def test_judges_agree(scene: Scene) -> None:
    q = configurations(np.random.default_rng(1), scene.machine, 300)
    expected = touching(scene.machine, q, scene.obstacles)
    np.testing.assert_array_equal(expected, judged_by(Coal, scene.machine, q, scene.obstacles))
    np.testing.assert_array_equal(expected, judged_by(Fcl, scene.machine, q, scene.obstacles))
    own = placed(scene.machine, q[:1])
    boxes = body_boxes(scene.machine, link_poses(scene.machine, q[0]))
    np.testing.assert_allclose(own.centers[0], boxes.centers, atol=1e-12)
    np.testing.assert_allclose(own.rotations[0], boxes.rotations, atol=1e-12)


def test_certificates_hold(scene: Scene) -> None:
    found = certificates(scene, SHAPE, 0.05, samples=4000, coal_samples=300, seed=1)
    assert wrong(found) == {}
    assert found["in free cells, eta"] > 300
    assert found["in colliding cells"] > 300
    assert found["displaced configurations"] > 300
    assert found["coal against SAT"] == 0


def test_certificates_of_centres_alone_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = random_scene(0, [load_machine("mini")])
    monkeypatch.setattr(joint_image, "OUTER", joint_image.EXACT)
    monkeypatch.setattr(joint_image, "INNER", joint_image.EXACT)
    found = wrong(certificates(scene, SHAPE, 0.05, samples=2000, coal_samples=300, seed=1))
    for judge in ("SAT", "coal"):
        assert found[f"free, yet touches: {judge}"] > 10
        assert found[f"colliding, yet free: {judge}"] > 10


def test_python_fcl_sees_the_exact_image(scene: Scene) -> None:
    found = exact_cells(scene, SHAPE, samples=1000, seed=1)
    assert not [d for d in found.disagreements if d.ours_is_wrong]
    assert found.sat_differs == 0
    assert 0.2 < found.touching / found.cells < 0.9


def test_margins_end_where_python_fcl_ends_them(scene: Scene) -> None:
    found = swept_margins(scene, 1, 0.0, seed=1) + swept_margins(scene, 1, 0.05, seed=2)
    assert found["states"] == 2
    assert found["to a contact"] >= 2
    for name in ("optimistic", "late", "misnamed", "limit missed"):
        assert found[name] == 0, name
