"""The numbers printed in Sun 2020 from its tables; where they do not come out, what we get."""

from __future__ import annotations

import numpy as np
import pytest

from backend.cspace.sun import SunPose, inverse_kinematics
from backend.cspace.sun_driving import in_free, length_samples, zone_distance
from backend.cspace.sun_images import sun_image
from backend.cspace.sun_manipulation import (
    co_d,
    co_theta,
    contact_length,
    contact_vectors,
    in_free_joints,
    in_obstacle,
    joint_sets,
    theta_d,
)
from backend.spatial.types import Array

Pair = tuple[SunPose, SunPose]

# Fitted to Figs. 10 and 22, not in the text: the distance at which both cut A's line, and the
# length of that line in Fig. 22.
FIGURE_CUT = 4.2
FIG22_LINE = 3.7231


def fig22(pair: Pair) -> tuple[Array, Array]:
    a, b = pair
    s = length_samples(FIG22_LINE, 49)[::-1]  # 50 points, from the tip
    vectors = contact_vectors(a, b, s)
    theta = co_theta(vectors)
    return theta, co_d(vectors, theta)


def test_lengths_of_the_tables(simulation: Pair, driving: Pair, experiment: Pair) -> None:
    for pose in (*simulation, *driving):
        assert pose.d == pytest.approx(4.01315, abs=5e-6)
    assert experiment[0].d == pytest.approx(4.08410, abs=5e-6)
    assert experiment[1].d == pytest.approx(3.37557, abs=5e-6)


def test_positions_of_the_tables(simulation: Pair, driving: Pair, experiment: Pair) -> None:
    assert simulation[0].position == pytest.approx([25.0, 25.0])
    assert simulation[1].position == pytest.approx([30.0, 27.0])
    assert driving[1].position == pytest.approx([35.0, 8.0])
    assert np.degrees([p.yaw for p in (*driving, *experiment)]) == pytest.approx(
        [60.0, 90.0, -36.7, 79.14]
    )
    assert experiment[1].position - experiment[0].position == pytest.approx([-0.216, -4.781])


def test_figure_10(simulation: Pair) -> None:
    theta, d = theta_d(*simulation, eta=0.1, n=49, reach=FIGURE_CUT)
    assert len(theta) == len(d) == 29
    assert np.round(theta[:3], 4).tolist() == [2.7135, 2.7372, 2.7607]
    assert np.round(theta[-3:], 4).tolist() == [3.2415, 3.2572, 3.2724]
    assert np.round(d[:3], 4).tolist() == [3.3454, 3.3539, 3.3643]
    assert np.round(d[-3:], 4).tolist() == [4.1021, 4.1492, 4.1973]


def test_figure_10_needs_b_at_30_not_at_the_printed_29(simulation: Pair) -> None:
    a, b = simulation
    printed = SunPose(np.array([29.0, 27.0]), b.yaw, b.pitch, b.boom, b.stick, b.bucket, b.lengths)
    theta, d = theta_d(a, printed, eta=0.1, n=49, reach=FIGURE_CUT)
    assert len(theta) == 45
    assert d.min() < 3.22  # which would deny that d_B = 3.22 turns freely


def test_b_really_reaches_three_points_more_than_figure_10(simulation: Pair) -> None:
    theta, _ = theta_d(*simulation, eta=0.1, n=49, reach=float(simulation[1].lengths.sum()))
    assert len(theta) == 32


def test_figure_9_first_case_meets_a_just_above_180_degrees(simulation: Pair) -> None:
    curve = theta_d(*simulation, eta=0.1, n=49, reach=FIGURE_CUT)
    yaw = np.radians(np.linspace(0.0, 360.0, 3601))
    hit = yaw[in_obstacle(*curve, yaw, 3.91)]
    assert np.degrees(hit.max()) == pytest.approx(181.6, abs=0.1)
    assert not in_obstacle(*curve, np.radians(185.0), 3.91)
    assert in_obstacle(*curve, np.pi, 3.91)


def test_figure_9_second_case_turns_freely(simulation: Pair) -> None:
    curve = theta_d(*simulation, eta=0.1, n=49, reach=FIGURE_CUT)
    assert not in_obstacle(*curve, np.radians(np.linspace(0.0, 360.0, 3601)), 3.22).any()


def test_figure_9_third_case_collides(simulation: Pair) -> None:
    a, b = simulation
    assert np.degrees(b.yaw) == pytest.approx(162.0)
    assert b.d == pytest.approx(4.01, abs=0.005)
    image = sun_image(a, b, float(b.lengths.sum()), 0.1, 49, 49)
    assert image.current.collides
    assert image.current.in_joint_set  # the asterisk of Fig. 11
    assert image.current.in_zone


def test_figure_6_b_is_free_far_away_and_caught_beside_a(driving: Pair, simulation: Pair) -> None:
    a, b = driving
    assert in_free(a, b.d, 0.1, b.position)
    assert not in_free(a, b.d, 0.1, simulation[1].position)


