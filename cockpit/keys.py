"""`cockpit keys`: makes them and says what goes where."""

from __future__ import annotations

from pathlib import Path

from backend.shell.link.keys import AUTHORITY, CONFIG, make_keys, read_backend
from backend.site.site import load_site

DEFAULT_BACKEND = "cockpit=127.0.0.1,localhost"


def run_keys(
    site_name: str,
    out: Path,
    backends: tuple[str, ...],
    listeners: tuple[str, ...],
    port: int,
    days: int,
    renew: bool,
) -> None:
    """Prints the folders, and how they are used."""
    site = load_site(site_name)
    found = tuple(read_backend(text) for text in backends or (DEFAULT_BACKEND,))
    made = make_keys(site, out, found, listeners, days, renew, port)
    for name, new in made.items():
        words = f"new certificate, {days} days" if new else "certificate kept"
        print(f"{out / name}: {words}")
    first = found[0].name
    print(
        f"Copy each folder to its own computer, and nowhere else. {out / AUTHORITY} signs new "
        f"ones: keep it off the site. Then, for example:\n"
        f"  cockpit serve --site {site_name} --link-config {out / first / CONFIG}\n"
        f"  cockpit agent --site {site_name} --machine {site.machines[0].name} "
        f"--link-config {out / site.machines[0].name / CONFIG}"
    )
