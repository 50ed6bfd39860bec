"""The bundle for browsers: small sRGB pictures, the head packed by meshopt, one description.

The folder web/ needs nothing from outside it, and its description repeats what a player needs of the
manifest, so that it can be served alone.
"""

import cv2
import numpy as np

from bakery.export.layout import WEB
from bakery.formats import record
from bakery.formats.image import encode_image
from bakery.geometry.color import to_encoded
from bakery.geometry.fill import diffuse
from bakery.types import EXPRESSIONS

FOLDER = WEB
DESCRIPTION = f"{FOLDER}/avatar.json"
HEAD = f"{FOLDER}/player.glb"  # for our player alone: without pictures, with proxies, packed
OLD_HEAD = "head.glb"  # its name in 1.0, whose description does not state it
MASK_SIDE = 256  # texels; they are smooth
DATA_SIDE = 512  # texels of the coverage, at most
SOURCE_STEP = 60  # of 255, between the kinds of source
CELLS = 16383  # pixels, the longest side of a WebP file


def web_pictures(textures, masks, paintable, photo, options):
    """The pictures of web/.

    Args:
        textures: Textures.
        masks: [E, m, m] float32 0..1.
        paintable: [T, T] float32: where skin comes from the photo (runtime.render.paintable).
        photo: [H, W, 3] float32 sRGB-encoded, or None.
        options: WebOptions of the bundle: `side`, `quality`, `photo`.

    Returns:
        files: path in the bundle -> bytes; and the manifest's table: name -> grid of pictures.
    """
    made = _Pictures(options.quality)
    resolution = min(options.side, textures.neutral.shape[0])
    faces = {"neutral": textures.neutral} | dict(zip(textures.key_names, textures.keys))
    for name, texture in faces.items():
        made.add(name, small_picture(texture, resolution), ".webp")
    ratio = resolution / textures.neutral.shape[0]
    made.grid("gaze", _encoded(textures.gaze, ratio), _numbered("gaze", textures.gaze, 2), ".webp")
    made.grid(
        "mouths", _encoded(textures.mouths, ratio), _numbered("mouth", textures.mouths, 3), ".webp"
    )
    made.grid("masks", [_shrink(mask, MASK_SIDE) for mask in masks], EXPRESSIONS, ".png")
    made.add("coverage", _coverage(textures, paintable, min(resolution, DATA_SIDE)), ".png")
    if np.any(textures.hair):
        made.add("hair", straight_alpha(small_layer(textures.hair, resolution)), ".webp")
    if textures.hair_mesh is not None:
        layer = small_layer(textures.hair_mesh.texture, options.side)
        made.add("hair_cards", straight_alpha(layer), ".webp")
    if photo is not None:
        made.add("photo", _within(photo, options.photo), ".webp")
    return made.files, made.table