def test_figure_22_nine_numbers(experiment: Pair) -> None:
    theta, d = fig22(experiment)
    assert len(theta) == 50
    assert theta[:3] == pytest.approx([0.6738, 0.6919, 0.7101], abs=1e-4)
    assert theta[-3:] == pytest.approx([1.4989, 1.5124, 1.5256], abs=1e-4)
    assert d[:3] == pytest.approx([4.0963, 4.0777, 4.0604], abs=1e-4)


def test_figure_22_last_three_lengths_do_not_reproduce(experiment: Pair) -> None:
    # Printed 3.6056 three times: below every distance from B to A's line, hence not on it at all.
    _, d = fig22(experiment)
    assert d[-3:] == pytest.approx([4.7023, 4.7437, 4.7859], abs=1e-4)
    assert d.min() == pytest.approx(3.9625, abs=1e-4)
    assert d.min() > 3.6056 + 0.35


def test_table_4_gives_another_line_than_figure_22(experiment: Pair) -> None:
    a, b = experiment
    assert a.d - 0.1 == pytest.approx(3.9841, abs=1e-4)
    theta, d = theta_d(a, b, eta=0.1, n=49, reach=float(b.lengths.sum()))
    assert theta[0] == pytest.approx(0.6132, abs=1e-4)  # printed 0.6738
    assert d[0] == pytest.approx(4.1702, abs=1e-4)  # printed 4.0963


def test_figure_21_no_contact_at_any_yaw(experiment: Pair) -> None:
    a, b = experiment
    image = sun_image(a, b, float(b.lengths.sum()), 0.1, 49, 49)
    yaw = np.linspace(0.0, 2.0 * np.pi, 3601)
    for length in (2.94, b.d):  # the text's and Table 6's
        assert not in_obstacle(image.theta, image.d, yaw, length).any()
    assert not image.current.collides
    assert not image.current.in_joint_set


def test_section_5_3_zone_holds_for_full_reach_only(experiment: Pair) -> None:
    # The text has B inside CO_xy. With Table 6's d_B it is 0.49 m outside, with full reach inside.
    a, b = experiment
    assert zone_distance(a, b.d, 0.1, b.position) == pytest.approx(0.4868, abs=1e-4)
    assert zone_distance(a, float(b.lengths.sum()), 0.1, b.position) < 0.0


def test_figure_24(experiment: Pair) -> None:
    theta, d = (values[:33] for values in fig22(experiment))
    b = experiment[1]
    # The figure leaves the pitch of -1.2 degrees out.
    level = SunPose(b.position, b.yaw, 0.0, b.boom, b.stick, b.bucket, b.lengths)
    sets = joint_sets(theta, d, level, eta=0.1, m=32)
    assert sets.d2 == pytest.approx(d - 1.6)
    first = [[0.2659, 0.2793, 0.2911], [0.3150, 0.3284, 0.3402], [0.3641, 0.3775, 0.3893]]
    last = [[1.6929, 1.6705, 1.6434], [1.7420, 1.7195, 1.6925], [1.7911, 1.7686, 1.7416]]
    assert sets.boom.shape == (33, 33)
    assert np.abs(sets.boom[:3, :3] - first).max() < 1e-4
    assert np.abs(sets.boom[-3:, -3:] - last).max() < 1e-4
    assert np.abs(sets.boom + sets.stick + sets.bucket).max() < 1e-12  # phi_B = 0, Eq. (26)


def test_pitch_lowers_the_boom_of_figure_24(experiment: Pair) -> None:
    # Eq. (24) with Table 6's pitch: the whole figure rises by 1.2 degrees.
    theta, d = (values[:33] for values in fig22(experiment))
    b = experiment[1]
    sets = joint_sets(theta, d, b, eta=0.1, m=32)
    assert sets.boom[0, 0] == pytest.approx(0.2659 + np.radians(1.2), abs=1e-3)


def test_third_posture_is_on_the_sets_surface(simulation: Pair) -> None:
    # Its boom and stick satisfy (19)-(21) exactly: 30 + (-60) + 30 degrees, a level bucket.
    b = simulation[1]
    x = 1.72 * np.cos(b.boom) + 0.951 * np.cos(b.boom + b.stick)
    z = 1.72 * np.sin(b.boom) + 0.951 * np.sin(b.boom + b.stick)
    solved = inverse_kinematics(b.lengths, x, z)
    assert np.array(solved) == pytest.approx([b.boom, b.stick, b.bucket])


def test_swing_tells_the_third_case_from_the_same_arm_turned_away(simulation: Pair) -> None:
    a, b = simulation
    curve = theta_d(a, b, eta=0.1, n=49, reach=float(b.lengths.sum()))
    sets = joint_sets(*curve, b, eta=0.1, m=49)
    q = np.array([b.boom, b.stick, b.bucket])
    assert not in_free_joints(sets.co3, q)
    contact = np.interp(3.945, curve[1], curve[0])  # its d'' + 1.6: the yaw of first contact
    assert contact_length(*curve, contact) == pytest.approx(3.945, abs=1e-3)
    assert not in_free_joints(sets.co4, np.array([contact, *q]))
    assert not in_free_joints(sets.co4, np.array([contact - 2.0 * np.pi, *q]))
    assert in_free_joints(sets.co4, np.array([np.radians(20.0), *q]))
