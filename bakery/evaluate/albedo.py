"""Is albedo the person's own: the same under three lights, and from two sides; on painted people.

Every light is brought to one reading of a light meter held before the face, as a photographer
exposes: what a white surface that faces the camera shows. Exposure by the picture's own mean would
take the skin's tone out of it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np

from bakery.bake.fitting import fit_portrait
from bakery.bake.textures import neutral_albedo
from bakery.bake.views import PhotoView
from bakery.evaluate.metrics import psnr
from bakery.formats.portraits import landmarks_of
from bakery.geometry import harmonics
from bakery.geometry.color import LUMA, to_encoded
from bakery.hair.layer import NoHair
from bakery.heads.base import HeadModel
from bakery.stages.atlas import make_atlas
from bakery.stages.fit.albedo import load_albedo, texel_chart
from bakery.stages.fit.samples import plain_skin
from bakery.stages.texture import TextureOptions
from bakery.stages.texture.complete import OBSERVED
from bakery.synth.chart import chart_of
from bakery.synth.hair import hair_color
from bakery.synth.light import Environment
from bakery.synth.render import Picture, dress, paint
from bakery.synth.scene import Scene, portrait_camera, studio_light
from bakery.synth.skin import design_skin, shade_inputs
from bakery.synth.subject import Subject, random_subject
from bakery.types import Landmarks, Photo

SIDE, SIZE = 640, 1024  # pixels of a photo, texels of an albedo
METER = 0.9  # luma that a white surface shows that faces the camera
MELANIN = (0.15, 0.6, 1.1, 1.7, 2.4, 3.1)  # palest to darkest; one person each, again and again
LIGHTS = {  # soft and from the front; warm, harder, from one side; cool, from above
    "front": dict(azimuth=-10, elevation=20, radius=26, key=0.7, fill=0.3, ambient=0.4, seed=1),
    "side": dict(azimuth=60, elevation=25, radius=10, key=1.0, fill=0.12, ambient=0.25, warm=1, seed=2),
    "above": dict(azimuth=-25, elevation=60, radius=20, key=0.6, fill=0.1, ambient=0.28, warm=-1, seed=3),
}  # fmt: skip
TURNED = 35.0  # degrees of yaw of the second view


@dataclass(frozen=True, eq=False)
class Shot:
    """One painted photo and its truth."""

    light: str
    yaw: float
    photo: Photo
    landmarks: Landmarks
    true_light: np.ndarray  # [9, 3] camera space


def person(head: HeadModel, number: int, seed: int = 0) -> Subject:
    """A painted person; their tones go from pale to dark, six to a round, no beards."""
    rng = np.random.default_rng([seed, number])
    drawn = random_subject(rng, head, 0.8)
    melanin = MELANIN[number % len(MELANIN)]
    dark = {"hair_color": "black", "iris": "dark brown", "freckles": 0.0} if melanin > 1 else {}
    short = {"hair": "crop"} if drawn.hair in ("bob", "pulled_back") else {}
    return replace(drawn, melanin=melanin, beard=0.0, **dark, **short)


def shots(head: HeadModel, subject: Subject) -> Iterator[Shot]:
    """A person's photos: from the front in each of LIGHTS, and turned in the first."""
    wardrobe = replace(dress(head, subject, 2.0, 0.1), share=0.25)
    for light, yaw in [*((name, 0.0) for name in LIGHTS), (next(iter(LIGHTS)), TURNED)]:
        camera = portrait_camera(SIDE, SIDE, yaw=yaw, filling=0.66)
        scene = Scene(camera, metered(studio_light(**LIGHTS[light])), seed=subject.seed)
        yield _shot(light, yaw, paint(wardrobe, scene, 1, 0.3))


def metered(light: Environment) -> Environment:
    """A light as bright as METER says, of the colour that it has."""
    shown = harmonics.irradiance(np.array([0.0, 0.0, 1.0]), light.irradiance()) @ LUMA
    gain = METER / shown
    lamps = tuple(replace(lamp, color=lamp.color * gain) for lamp in light.lamps)
    return replace(light, lamps=lamps, ambient=light.ambient * gain)


