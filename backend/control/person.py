"""Who sits at a page, as the access check found out; everything that moves a machine asks it."""

from __future__ import annotations

from dataclasses import dataclass

VIEWER, OPERATOR, SUPERVISOR = "viewer", "operator", "supervisor"
ROLES = (VIEWER, OPERATOR, SUPERVISOR)


@dataclass(frozen=True)
class Person:
    """who: the name they signed in with; role: one of `ROLES`."""

    who: str
    role: str

    def __post_init__(self) -> None:
        if not self.who.strip():
            raise ValueError("who: a person has a name")
        if self.role not in ROLES:
            raise ValueError(f"role: {self.role!r} is unknown; allowed are {', '.join(ROLES)}")

    @property
    def may_drive(self) -> bool:
        return self.role in (OPERATOR, SUPERVISOR)

    @property
    def may_override(self) -> bool:
        return self.role == SUPERVISOR
