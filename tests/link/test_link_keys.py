"""Keys and access control over real TLS on the loopback: who is heard, and who is not."""

from __future__ import annotations

import json
import os
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import zenoh
from program import cockpit

from backend.errors import InputError
from backend.shell.link.access import Party, Role, access_control
from backend.shell.link.certificates import issue, read_authority, read_certificate
from backend.shell.link.keys import AUTHORITY, Backend, make_keys, read_backend
from backend.shell.link.session import open_session, with_port
from backend.shell.link.topics import TOPICS, Direction
from backend.site.site import Site, load_site

BACKENDS = (Backend("cockpit", ("127.0.0.1", "localhost")), Backend("second", ("127.0.0.1",)))


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site("demo")


@pytest.fixture(scope="module")
def keys(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keys")
    make_keys(site, folder, BACKENDS, ("screen",))
    return folder


@dataclass
class Wire:
    """A backend that listens on `endpoint` with the site's keys, and what it heard."""

    keys: Path
    endpoint: str
    backend: Any
    heard: list[str]
    opened: ExitStack

    def join(self, party: str, keys: Path | None = None, **options: Any) -> Any:
        """A session of `party`, closed with the wire."""
        config = (keys or self.keys) / party / "link.json5"
        return self.add(open_session(connect=[self.endpoint], config_file=config, **options))

    def add(self, session: Any) -> Any:
        self.opened.callback(session.close)
        return session


@pytest.fixture
def wire(keys: Path) -> Iterator[Wire]:
    with ExitStack() as opened:
        endpoint = with_port("tls/127.0.0.1:0")
        config = keys / "cockpit" / "link.json5"
        backend = open_session(listen=[endpoint], mode="router", config_file=config)
        opened.callback(backend.close)
        heard: list[str] = []
        for below in ("left/**", "right/**", "cockpit/**"):
            backend.declare_subscriber(below, lambda s: heard.append(str(s.key_expr)))
        yield Wire(keys, endpoint, backend, heard, opened)


def until(holds: Callable[[], Any], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.02)


def heard_again_and_again(wire: Wire, put: Callable[[], Any], key: str) -> None:
    """`put` until `key` is heard: the link is up, and what was sent before it has arrived."""

    def holds() -> bool:
        put()
        return key in wire.heard

    until(holds)


def test_a_machine_is_heard_under_its_own_prefix_only(wire: Wire) -> None:
    left = wire.join("left")
    out = left.declare_publisher("left/joint_states")
    heard_again_and_again(wire, lambda: out.put(b"x"), "left/joint_states")
    for stranger in (
        *("right/joint_states", "right/imu/base", "left/cmd", "right/cmd", "right/limits"),
        *("cockpit/snapshot", "cockpit/alarm", "left/secret", "left/imu/base/deeper"),
    ):
        left.put(stranger, b"not mine to say")
    heard_again_and_again(wire, lambda: left.put("left/status", b"x"), "left/status")
    left.put("left/imu/base", b"x")
    until(lambda: "left/imu/base" in wire.heard)
    assert set(wire.heard) == {"left/joint_states", "left/status", "left/imu/base"}


def test_a_machine_obeys_backends_and_no_other_machine(wire: Wire) -> None:
    left, right = wire.join("left"), wire.join("right")
    told: list[tuple[str, bytes]] = []
    for key in ("left/cmd", "left/limits", "right/cmd", "right/joint_states"):
        left.declare_subscriber(key, lambda s: told.append((str(s.key_expr), bytes(s.payload))))
    left.declare_queryable("left/clock", lambda q: q.reply("left/clock", b"now"))
    heard_again_and_again(wire, lambda: right.put("right/status", b"x"), "right/status")

    def obeyed() -> bool:
        right.put("left/cmd", b"from right")
        right.put("right/joint_states", b"for the cockpit only")
        wire.backend.put("left/cmd", b"from the cockpit")
        wire.backend.put("right/cmd", b"for right")
        return bool(told)

    until(obeyed)
    until(lambda: [bytes(r.ok.payload) for r in wire.backend.get("left/clock")] == [b"now"])
    assert list(right.get("left/clock", timeout=0.5)) == []
    assert set(told) == {("left/cmd", b"from the cockpit")}


def test_a_second_backend_hears_the_machines_of_the_first_and_asks_them(wire: Wire) -> None:
    left, second = wire.join("left"), wire.join("second", mode="router")
    through: list[str] = []
    told: list[bytes] = []
    second.declare_subscriber("left/**", lambda s: through.append(str(s.key_expr)))
    left.declare_subscriber("left/cmd", lambda s: told.append(bytes(s.payload)))
    left.declare_queryable("left/lease", lambda q: q.reply("left/lease", b"{}"))

    def both() -> bool:
        left.put("left/status", b"x")
        second.put("left/cmd", b"go")
        return "left/status" in through and b"go" in told

    until(both)
    until(lambda: [bytes(r.ok.payload) for r in second.get("left/lease")] == [b"{}"])


def test_a_listener_hears_and_says_nothing(wire: Wire) -> None:
    screen = wire.join("screen")
    seen: list[str] = []
    screen.declare_subscriber("cockpit/**", lambda s: seen.append(str(s.key_expr)))

    def saw() -> bool:
        wire.backend.put("cockpit/snapshot", b"{}")
        screen.put("left/cmd", b"go")
        screen.put("cockpit/alarm", b"[]")
        return bool(seen)

    until(saw)
    assert "left/cmd" not in wire.heard
    assert "cockpit/alarm" not in wire.heard


def stranger(endpoint: str, tls: dict[str, Any]) -> Any:
    """A session of somebody who keeps to no rules of ours."""
    config = zenoh.Config()
    for path, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "transport/link/tls": tls,
    }.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def test_strangers_are_refused(wire: Wire, site: Site, tmp_path: Path) -> None:
    make_keys(site, tmp_path, BACKENDS)
    ours, theirs = wire.keys / "left", tmp_path / "left"
    root = {"root_ca_certificate": str(ours / "ca.pem")}
    without = {**root}
    foreign = {
        **root,
        "enable_mtls": True,
        "connect_certificate": str(theirs / "certificate.pem"),
        "connect_private_key": str(theirs / "key.pem"),
    }
    for tls in (without, foreign):
        with pytest.raises(zenoh.ZError):
            stranger(wire.endpoint, tls)
    with pytest.raises(zenoh.ZError):  # and nothing but TLS is spoken there
        stranger(wire.endpoint.replace("tls/", "tcp/"), {})
    left = wire.join("left")
    heard_again_and_again(wire, lambda: left.put("left/status", b"x"), "left/status")
    assert set(wire.heard) == {"left/status"}


