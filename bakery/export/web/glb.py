"""The head for browsers: one level of detail, shapes of 16 bits, packed by meshopt.

Positions and uv stay floats, so that a player meets the reference; they are a tenth of the file.
"""

import numpy as np

from bakery.export.glb import CLEAR
from bakery.export.glb_data import METRES
from bakery.formats import meshopt
from bakery.formats.glb import joined
from bakery.runtime.hair_cards import CAP, soft_normals
from bakery.types import HAIR_TRIANGLES

BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5120, 5122, 5123, 5125, 5126
ARRAY, ELEMENTS = 34962, 34963
HAIR = "hair"  # node and mesh
STILL = 0.005  # mm; a vertex that moves less is at rest
STEPS = 32767  # of a shape, from rest to the farthest that anything moves


def web_glb(surfaces, shape_names, generator, hair=None):
    """The bytes of a GLB file.

    Args:
        surfaces: glb.Surface of each piece; the piece's name is its material's.
        shape_names: [E] names of the morph targets.
        generator: name and version of the program.
        hair: HairMesh, or None: the mesh `hair`, of primitives that share their vertices.

    Returns:
        bytes; needs KHR_mesh_quantization and EXT_meshopt_compression.
    """
    reach = max(float(np.abs(piece.shapes).max()) for piece in surfaces)  # mm, one unit of the node
    made = _Packer()
    primitives = [_primitive(made, piece, number, reach) for number, piece in enumerate(surfaces)]
    materials = [_material(piece.name) for piece in surfaces]
    nodes = [{"name": "head", "mesh": 0, "scale": [reach * METRES] * 3}]
    meshes = [
        {
            "name": "head",
            "primitives": primitives,
            "weights": [0.0] * len(shape_names),
            "extras": {"targetNames": list(shape_names)},
        }
    ]
    if hair is not None:
        nodes.append({"name": HAIR, "mesh": 1, "scale": [METRES] * 3})
        meshes.append({"name": HAIR, "primitives": _hair_primitives(made, hair, len(materials))})
        materials += [_material("hair_cap"), _material("hair_cards")]
    document = {
        "asset": {"version": "2.0", "generator": generator},
        "extensionsUsed": [
            "EXT_meshopt_compression", "KHR_materials_unlit", "KHR_mesh_quantization",
        ],
        "extensionsRequired": ["EXT_meshopt_compression", "KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{"name": "head", "nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": made.accessors,
        "bufferViews": made.views,
        "buffers": [
            {"byteLength": len(made.data)},
            {
                "byteLength": made.unpacked,
                "extensions": {"EXT_meshopt_compression": {"fallback": True}},
            },
        ],
    }  # fmt: skip
    return joined(document, bytes(made.data))


def _primitive(made, piece, material, reach):
    normals = np.asarray(piece.normals, np.float64)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    short = piece.faces.max() < 65535
    return {
        "attributes": {
            "POSITION": made.vectors(np.float32(piece.vertices / reach), FLOAT, limits=True),
            "NORMAL": made.vectors(_rounded(normals, 127, np.int8), BYTE, normalized=True),
            "TEXCOORD_0": made.vectors(np.float32(piece.uv), FLOAT),
        },
        "indices": made.indices(piece.faces.ravel(), UNSIGNED_SHORT if short else UNSIGNED_INT),
        "material": material,
        "targets": [
            {
                "POSITION": made.vectors(
                    _rounded(_resting(shape) / reach, STEPS, np.int16),
                    SHORT,
                    normalized=True,
                    limits=True,
                )
            }
            for shape in piece.shapes
        ],
    }


def _hair_primitives(made, mesh, material):
    """Cap and cards of each level of detail; their materials begin at the number `material`.

    `extras` say the level, and of how many triangles each card is made, in the order of the indices:
    players sort cards by the view, fringe among them.
    """
    normals = _rounded(soft_normals(mesh).astype(np.float64), 127, np.int8)
    attributes = {
        "POSITION": made.vectors(np.float32(mesh.vertices), FLOAT, limits=True),
        "NORMAL": made.vectors(normals, BYTE, normalized=True),
        "TEXCOORD_0": made.vectors(np.float32(mesh.uv), FLOAT),
    }
    kind = UNSIGNED_SHORT if len(mesh.vertices) < 65536 else UNSIGNED_INT
    primitives = []
    for level in range(len(HAIR_TRIANGLES)):
        shown = mesh.shown(level)
        for number, mine in enumerate((mesh.kind == CAP, mesh.kind != CAP)):
            found = np.flatnonzero(shown & mine)
            if not len(found):
                continue
            ends = np.flatnonzero(np.diff(mesh.card[found], append=-2))
            primitives.append(
                {
                    "attributes": attributes,
                    "indices": made.indices(mesh.faces[found].ravel(), kind),
                    "material": material + number,
                    "extras": {
                        "level": level,
                        "cards": np.diff(ends, prepend=-1).tolist() if number else [],
                    },
                }
            )
    return primitives


def _material(name):
    clear = {"alphaMode": "BLEND"} if name in CLEAR or name == "hair_cards" else {}
    return {
        "name": name,
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9},
        "extensions": {"KHR_materials_unlit": {}},
        **clear,
        **({"doubleSided": True} if clear or name.startswith("hair") else {}),
    }


