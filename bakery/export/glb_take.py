"""A take as the animation of a binary glTF file: shapes by weights, the head by its bone."""

import numpy as np

from bakery.formats.glb import apart, joined
from bakery.formats.livelink import Take
from bakery.geometry import rotation

HEAD = "head"  # bone
NAME = "take"
FLOAT = 5126


def with_take(data: bytes, take: Take) -> bytes:
    """A GLB file that plays a take: meshes with shapes, and the bone `head` if there is one.

    Shapes go by their order, which is ours, further ones rest. Eyes look by the eyeLook shapes. Only
    what the scene shows moves: three.js complains of tracks for the other levels of detail.

    Args:
        data: a GLB file as `glb.write_glb` makes it.
    """
    document, rest = apart(data)
    binary = bytearray(rest)
    channels, samplers = [], []
    times = _accessor(document, binary, take.seconds[:, None], "SCALAR", limits=True)

    def play(values, kind, nodes, path):
        output = _accessor(document, binary, values, kind)
        samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
        for node in nodes:
            target = {"node": node, "path": path}
            channels.append({"sampler": len(samplers) - 1, "target": target})

    shaped: dict[int, list[int]] = {}  # how many shapes -> nodes
    for index in _shown(document):
        node = document["nodes"][index]
        count = len(document["meshes"][node["mesh"]].get("weights", ())) if "mesh" in node else 0
        if count:
            shaped.setdefault(count, []).append(index)
    for count, nodes in shaped.items():
        weights = np.pad(take.weights, ((0, 0), (0, count - take.weights.shape[1])))
        play(weights.reshape(-1, 1), "SCALAR", nodes, "weights")
    bones = [k for k, node in enumerate(document["nodes"]) if node.get("name") == HEAD]
    if bones and take.head.any():
        play(quaternions(take.head), "VEC4", bones, "rotation")
    document["animations"] = [{"name": NAME, "channels": channels, "samplers": samplers}]
    document["buffers"] = [{"byteLength": len(binary)}]
    return joined(document, bytes(binary))


def _shown(document) -> list[int]:
    """The nodes of the scene, and what hangs on them."""
    found = list(document["scenes"][document.get("scene", 0)]["nodes"])
    for index in found:
        found += document["nodes"][index].get("children", ())
    return found


def quaternions(head: np.ndarray) -> np.ndarray:
    """Angles of a Take's head [N, 3] as quaternions x, y, z, w [N, 4], neighbours near each other."""
    turns = np.array([rotation.vector(rotation.yaw_pitch_roll(*row)).ravel() for row in head])
    angles = np.linalg.norm(turns, axis=1, keepdims=True)
    axes = turns / np.maximum(angles, 1e-12)
    found = np.concatenate([axes * np.sin(angles / 2), np.cos(angles / 2)], 1)
    flips = np.cumprod(np.where((found[1:] * found[:-1]).sum(1) < 0, -1, 1))
    found[1:] *= flips[:, None]
    return found


def _accessor(document, binary, values, kind, limits=False):
    """Append numbers [N, C] as floats; returns the accessor's index."""
    values = np.ascontiguousarray(values, np.float32)
    binary.extend(bytes(-len(binary) % 4))
    view = {"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes}
    document["bufferViews"].append(view)
    binary.extend(values.tobytes())
    accessor = {
        "bufferView": len(document["bufferViews"]) - 1,
        "componentType": FLOAT,
        "count": len(values),
        "type": kind,
    }
    if limits:
        accessor |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
    document["accessors"].append(accessor)
    return len(document["accessors"]) - 1
