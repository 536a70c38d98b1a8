"""HTTPS with the program's own certificate: pages, websockets, cookies, and the files kept."""

from __future__ import annotations

import asyncio
import datetime
import ssl
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from cryptography import x509
from gatehouse import PASSWORD, House, house
from websockets.asyncio.client import connect

from backend.shell.access import certificates
from backend.shell.access.certificates import fingerprint, self_signed
from backend.shell.access.tls import Tls, given
from cockpit.entry import EntryOptions, decide

NAMES = ("127.0.0.1", "localhost", "::1", "cockpit.example")


@pytest.fixture(scope="module")
def tls(tmp_path_factory: pytest.TempPathFactory) -> Tls:
    return self_signed(tmp_path_factory.mktemp("tls"), NAMES)


@pytest.fixture
def secure(tls: Tls, users_file: Path, tmp_path: Path) -> Iterator[House]:
    with house(tmp_path, users_file, tls=tls) as running:
        running.verify = ssl.create_default_context(cafile=str(tls.cert))
        yield running


def test_pages_and_cookies_over_https(secure: House) -> None:
    with secure.client() as client:
        answer = client.post("/api/login", json={"name": "otto", "password": PASSWORD})
        cookie = answer.headers["set-cookie"]
        assert cookie.startswith("__Host-cockpit=")
        flags = ("HttpOnly", "SameSite=strict", "Path=/;", "Secure")
        assert all(flag in cookie for flag in flags), cookie
        assert client.get("/api/me").json()["who"] == "otto"
        assert client.get("/").headers["strict-transport-security"] == "max-age=31536000"
        # The name "localhost" is shared with every other program of this computer.
        local = client.get("/login", headers={"Host": "localhost"})
        assert "strict-transport-security" not in local.headers
        plain = {"Origin": secure.url.replace("https", "http")}
        marker = {"text": "x"}
        refused = client.post("/api/recording/marker", json=marker, headers=plain)
        assert refused.status_code == 403, "the same host without HTTPS is another origin"


def test_websockets_over_https(secure: House) -> None:
    # Not the client with threads: one reads while another writes, and OpenSSL allows only one of
    # them at a time, so that about one of a hundred connections is lost on the client's side.
    async def opened() -> None:
        async with connect(**secure.handshake("/ws", "otto"), ssl=secure.verify) as socket:
            assert isinstance(await asyncio.wait_for(socket.recv(), 5), bytes)
        async with connect(**secure.handshake("/view", "otto"), ssl=secure.verify) as socket:
            await asyncio.wait_for(await socket.ping(), 5)

    asyncio.run(opened())


def test_another_certificate_is_not_believed(secure: House, tmp_path: Path) -> None:
    other = self_signed(tmp_path, NAMES)
    context = ssl.create_default_context(cafile=str(other.cert))
    with pytest.raises(httpx.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
        httpx.get(f"{secure.url}/api/health", verify=context, trust_env=False)


def test_the_certificate_is_kept_and_names_its_hosts(tls: Tls) -> None:
    assert tls.key.stat().st_mode & 0o777 == 0o600
    assert tls.cert.stat().st_mode & 0o777 == 0o600
    before = tls.cert.read_bytes()
    assert self_signed(tls.cert.parent, NAMES[:2]) == tls
    assert tls.cert.read_bytes() == before
    found = x509.load_pem_x509_certificate(before)
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "cockpit.example"]
    assert [str(a) for a in names.get_values_for_type(x509.IPAddress)] == ["127.0.0.1", "::1"]
    assert len(fingerprint(tls)) == 95


def test_a_certificate_that_no_longer_serves_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = self_signed(tmp_path, ("localhost",))
    prints = [fingerprint(made)]

    def again(*names: str) -> None:
        prints.append(fingerprint(self_signed(tmp_path, names)))
        assert prints[-1] not in prints[:-1]

    again("localhost", "other.example")  # a name that it lacks
    made.key.chmod(0o644)  # others could have read it
    again("localhost")
    made.key.write_text("nonsense")
    again("localhost")
    made.cert.unlink()
    again("localhost")
    monkeypatch.setattr(certificates, "RENEW", datetime.timedelta(days=398))
    again("localhost")  # nearly over
    given(made.cert, made.key)


def test_a_given_certificate_and_the_program_s_own(tls: Tls, tmp_path: Path) -> None:
    options = EntryOptions(no_login=True, cert=tls.cert, key=tls.key)
    entry = decide(options, "127.0.0.1")
    assert entry.url(8000) == "https://127.0.0.1:8000"
    assert entry.notes()[-1] == f"Certificate (SHA-256): {fingerprint(tls)}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path))
        own = decide(EntryOptions(no_login=True, self_signed=True), "localhost").tls
    assert own is not None
    assert own.cert == tmp_path / "excavator-cockpit" / "self-signed.pem"
