"""Mouth cavity and eye sockets of the built-in head, for a skin that ends at lips or lids."""

import numpy as np

from bakery.heads.mesh import openings, register
from bakery.heads.mesh.parts import built_in
from bakery.heads.mesh.solve import factorized, stiffness, vertex_areas
from bakery.heads.patch import Patch

FADE = 10.0  # mm behind the contour over which a lining takes the built-in head's own shape again


def lining(number, contour, skin, laid, laid_shapes):
    """What lies behind one opening of a skin: Patch that meets the skin's contour.

    Args:
        number: of the opening in `openings.OPENINGS`.
        contour: (upper, lower) vertices of the skin, from right to left.
        skin: Patch; laid: Laid; laid_shapes: [E, V, 3] mm from `transfer.own_shapes`.
    """
    from scipy.sparse import diags

    head = laid.head
    part = openings.PART[openings.OPENINGS[number]]
    faces = head.part_faces(part)
    if part == "eye_socket":
        left = head.mean[head.faces[faces]].mean(1)[:, 0] > 0
        faces = faces[left == (openings.OPENINGS[number] == "left eye")]
    patch = built_in(laid, faces, laid.vertices, laid_shapes)
    used = np.unique(head.faces[faces])
    index = np.full(len(head.mean), -1)
    index[used] = np.arange(len(used))

    upper, lower = openings.guide(laid)[number]
    rim = index[np.concatenate([upper, lower[1:-1]])]
    fields = (skin.mean[None], skin.identity, skin.expression)
    reached = np.concatenate([
        np.concatenate([_along(half, own, skin.mean, laid.vertices, f)[:, cut] for half, own, cut in
                        zip(contour, (upper, lower), (slice(None), slice(1, -1)))], 1)
        for f in fields
    ])  # fmt: skip
    now = np.concatenate([patch.mean[None], patch.identity, patch.expression])
    missing = reached - now[:, rim]  # [1 + I + E, rim, 3]
    held = np.zeros(len(used))
    held[rim] = 1e4
    area = vertex_areas(patch.mean, patch.faces)
    solve = factorized(stiffness(patch.mean, patch.faces) + diags(area * (held + 1 / FADE**2)))
    right = np.zeros((len(used), 3 * len(now)))
    right[rim] = (area[rim] * held[rim])[:, None] * np.moveaxis(missing, 0, 1).reshape(len(rim), -1)
    moved = np.moveaxis(solve(right).reshape(len(used), len(now), 3), 1, 0)
    out = (now + moved).astype(np.float32)
    I = len(patch.identity)  # noqa: E741
    return Patch(
        patch.parts, out[0], patch.faces, patch.uv, patch.uv_faces, patch.follow,
        out[1 : 1 + I], out[1 + I :],
    )  # fmt: skip


def _along(half, own, mean, laid_vertices, fields):
    """Fields [K, V, 3] of the skin where the built-in head's half contour meets it: [K, n, 3]."""
    wanted = register.shares(laid_vertices[own])
    at = np.interp(wanted, register.shares(mean[half]), np.arange(len(half)))
    low = np.minimum(at.astype(int), len(half) - 2)
    share = (at - low)[None, :, None]
    return (1 - share) * fields[:, half[low]] + share * fields[:, half[low + 1]]
