"""C2PA signatures: files signed, signatures checked, by c2pa-python (the extra `c2pa`).

Nothing goes over a network: no time stamps are asked for, no manifests and no revocation lists are
fetched, and no host is allowed. A signature therefore holds as long as its certificate does. Private
keys are read into memory and written nowhere.

Source: C2PA, "Technical Specification" 2.2, sections 13 (trust model) and 14 (X.509 certificates).
"""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bakery import __version__
from bakery.errors import InputError
from bakery.formats import jumbf
from bakery.formats.files import read_bytes, replacing
from bakery.formats.ingredient import read_around
from bakery.formats.mark import PAINTED, Mark, found

LARGEST_PEM = 2**20  # bytes
NAME = "bakery"
MISSING = "signatures need c2pa-python, which is not installed: pip install 'bakery[c2pa]'"
SIGNABLE = "PNG, JPEG, WebP, MP4 and MOV files, and bundles"
SETTINGS = {
    "verify": {"remote_manifest_fetch": False, "ocsp_fetch": False, "verify_trust": True},
    "core": {"allowed_network_hosts": []},  # none, whatever else should ask
    "builder": {"thumbnail": {"enabled": False}},
}
CURVES = {"secp256r1": "es256", "secp384r1": "es384", "secp521r1": "es512"}
PROFILE = (
    "C2PA wants one that an authority issued, with the key usage digital signature and an extended "
    "usage such as email protection"
)
UNTRUSTED = "signingCredential.untrusted"
OTHER_BYTES = "assertion.dataHash.mismatch"
BESIDE = "application/json"  # kind of what a sidecar is about


@dataclass(frozen=True)
class Credentials:
    """What signs; it is kept in memory alone."""

    chain: bytes  # certificates in PEM, the signer's first
    key: bytes = field(repr=False)  # in PEM, PKCS #8
    algorithm: str  # as c2pa names it: es256, ps256, ed25519 ...


@dataclass(frozen=True)
class Signed:
    """What a signature that holds says."""

    by: str  # common name in the certificate
    organisation: str
    trusted: bool  # whether it leads to one of the anchors that were given
    generator: str  # program that made what is signed
    source_types: tuple[str, ...]  # digital source types, URLs


def library() -> Any:
    """The package c2pa.

    Raises:
        InputError: it is not installed, or not for this system.
    """
    try:
        import c2pa
    except (ImportError, OSError):
        raise InputError(MISSING) from None
    return c2pa


def read_credentials(certificate: str | Path, key: str | Path) -> Credentials:
    """A certificate and its private key from files in PEM, tried out on a few bytes.

    Args:
        certificate: the signer's first, then those that lead to the authority.
        key: not encrypted.

    Raises:
        InputError: the extra is missing, a file is none of these, they do not go together, the
            certificate is not valid today, or not of a kind that C2PA takes.
    """
    library()
    from cryptography import x509
    from cryptography.hazmat.primitives import serialization

    chain, secret = (read_bytes(path, LARGEST_PEM) for path in (certificate, key))
    if b"PRIVATE KEY-----" in chain and b"CERTIFICATE-----" in secret:
        raise InputError(
            f"{certificate}: holds a private key; give the certificate first, then the key"
        )
    try:
        own = x509.load_pem_x509_certificates(chain)[0]
    except ValueError:
        raise InputError(
            f"{certificate}: no certificate in PEM; give one, the signer's first"
        ) from None
    private = _private(key, secret)
    _check_dates(certificate, own)
    if _public(own.public_key()) != _public(private.public_key()):
        raise InputError(
            f"{key}: is not the key of {certificate}; give the pair that belongs together"
        )
    plain = private.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    credentials = Credentials(chain, plain, _algorithm(key, private))
    try:
        sign_beside(b"{}", PAINTED, credentials)
    except InputError as error:
        reason = str(error).rpartition(": ")[-1]
        raise InputError(f"{certificate}: cannot sign ({reason}); {PROFILE}") from None
    return credentials


def _private(path, data):
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives import serialization

    try:
        return serialization.load_pem_private_key(data, password=None)
    except TypeError:  # it wants a password
        raise InputError(
            f"{path}: the key is encrypted; decrypt a copy, as by `openssl pkey -in {Path(path).name}`"
        ) from None
    except (ValueError, UnsupportedAlgorithm):
        raise InputError(
            f"{path}: no private key in PEM; give the key of the certificate"
        ) from None