def test_a_valid_certificate_of_nobody_on_the_site_says_nothing(wire: Wire, tmp_path: Path) -> None:
    authority = read_authority(wire.keys / AUTHORITY)
    issue(tmp_path / "digger", authority, "digger", (), 1)
    other = stranger(
        wire.endpoint,
        {
            "root_ca_certificate": str(wire.keys / "left" / "ca.pem"),
            "enable_mtls": True,
            "connect_certificate": str(tmp_path / "digger" / "certificate.pem"),
            "connect_private_key": str(tmp_path / "digger" / "key.pem"),
        },
    )
    wire.add(other)
    left = wire.join("left")

    def known() -> None:
        other.put("left/joint_states", b"x")
        other.put("cockpit/snapshot", b"x")
        left.put("left/status", b"x")

    heard_again_and_again(wire, known, "left/status")
    assert set(wire.heard) == {"left/status"}


def test_names_authorities_and_expiry_are_told_in_one_sentence(
    wire: Wire, site: Site, tmp_path: Path
) -> None:
    config = wire.keys / "left" / "link.json5"
    elsewhere = wire.endpoint.replace("127.0.0.1", "127.0.0.2")
    port = wire.endpoint.rpartition(":")[2]
    file = wire.keys / "second" / "link.json5"
    wire.add(open_session(listen=[f"tls/127.0.0.2:{port}"], mode="router", config_file=file))
    with pytest.raises(InputError, match=r"127\.0\.0\.2.*is not accepted.*mismatch"):
        open_session(connect=[elsewhere], config_file=config)
    make_keys(site, tmp_path, BACKENDS)
    with pytest.raises(InputError, match="its certificate is not accepted: "):
        wire.join("left", tmp_path)
    # The right authority for the cockpit, but a certificate that the cockpit does not accept.
    shutil.copy(wire.keys / "left" / "ca.pem", tmp_path / "left" / "ca.pem")
    with pytest.raises(
        InputError, match=r"does not accept connect_certificate \(.*\); did the same"
    ):
        wire.join("left", tmp_path)
    issue(tmp_path / "left", read_authority(wire.keys / AUTHORITY), "left", (), -1)
    with pytest.raises(InputError, match=r"link.json5: listen_certificate: .*expired on .*renew"):
        wire.join("left", tmp_path)


