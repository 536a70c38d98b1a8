"""How a machine surmounts a step with the help of its arm: `cockpit surmount` and /api/surmount.

Jayasekara and Arisumi 2015: sequences 1, 2-1 and 2-2, with what precedes and follows them.
"""

from __future__ import annotations

from pydantic import BaseModel, Field

Row = list[float]


class SurmountParameters(BaseModel):
    """Fig. 2."""

    p1: float = Field(description="from P_b to the edge at the beginning [m]")
    p2: float = Field(description="from the bucket to the edge in stage 1 [m]")
    p3: float = Field(description="from the bucket to the edge in stage 2 [m]")
    p4: float = Field(description="from P_b to the edge at the end [m]")
    alpha_f: float = Field(description="lean after stage 1 [rad]")


class SurmountPhase(BaseModel):
    """One part of a manoeuvre."""

    name: str
    start: float = Field(description="[s]")
    end: float = Field(description="[s]")
    energy: float | None = Field(None, description="[J]; null where it was not simulated")
    min_stability_margin: float | None = Field(None, description="[m]")


class SurmountObstacle(BaseModel):
    """A step. Lengths along the way across its edge."""

    name: str = Field(description="of the site's box, empty where it was given by numbers")
    height: float = Field(description="[m]")
    distance: float = Field(description="from the swing axis to its edge [m]")
    angle: float = Field(0.0, description="of the machine to the way across the edge [rad]")
    depth: float | None = Field(None, description="[m]; null without end")


class SurmountCandidate(BaseModel):
    """One set of parameters that was looked at."""

    parameters: SurmountParameters
    energy: float | None = Field(None, description="(19) [J]")
    duration: float | None = Field(None, description="of the three sequences [s]")
    min_stability_margin: float | None = Field(
        None, description="of the three sequences; checks tell that of all [m]"
    )
    worst_torque: float | None = Field(None, description="share of the joint's own")
    simulated: bool = Field(False, description="else quasi-static")
    chosen: bool = False


class SurmountChecks(BaseModel):
    """What the simulated machine came nearest to."""

    min_clearance: float | None = Field(None, description="of the machine to what it passes [m]")
    min_stability_margin: float | None = Field(None, description="[m]")
    max_penetration: float | None = Field(None, description="of machine and ground [m]")
    max_slip: float | None = Field(None, description="of the bucket on the ground [m]")
    worst_torque: float | None = Field(None, description="share of the joint's own")
    worst_rate: float | None = Field(None, description="share of the joint's own")


class SurmountFigures(BaseModel):
    """Figs. 10-14, at most 600 rows."""

    time: list[float] = Field(description="[s]")
    joints: list[Row] = Field(description="[rad]")
    rates: list[Row] = Field(description="[rad/s]")
    torques: list[Row] = Field(description="[N m]")
    torque_limits: list[float | None] = Field(description="by joint [N m]")
    energy: list[float] = Field(description="from the beginning to then [J]")
    com: list[Row] = Field(description="centre of mass: along the way, height [m]")
    phase: list[int] = Field(description="index into phases")


class SurmountDocument(BaseModel):
    """A manoeuvre, or why there is none."""

    ok: bool
    why: str | None = None
    kind: str | None = Field(None, description="reach, torque, stability, collision, simulation")
    machine: str = ""
    method: str = ""
    duration: float | None = Field(None, description="[s]")
    time: list[float] = Field(default_factory=list, description="[s]")
    roles: list[str] = Field(default_factory=list)
    joints: list[Row] = Field(default_factory=list, description="[rad]")
    joint_velocities: list[Row] = Field(default_factory=list, description="[rad/s]")
    tracks: list[Row] = Field(default_factory=list, description="left, right [m/s]")
    base: list[Row] = Field(
        default_factory=list, description="x, y, z, yaw, pitch, roll of the URDF root [m, rad]"
    )
    end_point: list[Row] = Field(default_factory=list, description="[m]")
    phases: list[SurmountPhase] = Field(default_factory=list)
    energy: float | None = Field(None, description="(19), of sequences 1, 2-1 and 2-2 [J]")
    energy_moves: float | None = Field(None, description="of reach, turn and stow [J]")
    energy_quasi_static: float | None = Field(None, description="[J]")
    energy_potential: float | None = Field(
        None,
        description="what heights of the centre of mass ask of any drive in those sequences [J]",
    )
    parameters: SurmountParameters | None = None
    obstacle: SurmountObstacle | None = None
    candidates: list[SurmountCandidate] = Field(default_factory=list)
    checks: SurmountChecks | None = None
    figures: SurmountFigures | None = None
    assumptions: list[str] = Field(default_factory=list)
    notes: list[str] = Field(default_factory=list)
