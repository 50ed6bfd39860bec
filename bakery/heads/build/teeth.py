"""28 separate teeth and two gums on an arch, in millimetres of anatomy.

Crown sizes are the averages of Nelson, "Wheeler's Dental Anatomy, Physiology, and Occlusion",
10th ed., tables 1-1 to 1-8, without the third molars.
"""

from dataclasses import dataclass

import numpy as np

# From the midline back: mesiodistal width, crown height, depth from cheek to tongue, mm.
UPPER = np.array(
    [
        (8.5, 10.5, 7.0),
        (6.5, 9.0, 6.0),
        (7.5, 10.0, 8.0),
        (7.0, 8.5, 9.0),
        (7.0, 8.5, 9.0),
        (10.0, 7.5, 11.0),
        (9.0, 7.0, 11.0),
    ]
)
LOWER = np.array(
    [
        (5.0, 9.0, 6.0),
        (5.5, 9.5, 6.5),
        (7.0, 11.0, 7.5),
        (7.0, 8.5, 7.5),
        (7.0, 8.0, 8.0),
        (11.0, 7.5, 10.5),
        (10.5, 7.0, 10.0),
    ]
)
# Thickness of the biting edge as a share of the depth, and how far the corners drop, mm.
EDGE = np.array([0.2, 0.22, 0.3, 0.62, 0.62, 0.72, 0.72])
DROP = np.array([0.25, 0.5, 1.7, 1.1, 0.9, 0.5, 0.5])
COLUMNS = 6
ROWS = np.array([-0.2, 0.15, 0.45, 0.75, 0.94, 1.0])  # share of the crown from gum to edge
WIDTH = np.array([0.72, 0.84, 0.96, 1.0, 0.97, 0.88])  # of the tooth at those rows


@dataclass(frozen=True)
class Arch:
    """One jaw's curve z = front - a x^2 - b x^4 of the cheek side of its teeth, and its plane."""

    front: float  # mm, z at the midline
    a: float  # 1/mm
    b: float  # 1/mm^3
    edge: float  # mm, y of the biting edges at z = 0
    slope: float  # how y of the edges rises with z
    down: float  # -1 upper jaw: crowns point down; +1 lower jaw
    scale: float  # of the anatomy
    tall: float = 1.0  # of the crowns' heights beside that

    def at(self, along):
        """Points [N, 2] (x, z) and outward normals [N, 2] at arc lengths [N] from the midline."""
        x = np.linspace(0, 60, 6001)
        z = self.front - self.a * x**2 - self.b * x**4
        length = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
        side, s = np.sign(along), np.abs(along)
        px = np.interp(s, length, x)
        slope = -2 * self.a * px - 4 * self.b * px**3
        normal = np.stack([-slope * side, np.ones_like(px)], -1)
        points = np.stack([side * px, self.front - self.a * px**2 - self.b * px**4], -1)
        return points, normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def level(self, z):
        """y of the biting edges at z [N]."""
        return self.edge + self.slope * z


def crown(arch, sizes, number, start):
    """One tooth on the subject's left.

    Args:
        number: 0 the central incisor to 6 the second molar; start: mm of arch before it.

    Returns:
        (vertices [N, 3], faces, uv [N, 2]: u across 0..1, v from the cheek-side gum over the edge
        to the tongue-side gum).
    """
    width, height, depth = sizes[number] * arch.scale * [1, arch.tall, 1]
    middle = start + width / 2
    (point,), (normal,) = arch.at(np.array([middle]))
    tangent = np.array([normal[1], -normal[0]])
    across = -np.cos(np.pi * np.arange(COLUMNS + 1) / COLUMNS)  # -1 toward the midline .. 1
    round_ = (1 - np.abs(across) ** 2.6) ** (1 / 2.6)
    share = np.concatenate([ROWS, ROWS[::-1]])
    wide = np.concatenate([WIDTH, WIDTH[::-1]])
    front = np.arange(2 * len(ROWS)) < len(ROWS)
    thick = np.interp(share, [-0.2, 0.3, 1.0], [0.86, 1.0, EDGE[number]])
    # The cheek side bows gently; the tongue side takes the taper.
    inset = 0.05 * depth * (2 * np.clip(share, 0, 1) - 0.9) ** 2
    center = inset + thick * depth / 2
    half = thick * depth / 2 * np.where(front, 1, -1)
    outward = -center[:, None] + half[:, None] * round_[None]
    sideways = across[None] * wide[:, None] * (width / 2 * 0.985)
    drop = (
        DROP[number] * arch.scale * np.abs(across[None]) ** 2 * np.clip(share, 0, 1)[:, None] ** 3
    )
    along = share[:, None] * height - drop
    xz = point + sideways[..., None] * tangent + outward[..., None] * normal
    gum = arch.level(point[1]) - arch.down * height
    vertices = np.stack([xz[..., 0], gum + arch.down * along, xz[..., 1]], -1)
    number_of = np.arange(vertices[..., 0].size).reshape(vertices.shape[:2])
    faces = grid_faces(number_of)
    run = np.concatenate([[0], np.cumsum(np.maximum(np.abs(np.diff(share * height)), 0.8))])
    u, v = np.meshgrid(np.linspace(0, 1, COLUMNS + 1), run / run[-1])
    faces = outward_faces(vertices.reshape(-1, 3), faces)
    return vertices.reshape(-1, 3), faces, np.stack([u, v], -1).reshape(-1, 2)


