"""The bundle: everything that was baked, written into one folder."""

from dataclasses import replace

import numpy as np

from bakery import __version__
from bakery.bake.fitting import own_head
from bakery.export import bundle as files
from bakery.export import manifest as bundles
from bakery.export.glb import write_glb
from bakery.export.open import RIG
from bakery.export.web import web_files
from bakery.export.web.files import card_picture, small_picture
from bakery.formats import image
from bakery.formats.files import write_bytes
from bakery.formats.place import staged
from bakery.heads.file import save_head
from bakery.heads.lashes import card_rectangle, card_texels
from bakery.parallel import side_by_side
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import lay_hair
from bakery.runtime.contact_sheet import contact_sheet
from bakery.types import EXPRESSIONS

GLB_QUALITY = 95  # of the JPEG inside head.glb


def write_bundle(target, baked, options, keep_photo=False, overwrite=False):
    """Write a bundle.

    Args:
        target: the bundle's folder.
        baked: Baked.
        options: BundleOptions.
        keep_photo: whether the photo goes into the bundle.
        overwrite: whether an older bundle may be replaced.
    """
    textures = baked.textures
    head, neutral = own_head(baked.head, baked.fit)
    kept = baked.photo.encoded if keep_photo else None
    avatar = Avatar(head, neutral, baked.fit, textures, baked.masks, kept)
    with staged(target, overwrite) as folder:

        def heads():
            levels, carriers = bundles.levels_of_detail(head, neutral)
            atlas = small_picture(lay_hair(textures.neutral, textures.hair), options.glb)
            picture = image.encode_image(atlas, ".jpg", GLB_QUALITY)
            maker = f"bakery {__version__}"
            cards = None
            if card_rectangle(head) is not None:
                sheet = textures.hair[card_texels(head, len(textures.hair))]
                cards = image.encode_image(card_picture(sheet), ".png")
            write_glb(folder / "head.glb", levels, carriers, EXPRESSIONS, picture, cards, maker)
            modes = np.zeros((0, *neutral.shape), np.float32)
            save_head(folder / RIG, replace(head, mean=neutral, identity_basis=modes))
            return levels

        def web():
            packed, table = web_files(avatar, options.web)
            for name, data in packed.items():
                write_bytes(folder / name, data)
            return table

        def pictures():
            files.write_textures(folder, textures, baked.masks)
            if keep_photo:
                image.write_image(folder / "photo.png", baked.photo.encoded)

        def preview():
            image.write_image(folder / "preview.png", contact_sheet(avatar))

        jobs = (preview, web, pictures, heads)
        _, table, _, levels = side_by_side(lambda job: job(), jobs)
        manifest = bundles.manifest(baked, levels, table)
        if keep_photo:
            manifest["photo"] = "photo.png"
        files.write_manifest(folder, manifest)
