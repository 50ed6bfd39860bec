"""Numbers to compare head models by: landmark fit, closed lids, teeth that stay inside, size."""

import time

import numpy as np

from bakery.geometry.raster import rasterize
from bakery.heads.base import PARTS, PROXIES, weights
from bakery.heads.file import find_head, load_head
from bakery.heads.place import place_head
from bakery.heads.report.numbers import atlas_stretch, face_texels
from bakery.heads.report.penetrate import DEEP, PAIRS, Contacts, mixes, singles
from bakery.landmarks import LIPS_INNER


def landmark_fit(head, points, sizes):
    """Mean distance of the fitted points [N, 468] and of the inner lip, in eye distances."""
    error = np.array([place_head(head, p, tuple(map(int, s))).error for p, s in zip(points, sizes)])
    return float(error.mean()), float(error[:, LIPS_INNER].mean())


def visible(head, vertices, yaw, names, size=900, width=130.0):
    """Pixels of the named parts seen from `yaw` degrees, without perspective, about the eyes."""
    hidden = [PARTS.index(name) for name in (*PROXIES, "lashes", "tear")]
    shown = ~np.isin(head.face_part, hidden)
    turn, scale = np.radians(yaw), size / width
    x = vertices[:, 0] * np.cos(turn) - vertices[:, 2] * np.sin(turn)
    z = vertices[:, 0] * np.sin(turn) + vertices[:, 2] * np.cos(turn)
    pixels = np.stack([size / 2 + x * scale, size / 2 - vertices[:, 1] * scale], -1)
    face = rasterize(pixels, 500 - z, head.faces[shown], (size, size), True).face
    seen = head.face_part[shown][face[face >= 0]]
    return int(np.isin(seen, [PARTS.index(name) for name in names]).sum())


def open_eye_share(head, identities, close=None):
    """The largest share of the open eye that shows at eyeBlink 1, seen from 0 and +-40 degrees.

    Args:
        close: function (head, neutral) -> the head with lids that close on this person, or None.
    """
    shut = weights({"eyeBlinkLeft": 1, "eyeBlinkRight": 1})
    eyes = ("eye_left", "eye_right")
    worst = 0.0
    for identity in identities:
        neutral = head.neutral(identity)
        own = close(head, neutral) if close else head
        closed = own.vertices(neutral, shut)
        for yaw in (-40, 0, 40):
            open_ = visible(head, neutral, yaw, eyes)
            worst = max(worst, visible(head, closed, yaw, eyes) / max(open_, 1))
    return worst


def contacts(head, rng, count):
    """What reaches into what, deeper than DEEP, by pair of parts.

    Returns:
        {pair: (vertices over all shapes at 1, how many of `count` mixes have such vertices, the
        deepest of all mm)}.
    """
    near = Contacts(head)
    out = {pair: [0, 0, 0.0] for pair in PAIRS}
    for expressions, mixed in ((singles().values(), False), (mixes(rng, count), True)):
        for expression in expressions:
            found = near.depths(head.vertices(head.mean, expression), expression)
            for pair, depth in found.items():
                deep = int((depth > DEEP).sum())
                out[pair][mixed] += min(deep, 1) if mixed else deep
                out[pair][2] = max(out[pair][2], float(depth.max(initial=0.0)))
    return out


def measure(name, points, sizes, names, rng, count=1000, close=None):
    """One column of the table: what a head is worth, as a mapping.

    Args:
        points: [N, 478, 2] pixels; sizes: [N, 2]; names: [N], _neutral or _smiling in each.
        rng: numpy Generator; count: random mixes to try; close: see `open_eye_share`.
    """
    head = load_head(name)
    seconds = np.inf
    for _ in range(5):  # the best: other work on the machine slows single ones
        start = time.process_time()
        load_head(name)
        seconds = min(seconds, time.process_time() - start)
    out = {"vertices": len(head.mean), "triangles": len(head.faces)}
    out["megabytes"] = round(find_head(name).stat().st_size / 1e6, 2)
    out["load, processor ms"] = round(1000 * seconds)
    for kind in ("neutral", "smiling"):
        rows = [k for k, photo in enumerate(names) if kind in photo]
        if rows:
            every, lips = landmark_fit(head, points[rows], sizes[rows])
            out[f"{kind}: landmarks, %"] = round(100 * every, 3)
            out[f"{kind}: inner lips, %"] = round(100 * lips, 3)
    people = np.concatenate([np.zeros((1, len(head.identity_basis))),
                             rng.normal(size=(8, len(head.identity_basis)))])  # fmt: skip
    out["blink: eye showing, %, worst of 9"] = round(100 * open_eye_share(head, people), 2)
    if close:
        share = open_eye_share(head, people, close)
        out["the same, closed for each person"] = round(100 * share, 2)
    teeth = ("teeth_upper", "teeth_lower")
    out["neutral: pixels of teeth"] = sum(visible(head, head.mean, y, teeth) for y in (-40, 0, 40))
    for pair, (single, mixed, deepest) in contacts(head, rng, count).items():
        out[f"{pair}: vertices, 52 shapes"] = single
        out[f"{pair}: of {count} mixes"] = mixed
        out[f"{pair}: deepest, mm"] = round(deepest, 2)
    area, angle = atlas_stretch(head)
    out["face texels of 1024 x 1024"] = face_texels(head)
    out["atlas: deviation of ln area"], out["atlas: angle stretch"] = (
        round(area, 3),
        round(angle, 3),
    )
    return out
