"""Which of the 478 face-mesh points mean what. Right and left are the subject's.

The first 468 lie on the skin, the ten behind them on the irises. Rims run from corner to corner
with both corners in each; rings run once around. All are index arrays.
"""

import numpy as np

FACE = 468
RIGHT_IRIS, LEFT_IRIS = slice(468, 473), slice(473, 478)  # centre first, then four on the border

RIGHT_EYE_OUTER, RIGHT_EYE_INNER = 33, 133
LEFT_EYE_OUTER, LEFT_EYE_INNER = 263, 362
EYE_CORNERS = np.array([RIGHT_EYE_OUTER, LEFT_EYE_OUTER])  # their distance is the unit of errors
MOUTH_CORNERS = np.array([61, 291])  # outer, right and left
BEFORE_EARS = np.array([234, 454])  # right and left
NOSE_BASE, CHIN = np.array([2, 97, 326]), np.array([152, 148, 377, 175])

# The face contour, clockwise in the picture from the top of the forehead.
OVAL = np.array(
    [10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152]
    + [148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109]
)

# Lips from the right corner to the left; the rings go along the lower lip and back.
LIPS_INNER_UPPER = np.array([78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308])
LIPS_INNER_LOWER = np.array([78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308])
LIPS_OUTER_UPPER = np.array([61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291])
LIPS_OUTER_LOWER = np.array([61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291])
LIPS_INNER = np.concatenate([LIPS_INNER_LOWER, LIPS_INNER_UPPER[-2:0:-1]])
LIPS_OUTER = np.concatenate([LIPS_OUTER_LOWER, LIPS_OUTER_UPPER[-2:0:-1]])
LIPS = np.unique(np.concatenate([LIPS_INNER, LIPS_OUTER]))

# Lid rims from the outer to the inner corner; the rings go along the lower lid and back.
LID_RIGHT_UPPER = np.array([33, 246, 161, 160, 159, 158, 157, 173, 133])
LID_RIGHT_LOWER = np.array([33, 7, 163, 144, 145, 153, 154, 155, 133])
LID_LEFT_UPPER = np.array([263, 466, 388, 387, 386, 385, 384, 398, 362])
LID_LEFT_LOWER = np.array([263, 249, 390, 373, 374, 380, 381, 382, 362])
EYE_RIGHT = np.concatenate([LID_RIGHT_LOWER, LID_RIGHT_UPPER[-2:0:-1]])
EYE_LEFT = np.concatenate([LID_LEFT_LOWER, LID_LEFT_UPPER[-2:0:-1]])
LIDS_UPPER = (LID_LEFT_UPPER, LID_RIGHT_UPPER)  # the left eye first, as in every per-eye array
LIDS_LOWER = (LID_LEFT_LOWER, LID_RIGHT_LOWER)
EYES = (EYE_LEFT, EYE_RIGHT)

# Brows: upper edge from the outer end to the inner, then the lower edge back.
BROW_RIGHT = np.array([70, 63, 105, 66, 107, 55, 65, 52, 53, 46])
BROW_LEFT = np.array([300, 293, 334, 296, 336, 285, 295, 282, 283, 276])
BROWS = np.concatenate([BROW_RIGHT, BROW_LEFT])

# Nose, from between the eyes to its base, with wings and nostrils.
NOSE = np.array(
    [168, 6, 197, 195, 5, 4, 1, 19, 94, 2,
     3, 51, 45, 44, 131, 198, 236, 115, 220, 48, 49, 102, 129, 64, 98, 97,
     248, 281, 275, 274, 360, 420, 456, 344, 440, 278, 279, 331, 358, 294, 327, 326]
)  # fmt: skip
# On plain skin, where no edge or fold marks them.
PLAIN = np.setdiff1d(np.arange(FACE), np.concatenate([*EYES, BROWS, LIPS, NOSE]))
OPEN_MOUTH = 0.05  # of the mouth's width: lips so far apart show an interior


def face_size(points: np.ndarray) -> np.ndarray:
    """Distance of the outer eye corners of points [.., L, 2]: the unit of landmark errors."""
    return np.linalg.norm(points[..., EYE_CORNERS[0], :] - points[..., EYE_CORNERS[1], :], axis=-1)


def mirror_landmarks(points: np.ndarray) -> np.ndarray:
    """For each landmark of the face [468] the one on its other side, by a head's own [L, 3] mm."""
    face = points[:FACE]
    apart = np.asarray((((face * [-1, 1, 1])[:, None] - face) ** 2).sum(-1))
    return apart.argmin(1)


def lip_gap(points: np.ndarray) -> float:
    """Gap between the inner lips [L, 2] over the mouth's width, in the middle."""
    width = np.linalg.norm(np.subtract(*points[MOUTH_CORNERS]))
    return float(np.linalg.norm(points[13] - points[14]) / width)


def open_mouth(points: np.ndarray) -> bool:
    """Whether lips [L, 2] stand so far apart that an interior shows."""
    return lip_gap(points) >= OPEN_MOUTH
