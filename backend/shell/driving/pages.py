"""What a page says of driving, checked: anything malformed is no input at all."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import msgspec

from backend.control.lease import LONGEST, Kind
from backend.control.patterns import Method, Pattern, Sticks
from backend.control.seat import Input

Deflection = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]
Text = Annotated[str, msgspec.Meta(max_length=LONGEST)]


class SticksSaid(msgspec.Struct, tag_field="type", tag="sticks"):
    """Deflections in -1..1: x to the right, y forwards."""

    seq: Annotated[int, msgspec.Meta(ge=0)]
    left_x: Deflection
    left_y: Deflection
    right_x: Deflection
    right_y: Deflection
    track_left: Deflection
    track_right: Deflection
    enable: bool
    focus: bool
    gamepad: bool
    override: bool = False
    source: Literal["", "gamepad", "keyboard", "screen"] = ""

    @property
    def sticks(self) -> Sticks:
        return Sticks(
            self.left_x,
            self.left_y,
            self.right_x,
            self.right_y,
            self.track_left,
            self.track_right,
        )

    def input(self, arrival: float) -> Input:
        """arrival [s]."""
        flags = self.enable, self.focus, self.gamepad, self.override
        return Input(arrival, self.seq, self.sticks, *flags, self.source)


class StopSaid(msgspec.Struct, tag_field="type", tag="stop"):
    pass


class ResetSaid(msgspec.Struct, tag_field="type", tag="reset"):
    pass


class PauseSaid(msgspec.Struct, tag_field="type", tag="pause"):
    pass


class LeaseSaid(msgspec.Struct, tag_field="type", tag="lease"):
    do: Literal["request", "release", "hand_over", "take_over"]
    machine: str
    to: Text = ""
    reason: Text = ""

    @property
    def kind(self) -> Kind:
        return Kind(self.do)


class DriveSaid(msgspec.Struct, tag_field="type", tag="drive"):
    machine: str


class SettingSaid(msgspec.Struct, tag_field="type", tag="setting"):
    """method: None for the one that the seat has."""

    pattern: Pattern
    fine: bool
    method: Method | None = None


class OverrideSaid(msgspec.Struct, tag_field="type", tag="override"):
    reason: Text


class FollowSaid(msgspec.Struct, tag_field="type", tag="follow"):
    """plan: the name of a trajectory that was planned for the machine."""

    do: Literal["accept", "drop"]
    machine: str
    plan: Text = ""


Said = (
    SticksSaid
    | StopSaid
    | ResetSaid
    | PauseSaid
    | LeaseSaid
    | DriveSaid
    | SettingSaid
    | OverrideSaid
    | FollowSaid
)
KINDS = frozenset(
    ("sticks", "stop", "reset", "pause", "lease", "drive", "setting", "override", "follow")
)


def parse(message: dict[str, Any]) -> Said | None:
    """None for what is malformed; a deflection that is not a number is."""
    try:
        said: Said = msgspec.convert(message, type=Said)
    except (msgspec.ValidationError, RecursionError):
        return None
    if isinstance(said, SticksSaid) and not all(map(math.isfinite, vars(said.sticks).values())):
        return None
    return said
