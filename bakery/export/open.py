"""A bundle from disk, ready to be played."""

from dataclasses import replace
from pathlib import Path

from bakery.errors import BundleError, ModelError
from bakery.export import bundle as bundles
from bakery.export import hostile
from bakery.export.layout import RIG
from bakery.formats import record
from bakery.heads.file import load_head
from bakery.runtime.avatar import Avatar
from bakery.types import Maker


def open_avatar(path):
    """A bundle, ready to be played; it needs nothing but itself.

    Raises:
        BundleError: damaged.
    """
    manifest = bundles.read_manifest(path)
    hostile.refuse(path, manifest)
    bundles.read_file(path, manifest, RIG)  # is it what was written?
    try:
        head = load_head(Path(path) / RIG)
    except ModelError as error:
        raise BundleError(str(error)) from None
    textures, masks = bundles.read_textures(path, manifest)
    textures = replace(textures, maker=_maker(manifest["provenance"]))
    fit = record.fit_from_table(path, manifest["fit"])
    photo = bundles.read_photo(path, manifest) if "photo" in manifest else None
    return Avatar(head, head.mean, fit, textures, masks, photo)


def _maker(provenance):
    """The generator that a bundle names."""
    known = provenance.get("models", {}).get("generator", {})
    source_type = provenance["digitalSourceType"].rpartition("/")[2]
    return Maker(provenance["generator"], **known, source_type=source_type)