def _shot(light: str, yaw: float, picture: Picture) -> Shot:
    points = np.asarray(picture.landmarks, np.float64)
    photo = Photo(np.asarray(picture.encoded, np.float32), "painted")
    return Shot(light, yaw, photo, landmarks_of(points), picture.light)


def measure(head: HeadModel, subject: Subject) -> dict[str, float]:
    """How well a person's albedo is told from the light.

    Returns:
        lights: largest CIELAB distance between the mean albedo of two of LIGHTS; truth: mean distance
        from the painted albedo, over the same plain skin; views: dB between the albedo of two views
        (sRGB-encoded), where both see skin.

    Raises:
        BakeryError: a photo cannot be fitted.
    """
    seen = [_Seen(head, shot) for shot in shots(head, subject)]
    *lights, turned = seen
    plain = _plain(head) & np.all([one.skin for one in lights], 0)
    means = np.array([lab(one.albedo[plain].mean(0)) for one in lights])
    apart = [np.linalg.norm(a - b) for a, b in combinations(means, 2)]
    true = lab(true_albedo(head, subject)[plain].mean(0))
    both = lights[0].skin & turned.skin
    return {
        "lights": round(float(max(apart)), 3),
        "truth": round(float(np.linalg.norm(means - true, axis=1).mean()), 3),
        "views": round(psnr(*(to_encoded(one.albedo) for one in (lights[0], turned)), both), 3),
    }


class _Seen:
    """One photo's albedo [T, T, 3], and where it shows bare skin [T, T]."""

    def __init__(self, head: HeadModel, shot: Shot) -> None:
        fit, segmentation = fit_portrait("painted", shot.photo, shot.landmarks, head)
        view = PhotoView(shot.photo, shot.landmarks, fit, segmentation)
        albedo, prepared = neutral_albedo([view], head, NoHair(), TextureOptions(resolution=SIZE))
        self.albedo = np.asarray(albedo, np.float32)
        on_skin = make_atlas(head, SIZE).take("skin")
        self.skin = on_skin.paint(np.ones(len(on_skin.index), bool)) & (prepared.source == OBSERVED)


def _plain(head: HeadModel) -> np.ndarray:
    """Plain skin of the atlas [T, T]: off brows, eyes, nostrils and lips."""
    atlas, basis = make_atlas(head, SIZE).take("skin"), load_albedo()
    found: np.ndarray = atlas.paint(plain_skin(texel_chart(head, basis, atlas), basis.layout))
    return found


def true_albedo(head: HeadModel, subject: Subject, size: int = SIZE) -> np.ndarray:
    """The albedo [T, T, 3] that a person was painted with, on the skin of an atlas of `size`."""
    atlas, chart = make_atlas(head, size).take("skin"), chart_of(head, 2.0)
    maps = design_skin(chart, subject, chart.blank())
    points = atlas.at(head.mean)
    albedo, _, _, cavity, _ = shade_inputs(chart, maps, subject, points, hair_color(subject))
    painted: np.ndarray = atlas.paint(albedo * cavity[:, None])
    return painted


def lab(linear: np.ndarray) -> np.ndarray:
    """CIELAB (D65) of a linear colour [3]."""
    color = np.asarray(linear, np.float32).reshape(1, 1, 3)
    found: np.ndarray = cv2.cvtColor(color, cv2.COLOR_LRGB2LAB)[0, 0]
    return found


def summary(rows: list[dict[str, float]]) -> dict[str, float]:
    """Worst and mean of what `measure` found."""
    lights, views = ([row[name] for row in rows] for name in ("lights", "views"))
    return {
        "people": len(rows),
        "lights_mean": float(np.mean(lights)),
        "lights_worst": float(max(lights)),
        "truth_mean": float(np.mean([row["truth"] for row in rows])),
        "views_mean": float(np.mean(views)),
        "views_worst": float(min(views)),
    }
