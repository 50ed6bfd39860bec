"""The shader against the numpy reference: the same numbers from the same 8-bit pictures."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.export.open import open_avatar
from bakery.export.web import WebOptions
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.base import gaze_of, look
from bakery.runtime import mouth, render
from bakery.stages.condition import face_camera
from bakery.stages.texture.mouth import mouth_landmarks
from bakery.types import EXPRESSIONS

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "chidi.jpg"
WORST = 1.5  # of 255; half a step is rounding to 8 bits, the rest half floats and interpolation
EXACT = 0.999  # share of the mouth's texels
SHARE = 0.6  # of the picture that the face takes, as the page's front view has it
FOLD = 0.6  # texels off the mean of the neighbours: there the surface folds
GRID = 1 / 256  # pixel: where rasterisers place corners (WebGL asks for 4 bits; 8 are usual)
STEADY = 0.5  # of 255 that a step of GRID may change in the reference where pictures are compared
GRAZING = 70  # degrees: surface seen at a flatter angle may hide behind itself


def random_weights(rng, names=EXPRESSIONS):
    """Up to ten expressions at random strength [E]."""
    out = np.zeros(len(EXPRESSIONS), np.float32)
    chosen = rng.choice(names, rng.integers(1, 10), replace=False)
    for name in chosen:
        out[EXPRESSIONS.index(name)] = rng.random()
    return out


def states(frames, gazes, mouths, size):
    """What is drawn; every fifth frame without hair, every seventh with the static texture."""
    rng = np.random.default_rng(5)
    lips = [name for name in EXPRESSIONS if name.startswith(("jaw", "mouth"))]
    out = [("frame", random_weights(rng), None) for _ in range(frames)]
    for _ in range(gazes):
        gaze = rng.uniform([-28, -20], [28, 20])
        out.append(("frame", look(random_weights(rng), gaze), gaze))
    out += [("mouth", random_weights(rng, lips), None) for _ in range(mouths)]
    return [
        {
            "kind": kind,
            "size": size,
            "weights": {n: float(w) for n, w in zip(EXPRESSIONS, row) if w},
            "gaze": None if gaze is None else gaze.tolist(),
            "hair": number % 5 != 4,
            "dynamic": number % 7 != 6,
        }
        for number, (kind, row, gaze) in enumerate(out)
    ]


def inside(avatar, vertices, camera, known):
    """Pixels of the face whose neighbours show the same part, no fold and no grazing surface."""
    head = avatar.head
    faces = head.part_faces(*render.SHOWN)
    points = cameras.to_camera(vertices, camera)
    found = rasterize(
        cameras.project_camera(points, camera), -points[:, 2], head.faces[faces],
        (camera.height, camera.width), cull=True,
    )  # fmt: skip
    part = np.where(found.face >= 0, head.face_part[faces[found.face]], 255).astype(np.uint8)
    texel = interpolate(found, head.uv[head.uv_faces[faces]]) * avatar.textures.neutral.shape[0]
    around = np.ones((3, 3), np.uint8)
    smooth = np.abs(texel - cv2.blur(texel, (3, 3))).max(-1) < FOLD
    depth = np.where(found.face >= 0, found.depth, 0)
    slope = (
        (cv2.dilate(depth, around) - cv2.erode(depth, around)) * camera.focal / (2 * depth + 1e-6)
    )
    flat = smooth & (slope < np.tan(np.radians(GRAZING)))
    return (cv2.dilate(part, around) == cv2.erode(part, around)) & flat & (known > 0.99)


def levels(frame):
    """A picture over gray, sRGB-encoded, of 255."""
    return to_encoded(render.over_gray(frame)) * 255


def compare(avatar, wanted, folder, monkeypatch):
    """Worst difference of each frame, of 255; share of exact texels of each mouth; share compared."""
    monkeypatch.setattr(render, "SAMPLES", 1)
    worst, exact, shares = [], [], []
    for number, state in enumerate(wanted):
        raw = np.frombuffer((folder / f"{number:03d}.raw").read_bytes(), np.uint8)
        row = np.array([state["weights"].get(name, 0) for name in EXPRESSIONS], np.float32)
        gaze = gaze_of(row).mean(0) if state["gaze"] is None else np.array(state["gaze"])
        vertices = avatar.head.vertices(avatar.neutral, row, gaze)
        if state["kind"] == "mouth":
            marks = mouth_landmarks(avatar.head, avatar.neutral, vertices)
            median = np.rint(to_encoded(mouth.mouth_picture(avatar.textures, marks)) * 255)
            found = raw.reshape(*median.shape[:2], 4)[..., :3]
            exact.append((found == median).all(-1).mean())
            continue
        size = state["size"]
        camera = face_camera(avatar.fit, avatar.head, avatar.neutral, 0, 0, size, SHARE)
        arguments = (row, gaze, state["dynamic"], state["hair"])
        frame = render.draw(avatar, vertices, camera, *arguments)
        reference = levels(frame)
        error = np.abs(raw.reshape(size, size, 4)[..., :3] - reference).max(-1)
        face = inside(avatar, vertices, camera, np.minimum(frame.alpha, frame.face))
        for step in ([GRID, 0], [0, GRID]):
            aside = replace(camera, center=camera.center + step)
            moved = levels(render.draw(avatar, vertices, aside, *arguments)) - reference
            face &= np.abs(moved).max(-1) < STEADY
        worst.append(error[face].max())
        shares.append(face.sum() / (np.minimum(frame.alpha, frame.face) > 0.99).sum())
    return np.array(worst), np.array(exact), np.array(shares)


def measured(avatar, site, browser, serve, tmp_path, monkeypatch, counts, size):
    wanted = states(*counts, size)
    (tmp_path / "states.json").write_text(json.dumps(wanted))
    browser("parity.mjs", serve(site.folder), tmp_path / "states.json", tmp_path, timeout=1800)
    return compare(site.as_seen(avatar), wanted, tmp_path, monkeypatch)


def test_made_up_avatar(made_up, site, browser, serve, tmp_path, monkeypatch):
    worst, exact, shares = measured(
        made_up, site, browser, serve, tmp_path, monkeypatch, (4, 3, 8), 192
    )
    assert worst.max() <= WORST, worst
    assert exact.min() >= EXACT, exact
    assert shares.min() > 0.5, "too little of the face was compared"


@pytest.mark.slow
def test_sample(bakery, browser, serve, make_site, tmp_path, monkeypatch, capsys):
    """A baked sample: 100 weight sets, 20 gazes, 100 mouths; the figures in docs/log-web.md."""
    done = bakery("build", SAMPLE, "-o", tmp_path / "sample.avatar")
    assert done.returncode == 0, done.stderr
    avatar = open_avatar(tmp_path / "sample.avatar")
    (tmp_path / "site").mkdir()
    site = make_site(tmp_path / "site", avatar, WebOptions())
    worst, exact, shares = measured(
        avatar, site, browser, serve, tmp_path, monkeypatch, (100, 20, 100), 256
    )
    with capsys.disabled():
        print(
            f"\nworst difference of {len(worst)} frames: median {np.median(worst):.2f}, worst "
            f"{worst.max():.2f} of 255; exact texels of {len(exact)} mouths: least {exact.min():.4%}; "
            f"share of the face that was compared: least {shares.min():.1%}"
        )
    assert worst.max() <= WORST and exact.min() >= EXACT
