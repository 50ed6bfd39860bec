"""Delaunay triangles of points in the plane."""

import cv2
import numpy as np


def delaunay(points):
    """Triangles [F, 3] (rows of the points) that cover the hull of points [n, 2].

    Of points that coincide the first is taken.
    """
    points = np.asarray(points, np.float32)
    low, high = points.min(0) - 2, points.max(0) + 2
    net = cv2.Subdiv2D((*low.tolist(), *(high - low).tolist()))
    number = {}
    for index, point in enumerate(points.tolist()):
        net.insert(tuple(point))
        number.setdefault(tuple(point), index)
    corners = ([(t[k], t[k + 1]) for k in (0, 2, 4)] for t in net.getTriangleList().tolist())
    faces = [[number[c] for c in three] for three in corners if all(c in number for c in three)]
    return np.array(faces, np.int32)
