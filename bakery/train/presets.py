"""Makes the presets of mouth poses and gaze directions that ship in presets/expressions."""

import json

import numpy as np

from bakery.stages.texture.mouth import (
    candidate_poses,
    mouth_landmarks,
    ranging,
    smiling,
    spread,
    talking,
)
from bakery.types import EXPRESSIONS

GAZE_FIELD = (32.0, 24.0)  # degrees, half axes of the ellipse that eyes turn in without the head


def gaze_directions(count=20, field=GAZE_FIELD):
    """Directions [count, 2] (yaw, pitch) degrees, even over the ellipse; the first looks ahead.

    One in the middle, seven and twelve on two rings: nearly a hexagonal packing, and symmetric.
    """
    rings = ((1, 0.0, 0.0), (7, 0.52, 0.25), (count - 8, 1.0, 0.0))
    out = []
    for number, radius, phase in rings:
        turn = 2 * np.pi * (np.arange(number) / number + phase)
        out += [(radius * field[0] * np.cos(t), radius * field[1] * np.sin(t)) for t in turn]
    return np.round(np.array(out), 2)


# Kinds of poses and how many of them. Chosen by landmarks alone, extreme grimaces would take nearly
# all places, and talk and smiles, which avatars do all day, would be left with few.
KINDS = ((talking, 0.35), (smiling, 0.35), (ranging, 0.3))


def mouth_poses(head, count=300, seed=1, candidates=1500):
    """Poses [count, E], each kind spread evenly over what lips do in it; the first is neutral."""
    rng = np.random.default_rng(seed)
    neutral = head.neutral(np.zeros(0))
    out = []
    for make, share in KINDS:
        poses = candidate_poses(rng, make, candidates)
        landmarks = [
            mouth_landmarks(head, neutral, head.vertices(neutral, pose, (0, 0))).ravel()
            for pose in poses
        ]
        number = round(share * count)
        chosen = spread(np.stack(landmarks), number + 1)  # rest comes first in each
        out.append(poses[chosen if not out else chosen[1:]][:number])
    return np.concatenate(out)


def poses_to_json(poses):
    """Poses [M, E] as JSON text, one line a pose, zero weights left out."""
    lines = [
        json.dumps({EXPRESSIONS[e]: round(float(pose[e]), 3) for e in np.flatnonzero(pose)})
        for pose in poses
    ]
    return "[\n" + ",\n".join(lines) + "\n]\n"


def gaze_to_toml(directions):
    """Directions [n, 2] as TOML text."""
    lines = [f"    [{yaw:.2f}, {pitch:.2f}]," for yaw, pitch in directions]
    return (
        "# Gaze of the baked eye textures: yaw to the subject's left, pitch up, degrees.\n"
        "directions = [\n" + "\n".join(lines) + "\n]\n"
    )
