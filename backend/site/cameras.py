"""The cameras of a machine, as a site file lists them."""

from __future__ import annotations

from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from pydantic import Field, field_validator, model_validator

from backend.site.base import Name, Table

MOST = 4


class Camera(Table):
    """One camera. kind: how its picture comes.

    "mjpeg": the cockpit fetches it from `url` and passes it on; "whep": the page itself opens a
    WebRTC stream at `url`; "link": the machine is asked over the link for the camera called `name`.
    label: shown beside the machine's.
    """

    kind: Literal["mjpeg", "whep", "link"]
    url: Annotated[str, Field(max_length=500)] | None = None
    name: Name | None = None
    label: Annotated[str, Field(max_length=16)] = ""

    @field_validator("url")
    @classmethod
    def _http(cls, url: str | None) -> str | None:
        # A wrong address is not repeated: there may be a password in it.
        if url is None:
            return None
        try:
            parts = urlsplit(url)
            _ = parts.port
        except ValueError:
            raise ValueError(
                "is not an address; allowed is http://HOST/... or https://..."
            ) from None
        if "@" in parts.netloc:
            raise ValueError("holds a user name or a password; allowed is an address without them")
        strange = any(not c.isprintable() or c in " ;,'\"\\" for c in url)
        if parts.scheme not in ("http", "https") or not parts.hostname or strange:
            raise ValueError("is not an address; allowed is http://HOST/... or https://...")
        return url

    @model_validator(mode="after")
    def _one_place(self) -> Camera:
        wanted, other = ("name", "url") if self.kind == "link" else ("url", "name")
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            raise ValueError(
                f'kind is "{self.kind}"; allowed is that with "{wanted}", and without "{other}"'
            )
        return self

    @property
    def origin(self) -> str:
        """Scheme, host and port of `url`, as a page's policy names them."""
        parts = urlsplit(self.url or "")
        return f"{parts.scheme}://{parts.netloc}"


def as_list(table: dict[str, Any]) -> dict[str, Any]:
    """A machine's table with [machine.camera] as the only entry of [[machine.camera]]."""
    one = table.get("camera")
    return {**table, "camera": (one,)} if isinstance(one, dict) else table
