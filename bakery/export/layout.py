"""What stands in which file of a bundle, and in which part of it."""

import math

RIG = "head.npz"  # the person as a head model without identity modes, for the runtime
PREVIEW = "preview.png"
WEB = "web"  # folder of all that a browser needs
ROLES = {
    "head.glb": "geometry",
    RIG: "geometry",
    "proxies.glb": "proxies",
    "face.exr": "face",
    "masks.exr": "masks",
    "hair.exr": "hair",
    "hair_cards.exr": "hair",
    "hair_mesh.npz": "hair",
    "albedo.exr": "albedo",
    "coverage.exr": "coverage",
    "gaze.exr": "gaze",
    "mouth.exr": "mouth",
    PREVIEW: "preview",
    "photo.png": "photo",
}
SOURCES = {0: "none", 1: "observed", 2: "mirrored", 3: "inferred", 4: "painted"}
PICTURES = ("face", "gaze", "masks", "coverage", "hair")  # files whose parts are opened all at once
SHEET = (10, 6)  # columns and rows of the mouths in a part of mouth.exr, at most
CONVENTIONS = {
    "units": "millimetres; metres in *.glb",
    "axes": "right-handed, +x the subject's left, +y up, +z out of the face",
    "uv": "origin top left, rows run down, texel centres at +0.5",
    "textures": "scene-linear Rec.709 half float (lin_rec709_scene); web/ is sRGB-encoded",
    "gaze": "degrees, yaw to the subject's left, pitch up",
    "weights": "0 to 1, ARKit names, left and right are the subject's",
}


def is_opened(name: str) -> bool:
    """Whether players open a file; others belong to extras or an extension, and are left alone."""
    return name in ROLES or name.startswith(f"{WEB}/")


def gaze_parts(count: int) -> list[str]:
    """Names of the parts of gaze.exr."""
    return [f"gaze{index:02d}" for index in range(count)]


def mouth_grid(count: int) -> tuple[int, int]:
    """Columns and rows of the cells of each part of mouth.exr."""
    columns = min(count, SHEET[0])
    return columns, min(math.ceil(count / columns), SHEET[1])


def mouth_parts(count: int) -> list[str]:
    """Names of the parts of mouth.exr, by the first and the last mouth that is in them."""
    size = math.prod(mouth_grid(count))
    return [
        f"mouths{first:03d}_{min(first + size, count) - 1:03d}" for first in range(0, count, size)
    ]
