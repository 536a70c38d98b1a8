"""Two machines made of boxes, and snapshots of them, for the views' tests."""

from __future__ import annotations

import numpy as np
import shapely

from backend.fusion.pose import FusedPose, StreamStatus, Validity
from backend.fusion.samples import Fix
from backend.machine.model import Antenna, ArmPlane, Joint, Link, Machine, SunMap, Tracks, Visual
from backend.pipeline.exact import OwnImage
from backend.pipeline.records import Body3D, Health, MachineState, PairDistance, Snapshot
from backend.safety.record import Concern, Evidence, Level
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import about_axis, rz
from backend.spatial.transform import make
from cockpit.views.inputs import SceneMachine, SceneSite
from cockpit.views.shapes import BOX_FACES

YELLOW, DARK, GLASS = (226, 176, 60), (58, 60, 64), (60, 84, 100)

# Per link: name, parent, origin in the parent, axis, boxes (centre, half extents, colour).
CHAIN = [
    (
        *("tracks", -1, (0, 0, 0), (0, 0, 1)),
        [
            ((0, 0.65, 0.24), (1.05, 0.2, 0.24), DARK),
            ((0, -0.65, 0.24), (1.05, 0.2, 0.24), DARK),
            ((0, 0, 0.32), (0.55, 0.5, 0.12), DARK),
        ],
    ),
    (
        *("upper", 0, (0, 0, 0.5), (0, 0, 1)),
        [
            ((-0.25, 0, 0.15), (1.0, 0.75, 0.12), YELLOW),
            ((-0.85, 0, 0.5), (0.42, 0.7, 0.26), YELLOW),
            ((0.25, 0.42, 0.75), (0.45, 0.32, 0.5), GLASS),
            ((-0.2, -0.45, 0.45), (0.4, 0.25, 0.2), YELLOW),
        ],
    ),
    ("boom", 1, (0.75, 0, 0.25), (0, -1, 0), [((0.86, 0, 0), (0.9, 0.1, 0.13), YELLOW)]),
    ("stick", 2, (1.72, 0, 0), (0, -1, 0), [((0.45, 0, 0), (0.52, 0.08, 0.1), YELLOW)]),
    (
        *("bucket", 3, (0.951, 0, 0), (0, -1, 0)),
        [((0.3, 0, -0.12), (0.28, 0.3, 0.05), DARK), ((0.15, 0, 0.05), (0.06, 0.3, 0.2), DARK)],
    ),
]


def box_visual(center: tuple, half: tuple, color: tuple[int, int, int]) -> Visual:
    box = Boxes(np.array([center]), np.eye(3)[None], np.array([half]))
    return Visual(box.corners()[0], BOX_FACES, color)


def machine(visuals: bool = True) -> Machine:
    links, centers, halves, owners, names = [], [], [], [], []
    for k, (name, parent, origin, axis, boxes) in enumerate(CHAIN):
        shapes = tuple(box_visual(*box) for box in boxes) if visuals else ()
        T = make(np.eye(3), np.array(origin, dtype=float))
        links.append(Link(name, name, parent, T, np.array(axis, float), k - 1, None, shapes))
        for j, (center, half, _) in enumerate(boxes):
            centers.append(center)
            halves.append(half)
            owners.append(k)
            names.append(f"{name}/{j}")
    roles = ("swing", "boom", "stick", "bucket")
    joints = tuple(Joint(role, role, -3.2, 3.2, 0.5, 1.0) for role in roles)
    return Machine(
        name="toy",
        title="Toy of boxes",
        joints=joints,
        links=tuple(links),
        bodies=Boxes(np.array(centers), np.tile(np.eye(3), (len(centers), 1, 1)), np.array(halves)),
        body_names=tuple(names),
        body_links=tuple(owners),
        end_link=4,
        end_point=np.array([0.7, 0.0, 0.0]),
        sun=SunMap((0.75, 1.72, 0.951, 0.7), (1, 1, 1), (0, 0, 0)),
        arm=ArmPlane(make(np.eye(3), np.array([0.0, 0.0, 0.5])), 0.25, 0.0),
        antenna=Antenna(1, np.array([-0.8, 0.0, 1.2])),
        heading_of="upper",
        heading_offset=0.0,
        tracks=Tracks(2.1, 1.3, 0.4, 1.0, 0.5),
        masses_trusted=False,
        payload=100.0,
        self_pairs=(),
        max_reach=0.75 + 1.72 + 0.951 + 0.7,
    )


def site(model: Machine | None = None, obstacles: Boxes | None = None) -> SceneSite:
    none = Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    model = model or machine()
    return SceneSite(
        title="Toy site",
        origin=(308603.5, 4129952.0, 0.0),
        machines={"left": SceneMachine("LEFT", model), "right": SceneMachine("RIGHT", model)},
        obstacles=obstacles if obstacles is not None else none,
        slow_below=0.8,
        stop_below=0.2,
    )


