"""Who may sign in, who is signed in, and what the audit log holds."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Role = Literal["viewer", "operator", "supervisor"]
NAME = r"^\w[\w .@-]{0,63}$"


class UserEntry(BaseModel):
    model_config = ConfigDict(extra="forbid")

    role: Role
    password: str = Field(pattern=r"^\$argon2id\$", max_length=512, description="its Argon2id hash")


class UsersFileDocument(BaseModel):
    """The users file. Passwords are in it as hashes only; still it is for its owner's eyes."""

    model_config = ConfigDict(extra="forbid")

    users: dict[str, UserEntry] = Field(description="by the name they sign in with")


class UserRow(BaseModel):
    name: str
    role: Role


class UsersDocument(BaseModel):
    """Everybody who may sign in."""

    file: str
    users: list[UserRow]


class MeDocument(BaseModel):
    """Who is signed in in this browser."""

    who: str
    role: Role
    may_drive: bool
    may_override: bool
    how: Literal["password", "link", "no login"] = Field(description="how they got in")
    idle: float | None = Field(description="signed out after so long without a page [s]")
    left: float | None = Field(description="until they are signed out in any case [s]")


class EntranceDocument(BaseModel):
    """How one signs in here."""

    passwords: bool = Field(description="with a name and a password")
    link: bool = Field(description="with the link in the terminal of the program")
    who: str | None = Field(description="who is signed in already")


class LoginRequest(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: str = Field(max_length=256)
    password: str = Field(max_length=1024)


class AuditEntry(BaseModel):
    """One line of the audit log."""

    model_config = ConfigDict(extra="forbid")

    time: float = Field(description="[s since 1970]")
    event: str = Field(description="login, login failed, logout, refused, lost, and what drives")
    who: str | None = Field(description="null where nobody is known, a wrong name included")
    details: dict[str, Any]
