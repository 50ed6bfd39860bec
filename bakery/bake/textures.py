"""The textures of one person: condition -> generate -> texture, for each key, gaze and mouth."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import fields, replace
from functools import partial

import numpy as np

from bakery.bake.fitting import made_from, own_head
from bakery.bake.kept import Arrays, Kept
from bakery.bake.options import BuildOptions
from bakery.bake.targets import Targets, read_targets
from bakery.bake.views import PhotoView, merged, quality
from bakery.generators.base import Generator, Subject
from bakery.generators.eyes import EyeMaps
from bakery.generators.lids import LidSkin
from bakery.geometry import rotation
from bakery.hair.base import Hair
from bakery.heads.base import HeadModel
from bakery.parallel import ahead, beside
from bakery.plugins import maker_of
from bakery.stages.atlas import make_atlas
from bakery.stages.condition import condition, face_camera
from bakery.stages.generate import generate
from bakery.stages.segment import Segmentation
from bakery.stages.texture import TextureOptions, gaze, keys, mouth
from bakery.stages.texture.albedo import albedo_of
from bakery.stages.texture.complete import CompleteAlbedo
from bakery.stages.texture.hair import mattes_of
from bakery.stages.texture.hairline import beside_mesh
from bakery.stages.texture.neutral import Prepared, prepare
from bakery.stages.texture.proxies import eye_proxies, make_proxy
from bakery.stages.texture.rest import rest_of
from bakery.stages.texture.tongue import keep_in, tongue_light
from bakery.types import Camera, Conditions, Fit, HairMesh, Landmarks, Photo, Textures

AHEAD = (0.0, 0.0)  # degrees of gaze
STEPS = ("neutral", "key", "gaze", "mouth")  # what `paint` tells of its progress
# Pictures a kept part: each takes the time of about a second to paint.
GAZES, MOUTHS = 10, 25


class Painter:
    """One person and one generator: an expression, gaze or pose in, a texture out."""

    def __init__(
        self, subject: Subject, generator: Generator, fit: Fit, options: TextureOptions
    ) -> None:
        head, resolution = subject.head, options.resolution
        self.subject, self.generator = subject, generator
        self.views = keys.key_cameras(subject, fit, options.views)
        self.skin = keys.ratio_atlas(head, resolution)
        camera = face_camera(fit, head, subject.neutral)
        self.strip, self.caps = gaze.strip_camera(subject, camera), eye_proxies(head, resolution)
        piece, self.crop = mouth.cut(subject), mouth.crop_camera(subject, camera)
        # Players draw a tongue that is out before the picture of what is behind it.
        self.piece = replace(piece, head=keep_in(piece.head))
        self.tongue = tongue_light(subject, make_atlas(head, resolution))
        self.sheet = make_proxy(self.piece.head, "mouth_sheet", resolution)
        self.closed = mouth.closed_mouth(subject, self.sheet)

    def key(self, weights: np.ndarray) -> Arrays:
        """T_k [T, T, 3] of a key expression [E], from all views."""
        seen = (self._seen(self.subject, weights, AHEAD, camera) for camera in self.views)
        pictures = ((view, generate(self.generator, self.subject, view)) for view in seen)
        return {"texture": keys.key_texture(pictures, self.subject, self.skin)}

    def gaze(self, direction: np.ndarray) -> Arrays:
        """Both eye proxies [h, 2 w, 3] of a gaze [2] degrees."""
        expression = gaze.gaze_expression(direction)
        seen = self._seen(self.subject, expression, direction, self.strip)
        picture = seen, generate(self.generator, self.subject, seen)
        return {"texture": gaze.gaze_texture(picture, self.subject, self.caps)}

    def mouth(self, pose: np.ndarray) -> Arrays:
        """The mouth proxy [h, w, 3] of a pose [E], and its lip landmarks [40, 2]."""
        seen = self._seen(self.piece, pose, AHEAD, self.crop)
        picture = seen, generate(self.generator, self.piece, seen, interior_only=True)
        texture, lips = mouth.mouth_texture(picture, self.piece, self.sheet, self.closed)
        return {"texture": texture, "landmarks": lips}

    def lit(self, texture: np.ndarray) -> np.ndarray:
        """A face texture [T, T, 3] for players, which draw a tongue in no light but its own."""
        lit: np.ndarray = (texture * self.tongue).astype(np.float16)
        return lit

    @staticmethod
    def _seen(
        subject: Subject,
        weights: np.ndarray,
        direction: Sequence[float] | np.ndarray,
        camera: Camera,
    ) -> Conditions:
        return condition(subject.head, subject.neutral, subject.texture, weights, direction, camera)


def paint(
    photo: Photo,
    landmarks: Landmarks,
    fit: Fit,
    segmentation: Segmentation,
    head: HeadModel,
    generator: Generator,
    hair: Hair,
    options: BuildOptions,
    kept: Kept | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    wanted: Targets | None = None,
    views: Sequence[PhotoView] = (),
) -> Textures:
    """Paint all textures of one fit.

    Args:
        head: the head model that was fitted.
        generator: what paints.
        hair: what makes the hair.
        kept: where finished parts are kept.
        progress: called with (step, done, total).
        wanted: the expressions, gazes and mouths; None takes those of presets/expressions.
        views: further photos of the person, fitted with the same identity and warp, for what the
            photo sees badly.

    Raises:
        ModelError: the generator gave back something that cannot be used.
    """
    origin = made_from(photo, landmarks, fit, head)
    head, neutral = own_head(head, fit)
    wanted = wanted or read_targets()
    kept = kept or Kept()
    directions = gaze.with_own_gaze(wanted.gaze, fit.gaze)
    poses = wanted.mouths[: options.texture.mouths]
    total = 1 + len(wanted.key_names) + len(directions) + len(poses)
    numbers = iter(range(total))

    def say(word: str) -> None:
        if progress:
            progress(word, next(numbers), total)

    def painted(
        word: str, make: Callable[[np.ndarray], Arrays], rows: np.ndarray, size: int
    ) -> Iterator[Arrays]:
        with closing(kept.series(word, make, list(rows), size)) as series:
            for _ in rows:
                say(word)
                yield next(series)

    say("neutral")
    if hasattr(generator, "get_ready"):
        ahead(generator.get_ready, head)

    def whole() -> Arrays:
        seen = [PhotoView(photo, landmarks, fit, segmentation), *views]
        return _to_arrays(unwrapped(seen, head, neutral, hair, options.texture, kept))

    def volume() -> Arrays:
        made = hair.mesh(photo, segmentation, fit, head, neutral)
        return {} if made is None else {f.name: getattr(made, f.name) for f in fields(HairMesh)}

    # Hair with volume does not depend on the skin: with it, both cores have work.
    with beside(partial(kept.one, "hair", volume)) as hairdo:
        arrays = kept.one("neutral", whole)
        for number in range(1 + len(views)):
            kept.drop(f"skin{number}")
        prepared = _from_arrays(arrays, head, neutral, fit)
        of_hair = hairdo()
    mesh = HairMesh(**of_hair) if of_hair else None

    def unpainted() -> tuple[np.ndarray, np.ndarray]:
        """The layer of the hair and the albedo, of which no picture is painted."""
        layer = beside_mesh(prepared.hair, mesh, head, neutral, fit.camera)
        return layer.astype(np.float16), albedo_of(prepared.subject, fit).astype(np.float16)

    painter = Painter(prepared.subject, generator, fit, options.texture)
    with beside(unpainted) as others:
        of_keys = list(painted("key", painter.key, wanted.key_weights, 1))
        of_gaze = list(painted("gaze", painter.gaze, directions, GAZES))
        of_mouths = list(painted("mouth", painter.mouth, poses, MOUTHS))
        layer, albedo = others()
    return Textures(
        neutral=painter.lit(prepared.subject.texture),
        keys=np.stack([painter.lit(row["texture"]) for row in of_keys]),
        key_names=wanted.key_names,
        key_weights=wanted.key_weights,
        source=prepared.source,
        facing=prepared.facing.astype(np.float16),
        hair=layer,
        gaze=np.stack([row["texture"] for row in of_gaze]),
        gaze_directions=directions,
        mouths=np.stack([row["texture"] for row in of_mouths]),
        mouth_landmarks=np.stack([row["landmarks"] for row in of_mouths]),
        mouth_weights=poses,
        maker=maker_of("generators", generator),
        made_from=origin,
        albedo=albedo,
        hair_mesh=mesh,
    )


def unwrapped(
    seen: Sequence[PhotoView],
    head: HeadModel,
    neutral: np.ndarray,
    hair: Hair,
    options: TextureOptions,
    kept: Kept | None = None,
) -> Prepared:
    """The neutral texture of one person.

    Args:
        seen: photos of the person; the first leads.
        head: as the person has it; neutral: [V, 3] mm.
        hair: what makes the hair.
        kept: where the completed skin of each photo is kept until all of the texture is.
    """
    kept = kept or Kept()

    def one(number: int, view: PhotoView) -> Prepared:
        mattes = mattes_of(view.photo.encoded, view.segmentation, view.landmarks.points)
        return prepare(
            view.photo, view.landmarks, view.fit, neutral, head, mattes, options.resolution,
            hair.layer, rest_of(options), options.complete, options.glasses == "keep",
            partial(kept.record, f"skin{number}", CompleteAlbedo),
        )  # fmt: skip

    first, *more = [one(number, view) for number, view in enumerate(seen)]
    if not more:
        return first
    weights = [
        quality(head, neutral, each, view.fit, options.resolution)
        for each, view in zip([first, *more], seen)
    ]
    return merged(first, more, weights)


def neutral_albedo(
    seen: Sequence[PhotoView], head: HeadModel, hair: Hair, options: TextureOptions
) -> tuple[np.ndarray, Prepared]:
    """The albedo [T, T, 3] float16 that a bundle of these photos holds, and what it is made from.

    Args:
        seen: photos of one person; the first leads.
        head: the head model that was fitted.
        hair: what makes the hair.
    """
    own, neutral = own_head(head, seen[0].fit)
    prepared = unwrapped(seen, own, neutral, hair, options)
    return albedo_of(prepared.subject, seen[0].fit).astype(np.float16), prepared


def _to_arrays(prepared: Prepared) -> Arrays:
    """What of a neutral texture neither the head nor the fit says, as named arrays."""
    subject = prepared.subject
    return {
        "texture": subject.texture,
        "photo": subject.photo,
        **{f"eyes_{field.name}": getattr(subject.eyes, field.name) for field in fields(EyeMaps)},
        **{f"lids_{field.name}": getattr(subject.lids, field.name) for field in fields(LidSkin)},
        "source": prepared.source,
        "facing": prepared.facing,
        "hair": prepared.hair,
    }


def _from_arrays(arrays: Arrays, head: HeadModel, neutral: np.ndarray, fit: Fit) -> Prepared:
    eyes = EyeMaps(*(arrays[f"eyes_{field.name}"] for field in fields(EyeMaps)))
    lids = LidSkin(*(arrays[f"lids_{field.name}"] for field in fields(LidSkin)))
    turn = rotation.matrix(fit.camera.rotation)
    subject = Subject(
        head, neutral, arrays["texture"], eyes, lids, fit.light, turn, arrays["photo"]
    )
    return Prepared(subject, arrays["source"], arrays["facing"], arrays["hair"])