def _public(key):
    from cryptography.hazmat.primitives import serialization

    return key.public_bytes(
        serialization.Encoding.DER, serialization.PublicFormat.SubjectPublicKeyInfo
    )


def _check_dates(path, certificate):
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    now = datetime.now(UTC)
    if now > end:
        raise InputError(f"{path}: the certificate expired on {end:%Y-%m-%d}; get a new one")
    if now < begin:
        raise InputError(
            f"{path}: the certificate is valid from {begin:%Y-%m-%d} on; check the clock"
        )


def _algorithm(path, private):
    """How c2pa calls what a key signs with."""
    from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa

    if isinstance(private, ed25519.Ed25519PrivateKey):
        return "ed25519"
    if isinstance(private, rsa.RSAPrivateKey) and private.key_size >= 2048:
        return "ps256"
    if isinstance(private, ec.EllipticCurvePrivateKey) and private.curve.name in CURVES:
        return CURVES[private.curve.name]
    raise InputError(
        f"{path}: a key that C2PA does not take; it takes EC P-256, P-384 and P-521, Ed25519, and RSA "
        "from 2048 bits"
    )


def read_anchors(path: str | Path) -> bytes:
    """Certificates of authorities that are trusted, from a file in PEM.

    Raises:
        InputError: the extra is missing, or there is none in it.
    """
    library()
    from cryptography import x509

    data = read_bytes(path, 16 * LARGEST_PEM)
    try:
        x509.load_pem_x509_certificates(data)
    except ValueError:
        raise InputError(f"{path}: no certificates in PEM; give those of the authorities") from None
    return data


def media_type(data: bytes) -> str:
    """The kind of a file that can be signed, by its first bytes; "" for any other."""
    if data[:8] == b"\x89PNG\r\n\x1a\n":
        return "image/png"
    if data[:3] == b"\xff\xd8\xff":
        return "image/jpeg"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return "image/webp"
    if data[4:8] == b"ftyp":
        return "video/quicktime" if data[8:12] == b"qt  " else "video/mp4"
    return ""


def sign_file(
    path: str | Path, output: str | Path, credentials: Credentials, again: bool = False
) -> None:
    """Sign a file that bakery wrote; the output appears complete or not at all.

    Args:
        path: PNG, JPEG, WebP, MP4 or MOV, which carries bakery's mark.
        output: may be the file itself.
        again: whether an older signature may be replaced.

    Raises:
        InputError: of another kind, without a mark, signed already, or the disk is full.
    """
    mark, kind = found(path), media_type(read_bytes(path, 2**50, first=12))
    if not kind:
        raise InputError(f"{path}: cannot carry a signature; {SIGNABLE} can")
    if mark is None:
        raise InputError(f"{path}: carries no mark that says what it is; sign what bakery wrote")
    if not again and jumbf.find_store(read_around(path)):
        raise InputError(f"{path}: is signed already; --overwrite signs it anew")
    with replacing(output) as made, open(path, "rb") as source:
        _signed(kind, source, made, mark, credentials, str(path))


def sign_beside(
    data: bytes, mark: Mark, credentials: Credentials, says: Sequence[str] = ()
) -> bytes:
    """A C2PA manifest store about some bytes, which stands beside them.

    Args:
        data: of any kind.
        mark: what they are.
        says: what the portrait says of itself, words.

    Raises:
        InputError: it cannot be signed.
    """
    return _signed(
        BESIDE, io.BytesIO(data), io.BytesIO(), mark, credentials, "the bundle", True, says
    )


def _signed(kind, source, made, mark, credentials, where, beside=False, says=()):
    """Sign what stands in a stream into another one: the store's bytes."""
    c2pa = library()
    try:
        with _context() as context, c2pa.Builder(_claim(mark, says), context) as builder:
            if beside:
                builder.set_no_embed()
            given = c2pa.C2paSignerInfo(
                credentials.algorithm, credentials.chain, credentials.key, None
            )
            with c2pa.Signer.from_info(given) as signer:
                store: bytes = builder.sign(signer, kind, source, made)
    except c2pa.C2paError as error:
        raise InputError(f"{where}: cannot be signed: {_reason(error)}") from None
    return store


def _reason(error):
    """What c2pa says, on one line, without the names of its layers."""
    text = " ".join(str(error).split()).rpartition("Error during signing: ")[-1]
    return text.partition(": ")[2] or text


