"""Bones in a glTF file: nodes, a skin, and how much each bone carries of a vertex."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pygltflib as gltf

from bakery.export.glb import Surface
from bakery.export.glb_data import Writer
from bakery.export.skeleton import Joint

MOST = 4  # bones that carry a vertex, as one set of glTF's attributes has them


@dataclass(frozen=True, eq=False)
class Rig:
    """Bones without a turn of their own, and what hangs on them."""

    joints: Sequence[Joint]  # parents first
    carrying: Sequence[str]  # names of those that carry vertices, J
    shares: Callable[[Surface], np.ndarray]  # of a Surface [V, J], sums of 1

    def add(self, document: gltf.GLTF2, made: Writer) -> int:
        """Add a node for each bone, and skin 0; returns the node of the first bone."""
        start = len(document.nodes)
        number = {joint.name: start + index for index, joint in enumerate(self.joints)}
        place = {joint.name: joint.place for joint in self.joints}
        for joint in self.joints:
            above = place.get(joint.parent, np.zeros(3))
            moved = [round(float(x), 6) for x in joint.place - above]
            document.nodes.append(gltf.Node(name=joint.name, translation=moved, children=[]))
            if joint.parent is not None:
                document.nodes[number[joint.parent]].children.append(number[joint.name])
        bind = np.tile(np.eye(4), (len(self.carrying), 1, 1))
        bind[:, :3, 3] = [-place[name] for name in self.carrying]
        document.skins = [
            gltf.Skin(
                joints=[number[name] for name in self.carrying],
                skeleton=start,
                inverseBindMatrices=made.matrices(bind),
            )
        ]
        return start

    def weights(self, piece: Surface) -> tuple[np.ndarray, np.ndarray]:
        """The four bones that carry most of each vertex, and how much.

        Returns:
            [V, 4] uint8 into `carrying`, 0 where fewer carry it; [V, 4] float32, sums of 1.
        """
        shares = self.shares(piece)
        joints = np.argsort(-shares, axis=1, kind="stable")[:, :MOST]
        weights = np.take_along_axis(shares, joints, 1)
        weights = np.where(weights > 1e-3, weights, 0)
        weights = weights / weights.sum(1, keepdims=True)
        joints, weights = np.where(weights > 0, joints, 0), weights.astype(np.float32)
        short = MOST - joints.shape[1]
        wide = ((0, 0), (0, max(short, 0)))
        return np.pad(joints, wide).astype(np.uint8), np.pad(weights, wide)
