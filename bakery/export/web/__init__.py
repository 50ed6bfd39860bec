"""The copy of an avatar for browsers, as the files of web/."""

from dataclasses import dataclass

from bakery import __version__
from bakery.errors import InputError
from bakery.export.schema import VERSION
from bakery.export.web import files as web
from bakery.export.web.glb import web_glb
from bakery.export.web.head import facts, surfaces
from bakery.runtime.render import paintable
from bakery.types import EXPRESSIONS


@dataclass(frozen=True)
class WebOptions:
    """How large web/ gets."""

    side: int = 1024  # texels on a side of the face's textures, at most
    quality: int = 95  # of WebP, 1 to 100
    photo: int = 1600  # pixels on the longer side of the portrait, if it is kept
    triangles: float = 1.0  # share of the skin's triangles

    def __post_init__(self):
        if not (64 <= self.side <= 4096 and 1 <= self.quality <= 100 and 64 <= self.photo <= 8192):
            raise InputError(
                f"bundle.web: side {self.side}, quality {self.quality}, photo {self.photo}; "
                "give 64..4096, 1..100 and 64..8192"
            )
        if not 0.05 <= self.triangles <= 1:
            raise InputError(f"bundle.web: triangles {self.triangles}; give 0.05..1")


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
    files[web.HEAD] = web_glb(pieces, EXPRESSIONS, maker)
    about = {
        "asset": {"version": VERSION, "generator": maker},
        **facts(avatar.head, avatar.neutral, avatar.fit),
    }
    files[web.DESCRIPTION] = web.describe(table, textures, about)
    return files, table
