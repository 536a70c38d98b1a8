"""Who gets in, and over what: decided before a backend starts."""

from __future__ import annotations

import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from backend.control.person import SUPERVISOR, Person
from backend.errors import InputError
from backend.shell.access.access import LOCAL, Access
from backend.shell.access.audit import Audit
from backend.shell.access.links import Links
from backend.shell.access.places import state_folder
from backend.shell.access.sessions import Sessions
from backend.shell.access.tls import Tls, given
from backend.shell.access.users import Users, default_file

LOOPBACK = ("127.0.0.1", "localhost", "::1")
ANYWHERE = ("", "0.0.0.0", "::")


@dataclass(frozen=True)
class EntryOptions:
    """As on the command line; see `cockpit.cli_entry`."""

    users: Path | None = None
    no_login: bool = False
    one_time_link: bool = False
    cert: Path | None = None
    key: Path | None = None
    self_signed: bool = False
    insecure_http: bool = False
    metrics_token: str = ""


@dataclass(frozen=True)
class Entry:
    """host: of the page; users: who signs in with a password; link_for: whom one-time links sign
    in; everybody: who all are, where nobody has to sign in; tls: None for plain HTTP;
    metrics_token: of programs that read /metrics without a session, empty for none.
    """

    host: str
    users: Users | None = None
    link_for: Person | None = None
    everybody: Person | None = None
    tls: Tls | None = None
    metrics_token: str = ""

    @property
    def hosts(self) -> tuple[str, ...]:
        """Names under which the page answers: on the loopback no other."""
        return LOOPBACK if self.host in LOOPBACK else ("*",)

    def url(self, port: int) -> str:
        """Of the page, as seen from this computer."""
        shown = "127.0.0.1" if self.host in ANYWHERE else self.host
        shown = f"[{shown}]" if ":" in shown else shown
        return f"{'http' if self.tls is None else 'https'}://{shown}:{port}"

    def access(self, port: int, say: Callable[[str], None] | None = None) -> Access:
        """The access control of a backend on this port. say: prints a line in the terminal."""
        tell = say or _say
        links = None
        if self.link_for is not None:
            address = self.url(port)
            links = Links(
                self.link_for,
                lambda token: tell(f"The next link (works once): {link(address, token)}"),
            )
        secure = self.tls is not None
        kept = state_folder() / f"sessions-{port}.json" if self.users is not None else None
        return Access(
            Sessions(kept),
            Audit(state_folder() / "audit.jsonl"),
            cookie=f"{'__Host-' if secure else ''}cockpit-{port}",
            users=self.users,
            links=links,
            everybody=self.everybody,
            https=secure,
            metrics_token=self.metrics_token or None,
        )

    def notes(self) -> list[str]:
        """What must be said in the terminal."""
        found = []
        if self.everybody is not None:
            found.append(
                "WARNING: --no-login: everybody on this computer is "
                f'"{self.everybody.who}", {self.everybody.role}. Nobody has to sign in.'
            )
        if self.tls is None and self.host not in LOOPBACK:
            found.append(
                "WARNING: --insecure-http: passwords and the whole cockpit can be read and changed "
                "by everybody on the network between."
            )
        if self.tls is not None:
            from backend.shell.access.certificates import fingerprint

            found.append(f"Certificate (SHA-256): {fingerprint(self.tls)}")
        return found


def decide(options: EntryOptions, host: str, link_for: Person | None = None) -> Entry:
    """As `_decide`, with what does not depend on who gets in."""
    return replace(_decide(options, host, link_for), metrics_token=options.metrics_token)


def _decide(options: EntryOptions, host: str, link_for: Person | None) -> Entry:
    """What the options come to. Raises InputError for what is not safe or does not fit.

    link_for: whom one-time links sign in when no users file is named; None where a users file is
    needed, unless the options ask for a link.
    """
    local = host in LOOPBACK
    tls = _tls(options, host)
    if not local and tls is None and not options.insecure_http:
        raise InputError(
            f"--host: {host} can be reached by others, over plain HTTP; allowed is that with "
            "--cert FILE --key FILE, with --self-signed, or with --insecure-http."
        )
    if options.no_login:
        if options.users is not None or options.one_time_link:
            raise InputError("--no-login: allowed is it alone, or --users, or --one-time-link.")
        if not local:
            raise InputError(
                f"--no-login: {host} can be reached by others; allowed is it on "
                f"{', '.join(LOOPBACK)} only."
            )
        return Entry(host, everybody=LOCAL, tls=tls)
    if options.one_time_link:
        if not local:
            raise InputError(
                f"--one-time-link: {host} can be reached by others; allowed is it on "
                f"{', '.join(LOOPBACK)} only. For others there is `cockpit users add`."
            )
        link_for = link_for or Person("local", SUPERVISOR)
    if options.users is not None:
        users = Users(options.users)
        return Entry(host, users, link_for if options.one_time_link else None, tls=tls)
    if link_for is not None:
        return Entry(host, link_for=link_for, tls=tls)
    return Entry(host, Users(default_file()), tls=tls)


def _tls(options: EntryOptions, host: str) -> Tls | None:
    if (options.cert is None) != (options.key is None):
        missing = "--cert" if options.cert is None else "--key"
        raise InputError(f"{missing}: is missing; allowed are --cert and --key together.")
    if options.cert is not None and options.key is not None:
        if options.self_signed:
            raise InputError("--self-signed: allowed is it alone, or --cert with --key.")
        return given(options.cert, options.key)
    if not options.self_signed:
        return None
    # Loaded only here: its libraries load slowly, and the page waits for what is loaded before.
    from backend.shell.access.certificates import self_signed

    names = (*LOOPBACK, *((socket.gethostname(),) if host not in LOOPBACK else ()))
    return self_signed(state_folder(), (*names, *_addresses(host)))


def _addresses(host: str) -> tuple[str, ...]:
    """Under which others find this computer."""
    if host not in ANYWHERE:
        return (host,)
    try:
        found = socket.getaddrinfo(socket.gethostname(), None)
    except OSError:
        return ()
    return tuple(dict.fromkeys(str(entry[4][0]).partition("%")[0] for entry in found))


def link(url: str, token: str) -> str:
    """The address that signs in who opens it."""
    return f"{url}/?token={token}"


def _say(line: str) -> None:
    print(line, flush=True)