def test_keys_are_private_and_stay_unless_renewed(site: Site, tmp_path: Path) -> None:
    made = make_keys(site, tmp_path, BACKENDS)
    assert made == {"left": True, "right": True, "cockpit": True, "second": True}
    for key in tmp_path.glob("*/key.pem"):
        assert stat.S_IMODE(key.stat().st_mode) == 0o600
        assert stat.S_IMODE(key.parent.stat().st_mode) == 0o700
    assert not list(tmp_path.glob("[!a]*/../[!a]*/authority*"))
    before = (tmp_path / "left" / "certificate.pem").read_bytes()
    assert not any(make_keys(site, tmp_path, BACKENDS).values())
    assert (tmp_path / "left" / "certificate.pem").read_bytes() == before
    assert all(make_keys(site, tmp_path, BACKENDS, renew=True).values())
    assert (tmp_path / "left" / "certificate.pem").read_bytes() != before
    assert read_certificate(tmp_path / "left" / "certificate.pem").subject.rfc4514_string() == (
        "CN=left"
    )
    shutil.rmtree(tmp_path / AUTHORITY)  # another authority: nothing that it did not sign counts
    assert all(make_keys(site, tmp_path, BACKENDS).values())


def test_every_row_of_the_table_is_in_the_rules_of_both_ends() -> None:
    machine, backend = Party("left", Role.MACHINE, "plant/left"), Party("cockpit", Role.BACKEND)
    parties = (machine, Party("right", Role.MACHINE, "right"), backend)
    rules = {}
    for own, other in ((machine, backend), (backend, machine)):
        section = access_control(own, parties)
        assert section["default_permission"] == "deny"
        of = next(s["id"] for s in section["subjects"] if other.name in s["cert_common_names"])
        policy = next(p for p in section["policies"] if p["subjects"] == [of])
        rules[own.name] = [r for r in section["rules"] if r["id"] in policy["rules"]]
    for row in TOPICS:
        if row.direction is Direction.FROM_COCKPIT:
            continue
        key = row.template.replace("{machine}", "plant/left")
        key = key.replace("{link}", "*").replace("{camera}", "*")
        message = "reply" if row.queryable else "put"
        from_machine = row.direction is Direction.FROM_MACHINE
        for own, flow in (("cockpit", from_machine), ("left", not from_machine)):
            flows = {
                flow
                for rule in rules[own]
                for flow in rule["flows"]
                if message in rule["messages"] and key in rule["key_exprs"]
            }
            assert flows == {"ingress" if flow else "egress"}, (row.name, own)
    said = [k for own in rules for rule in rules[own] for k in rule["key_exprs"]]
    assert not any(key.startswith(("right/", "cockpit/")) for key in said)


@pytest.mark.parametrize(
    "text", ["", "cockpit", "cockpit=", "=host", "a b=host", "a=ho st", "a=-x"]
)
def test_backends_that_cannot_be(text: str) -> None:
    with pytest.raises(InputError, match="--backend"):
        read_backend(text)


def test_two_parties_of_one_name_are_refused(site: Site, tmp_path: Path) -> None:
    for name in ("left", AUTHORITY):
        with pytest.raises(InputError, match="name of two parties"):
            make_keys(site, tmp_path, (Backend(name, ("a",)),))
    assert not list(tmp_path.iterdir())


def test_mistakes_in_a_configuration_name_the_file(keys: Path, tmp_path: Path) -> None:
    folder = tmp_path / "left"
    shutil.copytree(keys / "left", folder)
    file = folder / "link.json5"
    text = file.read_text()

    def refused(words: str) -> None:
        with pytest.raises(InputError, match=words) as caught:
            open_session(config_file=file)
        assert str(file) in str(caught.value)
        assert "\n" not in str(caught.value)

    os.chmod(folder / "key.pem", 0o644)
    refused("can be read by others")
    os.chmod(folder / "key.pem", 0o600)
    shutil.copy(keys / "right" / "key.pem", folder / "key.pem")
    refused("connect_private_key is not the key of connect_certificate")
    (folder / "key.pem").unlink()
    refused("listen_private_key: .*key.pem: cannot be read")
    (folder / "certificate.pem").write_text("nonsense")
    refused("listen_certificate: .*is not a certificate")
    file.write_text(text.replace('"enable_mtls"', '"enable_mttls"'))
    refused("is not a Zenoh configuration: unknown field `enable_mttls`")
    file.write_text("{mode:")
    refused("is not a Zenoh configuration")
    file.unlink()
    refused("cannot be read: No such file")


def test_the_command_makes_what_serve_and_agent_take(tmp_path: Path) -> None:
    done = cockpit("keys", "demo", "--out", str(tmp_path / "k"), "--backend", "base=10.0.0.1,base")
    assert done.returncode == 0, done.stderr
    assert "cockpit serve --site demo --link-config" in done.stdout
    assert "tls/10.0.0.1:7447" in (tmp_path / "k" / "left" / "link.json5").read_text()
    done = cockpit("keys", "demo", "--out", str(tmp_path / "k"), "--backend", "left=a")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    for command in ("sim", "agent"):
        missing = tmp_path / "none.json5"
        done = cockpit(
            command, "--site", "demo", "--machine", "left", "--link-config", str(missing)
        )
        assert done.returncode == 2
        assert f"{missing}: cannot be read" in done.stderr
