"""Faces by their proportions: the identity of any head model that comes nearest to a description."""

import numpy as np

# Proportion -> (landmarks whose mean counts +, whose mean counts -, axis); mirrored pairs together.
PROPORTIONS = {
    "face_width": ((454, 323), (234, 93), 0),
    "jaw_width": ((288, 397), (58, 172), 0),
    "chin_width": ((400, 378), (176, 149), 0),
    "face_height": ((10,), (152,), 1),
    "chin_height": ((17,), (152,), 1),
    "nose_width": ((278,), (48,), 0),
    "nose_length": ((6,), (2,), 1),
    "nose_depth": ((4,), (164,), 2),
    "bridge_depth": ((6,), (33, 263), 2),
    "lip_gap": ((2,), (0,), 1),
    "mouth_width": ((291,), (61,), 0),
    "upper_lip": ((37, 0, 267), (82, 13, 312), 1),
    "lower_lip": ((87, 14, 317), (84, 17, 314), 1),
    "eye_width": ((263, 133), (362, 33), 0),
    "eye_open": ((386, 159), (374, 145), 1),
    "eye_gap": ((362,), (133,), 0),
    "eye_tilt": ((263, 33), (362, 133), 1),
    "brow_height": ((105, 334, 66, 296), (159, 386), 1),
    "cheek": ((205, 425), (132, 361), 2),
    "corner": ((61, 291), (13, 14), 1),
}


def _measure(points):
    """Proportions [P] mm of landmarks [..., L, 3]."""
    return np.stack(
        [
            points[..., list(plus), axis].mean(-1) - points[..., list(minus), axis].mean(-1)
            for plus, minus, axis in PROPORTIONS.values()
        ],
        -1,
    )


def identity_of(head, wanted, seed=0, freedom=0.35, sharpness=0.8, largest=2.2):
    """Identity coefficients of a face with the wanted proportions.

    Args:
        head: head model.
        wanted: proportion -> mm more than the mean head has; those left out stay at the mean.
        seed, freedom: of the random rest of the face, standard deviations.
        sharpness: mm that a proportion may be missed by at the price of one standard deviation.
        largest: no coefficient goes beyond this many standard deviations.

    Returns:
        [I] float32.
    """
    marks = np.stack([head.landmarks(mode) for mode in head.identity_basis])
    slope = _measure(marks).T.astype(np.float64)  # [P, I]
    target = np.array([float(wanted.get(name, 0.0)) for name in PROPORTIONS])
    loose = np.random.default_rng(seed).normal(size=slope.shape[1]) * freedom
    normal = slope.T @ slope / sharpness**2 + np.eye(slope.shape[1])
    start = slope.T @ (target - slope @ loose) / sharpness**2
    return np.clip(loose + np.linalg.solve(normal, start), -largest, largest).astype(np.float32)
