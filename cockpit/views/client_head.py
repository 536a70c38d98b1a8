"""What is put in the head of viser's client page by whoever serves it to browsers."""

from __future__ import annotations

from pathlib import Path

HEAD = (Path(__file__).parent / "client_head.html").read_text(encoding="utf-8")
