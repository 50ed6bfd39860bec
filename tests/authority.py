"""An authority and the signers that it certifies, made for a test run; see `authority` in conftest."""

import datetime
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

PEM = serialization.Encoding.PEM
KEYS = {
    "p256": lambda: ec.generate_private_key(ec.SECP256R1()),
    "p384": lambda: ec.generate_private_key(ec.SECP384R1()),
    "ed25519": ed25519.Ed25519PrivateKey.generate,
    "rsa": lambda: rsa.generate_private_key(65537, 2048),
    "rsa-short": lambda: rsa.generate_private_key(65537, 1024),
    "k256": lambda: ec.generate_private_key(ec.SECP256K1()),
}


@dataclass(frozen=True)
class Signer:
    """Paths of what signs."""

    chain: Path
    key: Path
    anchors: Path  # of the authority


class Authority:
    """Certifies signers into a folder."""

    def __init__(self, folder: Path, name: str = "Test authority"):
        self.folder, self.name, self.key = folder, name, KEYS["p256"]()
        usage = _usage(key_cert_sign=True, crl_sign=True)
        own = _begun(self.name, self.name, self.key.public_key(), (-10, 3650))
        own = own.add_extension(x509.BasicConstraints(True, None), True)
        own = own.add_extension(usage, True)
        own = own.add_extension(
            x509.SubjectKeyIdentifier.from_public_key(self.key.public_key()), False
        )
        self.certificate = own.sign(self.key, hashes.SHA256())
        self.anchors = folder / f"{name}.pem"
        self.anchors.write_bytes(self.certificate.public_bytes(PEM))

    def signer(self, name="signer", kind="p256", days=(-1, 365), usable=True, password=None):
        """A Signer whose certificate is valid from one day to another, counted from today.

        Args:
            kind: of KEYS; usable: whether C2PA takes the certificate; password: of the key's file.
        """
        key = KEYS[kind]()
        made = _begun(name, self.name, key.public_key(), days)
        made = made.add_extension(x509.BasicConstraints(False, None), True)
        made = made.add_extension(_usage(digital_signature=True), True)
        if usable:
            made = made.add_extension(
                x509.ExtendedKeyUsage([ExtendedKeyUsageOID.EMAIL_PROTECTION]), False
            )
        above = x509.AuthorityKeyIdentifier.from_issuer_public_key(self.key.public_key())
        certificate = made.add_extension(above, False).sign(self.key, hashes.SHA256())
        chain, place = self.folder / f"{name}-chain.pem", self.folder / f"{name}-key.pem"
        chain.write_bytes(certificate.public_bytes(PEM) + self.certificate.public_bytes(PEM))
        locked = (
            serialization.BestAvailableEncryption(password)
            if password
            else serialization.NoEncryption()
        )
        place.write_bytes(key.private_bytes(PEM, serialization.PrivateFormat.PKCS8, locked))
        return Signer(chain, place, self.anchors)


def _begun(name, issuer, key, days):
    now = datetime.datetime.now(datetime.UTC)
    first, last = (now + datetime.timedelta(days=day) for day in days)
    return (
        x509.CertificateBuilder()
        .subject_name(_named(name))
        .issuer_name(_named(issuer))
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(first)
        .not_valid_after(last)
    )


def _named(name):
    return x509.Name(
        [
            x509.NameAttribute(NameOID.COMMON_NAME, name),
            x509.NameAttribute(NameOID.ORGANIZATION_NAME, "Test studio"),
        ]
    )


def _usage(**of):
    names = (
        "digital_signature", "content_commitment", "key_encipherment", "data_encipherment",
        "key_agreement", "key_cert_sign", "crl_sign", "encipher_only", "decipher_only",
    )  # fmt: skip
    return x509.KeyUsage(**{name: of.get(name, False) for name in names})