def _context(anchors=b""):
    """A context without any network."""
    c2pa = library()
    trust = {"trust": {"user_anchors": anchors.decode("latin-1")}} if anchors else {}
    return c2pa.Context(c2pa.Settings.from_dict(SETTINGS | trust))


def _claim(mark, says):
    """The claim about a file: made by a program, of what kind, and from which portrait."""
    name, _, version = mark.tool.partition(" ")
    action = {
        "action": "c2pa.created",
        "softwareAgent": {"name": name, **({"version": version} if version else {})},
        "digitalSourceType": mark.source_type,
    }
    portrait = {
        "title": "portrait",
        "instance_id": f"urn:sha256:{mark.photo}",
        "relationship": "inputTo",
        **({"description": "; ".join(says)} if says else {}),
    }
    return {
        "claim_generator_info": [{"name": NAME, "version": __version__}],
        "assertions": [{"label": "c2pa.actions", "data": {"actions": [action]}}],
        "ingredients": [portrait] if mark.photo else [],
    }


def check_file(path: str | Path, anchors: bytes = b"") -> Signed:
    """Check the signature of a file.

    Args:
        anchors: certificates in PEM that it has to lead to; none asks only whether it holds.

    Raises:
        InputError: the extra is missing, there is no signature, or it does not hold.
    """
    library()
    kind, around = media_type(read_bytes(path, 2**50, first=12)), read_around(path)
    store = jumbf.find_store(around)
    if not store:
        raise InputError(f"{path}: carries no C2PA signature; `bakery sign` makes one")
    with open(path, "rb") as file:
        said = _checked(str(path), str(path), kind or None, file, None, anchors)
    if said.generator.startswith(f"{NAME} ") and jumbf.is_loose(store, around):
        raise _changed(path, "its manifest")
    return said


def check_beside(
    where: str, beside: str, data: bytes, store: bytes, anchors: bytes = b""
) -> Signed:
    """Check a C2PA manifest store about some bytes.

    Args:
        where, beside: how messages call the bytes and the store.
        anchors: as for `check_file`.

    Raises:
        InputError: the extra is missing, or the signature does not hold.
    """
    said = _checked(where, beside, BESIDE, io.BytesIO(data), store, anchors)
    if said.generator.startswith(f"{NAME} ") and jumbf.is_loose(store):
        raise _changed(beside, "bytes that nothing vouches for")
    return said


def _checked(where, holder, kind, file, store, anchors):
    """`holder` is what the signature stands in: it changed, unless the signed bytes' hash alone differs."""
    c2pa = library()
    try:
        with (
            _context(anchors) as context,
            c2pa.Reader(kind, file, store, context=context) as reader,
        ):
            state, table = reader.get_validation_state(), json.loads(reader.json())
    except c2pa.C2paError as error:
        raise _changed(holder, _reason(error)) from None
    active = table["manifests"][table["active_manifest"]]
    failed = [one["code"] for one in table["validation_results"]["activeManifest"]["failure"]]
    if not anchors:
        failed = [code for code in failed if code != UNTRUSTED]  # nobody asked
    if "signingCredential.expired" in failed:
        raise InputError(f"{where}: the signer's certificate expired; have it signed again")
    if state not in ("Valid", "Trusted"):
        blamed = where if failed == [OTHER_BYTES] else holder
        raise _changed(blamed, ", ".join(failed) or "not valid")
    signer = active.get("signature_info", {})
    by, organisation = (_line(signer.get(key)) for key in ("common_name", "issuer"))
    if anchors and state != "Trusted":
        raise InputError(
            f"{where}: signed by {by or 'somebody'}, whom no certificate given by --trust vouches for; "
            "ask the sender for their authority's"
        )
    info = (active.get("claim_generator_info") or [{}])[0]
    generator = _line(f"{info.get('name', '')} {info.get('version', '')}")
    types = {
        _line(action["digitalSourceType"])
        for one in active.get("assertions", ())
        if one["label"].startswith(jumbf.ACTIONS)
        for action in one["data"].get("actions", ())
        if "digitalSourceType" in action
    }
    return Signed(by, organisation, state == "Trusted", generator, tuple(sorted(types)))


def _changed(where, why):
    return InputError(
        f"{where}: changed since it was signed ({why}); get it again from who signed it"
    )


def _line(text):
    """Text of a stranger on one line."""
    kept = "".join(c if c.isprintable() else " " for c in str(text or ""))
    return " ".join(kept.split())[:200]
