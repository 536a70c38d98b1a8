"""A site's own certificate authority, and what can be said of a certificate before it is used."""

from __future__ import annotations

import contextlib
import ipaddress
import os
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from backend.errors import InputError

CA_DAYS = 3650
EARLY = timedelta(days=1)  # valid before it was made: machines' clocks may be late
LONGEST_NAME = 64  # of a common name, by X.509
CA_CERTIFICATE, CERTIFICATE, KEY = "ca.pem", "certificate.pem", "key.pem"


@dataclass(frozen=True)
class Authority:
    """The certificate and key with which a site's certificates are signed."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @property
    def pem(self) -> bytes:
        return self.certificate.public_bytes(serialization.Encoding.PEM)


def make_authority(name: str) -> Authority:
    """A new one. name: of the site."""
    key = ec.generate_private_key(ec.SECP256R1())
    title = _name(f"{name} link authority"[:LONGEST_NAME])
    builder = (
        _builder(title, title, key.public_key(), CA_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs=True), critical=True)
    )
    return Authority(builder.sign(key, hashes.SHA256()), key)


def read_authority(folder: Path) -> Authority:
    """What `write_authority` wrote. Raises InputError."""
    certificate = read_certificate(folder / CA_CERTIFICATE)
    path = folder / KEY
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), None)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except (ValueError, TypeError):
        raise InputError(f"{path}: is not a private key in PEM.") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey) or key.public_key() != (
        certificate.public_key()
    ):
        raise InputError(f"{path}: is not the key of {folder / CA_CERTIFICATE}.")
    return Authority(certificate, key)


def write_authority(folder: Path, authority: Authority) -> None:
    """ca.pem and key.pem (0600) in a folder that only its owner may enter."""
    private_folder(folder)
    (folder / CA_CERTIFICATE).write_bytes(authority.pem)
    write_private(folder / KEY, _key_pem(authority.key))


def issue(folder: Path, authority: Authority, name: str, hosts: Iterable[str], days: int) -> None:
    """Writes a party's certificate.pem, key.pem (0600) and ca.pem.

    name: the common name, which access control goes by; hosts: names and addresses under which it
    is connected to.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    names = [_general_name(host) for host in dict.fromkeys([*hosts, name])]
    subject = authority.certificate.subject
    builder = (
        _builder(_name(name), subject, key.public_key(), days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs=False), critical=True)
        .add_extension(
            x509.ExtendedKeyUsage(
                [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
            ),
            critical=False,
        )
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
    )
    certificate = builder.sign(authority.key, hashes.SHA256())
    private_folder(folder)
    (folder / CA_CERTIFICATE).write_bytes(authority.pem)
    (folder / CERTIFICATE).write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    write_private(folder / KEY, _key_pem(key))


def read_certificate(path: Path) -> x509.Certificate:
    """The first certificate of a PEM file. Raises InputError when it is not one, or not valid."""
    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except ValueError:
        raise InputError(f"{path}: is not a certificate in PEM.") from None
    now = datetime.now(UTC)
    if now > certificate.not_valid_after_utc:
        end = certificate.not_valid_after_utc.date()
        raise InputError(
            f"{path}: the certificate expired on {end}; `cockpit keys --renew` makes new ones."
        )
    if now < certificate.not_valid_before_utc:
        begin = certificate.not_valid_before_utc.date()
        raise InputError(
            f"{path}: the certificate is valid from {begin} on; is this computer's clock right?"
        )
    return certificate


def private_folder(folder: Path) -> None:
    """A folder (0700), made where there is none. Raises InputError."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}.") from None


def write_private(path: Path, content: bytes) -> None:
    """A file (0600) that was never readable by others, not even while it was written."""
    part = path.with_name(path.name + ".part")
    with contextlib.suppress(FileNotFoundError):
        part.unlink()
    with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)
    part.replace(path)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, days: int
) -> x509.CertificateBuilder:
    now = datetime.now(UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLY)
        .not_valid_after(now + timedelta(days=days))
    )


def _usage(signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs,
        key_cert_sign=signs,
        crl_sign=signs,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _name(common: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host.strip("[]")))
    except ValueError:
        return x509.DNSName(host)


def _key_pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