def place(model: Machine, base: tuple[float, float, float], yaw: float, q: tuple) -> Body3D:
    poses: list[np.ndarray] = []
    for link in model.links:
        parent = make(rz(yaw), np.array(base)) if link.parent < 0 else poses[link.parent]
        angle = 0.0 if link.joint < 0 else q[link.joint]
        poses.append(parent @ link.T_parent_joint @ make(about_axis(link.axis, angle), np.zeros(3)))
    link_poses = np.array(poses)
    owners = list(model.body_links)
    T = link_poses[owners]
    centers = np.einsum("nij,nj->ni", T[:, :3, :3], model.bodies.centers) + T[:, :3, 3]
    boxes = Boxes(centers, T[:, :3, :3] @ model.bodies.rotations, model.bodies.half_extents)
    tip = link_poses[model.end_link] @ np.append(model.end_point, 1.0)
    reach = float(np.hypot(*(tip[:2] - link_poses[1, :2, 3])))
    return Body3D(link_poses, boxes, tip[:3], link_poses[1, :3, 3], yaw + q[0], reach)


def state(
    name: str, body: Body3D | None, validity: Validity = Validity.VALID, age: float = 0.02
) -> MachineState:
    stream = StreamStatus(age, 50.0, "offset", 100, 0)
    pose = FusedPose(
        machine=name,
        time=0.0,
        validity=validity,
        reasons=(),
        position=np.zeros(3),
        yaw=0.0,
        pitch=0.0,
        roll=0.0,
        joints=np.zeros(4),
        joint_velocities=np.zeros(4),
        base_velocity=np.zeros(3),
        sigma_position=0.02,
        sigma_yaw=0.01,
        sigma_joints=0.001,
        fix=Fix.RTK_FIXED,
        streams={"joints": stream, "position": stream, "heading": stream},
        clock_offset=None,
    )
    return MachineState(pose, body, 0.1)


def snapshot(
    cycle: int = 1,
    time: float = 0.0,
    validity: Validity = Validity.VALID,
    distance: float | None = None,
    swing: float = 0.0,
    model: Machine | None = None,
) -> Snapshot:
    """LEFT at (-2.6, 0) looking at RIGHT at (2.6, 0.6). distance: None measures tip to tip."""
    model = model or machine()
    left = place(model, (-2.6, 0.0, 0.0), 0.0, (swing, 0.9, -1.5, -0.6))
    right = place(model, (2.6, 0.6, 0.0), np.pi, (0.4, 0.8, -1.2, -0.7))
    points = np.array([left.end_point, right.end_point])
    exact = float(np.linalg.norm(points[1] - points[0]))
    unknown = validity is not Validity.VALID
    value = float("nan") if unknown else exact if distance is None else distance
    pair = PairDistance(
        *("left", "right", "bucket/0", "bucket/0", value),
        points=None if unknown else points,
        reason="RIGHT is stale" if unknown else "",
        checked=1,
        approach=0.0,
        near=True,
    )
    return Snapshot(
        time=time,
        state_time=time,
        cycle=cycle,
        mode="DEMO",
        machines={
            "left": state("left", left),
            "right": state("right", right, validity, 0.02 if not unknown else 0.6),
        },
        pairs=(pair,),
        concerns=(),
        alarms=(),
        health=Health(malformed={}, foreign={}, lost=0, images={}),
    )


def concern(level: Level, machine_name: str = "left", other: str = "right:boom/0") -> Concern:
    evidence = Evidence(f"{machine_name}:bucket/0", other, 1.0, None, 2.0)
    ones = np.ones((4, 2)), np.ones(2)
    return Concern("partner", machine_name, level, "near", *ones, evidence, 0.0)


class Zone:
    """An image of an ordered pair, as far as the ground shows it."""

    def __init__(self, zone: np.ndarray, state_time: float = 0.0) -> None:
        self.zone = zone
        self.state_time = state_time


def ring_zone(center: tuple[float, float] = (1.5, 0.4), radius: float = 3.2) -> np.ndarray:
    """A long rounded polygon (k, 2), like the partner's arm grown by the own reach."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 17)
    arc = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.concatenate([arc + center, -arc + (np.array(center) - [1.4, 0.0])])


class ExactZone:
    """An exact zone of an ordered pair, as far as the ground shows it."""

    def __init__(self, state_time: float = 0.0, **zones: shapely.Geometry | None) -> None:
        self.zones = zones
        self.state_time = state_time


def own_image(
    volume: np.ndarray, state_time: float = 0.0, q: tuple = (0.5, 0.0, -0.5, 0.5)
) -> OwnImage:
    """Joint images of LEFT over boom -1..1, stick -2..1, bucket -1..2 rad; it slowly raises."""
    return OwnImage(
        own="left",
        partners=("right",),
        state_time=state_time,
        eta=0.1,
        q=np.array(q),
        slices=(),
        bars=(),
        volume=volume,
        volume_edges=np.array([[-1.0, 1.0], [-2.0, 1.0], [-1.0, 2.0]]),
        reach=None,  # type: ignore[arg-type]
        tip_height=None,
        stopping=np.array([[0.0, 0.3], [0.1, 0.4], [-0.1, 0.4], [0.0, 0.5]]),
    )


class Source:
    """A hub of one fixed sequence: `put` publishes."""

    def __init__(self) -> None:
        self.current: Snapshot | None = None
        self.images: dict[tuple[str, str], object] = {}

    def put(self, value: Snapshot) -> None:
        self.current = value

    def latest(self) -> Snapshot | None:
        return self.current

    def wait(self, after_cycle: int, timeout: float) -> Snapshot | None:
        import time

        end = time.monotonic() + timeout
        while time.monotonic() < end:
            if self.current is not None and self.current.cycle > after_cycle:
                return self.current
            time.sleep(0.004)
        return None

    def image(self, kind: str, key: str) -> object:
        return self.images.get((kind, key))
