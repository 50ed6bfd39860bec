"""Hair with volume from one photo: a shell, wisps that follow it, cards that the photo cuts to shape."""

import numpy as np

from bakery.geometry.color import to_encoded
from bakery.heads.base import HeadModel
from bakery.landmarks import CHIN
from bakery.stages.hair import atlas as atlases
from bakery.stages.hair import mesh as meshes
from bakery.stages.hair.curls import curliness, take_curls
from bakery.stages.hair.directions import flow, photographed
from bakery.stages.hair.painter import Painter
from bakery.stages.hair.portrait import NOTHING, Portrait, at, look
from bakery.stages.hair.shell import make_shell
from bakery.stages.hair.strands import KNOTS, grow
from bakery.stages.segment import Segmentation
from bakery.types import HAIR_KINDS, HAIR_TRIANGLES, Fit, HairMesh

SIZE = 1024  # texels on a side of the atlas
LEAST = 400.0  # mm2 of hair in the photo, below which there is none
CARDS = 320
WIDTH = 14.0  # mm
LONGEST, SHORT = 130.0, 48.0  # mm, wisps of long and of short hair
CURLED = 60.0  # mm, wisps of long hair that is all curls
CROPPED = 5.0  # mm: hair so short is drawn on the skin
STUBBLE, SHAVED = 9.0, 0.235  # mm, distance of sRGB colours: shorter and more alike is no volume
COARSE = 60  # cards of the coarsest level
WIDER = 2.0  # times the width that they have there
FULLER = 0.5  # of their width that cards of curls get wider, whose borders are cut off


def make_hair(
    encoded: np.ndarray,
    segmentation: Segmentation,
    fit: Fit,
    head: HeadModel,
    neutral: np.ndarray,
    size: int = SIZE,
) -> HairMesh | None:
    """The hair of a portrait as a mesh; None where the photo shows none, or hair cropped to the skin.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded photo.
        segmentation: of the photo.
        fit: Fit of the photo.
        head: the head of the person.
        neutral: [V, 3] mm, neutral shape.
        size: texels on a side of the atlas.
    """
    portrait = look(encoded, segmentation, fit, head, neutral)
    if portrait.solid.sum() < LEAST * portrait.scale**2:
        return None
    shell = make_shell(portrait, head, neutral)
    if (shell.there > 0.5).sum() < 20:
        return None
    angle, sure = photographed(portrait)
    ways, _ = flow(portrait, shell, angle, sure)
    chin = float(head.landmarks(neutral)[CHIN, 1].mean())
    thick = np.percentile((shell.radius - shell.base)[shell.there > 0.5], 80)
    long = shell.below > -10 or thick > 25
    if thick < CROPPED or (thick < STUBBLE and not long and _like_skin(portrait)):
        return None
    curly = curliness(portrait, angle, sure)
    curls = take_curls(portrait, curly) if curly > 0 else None
    longest = (LONGEST + curly * (CURLED - LONGEST)) if long else SHORT
    wisps = grow(shell, ways, CARDS, WIDTH, longest)
    return _assembled(Painter(portrait, shell, ways, curls, longest), wisps, chin, size)


def _like_skin(portrait: Portrait) -> bool:
    """Whether what is labelled hair has the colour of skin: a shaved head."""
    hair, skin = (portrait.linear[where] for where in (portrait.solid, portrait.skin))
    if not len(skin):
        return False
    apart = to_encoded(np.median(hair, 0)) - to_encoded(np.median(skin, 0))
    return bool(np.linalg.norm(apart) < SHAVED)


