"""A bundle from disk, ready to be played."""

from pathlib import Path

from bakery.errors import BundleError, ModelError
from bakery.export import bundle as files
from bakery.export import hostile
from bakery.export.layout import RIG
from bakery.export.schema import read_version
from bakery.formats import record
from bakery.heads.file import load_head
from bakery.runtime.avatar import Avatar
from bakery.stages.texture.tongue import comes_out, seat_tongue


def open_avatar(path):
    """A bundle, ready to be played; it needs nothing but itself.

    Raises:
        BundleError: damaged.
    """
    manifest = files.read_manifest(path)
    hostile.refuse(path, manifest)
    files.read_file(path, manifest, RIG)  # is it what was written?
    try:
        head = load_head(Path(path) / RIG)
    except ModelError as error:
        raise BundleError(str(error)) from None
    if read_version(path, manifest) == 0 and not comes_out(head):
        head = seat_tongue(head, head.mean)  # it was not drawn when that was baked
    textures, masks = files.read_textures(path, manifest)
    fit = record.fit_from_table(path, manifest["fit"])
    photo = files.read_photo(path, manifest) if "photo" in manifest else None
    return Avatar(head, head.mean, fit, textures, masks, photo)
