"""Other programs' recordings as sessions, converted once and kept."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from backend.errors import InputError
from backend.site.site import load_site, shipped_sites


def as_session(path: Path, site_name: str | None) -> Path:
    """`path` itself, or for what only `cockpit convert` reads (rosbag2 with sqlite, CAN logs,
    tables of poses) the session made of it. Raises InputError, also where no site is named.
    """
    if path.suffix == ".mcap" or any(path.glob("*.mcap")):
        return path
    # CAN and table libraries take a while to load, and most sessions need none of them.
    from backend.shell.session.convert import convert, needs_conversion

    if not needs_conversion(path):
        return path
    if not site_name:
        raise InputError(
            f"{path}: does not say on which site it was recorded; --site is needed, allowed are "
            f"{', '.join(shipped_sites())}, or the path of a site file."
        )
    site = load_site(site_name)
    out = _cache() / _digest(path, site.path) / f"{path.stem}.mcap"
    if out.exists():
        return out
    out.parent.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"converting {path.name}", total=1.0)
        convert(path, site, out, lambda share: bar.update(task, completed=share))
    return out


def _cache() -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "excavator-cockpit" / "converted"


def _digest(path: Path, site: Path) -> str:
    """Of where the recording is, when it was changed, and what the site file says."""
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    stats = [(str(p.resolve()), p.stat().st_mtime_ns, p.stat().st_size) for p in files]
    return hashlib.sha256(repr(stats).encode() + site.read_bytes()).hexdigest()[:16]
