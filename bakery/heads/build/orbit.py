"""Lids that lie on the eyeball: on the mean head, for every identity, in every shape.

Build-time only.
"""

from dataclasses import replace

import numpy as np

from bakery.geometry import rotation
from bakery.heads.base import PARTS, gaze_of
from bakery.heads.eyes import bulge
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

CLEAR = 0.48  # mm between lid and ball
# A lid moves on a straight line and the ball is round: what travels most keeps what it loses on the
# way.
CLEAR_SHUT = 3.0  # mm
SEAL = 0.5  # mm that the upper lid closes more at the nose, where the source leaves a crack
HELD, FREE = 1.5, 5.0  # mm over the ball: lids nearer than the first move with it, beyond freely


def lay_lids(patch, balls, seal=SEAL):
    """The skin with its lids on the balls.

    Args:
        patch: Patch of the skin, sockets and mouth cavity; balls: Ball, left and right.
        seal: mm that the upper lid closes more at the nose.
    """
    skin = np.zeros(len(patch.mean), bool)
    skin[patch.faces[patch.parts == PARTS.index("skin")]] = True
    mean, identity = patch.mean.copy(), patch.identity.copy()
    expression = patch.expression.copy()
    for eye, (side, ball) in enumerate(zip(("Left", "Right"), balls)):
        near = np.linalg.norm(mean - ball.center, axis=1) < ball.radius + FREE
        near = np.flatnonzero(near & skin & (mean[:, 2] > ball.center[2]))
        mean[near] += _missing(mean[near], ball, CLEAR)
        identity[:, near] = _carried(mean[near], identity[:, near], ball)
        for name in EXPRESSIONS:
            k = EXPRESSION_INDEX[name]
            moved = np.abs(expression[k, near]).max(1) > 0.05
            at = near[moved]
            one = np.zeros(len(EXPRESSIONS))
            one[k] = 1.0
            clear = CLEAR
            if name == "eyeBlink" + side:
                travel = np.linalg.norm(expression[k, at], axis=1)
                clear = CLEAR + (CLEAR_SHUT - CLEAR) * travel / travel.max()
                expression[k, at, 1] -= seal * _at_nose(mean[at], expression[k, at])
            expression[k, at] += _missing(
                mean[at] + expression[k, at], ball, clear, gaze_of(one)[eye]
            )
    return replace(patch, mean=mean, identity=identity, expression=expression)


def _at_nose(points, blink):
    """Share 0..1 of each point that the seal of the corner at the nose takes."""
    across = np.abs(points[:, 0])
    falling = np.clip(-blink[:, 1], 0, 1)
    start = across[falling > 0.5].min()
    return falling * np.clip(1 - (across - start) / 9, 0, 1)


def _missing(points, ball, clear, gaze=(0.0, 0.0)):
    """What points [N, 3] must be moved by to lie `clear` mm over a ball with its cornea."""
    axis = rotation.yaw_pitch(*gaze) @ np.array([0.0, 0.0, 1.0])
    offset = points - ball.center
    reach = np.linalg.norm(offset, axis=1)
    angle = np.degrees(np.arccos(np.clip(offset @ axis / reach, -1, 1)))
    least = ball.radius * (1 + bulge(angle, ball.iris)) + clear
    return offset / reach[:, None] * np.maximum(least - reach, 0)[:, None]


def _carried(points, modes, ball):
    """Identity modes [I, N, 3] of lids, without what would lift them off the ball or sink them."""
    offset = points - ball.center
    reach = np.linalg.norm(offset, axis=1)
    outward = offset / reach[:, None]
    with_ball = ball.center_modes[:, None] + ball.scale_modes[:, None, None] * offset
    lift = ((modes - with_ball) * outward).sum(-1)
    share = np.clip((ball.radius + FREE - reach) / (FREE - HELD), 0, 1)
    share = share * share * (3 - 2 * share)
    return modes - (share * lift)[..., None] * outward
