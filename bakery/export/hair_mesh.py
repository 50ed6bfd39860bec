"""Hair with volume in a bundle: its arrays, and the pictures of its atlas."""

from collections.abc import Mapping

import numpy as np

from bakery.formats import exr, npz
from bakery.types import HAIR_KINDS, HAIR_TRIANGLES, HairMesh

MESH, ATLAS = "hair_mesh.npz", "hair_cards.exr"  # files
# Arrays of MESH, each a number of this kind; parts of ATLAS, each with its colorInteropID.
ARRAYS = {
    "vertices": np.float32, "faces": np.int32, "uv": np.float32, "kind": np.uint8,
    "card": np.int32, "levels": np.uint8, "hang": np.float32,
}  # fmt: skip
PARTS = {
    "texture": ("RGBA", exr.LINEAR), "direction_x": ("Y", exr.DATA), "direction_y": ("Y", exr.DATA),
    "root_to_tip": ("Y", exr.DATA), "source": ("Y", exr.DATA),
}  # fmt: skip
LARGEST = 16 * 2**20  # bytes of MESH, unpacked: fifty times what hair takes
LAYOUT = (
    "triangles in head space, mm: an opaque cap, then card by card from the skull outwards; uv, kind "
    "(0 cap, 1 card, 2 fringe), card (-1: the cap), levels (bit 0: the finest shows it), hang; colour "
    "multiplied by alpha, the photo's light in it; direction along the strand, x right, y down"
)


def table(mesh: HairMesh) -> dict:
    """What the manifest says of hair with volume."""
    return {
        "file": MESH,
        "atlas": ATLAS,
        "parts": list(PARTS),
        "kinds": list(HAIR_KINDS),
        "triangles": [int(mesh.shown(level).sum()) for level in range(len(HAIR_TRIANGLES))],
        "cards": len(np.unique(mesh.card[mesh.card >= 0])),
        "layout": LAYOUT,
    }


def arrays(mesh: HairMesh) -> dict[str, np.ndarray]:
    """What stands in MESH."""
    return {name: np.asarray(getattr(mesh, name), kind) for name, kind in ARRAYS.items()}


def pictures(mesh: HairMesh) -> dict[str, np.ndarray]:
    """What stands in ATLAS."""
    along = mesh.direction
    own = {"direction_x": along[..., 0], "direction_y": along[..., 1]}
    return {name: own[name] if name in own else getattr(mesh, name) for name in PARTS}


def assembled(data: bytes, parts: Mapping[str, np.ndarray]) -> HairMesh:
    """The hair of the bytes of MESH and the parts of ATLAS.

    Raises:
        KeyError, ValueError: they are not that.
    """
    found = npz.unpack_arrays(data, LARGEST)
    for name, kind in ARRAYS.items():
        if found[name].dtype != kind:
            raise ValueError(f"{name} is {found[name].dtype}, needs {np.dtype(kind)}")
    return HairMesh(
        **{name: found[name] for name in ARRAYS},
        texture=parts["texture"],
        direction=np.stack([parts["direction_x"], parts["direction_y"]], -1),
        root_to_tip=parts["root_to_tip"],
        source=parts["source"].astype(np.uint8),
    )
