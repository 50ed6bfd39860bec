"""The head for browsers: one level of detail, shapes of 16 bits, packed by meshopt.

Positions and uv stay floats, so that a player meets the reference; they are a tenth of the file.
"""

import json

import numpy as np

from bakery.export.glb import CLEAR, METRES, STILL
from bakery.formats import meshopt

BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5120, 5122, 5123, 5125, 5126
ARRAY, ELEMENTS = 34962, 34963
STEPS = 32767  # of a shape, from rest to the farthest that anything moves


def web_glb(surfaces, shape_names, generator):
    """The bytes of a GLB file.

    Args:
        surfaces: glb.Surface of each piece; the piece's name is its material's.
        shape_names: [E] names of the morph targets.
        generator: name and version of the program.

    Returns:
        bytes; needs KHR_mesh_quantization and EXT_meshopt_compression.
    """
    reach = max(float(np.abs(piece.shapes).max()) for piece in surfaces)  # mm, one unit of the node
    made = _Packer()
    primitives = [_primitive(made, piece, number, reach) for number, piece in enumerate(surfaces)]
    document = {
        "asset": {"version": "2.0", "generator": generator},
        "extensionsUsed": [
            "EXT_meshopt_compression", "KHR_materials_unlit", "KHR_mesh_quantization",
        ],
        "extensionsRequired": ["EXT_meshopt_compression", "KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{"name": "head", "nodes": [0]}],
        "nodes": [{"name": "head", "mesh": 0, "scale": [reach * METRES] * 3}],
        "meshes": [
            {
                "name": "head",
                "primitives": primitives,
                "weights": [0.0] * len(shape_names),
                "extras": {"targetNames": list(shape_names)},
            }
        ],
        "materials": [
            {
                "name": piece.name,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9},
                "extensions": {"KHR_materials_unlit": {}},
                **({"alphaMode": "BLEND", "doubleSided": True} if piece.name in CLEAR else {}),
            }
            for piece in surfaces
        ],
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
    text = json.dumps(document, separators=(",", ":")).encode()
    return _container(text, bytes(made.data))


def _container(text, binary):
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    size = 12 + 8 + len(text) + 8 + len(binary)
    numbers = [
        np.array(pair, "<u4").tobytes() for pair in ((2, size), (len(text),), (len(binary),))
    ]
    return b"".join([b"glTF", numbers[0], numbers[1], b"JSON", text, numbers[2], b"BIN\0", binary])


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