class _Pictures:
    """Collects encoded pictures and the table about them."""

    def __init__(self, quality):
        self.quality = quality
        self.files = {}
        self.table = {}

    def add(self, name, picture, kind, columns=1, rows=1, names=None):
        path = f"{FOLDER}/{name}{kind}"
        self.files[path] = encode_image(picture, kind, self.quality)
        self.table[name] = {
            "file": path, "columns": columns, "rows": rows, "names": list(names or [name]),
        }  # fmt: skip

    def grid(self, name, pictures, names, kind):
        """Pictures of one size side by side, in about a square."""
        height, width = pictures[0].shape[:2]
        columns = max(1, min(round(np.sqrt(len(pictures) * height / width)), CELLS // width))
        rows = -(-len(pictures) // columns)
        out = np.zeros((rows * height, columns * width) + pictures[0].shape[2:], np.float32)
        for index, picture in enumerate(pictures):
            top, left = index // columns * height, index % columns * width
            out[top : top + height, left : left + width] = picture
        self.add(name, out, kind, columns, rows, names)


def _numbered(word, pictures, digits):
    return [f"{word}{index:0{digits}d}" for index in range(len(pictures))]


def small_picture(texture, resolution):
    """A linear texture [T, T, 3] as an sRGB-encoded picture of at most `resolution` texels a side."""
    return to_encoded(_shrink(np.asarray(texture, np.float32), resolution))


def small_layer(layer, resolution):
    """A linear layer [T, T, 4], colour multiplied by alpha, of at most `resolution` texels a side."""
    return _shrink(np.asarray(layer, np.float32), resolution)


def straight_alpha(layer):
    """A linear layer premultiplied by alpha [T, T, 4] as sRGB-encoded colour and alpha.

    Colour goes on where the layer is clear: lossy packing spreads it over the border.
    """
    color, alpha = layer[..., :3], np.clip(layer[..., 3], 0, 1)
    color = color / np.maximum(alpha, 1e-3)[..., None]
    return np.dstack([to_encoded(diffuse(color, alpha)), alpha])


def card_picture(layer):
    """`straight_alpha` of a piece of a layer [h, w, 4], its sides grown to powers of two.

    glTF's validator, and old graphics cards, want those of a texture with mipmaps.
    """
    size = [1 << int(np.ceil(np.log2(length))) for length in layer.shape[1::-1]]
    return straight_alpha(cv2.resize(np.float32(layer), size, interpolation=cv2.INTER_LINEAR))


def _coverage(textures, paintable, resolution):
    """Red: where the photo is known; green: the kind of source; blue: how squarely it was seen."""
    size = textures.source.shape[0]
    pick = (np.arange(resolution) * size // resolution) + size // resolution // 2
    source = textures.source[np.ix_(pick, pick)] * SOURCE_STEP
    smooth = [
        _shrink(np.asarray(plane, np.float32), resolution) for plane in (paintable, textures.facing)
    ]
    return np.dstack([_bytes(smooth[0]), source.astype(np.uint8), _bytes(smooth[1])])


def _bytes(plane):
    return (np.clip(plane, 0, 1) * 255 + 0.5).astype(np.uint8)


def _shrink(picture, resolution):
    if picture.shape[0] <= resolution:
        return np.asarray(picture, np.float32)
    return cv2.resize(picture, (resolution, resolution), interpolation=cv2.INTER_AREA)


def _within(photo, longest):
    height, width = photo.shape[:2]
    scale = longest / max(height, width)
    if scale >= 1:
        return photo
    size = (round(width * scale), round(height * scale))
    return cv2.resize(photo, size, interpolation=cv2.INTER_AREA)


def _encoded(pictures, ratio):
    """Linear pictures [n, h, w, 3] at `ratio` of their size, sRGB-encoded."""
    pictures = [np.asarray(picture, np.float32) for picture in pictures]
    if ratio != 1:
        pictures = [
            cv2.resize(picture, None, fx=ratio, fy=ratio, interpolation=cv2.INTER_AREA)
            for picture in pictures
        ]
    return [to_encoded(picture) for picture in pictures]


def head_path(description: dict) -> str:
    """Where the head of a description for browsers stands in the bundle."""
    return f"{FOLDER}/{description.get('geometry', OLD_HEAD)}"


def describe(table, textures, facts):
    """The bytes of web/avatar.json.

    Args:
        table: of `web_pictures`.
        textures: Textures.
        facts: what stages.web.facts says of the head.
    """
    return record.dump(
        {
            "$schema": "urn:bakery:schema:web-1",
            **facts,
            "geometry": HEAD.removeprefix(FOLDER + "/"),
            "expressions": list(EXPRESSIONS),
            "keys": [
                {"name": name, "weights": record.numbers(weights, 6)}
                for name, weights in zip(textures.key_names, textures.key_weights)
            ],
            "gaze": record.numbers(textures.gaze_directions, 4),
            "mouths": record.numbers(
                textures.mouth_landmarks.reshape(len(textures.mouth_landmarks), -1), 5
            ),
            "atlases": {
                name: entry | {"file": entry["file"].removeprefix(FOLDER + "/")}
                for name, entry in table.items()
            },
        }
    )
