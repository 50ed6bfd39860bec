"""Hair that hangs, on chains of bones that programs for VRM swing: VRMC_springBone 1.0.

Chains stand around the head, one in each sector in which hair hangs far enough. Between two of them
hair follows both; where a neighbour is missing, it follows the head so much the more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bakery.export.skeleton import Joint, to_body

SECTORS = 8
LINKS = 3  # bones of a chain that swing; a tail behind them says how long the last one is
LEAST = 40.0  # mm of hair below its chain's first bone; shorter hair stands
FEW = 20  # vertices; fewer are stray
NEAR = 15.0  # mm of height around a bone, in which hair says where it stands
STIFF, GRAVITY, DRAG = 1.0, 0.1, 0.4  # as VRM has them; it settles within a second
THICK = 0.008  # metres from a bone's end to what must not touch the skin
INSIDE = 0.9  # of the head's half width: what hair collides with lies below the skin
NECK, SHOULDER = 0.045, 0.045  # metres, radii
SIDE, SINK = 0.11, 0.06  # metres from the root of the neck, aside and down, to the shoulders' ends


@dataclass(frozen=True, eq=False)
class Chain:
    """Bones of one sector."""

    angle: float  # degrees around the head: 0 before the face, 90 on the subject's left
    places: np.ndarray  # [LINKS + 1, 3] mm in the head's space, downwards; the last is the tail

    def names(self) -> list[str]:
        """Of the bones, the tail too."""
        return [f"hair_{round(self.angle) % 360}_{link}" for link in range(LINKS + 1)]


def hair_chains(points: np.ndarray, pivot: np.ndarray) -> list[Chain]:
    """The chains that hair needs; none for hair that does not hang.

    Args:
        points: [N, 3] mm, vertices of the hair in the head's space.
        pivot: [3] mm, where the head turns: below it hair hangs.
    """
    below = points[points[:, 1] < pivot[1]]
    around = _around(below, pivot)
    found = []
    for angle in np.arange(SECTORS) * 360 / SECTORS:
        mine = below[np.abs(_apart(around, angle)) <= 180 / SECTORS]
        if len(mine) < FEW or pivot[1] - np.percentile(mine[:, 1], 2) < LEAST:
            continue
        heights = np.linspace(pivot[1], np.percentile(mine[:, 1], 2), LINKS + 1)
        places = []
        for height in heights:
            level = mine[np.abs(mine[:, 1] - height) < NEAR]
            aside = (level if len(level) else mine).mean(0)
            places.append((aside[0], height, aside[2]))
        found.append(Chain(float(angle), np.array(places)))
    return found


def chain_joints(chains: Sequence[Chain]) -> list[Joint]:
    """The bones of chains on a person's bones, parents first."""
    return [
        Joint(name, parent, to_body(place))
        for chain in chains
        for name, parent, place in zip(
            chain.names(), ["head", *chain.names()], chain.places, strict=False
        )
    ]


def chain_weights(chains: Sequence[Chain], points: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """How much the swinging bones carry points of the hair: [N, chains * LINKS], sums of 1 at most.

    Args:
        points: [N, 3] mm, in the head's space; pivot: as for `hair_chains`.
    """
    around = _around(points, pivot)
    shares = [np.zeros((len(points), 0))]
    for chain in chains:
        near = np.clip(1 - np.abs(_apart(around, chain.angle)) * SECTORS / 360, 0, 1)
        top, low = chain.places[0, 1], chain.places[-1, 1]
        along = np.clip((top - points[:, 1]) / (top - low) * LINKS, 0, LINKS - 0.5)
        links = np.clip(1 - np.abs(along[:, None] - (np.arange(LINKS) + 0.5)), 0, 1)
        links[:, 0] *= np.clip(2 * along, 0, 1)  # none at the first bone: above it the head carries
        shares.append(near[:, None] * links)
    return np.concatenate(shares, 1)


def spring_table(
    chains: Sequence[Chain], number: dict[str, int], places: dict[str, np.ndarray], width: float
) -> dict:
    """The extension VRMC_springBone.

    Args:
        number: node of each bone; places: where it stands, [3] metres in the body's space.
        width: of the head, metres.
    """
    middle = to_body(np.zeros(3)) * (1, 1, 0)  # between the eyes, above the spine
    middle[2] = places["head"][2] + 0.02
    root = places["neck"]
    shoulder = [root + (sign * SIDE, -SINK, 0.0) for sign in (1, -1)]
    colliders = [
        _sphere(number["head"], middle - places["head"], INSIDE * width / 2),
        _capsule(number["neck"], np.zeros(3), places["head"] - root, NECK),
        _capsule(number["chest"], *(end - places["chest"] for end in shoulder), SHOULDER),
    ]
    link = {
        "hitRadius": THICK,
        "stiffness": STIFF,
        "gravityPower": GRAVITY,
        "gravityDir": [0, -1, 0],
        "dragForce": DRAG,
    }
    return {
        "specVersion": "1.0",
        "colliders": colliders,
        "colliderGroups": [{"name": "body", "colliders": list(range(len(colliders)))}],
        "springs": [
            {
                "name": chain.names()[0].rpartition("_")[0],
                "joints": [{"node": number[name], **link} for name in chain.names()],
                "colliderGroups": [0],
            }
            for chain in chains
        ],
    }


def _around(points, pivot):
    """Degrees around the head [N] of points [N, 3]."""
    return np.degrees(np.arctan2(points[:, 0] - pivot[0], points[:, 2] - pivot[2]))


def _apart(angles, angle):
    """Differences of angles, -180..180 degrees."""
    return (angles - angle + 180) % 360 - 180


def _sphere(node, offset, radius):
    return {
        "node": node,
        "shape": {"sphere": {"offset": _short(offset), "radius": round(radius, 4)}},
    }


def _capsule(node, offset, tail, radius):
    shape = {"offset": _short(offset), "radius": radius, "tail": _short(tail)}
    return {"node": node, "shape": {"capsule": shape}}


def _short(place):
    return [round(float(x), 5) for x in place]