def _resting(shape):
    return np.where(np.linalg.norm(shape, axis=1, keepdims=True) > STILL, shape, 0)


def _rounded(values, steps, kind):
    """Values -1..1 [N, 3] as whole steps, with a fourth column that fills the entry to four."""
    out = np.zeros((len(values), 4), kind)
    out[:, :3] = np.rint(values * steps)
    return out


class _Packer:
    """Collects packed streams, their views and accessors."""

    def __init__(self):
        self.data = bytearray()
        self.unpacked = 0  # bytes of the buffer that a decoder fills
        self.views = []
        self.accessors = []

    def vectors(self, array, kind, normalized=False, limits=False):
        """Append [N, 2, 3 or 4]; a fourth column is padding. Returns the accessor's index."""
        width = min(array.shape[1], 3)
        view = self._view(meshopt.encode_vertices(array), array, "ATTRIBUTES", ARRAY)
        accessor = {
            "bufferView": view, "componentType": kind, "count": len(array), "type": f"VEC{width}",
        }  # fmt: skip
        if normalized:
            accessor["normalized"] = True
        if limits:
            accessor["min"] = array[:, :width].min(0).tolist()
            accessor["max"] = array[:, :width].max(0).tolist()
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def indices(self, flat, kind):
        """Append indices [N]; returns the accessor's index."""
        array = np.ascontiguousarray(flat, np.uint16 if kind == UNSIGNED_SHORT else np.uint32)
        view = self._view(meshopt.encode_indices(array), array[:, None], "INDICES", ELEMENTS)
        self.accessors.append(
            {"bufferView": view, "componentType": kind, "count": len(array), "type": "SCALAR"}
        )
        return len(self.accessors) - 1

    def _view(self, packed, array, mode, target):
        stride = array.shape[1] * array.itemsize
        self.data.extend(bytes(-len(self.data) % 4))
        self.unpacked += -self.unpacked % 4
        view = {
            "buffer": 1,
            "byteOffset": self.unpacked,
            "byteLength": array.nbytes,
            "target": target,
            "extensions": {
                "EXT_meshopt_compression": {
                    "buffer": 0,
                    "byteOffset": len(self.data),
                    "byteLength": len(packed),
                    "byteStride": stride,
                    "mode": mode,
                    "count": len(array),
                }
            },
        }
        if target == ARRAY:
            view["byteStride"] = stride
        self.data.extend(packed)
        self.unpacked += array.nbytes
        self.views.append(view)
        return len(self.views) - 1
