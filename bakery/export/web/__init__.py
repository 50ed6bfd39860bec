"""The copy of an avatar for browsers, as the files of web/."""

from dataclasses import dataclass

from bakery import __version__
from bakery.export.schema import VERSION
from bakery.export.web import files as web
from bakery.export.web.glb import web_glb
from bakery.export.web.head import facts, surfaces
from bakery.runtime.render import paintable
from bakery.settings import Settings, setting
from bakery.types import EXPRESSIONS


@dataclass(frozen=True)
class WebOptions(Settings):
    """How large web/ gets."""

    side: int = setting(1024, "side of the face's textures, at most", 64, 4096, unit="texels")
    quality: int = setting(95, "quality of WebP", 1, 100)
    photo: int = setting(
        1600, "longer side of the portrait, if it is kept", 64, 8192, unit="pixels"
    )
    triangles: float = setting(1.0, "share of the skin's triangles", 0.05, 1)


def web_files(avatar, options=WebOptions()):
    """Everything under web/.

    Args:
        avatar: Avatar; with a photo, the portrait goes along.
        options: WebOptions.

    Returns:
        files: path in the bundle -> bytes; and the manifest's table about the pictures.
    """
    textures = avatar.textures
    files, table = web.web_pictures(
        textures, avatar.masks, paintable(textures), avatar.photo, options
    )
    maker = f"bakery {__version__}"
    pieces = surfaces(avatar.head, avatar.neutral, options.triangles)
    files[web.HEAD] = web_glb(pieces, EXPRESSIONS, maker, textures.hair_mesh)
    about = {
        "asset": {"version": VERSION, "generator": maker},
        **facts(avatar.head, avatar.neutral, avatar.fit),
    }
    files[web.DESCRIPTION] = web.describe(table, textures, about)
    return files, table