def _assembled(painter, wisps, chin, size):
    portrait, shell = painter.portrait, painter.shell
    surface, inner = meshes.cap_surface(shell, portrait)
    fine, coarse = (
        meshes.make_cap(shell, surface, inner, every) for every in (meshes.FINE, meshes.COARSE)
    )
    per_card = 2 * (KNOTS - 1)
    room = [
        (limit - len(cap.faces)) // per_card
        for limit, cap in zip(HAIR_TRIANGLES, (fine, coarse, coarse))
    ]
    # A hem ends hair that has a cap; without one it would float.
    wisps = wisps.chosen(~wisps.hem | (shell.chart.take(inner, wisps.cells[:, 0]) > 0))
    order = np.argsort(wisps.layer, kind="stable")
    rank = np.arange(len(wisps.layer))[order]  # the first that were chosen matter most
    wisps = wisps.chosen(order)
    wider = 1 + FULLER * (painter.curls.share if painter.curls else 0.0)
    edges, cells = meshes.ribbons(shell, wisps, portrait.camera, wider)
    wide, _ = meshes.ribbons(shell, wisps, portrait.camera, WIDER * wider)
    spread = np.linspace(0, max(len(rank) - 1, 0), min(COARSE, max(room[2], 0), len(rank))).astype(
        int
    )
    few = np.unique(spread)
    levels = (rank < room[0]) * 1 + (rank < room[1]) * 2
    shown = shell.chart.take(shell.seen, wisps.cells).mean(1)
    dense = 0.75 + 0.6 * shown  # what the photo shows is told finer
    across = np.linalg.norm(edges[:, :, 1] - edges[:, :, 0], axis=-1).max(1)
    layout = atlases.pack(across * dense, wisps.length * dense, size)
    lowest = max([part.cells[:, 1].max() for part in (fine, coarse) if len(part.cells)], default=1)
    cap_map = atlases.map_cap(shell, surface, inner, int(np.ceil(lowest)))
    texture = np.zeros((size, size, 4), np.float32)
    direction = np.zeros((size, size, 2), np.float32)
    along = np.zeros((size, size), np.float32)
    source = np.zeros((size, size), np.uint8)
    middle = edges.mean(2)
    pixels, depth = portrait.pixels(middle)
    bare = at(portrait.depth, pixels)
    over = ((bare < NOTHING) & (depth < bare + 5)).mean(1)
    off_scalp = 1 - shell.chart.take(shell.growth, wisps.cells).mean(1)
    fringe = (over > 0.5) & (off_scalp > 0.5)
    solid = np.where(fringe, 1.0, np.clip(2 * off_scalp - 0.6, 0, 1))
    atlases.paint_cap(painter, surface, cap_map, size, texture, direction, source)
    atlases.paint_cards(
        painter, layout, edges, cells, solid, wisps, texture, direction, along, source
    )
    tall = int(atlases.CAP_PART * size)
    s, t = np.array([0.0, 1.0]), np.linspace(0, 1, KNOTS)
    uv = np.stack(
        np.broadcast_arrays(
            (layout.left[:, None, None] + s * layout.width[:, None, None]) / size,
            (layout.top[:, None, None] + t[:, None] * layout.height[:, None, None]) / size,
        ), -1,
    )  # fmt: skip
    parts, total = [], 0

    def add(points, places, faces, kind, card, level):
        nonlocal total
        parts.append((points, places, faces + total, kind, card, level))
        total += len(points)

    def cap_uv(part):
        return cap_map.places(part.cells) * [1.0, tall / size]

    count = len(wisps.layer)
    for part, level in ((fine, 1), (coarse, 6)):
        n = len(part.faces)
        add(part.vertices, cap_uv(part), part.faces, np.zeros(n), np.full(n, -1), np.full(n, level))
    kind = np.where(fringe, HAIR_KINDS.index("fringe"), HAIR_KINDS.index("card"))
    for points, chosen, level, first in (
        (edges, np.flatnonzero(levels), levels, 0),
        (wide, few, np.full(count, 4), count),
    ):
        faces = meshes.ribbon_faces(len(chosen))
        per = np.repeat(np.arange(len(chosen)), per_card)
        add(
            points[chosen].reshape(-1, 3), uv[chosen].reshape(-1, 2), faces.reshape(-1, 3),
            kind[chosen][per], chosen[per] + first, level[chosen][per],
        )  # fmt: skip
    vertices, uvs, faces, kinds, cards, level = (np.concatenate(column) for column in zip(*parts))
    return HairMesh(
        vertices.astype(np.float32), faces.astype(np.int32), np.clip(uvs, 0, 1).astype(np.float32),
        kinds.astype(np.uint8), cards.astype(np.int32), level.astype(np.uint8),
        meshes.hang(shell, vertices, chin), texture.astype(np.float16),
        direction.astype(np.float16), along.astype(np.float16), source,
    )  # fmt: skip
