"""A certificate for HTTPS that this program signs itself and keeps."""

from __future__ import annotations

import datetime
import ipaddress
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from backend.errors import InputError
from backend.shell.access.places import others_may, write_private
from backend.shell.access.tls import Tls, given

LASTS = datetime.timedelta(days=397)  # the longest that browsers take
RENEW = datetime.timedelta(days=30)  # before its end a new one is made


def self_signed(folder: Path, names: tuple[str, ...]) -> Tls:
    """This program's own certificate in a folder, made anew when it is nearly over, cannot be
    read, or lacks a name. names: host names and addresses. Raises InputError.
    """
    found = Tls(folder / "self-signed.pem", folder / "self-signed.key")
    if not _usable(found, names):
        cert, key = _make(names)
        try:
            write_private(found.key, key)
            write_private(found.cert, cert)
        except OSError as error:
            raise InputError(
                f"--self-signed: {folder} cannot be written: {error.strerror}."
            ) from None
    return found


def fingerprint(tls: Tls) -> str:
    """SHA-256 of a certificate, as browsers show it."""
    certificate = x509.load_pem_x509_certificate(tls.cert.read_bytes())
    return certificate.fingerprint(hashes.SHA256()).hex(":").upper()


def _usable(tls: Tls, names: tuple[str, ...]) -> bool:
    try:
        if others_may(tls.key):
            return False
        given(tls.cert, tls.key)
        certificate = x509.load_pem_x509_certificate(tls.cert.read_bytes())
        known = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, InputError, x509.ExtensionNotFound):
        return False
    now = datetime.datetime.now(datetime.UTC)
    return certificate.not_valid_after_utc - now > RENEW and set(_general(names)) <= set(known)


def _make(names: tuple[str, ...]) -> tuple[bytes, bytes]:
    """Certificate and private key, in PEM."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Excavator cockpit")])
    now = datetime.datetime.now(datetime.UTC)
    identifier = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))
        .not_valid_after(now + LASTS - datetime.timedelta(hours=2))
        .add_extension(x509.SubjectAlternativeName(_general(names)), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(identifier, critical=False)
        .sign(key, hashes.SHA256())
    )
    private = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    return certificate.public_bytes(serialization.Encoding.PEM), private


def _general(names: tuple[str, ...]) -> list[x509.GeneralName]:
    found: list[x509.GeneralName] = []
    for name in dict.fromkeys(names):
        try:
            found.append(x509.IPAddress(ipaddress.ip_address(name)))
        except ValueError:
            found.append(x509.DNSName(name))
    return found
