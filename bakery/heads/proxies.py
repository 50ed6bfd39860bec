"""The proxy meshes every head gets: the mouth proxy and the eye proxies (see `heads.eyes`)."""

import numpy as np

from bakery.heads.patch import Patch, follow_ids, part_ids

SHEET_ROWS = 10
SHEET_COLUMNS = 32


def split_ring(ring, mean, jaw_open):
    """Split the inner lip contour at its corners.

    Args:
        ring: [N] vertices in order around.
        mean: [V, 3] mm.
        jaw_open: [V, 3] mm displacement of jawOpen, which tells the lower lip from the upper.

    Returns:
        (upper, lower): vertices from the subject's right corner to the left, corners in both.
    """
    ring = np.asarray(ring)
    x = mean[ring, 0]
    ring = np.roll(ring, -int(x.argmin()))
    end = int(mean[ring, 0].argmax())
    one, two = ring[: end + 1], np.concatenate([ring[end:], ring[:1]])[::-1]
    if jaw_open[one, 1].mean() < jaw_open[two, 1].mean():
        one, two = two, one
    return one, two


def _spread(mean, line, columns):
    """Weights [columns + 1, V] that read a line of vertices at even shares of its width."""
    x = mean[line, 0]
    share = np.maximum.accumulate((x - x[0]) / (x[-1] - x[0]))
    share = share + np.linspace(0, 1e-6, len(share))
    at = np.interp(np.linspace(0, share[-1], columns + 1), share, np.arange(len(line)))
    low = np.minimum(at.astype(int), len(line) - 2)
    out = np.zeros((columns + 1, len(mean)), np.float32)
    rows = np.arange(columns + 1)
    np.add.at(out, (rows, line[low]), 1 - (at - low))
    np.add.at(out, (rows, line[low + 1]), at - low)
    return out


def mouth_proxy(ring, mean, identity, expression, jaw_open):
    """A sheet that spans the inner lip contour; every row is a blend of the two lips, so whatever
    moves the lips moves the sheet.

    Args:
        ring: [N] vertices of the inner lip contour, in order.
        mean: [V, 3] mm; identity: [I, V, 3]; expression: [E, V, 3]; jaw_open: [V, 3].

    Returns:
        Patch; u runs from the subject's right corner to the left, v from upper to lower lip.
    """
    upper, lower = split_ring(ring, mean, jaw_open)
    top = _spread(mean, upper, SHEET_COLUMNS)
    bottom = _spread(mean, lower, SHEET_COLUMNS)
    v = np.linspace(0, 1, SHEET_ROWS + 1)
    weights = ((1 - v)[:, None, None] * top + v[:, None, None] * bottom).reshape(-1, len(mean))
    used = np.unique(np.concatenate([upper, lower]))
    weights = weights[:, used]
    u = np.linspace(0, 1, SHEET_COLUMNS + 1)
    uv = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
    number = np.arange(len(uv)).reshape(SHEET_ROWS + 1, SHEET_COLUMNS + 1)
    a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    c, d = number[1:, 1:].ravel(), number[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)])
    return Patch(
        parts=part_ids("mouth_sheet", len(faces)),
        mean=weights @ mean[used],
        faces=faces,
        uv=uv,
        uv_faces=faces,
        follow=follow_ids("skin", len(uv)),
        identity=np.einsum("nv,ivc->inc", weights, identity[:, used]),
        expression=np.einsum("nv,ivc->inc", weights, expression[:, used]),
    )