def grid_faces(number):
    """Two triangles for each cell of a grid of vertex numbers [R, C]."""
    a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    c, d = number[1:, 1:].ravel(), number[1:, :-1].ravel()
    return np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)])


def outward_faces(vertices, faces):
    """Faces turned so that the surface encloses a positive volume about its middle."""
    p = vertices[faces] - vertices.mean(0)
    volume = np.einsum("nc,nc->n", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum()
    return faces if volume > 0 else faces[:, ::-1]


def row_of_teeth(arch, sizes):
    """All teeth of one jaw: (vertices, faces, uv); u runs from the subject's right to the left."""
    total = sizes[:, 0].sum() * arch.scale
    vertices, faces, uv, start, count = [], [], [], 0.0, 0
    for number in range(len(sizes)):
        width = sizes[number, 0] * arch.scale
        points, triangles, chart = crown(arch, sizes, number, start)
        slot = (start + width * (0.04 + 0.92 * chart[:, 0])) / total / 2
        for side in (1, -1):
            vertices.append(points * [side, 1, 1])
            faces.append((triangles if side > 0 else triangles[:, ::-1]) + count)
            uv.append(np.stack([0.5 + side * slot, chart[:, 1]], -1))
            count += len(points)
        start += width
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(uv)


def gum(arch, sizes, dome):
    """The gum of one jaw: from the fold of the lip over the margin to the palate or floor.

    Args:
        dome: mm that the middle of the palate (or floor) lies beyond the gum line.

    Returns:
        (vertices, faces, uv).
    """
    edges = np.concatenate([[0], np.cumsum(sizes[:, 0] * arch.scale)])
    along, phase, which = [], [], []
    for number in range(len(sizes)):
        for k in range(4):
            along.append(edges[number] + (edges[number + 1] - edges[number]) * k / 4)
            phase.append(k / 4)
            which.append(number)
    along += [edges[-1], edges[-1] + 3.0]
    phase += [0.0, 0.0]
    which += [len(sizes) - 1] * 2
    along, phase, which = np.array(along), np.array(phase), np.array(which, float)
    along = np.concatenate([-along[:0:-1], along])
    phase = np.concatenate([phase[:0:-1], phase])
    which = np.concatenate([which[:0:-1], which]).astype(int)
    points, normals = arch.at(along)
    depth = np.interp(np.abs(along), (edges[:-1] + edges[1:]) / 2, sizes[:, 2]) * arch.scale
    height = (
        np.interp(np.abs(along), (edges[:-1] + edges[1:]) / 2, sizes[:, 1]) * arch.scale * arch.tall
    )
    beyond = np.clip((np.abs(along) - edges[-1]) / 3.0, 0, 1)  # behind the last tooth it closes
    papilla = 2.6 * arch.scale * (1 - np.sin(np.pi * phase)) ** 1.3 * (1 - beyond)
    line = arch.level(points[:, 1]) - arch.down * height  # gum line at mid-tooth
    margin = line + arch.down * (papilla + 0.2)
    up = -arch.down
    rows = [
        (points + normals * 0.6, line + up * 8.5),
        (points + normals * 1.3, line + up * 5.0),
        (points + normals * 0.9, line + up * 1.8),
        (points + normals * 0.25, margin + up * 0.6),
        (points - normals * 0.6, margin),
        (points - normals * (depth / 2)[:, None], margin + up * 0.8),
        (points - normals * (depth - 0.5)[:, None], margin),
        (points - normals * (depth + 0.5)[:, None], line + up * 1.5),
        (points - normals * (depth + 2.0)[:, None], line + up * 5.0),
    ]
    inner = points - normals * (depth + 2.0)[:, None]
    back = np.clip((inner[:, 1] - 0) / 12, 0, 1)  # the front curves to the back, not sideways
    target = np.stack([0 * inner[:, 0], inner[:, 1] - 5 * back], -1)
    for share in (0.5, 1.0):
        rise = 5.0 + (dome - 5.0) * np.sin(np.pi / 2 * share)
        rows.append((inner + share * (target - inner), line + up * rise))
    grid = np.stack([np.stack([xz[:, 0], y + 0 * xz[:, 0], xz[:, 1]], -1) for xz, y in rows])
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:2])
    faces = grid_faces(number)
    steps = np.linalg.norm(np.diff(grid, axis=0), axis=-1).mean(1)
    v = np.concatenate([[0], np.cumsum(steps)])
    u = (along - along[0]) / (along[-1] - along[0])
    uu, vv = np.meshgrid(u, v / v[-1])
    vertices = grid.reshape(-1, 3)
    middle = len(along) // 2
    a, b, c = number[0, middle], number[1, middle], number[0, middle + 1]
    outward = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
    if outward[2] < 0 and (faces[0] == [number[0, 0], number[1, 0], number[1, 1]]).all():
        faces = faces[:, ::-1]
    return vertices, faces, np.stack([uu, vv], -1).reshape(-1, 2)


def affine_carry(points, moves, targets):
    """Move new points as the affine map that explains old ones best.

    Args:
        points: [N, 3]; moves: [K, N, 3] their displacements; targets: [M, 3].

    Returns:
        [K, M, 3].
    """
    middle = points.mean(0)
    A = np.concatenate([points - middle, np.ones((len(points), 1))], 1)
    solved = np.linalg.lstsq(A, np.moveaxis(moves, 0, 1).reshape(len(points), -1), rcond=None)[0]
    B = np.concatenate([targets - middle, np.ones((len(targets), 1))], 1)
    return np.moveaxis((B @ solved).reshape(len(targets), len(moves), 3), 1, 0)
