"""Conformance tests of the plug-in points: what a plug-in of each kind has to keep to.

A plug-in's own tests call the check of its kind; each raises AssertionError that says what is wrong.

    from bakery.testing import check_generator
    from my_package import MyGenerator

    def test_it_is_a_generator():
        check_generator(MyGenerator())

The portrait that the checks look at is painted, so that they need no file.
"""

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

import numpy as np

from bakery.detectors.base import Detector
from bakery.errors import BakeryError
from bakery.exporters.base import Exporter
from bakery.generators.base import Generator, Subject
from bakery.hair.base import Hair
from bakery.heads.base import FOLLOW, PARTS, HeadModel, weights
from bakery.runtime.avatar import Avatar
from bakery.types import (
    EXPRESSIONS,
    HAIR_KINDS,
    HAIR_TRIANGLES,
    LANDMARKS,
    Conditions,
    Fit,
    HairMesh,
    Landmarks,
    Photo,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Painted:
    """A painted portrait with everything that the steps before a plug-in make of it."""

    photo: Photo
    landmarks: Landmarks  # as painted: the truth
    fit: Fit
    head: HeadModel  # as the person has it
    subject: Subject


@cache
def painted(size: int = 400, resolution: int = 512) -> Painted:
    """A painted person, fitted and unwrapped. Takes some seconds, once.

    Args:
        size: pixels a side of the picture; resolution: texels a side of the neutral texture.
    """
    from bakery.bake.fitting import fit_portrait, own_head
    from bakery.heads.file import load_head
    from bakery.stages.texture.hair import mattes_of
    from bakery.stages.texture.neutral import prepare
    from bakery.synth.render import dress, paint
    from bakery.synth.scene import neutral_scene, random_scene
    from bakery.synth.subject import random_subject

    head, rng = load_head(), np.random.default_rng(7)
    wardrobe = dress(head, random_subject(rng, head, 0.8), 1.0, 0.03)
    scene = neutral_scene(random_scene(rng, size, size, 0.0))
    picture = paint(wardrobe, scene, 1, 0.2)
    points = np.asarray(picture.landmarks, np.float64)
    low, high = points[:468].min(0), points[:468].max(0)
    face = Landmarks(np.concatenate([low, high - low]), 1.0, points, np.ones(LANDMARKS))
    photo = Photo(np.asarray(picture.encoded, np.float32), "painted")
    fit, segmentation = fit_portrait("painted", photo, face, head)
    own, neutral = own_head(head, fit)
    mattes = mattes_of(photo.encoded, segmentation, face.points)
    made = prepare(photo, face, fit, neutral, own, mattes, resolution)
    return Painted(photo, face, fit, own, made.subject)


def _named(plug_in: Detector | Generator | Hair | Exporter) -> None:
    assert isinstance(plug_in.name, str) and plug_in.name, "name: needs a text"
    assert isinstance(plug_in.sha256, str), 'sha256: needs a text, "" without weights'
    assert plug_in.sha256 == "" or len(plug_in.sha256) == 64, "sha256: not 64 hexadecimal digits"


def _same(one: object, other: object, what: str) -> None:
    assert np.array_equal(np.asarray(one), np.asarray(other)), f"{what}: differs from call to call"


def check_detector(detector: Detector, error: float = 0.1) -> None:
    """A detector finds the painted face, leaves the picture alone, and says the same twice.

    Args:
        error: largest mean distance of the 478 points from the truth, in distances of the outer eye
            corners. A painted face of this size gives the built-in network 0.04.
    """
    from bakery.landmarks import face_size

    _named(detector)
    seen = painted()
    picture = np.round(seen.photo.encoded * 255).astype(np.uint8)
    given = picture.copy()
    faces = detector.detect(picture)
    assert np.array_equal(picture, given), "detect: changes the picture that it is given"
    assert isinstance(faces, list) and len(faces) == 1, f"detect: {len(faces)} faces, one is there"
    (face,) = faces
    assert isinstance(face, Landmarks), "detect: gives something else than Landmarks"
    assert 0 <= face.score <= 1, "detect: the score lies outside 0..1"
    truth = seen.landmarks.points
    apart = np.linalg.norm(face.points - truth, axis=1).mean() / face_size(truth)
    assert apart <= error, f"detect: points lie {apart:.3f} eye distances off, at most {error}"
    # The irises, as every pair of points, are named by the subject's side.
    right, left = face.points[468:473].mean(0), face.points[473:478].mean(0)
    assert right[0] < left[0], "detect: the subject's right iris comes first (points 468 to 472)"
    _same(face.points, detector.detect(picture)[0].points, "detect")
    assert detector.detect(np.full((96, 128, 3), 127, np.uint8)) == [], (
        "detect: a face in plain grey"
    )


def conditions(
    name: str = "jawOpen", side: int = 256, subject: Subject | None = None
) -> Conditions:
    """The conditions of one shape at full weight, drawn of the painted person."""
    from bakery.stages.condition import condition, face_camera

    seen = painted()
    subject = subject or seen.subject
    camera = face_camera(seen.fit, subject.head, subject.neutral, 15.0, size=side)
    return condition(
        subject.head, subject.neutral, subject.texture, weights({name: 1.0}), (0.0, 0.0), camera
    )


def check_generator(generator: Generator) -> None:
    """A generator paints frames and crops of any size, in several threads, the same each time."""
    from bakery.stages.generate import generate

    _named(generator)
    assert isinstance(generator.source_type, str) and generator.source_type, "source_type: a text"
    subject = painted().subject
    if hasattr(generator, "get_ready"):
        generator.get_ready(subject.head)
    for side, interior in ((256, False), (219, False), (160, True)):
        seen = conditions(side=side)
        before = seen.deformed_neutral.copy()
        made = generate(generator, subject, seen, interior)
        assert np.array_equal(seen.deformed_neutral, before), "generate: changes its conditions"
        assert made.alpha.min() >= 0 and made.alpha.max() <= 1, "alpha: outside 0..1"
        assert made.ratio.min() > 0, "ratio: not above 0"
        alpha = made.alpha[..., None]
        wanted = before * made.ratio * (1 - alpha) + made.color * alpha
        apart = float(np.abs(made.image - wanted).max())
        assert apart < 1e-3, (
            f"image: {apart:.4f} off deformed_neutral * ratio * (1 - a) + color * a"
        )
    seen = conditions()
    with ThreadPoolExecutor(2) as pool:
        one, other = pool.map(lambda _: generate(generator, subject, seen), range(2))
    _same(one.image, other.image, "generate, in two threads")


def check_head(head: HeadModel) -> None:
    """A head model is complete, comes back from its file, and its lids, jaw and eyes move."""
    from bakery.heads.file import load_head, save_head

    vertices = len(head.mean)
    for part in ("skin", "eye_left", "eye_right"):
        assert len(head.part_faces(part)), f"face_part: no face of part {part}"
    assert head.expression_basis.shape == (len(EXPRESSIONS), vertices, 3), "expression_basis: shape"
    assert head.landmark_faces.shape == (LANDMARKS,), "landmark_faces: needs 478"
    assert head.face_part.max() < len(PARTS) and head.follow.max() < len(FOLLOW), "unknown part"
    height = np.ptp(head.landmarks(head.mean)[:468, 1])
    assert 90 < height < 250, f"mean: the face is {height:.0f} mm high; millimetres are needed"
    marks = head.landmarks(head.mean)
    assert marks[473:478, 0].mean() > marks[468:473, 0].mean(), "mean: +x is the subject's left"
    assert marks[10, 1] > marks[152, 1], "mean: +y is up"
    assert marks[4, 2] > marks[234, 2], "mean: +z is out of the face"
    opened = head.landmarks(head.vertices(head.mean, weights({"jawOpen": 1.0})))
    assert marks[14, 1] - opened[14, 1] > 5, "jawOpen: the lower lip moves less than 5 mm"
    for side, upper, lower in (("Left", 386, 374), ("Right", 159, 145)):
        shut = head.landmarks(head.vertices(head.mean, weights({"eyeBlink" + side: 1.0})))
        gap = marks[upper, 1] - marks[lower, 1], shut[upper, 1] - shut[lower, 1]
        assert gap[1] < 0.5 * gap[0], f"eyeBlink{side}: the lids do not close"
    with TemporaryDirectory() as folder:
        save_head(Path(folder) / "head.npz", head)
        back = load_head(Path(folder) / "head.npz")
    assert np.array_equal(back.mean, head.mean) and np.array_equal(back.faces, head.faces)
    assert np.allclose(back.expression_basis, head.expression_basis, atol=0.1), "expression_basis"


def check_hair(hair: Hair) -> None:
    """Hair is a premultiplied layer on the atlas, and a mesh or none, the same each time."""
    from bakery.bake.fitting import segment_portrait
    from bakery.bake.options import BuildOptions
    from bakery.geometry.color import to_linear
    from bakery.stages.atlas import make_atlas, make_view, visibility_of
    from bakery.stages.texture.hair import mattes_of

    _named(hair)
    seen = painted()
    head, neutral = seen.head, seen.subject.neutral
    segmentation = segment_portrait(seen.photo, seen.landmarks, BuildOptions())
    mattes = mattes_of(seen.photo.encoded, segmentation, seen.landmarks.points)
    atlas = make_atlas(head, 256).take("skin")
    vertices = head.vertices(neutral, seen.fit.expression, seen.fit.gaze)
    visibility = visibility_of(atlas, make_view(vertices, head, seen.fit.camera))
    linear = to_linear(seen.photo.encoded).astype(np.float32)
    layers = [hair.layer(linear, mattes, head, atlas, visibility) for _ in range(2)]
    layer = layers[0]
    assert layer.shape == (256, 256, 4), f"layer: shape {layer.shape}, needs (256, 256, 4)"
    assert layer.dtype == np.float32, f"layer: {layer.dtype}, needs float32"
    assert np.isfinite(layer).all() and layer.min() >= 0, "layer: not finite, or below 0"
    assert layer[..., 3].max() <= 1 + 1e-5, "layer: alpha above 1"
    assert not layer[layer[..., 3] == 0].any(), "layer: colour where alpha is 0; multiply it"
    _same(layer, layers[1], "layer")
    meshes = [hair.mesh(seen.photo, segmentation, seen.fit, head, neutral) for _ in range(2)]
    one, other = meshes
    assert (one is None) == (other is None), "mesh: differs from call to call"
    if one is not None and other is not None:
        _hair_mesh(one)
        for entry in fields(HairMesh):
            _same(getattr(one, entry.name), getattr(other, entry.name), f"mesh, {entry.name}")


def _hair_mesh(mesh: HairMesh) -> None:
    """Hair with volume that players can draw."""
    side = len(mesh.texture)
    assert side and not side & (side - 1), f"mesh: texture of {side} texels; needs a power of two"
    clear = mesh.texture[..., 3] == 0
    assert not mesh.texture[..., :3][clear].any(), "mesh: colour where alpha is 0; multiply it"
    assert np.isfinite(mesh.texture).all() and mesh.texture.min() >= 0, "mesh: texture not finite"
    assert mesh.texture[..., 3].max() <= 1, "mesh: alpha above 1"
    cap = mesh.kind == HAIR_KINDS.index("cap")
    assert (cap == (mesh.card < 0)).all(), "mesh: faces of the cap have card -1, others 0 or more"
    starts = np.flatnonzero(np.diff(mesh.card[~cap], prepend=-2))
    assert len(np.unique(mesh.card[~cap][starts])) == len(starts), "mesh: a card's faces lie apart"
    for level, most in enumerate(HAIR_TRIANGLES):
        count = int(mesh.shown(level).sum())
        assert count <= most, f"mesh: level {level} has {count} triangles, {most} at most"


def check_exporter(exporter: Exporter, avatar: Avatar) -> None:
    """An exporter writes what it names, leaves the avatar alone, and gives the same bytes twice."""
    _named(exporter)
    assert exporter.suffix == "" or exporter.suffix.startswith("."), "suffix: as .glb, or empty"
    place = PurePosixPath(exporter.place)
    assert exporter.place and not place.is_absolute() and ".." not in place.parts, "place: odd"
    before = avatar.textures.neutral.copy()
    found = []
    with TemporaryDirectory() as folder:
        for number in range(2):
            parent = Path(folder) / f"{number}"
            parent.mkdir()
            target = parent / f"made{exporter.suffix}"
            said = exporter.export(avatar, target, 256)
            assert isinstance(said, dict), "export: gives a table for the manifest, or {}"
            json.dumps(said, allow_nan=False)  # what JSON cannot hold, a manifest cannot
            assert target.is_file() if exporter.suffix else target.is_dir(), "export: wrote nothing"
            assert [path.name for path in parent.iterdir()] == [target.name], "export: wrote beside"
            paths = [path for path in sorted(parent.rglob("*")) if path.is_file()]
            assert paths, "export: an empty folder"
            found.append({path.relative_to(parent): path.read_bytes() for path in paths})
    assert np.array_equal(avatar.textures.neutral, before), "export: changes the avatar"
    differ = [str(name) for name in found[0] if found[0][name] != found[1].get(name)]
    assert not differ, f"export: {', '.join(differ)} differ from run to run"


def refuses(call: Callable[[], object], *words: str) -> None:
    """A call ends in one line that a user can mend, with all the words in it."""
    try:
        call()
    except BakeryError as error:
        text = str(error)
    else:
        raise AssertionError("nothing was refused")
    assert "\n" not in text, f"more than one line: {text!r}"
    missing = [word for word in words if word not in text]
    assert not missing, f"{text!r} lacks {missing}"


__all__ = [
    "Painted",
    "check_detector",
    "check_exporter",
    "check_generator",
    "check_hair",
    "check_head",
    "conditions",
    "painted",
    "refuses",
]
