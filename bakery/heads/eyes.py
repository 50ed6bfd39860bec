"""Round eyeballs with cornea, iris and pupil, and the caps in front of them."""

from dataclasses import dataclass

import numpy as np

from bakery.heads.patch import Patch, follow_ids, part_ids, rigid, still

SEGMENTS = 28
CORNEA = 0.055  # height of the bulge over the sphere, in radii
CAP_ANGLE = 65.0  # degrees from the axis that a cap reaches


@dataclass(frozen=True)
class Ball:
    """Where an eyeball sits: the mean head's, and how each identity mode moves and scales it."""

    center: np.ndarray  # [3] mm
    radius: float  # mm
    iris: float  # degrees, half-angle of the iris seen from the centre
    center_modes: np.ndarray  # [I, 3] mm
    scale_modes: np.ndarray  # [I] relative


def fit_ball(points, center, modes):
    """How identity modes [I, V, 3] move and scale a sphere of points [V, 3], least squares.

    Returns:
        (center_modes [I, 3] mm, scale_modes [I]).
    """
    offsets = points - center
    A = np.zeros((len(points), 3, 4))
    A[:, [0, 1, 2], [0, 1, 2]] = 1
    A[:, :, 3] = offsets
    solved = np.linalg.lstsq(A.reshape(-1, 4), modes.reshape(len(modes), -1).T, rcond=None)[0].T
    return solved[:, :3], solved[:, 3]


def ring_angles(iris):
    """Angles [R] degrees of the rings of vertices from the front pole to near the back pole.

    The iris ends on one of them. The back rings are spread so that the mean of all vertices of the
    ball, poles and cornea with it, is its centre.
    """
    front = iris * np.array([0.19, 0.38, 0.7, 1.0, 1.2])
    front = np.concatenate([front, np.linspace(1.2 * iris, 90, 7)[1:]])
    steps = np.arange(1, 11) / 11

    def both(power):
        return np.concatenate([front, 90 + 90 * steps**power])

    def lean(power):
        angles = both(power)
        heights = (1 + bulge(angles, iris)) * np.cos(np.radians(angles))
        return SEGMENTS * heights.sum() + 1 + CORNEA - 1

    low, high = 0.2, 5.0  # a larger power keeps the rings forward
    for _ in range(60):
        power = (low + high) / 2
        low, high = (power, high) if lean(power) < 0 else (low, power)
    return both(power)


def bulge(angles, iris):
    """Height of the cornea over the unit sphere at angles from the front pole, in radii."""
    x = np.clip(np.asarray(angles) / (1.25 * iris), 0, 1)
    return CORNEA * (1 - x**2) ** 2


def disc(angles, edge_angle, segments=SEGMENTS):
    """Faces and directions of rings about +z.

    Args:
        angles: [R] degrees from the pole, rising.
        edge_angle: degrees that lie on the rim of the chart; the chart's centre is the pole.

    Returns:
        (directions [1 + R * S, 3], faces counter-clockwise from outside, uv [same, 2]).
    """
    turn = np.arange(segments) * 2 * np.pi / segments
    polar = np.radians(np.asarray(angles))[:, None]
    ring = np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar) + 0 * turn], -1
    )
    directions = np.concatenate([[[0, 0, 1.0]], ring.reshape(-1, 3)])
    reach = np.asarray(angles)[:, None] / edge_angle / 2
    chart = np.stack([0.5 + reach * np.cos(turn), 0.5 - reach * np.sin(turn)], -1)
    uv = np.concatenate([[[0.5, 0.5]], chart.reshape(-1, 2)])
    following = (np.arange(segments) + 1) % segments
    faces = [np.stack([np.zeros(segments), 1 + np.arange(segments), 1 + following], -1)]
    for r in range(len(angles) - 1):
        a, b = 1 + r * segments, 1 + (r + 1) * segments
        here, there = np.arange(segments), following
        faces.append(np.stack([a + here, b + here, b + there], -1))
        faces.append(np.stack([a + here, b + there, a + there], -1))
    return directions, np.concatenate(faces).astype(int), uv


def eyeball(side, ball):
    """A closed eyeball that turns about its centre; its vertices' mean is that centre.

    Args:
        side: "left" or "right".
        ball: Ball.

    Returns:
        Patch; the chart is azimuthal, front pole in the middle, back pole on the rim.
    """
    angles = ring_angles(ball.iris)
    directions, faces, uv = disc(angles, 180.0)
    polar = np.concatenate([[0.0], np.repeat(angles, SEGMENTS)])
    shape = directions * (1 + bulge(polar, ball.iris))[:, None]
    last = len(shape) - SEGMENTS
    ring = last + np.arange(SEGMENTS)
    shape = np.concatenate([shape, [[0, 0, -1.0]]])
    fan = np.stack([ring, np.full(SEGMENTS, len(shape) - 1), np.roll(ring, -1)], -1)
    faces = np.concatenate([faces, fan])
    uv_fan = np.stack([ring, len(uv) + np.arange(SEGMENTS), np.roll(ring, -1)], -1)
    middle = uv[ring] + uv[np.roll(ring, -1)] - 1.0
    uv = np.concatenate([uv, 0.5 + 0.5 * middle / np.linalg.norm(middle, axis=1, keepdims=True)])
    uv_faces = np.concatenate([faces[:-SEGMENTS], uv_fan])
    mean = ball.center + ball.radius * shape
    return Patch(
        parts=part_ids("eye_" + side, len(faces)),
        mean=mean,
        faces=faces,
        uv=uv,
        uv_faces=uv_faces,
        follow=follow_ids("eye_" + side, len(mean)),
        identity=rigid(mean, ball.center, ball.center_modes, ball.scale_modes),
        expression=still(len(mean)),
    )


def eye_proxy(side, ball, gap):
    """The proxy mesh in front of an eyeball: part of a sphere that does not turn.

    It keeps the radius of the white, without the cornea's bulge: lids lie on the white, and a cap
    any larger would cut through them.

    Args:
        gap: mm between the white of the eye and the cap.
    """
    directions, faces, uv = disc(np.linspace(0, CAP_ANGLE, 10)[1:], CAP_ANGLE)
    mean = ball.center + (ball.radius + gap) * directions
    return Patch(
        parts=part_ids("eye_cap_" + side, len(faces)),
        mean=mean,
        faces=faces,
        uv=uv,
        uv_faces=faces,
        follow=follow_ids("skull", len(mean)),
        identity=rigid(mean, ball.center, ball.center_modes, ball.scale_modes),
        expression=still(len(mean)),
    )


def iris_vertices(head, side):
    """The pole and the ring of vertices [S] at the border of the iris, made by `eyeball`."""
    used = head.part_vertices("eye_" + side)
    return int(used[0]), used[1 + 3 * SEGMENTS : 1 + 4 * SEGMENTS]
