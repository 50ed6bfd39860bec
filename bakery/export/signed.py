"""Signed bundles: a C2PA manifest in avatar.c2pa, beside avatar.json and about it.

avatar.json holds the SHA-256 of every other file and of itself, so a signature over it covers the
whole bundle, and no file of an avatar changes by it, but for the preview, which is signed in itself:
it is what people pass on. C2PA can sign a .zip as well; players would have to unpack it, a copy of all
of it would lie on the disk, and the signature would be lost with the packing.
"""

import shutil
from pathlib import Path

from bakery.errors import BundleError
from bakery.export import bundle as bundles
from bakery.export import schema
from bakery.export.layout import PREVIEW
from bakery.export.validate import file_problems
from bakery.formats import jumbf, signing
from bakery.formats.files import read_bytes, write_bytes
from bakery.formats.ingredient import MADE_BY_AI
from bakery.formats.mark import of_manifest, type_name
from bakery.formats.place import MANIFEST, SIGNATURE, staged
from bakery.formats.signing import Credentials, Signed


def sign_preview(folder: Path, credentials: Credentials) -> None:
    """Sign the preview of a bundle, if it has one.

    Raises:
        InputError: see `signing.sign_file`.
    """
    path = folder / PREVIEW
    if path.is_file():
        signing.sign_file(path, path, credentials, again=True)


def write_signature(folder: Path, manifest: dict, credentials: Credentials) -> None:
    """Write avatar.c2pa of a bundle whose files and manifest are complete.

    Raises:
        BundleError: the manifest says nothing of how the avatar was made, as before version 1.0.
        InputError: it cannot be signed.
    """
    mark = of_manifest(manifest)
    if mark is None:
        raise BundleError(f"{folder}: does not say how it was made; make the bundle again")
    said = manifest["provenance"].get("ingredients", [])
    types = [url for one in said for url in _types(one) if type_name(url) in MADE_BY_AI]
    data = read_bytes(folder / MANIFEST)
    store = signing.sign_beside(data, mark, credentials, sorted(set(types)))
    write_bytes(folder / SIGNATURE, store)


def _types(ingredient):
    """The source types that an input names for itself."""
    claimed = ingredient.get("c2pa", {}).get("digitalSourceTypes", [])
    return [ingredient.get("digitalSourceType", ""), *claimed]


def sign_bundle(
    bundle: Path, output: Path, credentials: Credentials, overwrite: bool = False
) -> None:
    """A bundle, signed; it takes its place when it is complete.

    Args:
        output: may be the bundle itself.
        overwrite: whether an older signature, or a bundle at another place, may be replaced.

    Raises:
        BakeryError: the bundle is damaged or signed already, the place is taken, or the disk is full.
    """
    same = output.exists() and output.samefile(bundle)
    manifest, files = _whole(bundle)
    if (bundle / SIGNATURE).exists() and not overwrite:
        raise BundleError(f"{bundle}: is signed already; --overwrite signs it anew")
    with staged(output, overwrite or same) as folder:
        for name in (MANIFEST, *files):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(bundle / name, folder / name)
        sign_preview(folder, credentials)
        listed = {entry["path"]: entry for entry in bundles.list_files(folder)}
        for entry in manifest["files"]:
            entry |= {key: listed[entry["path"]][key] for key in ("bytes", "sha256")}
        write_bytes(folder / MANIFEST, schema.seal(manifest))
        write_signature(folder, manifest, credentials)


def _whole(bundle):
    """The manifest of a bundle and the names of its files, all of which are what was written."""
    manifest = bundles.read_manifest(bundle)
    found, good = file_problems(bundle, manifest)
    if found:
        raise BundleError(f"{bundle}: {found[0]}; make the bundle again")
    return manifest, good


def verify_bundle(bundle: Path, anchors: bytes = b"") -> Signed:
    """Check the signature of a bundle: that of its manifest, and every file by its hash.

    Args:
        anchors: see `signing.check_file`.

    Raises:
        BakeryError: the extra is missing, there is no signature, or anything is not what was signed.
    """
    signing.library()
    path, place = bundle / MANIFEST, bundle / SIGNATURE
    if not place.is_file():
        bundles.read_manifest(bundle)  # whether it is a bundle at all
        raise BundleError(f"{bundle}: carries no {SIGNATURE}; `bakery sign` makes one")
    data, store = read_bytes(path), read_bytes(place, jumbf.LARGEST)
    said = signing.check_beside(str(path), str(place), data, store, anchors)
    manifest = bundles.read_manifest(bundle)
    found, _ = file_problems(bundle, manifest)
    if found:
        raise BundleError(f"{bundle}: {found[0]}; get the bundle again from who signed it")
    return said
