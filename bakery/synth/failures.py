"""Portraits that no good avatar can come from, each for one reason; of people who never lived.

They show what a bake warns of and what it makes of such a portrait (docs/failures.md).
"""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from bakery.errors import InputError
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
from bakery.geometry.camera import project
from bakery.heads.base import look, weights
from bakery.synth import props
from bakery.synth.likeness import identity_of
from bakery.synth.render import dress, paint
from bakery.synth.samples import CALM
from bakery.synth.scene import EXPRESSIVE, Scene, portrait_camera, studio_light
from bakery.synth.subject import Subject

SIZE = (768, 960)  # width and height, pixels
FILLING = 0.66  # share of the height between chin and crown
HARD = {"radius": 0.8, "fill": 0.0, "ambient": 0.06, "key": 1.3}  # a bare lamp in a dark room


@dataclass(frozen=True)
class Case:
    """One failure."""

    what: str  # in plain words
    code: str  # of the finding that must name it, see stages.assess
    seed: int
    traits: dict = field(default_factory=dict)  # of the Subject, where they are not drawn
    light: dict = field(default_factory=dict)  # of studio_light
    view: dict = field(default_factory=dict)  # of portrait_camera
    film: dict = field(default_factory=dict)  # of Scene
    expression: dict = field(default_factory=lambda: CALM)
    before: str = ""  # what is before the face: hand, glasses, dark glasses, brim or fringe


CASES = {
    "smile": Case(
        "a wide smile with teeth", "expression", 1,
        {"age": 34, "melanin": 0.9, "hair": "pulled_back", "hair_color": "black"},
        expression={**EXPRESSIVE["smile"], "jawOpen": 0.2},
    ),
    "three-quarter": Case(
        "head turned by 38 degrees", "yaw", 2,
        {"age": 41, "melanin": 0.4, "hair": "crop", "hair_color": "chestnut", "stubble": 0.4},
        view={"yaw": 38.0},
    ),
    "nose-shadow": Case(
        "bare lamp from above and aside", "cast_shadow", 3,
        {"age": 26, "melanin": 0.35, "hair": "pulled_back", "hair_color": "blond"},
        light={"azimuth": 42.0, "elevation": 42.0, **HARD},
    ),
    "half-shadow": Case(
        "half of the face in shadow", "hidden", 4, {"age": 30, "melanin": 0.5, "hair": "side_part"},
        light={"azimuth": -82.0, "elevation": 12.0, **HARD},
    ),
    "brim": Case(
        "shadow of a brim over eyes and nose", "cast_shadow", 5,
        {"age": 52, "melanin": 1.2, "hair": "crop", "hair_color": "black", "grey": 0.3},
        light={"azimuth": 8.0, "elevation": 46.0, **HARD}, before="brim",
    ),
    "dark": Case(
        "bare lamp, far too dark", "dark", 6,
        {"age": 28, "melanin": 0.4, "hair": "bob", "hair_color": "brown"},
        light={"azimuth": -55.0, "elevation": 35.0, **HARD, "key": 0.22, "ambient": 0.012},
        film={"grain": 3.0, "background_color": np.full(3, 0.012)},
    ),
    "glasses": Case(
        "glasses that mirror a window", "glasses", 7,
        {"age": 38, "melanin": 0.3, "hair": "side_part", "hair_color": "dark blond"}, before="glasses",
    ),
    "dark-glasses": Case(
        "dark glasses", "glasses", 8, {"age": 33, "melanin": 0.7, "hair": "bob"}, before="dark glasses"
    ),
    "fringe": Case(
        "hair over forehead and one eye", "hidden", 9,
        {"age": 23, "melanin": 0.45, "hair": "bob", "hair_color": "chestnut", "part": -1.0},
        before="fringe",
    ),
    "hand": Case(
        "a hand before chin and cheek", "covered", 10,
        {"age": 45, "melanin": 0.6, "hair": "side_part", "hair_color": "black"}, before="hand",
    ),
    "blurred": Case(
        "out of focus", "blur", 11,
        {"age": 31, "melanin": 1.9, "hair": "pulled_back", "hair_color": "black"}, film={"blur": 8.0},
    ),
    "small": Case(
        "a small face", "small", 12,
        {"age": 60, "melanin": 0.35, "hair": "thinning", "hair_color": "grey"},
        view={"filling": 0.40},
    ),
}  # fmt: skip
FACE = {"corner": 1.5, "lip_gap": -1.0, "jaw_width": -4.0, "eye_open": 0.8}  # see `likeness`
SMALL = 0.4  # of the size of the others


def subject_of(case, head):
    """Who sits for a case."""
    return Subject(case.seed, identity_of(head, FACE, case.seed, freedom=0.6), **case.traits)


def paint_case(head, name, scale=1.0, detail=4.0, share=1.0, supersample=2, quality=1.0):
    """Paint one case.

    Args:
        head: head model.
        name: key of CASES.
        scale: of SIZE.
        detail, share: see `render.dress`; supersample, quality: see `render.paint`.

    Returns:
        [H, W, 3] float32 sRGB-encoded 0..1.
    """
    case = CASES[name]
    width, height = (int(n * scale) for n in SIZE)
    subject = subject_of(case, head)
    wardrobe = dress(head, subject, detail, share)
    wardrobe = replace(wardrobe, **_before(case.before, wardrobe))
    film = {
        "background_color": np.array([0.32, 0.33, 0.35]),
        "grain": 1.0,
        "blur": 0.45,
        **case.film,
    }
    scene = Scene(
        portrait_camera(width, height, **{"filling": FILLING, **case.view}),
        studio_light(**case.light),
        look(weights(case.expression), (0.0, -3.5)),
        np.array([0.0, -3.5]),
        seed=case.seed,
        quality=None,
        **(film | {"blur": film["blur"] * scale}),
    )
    image = paint(wardrobe, scene, supersample, quality).encoded
    if case.before == "glasses":
        image = _mirrored_window(image, wardrobe, scene.camera)
    if name == "small":
        image = cv2.resize(image, None, fx=SMALL, fy=SMALL, interpolation=cv2.INTER_AREA)
    return image


def _before(what, wardrobe):
    """The fields of a wardrobe that change when a thing is before the face."""
    head, subject, neutral = wardrobe.head, wardrobe.subject, wardrobe.neutral
    if what == "hand":
        return {"props": (props.hand(head, subject, neutral),)}
    if what == "glasses":
        return {"props": tuple(props.glasses(head, neutral))}
    if what == "dark glasses":
        return {"props": tuple(props.glasses(head, neutral, (0.004, 0.004, 0.004)))}
    if what == "brim":
        brow = head.landmarks(neutral)[9].astype(float)
        across, near, far = [110.0, 0, 0], [0, 52.0, 18.0], [0, 62.0, 95.0]
        edges = [np.add(near, across), np.subtract(near, across)]
        edges += [np.subtract(far, across), np.add(far, across)]
        return {"props": (props.card(brow + edges),)}
    if what == "fringe":
        return {"hair": props.fringe(head, subject, neutral, wardrobe.hair)}
    return {}


def _mirrored_window(image, wardrobe, camera):
    """A window's light on both lenses of clear glasses."""
    out = image.copy()
    for side in props.LENS:
        rim = project(props.rim(wardrobe.head, wardrobe.neutral, side), camera)
        lens = np.zeros(image.shape[:2], np.float32)
        pane = lens.copy()
        cv2.fillPoly(lens, [np.round(rim * 16).astype(np.int32)], 1.0, shift=4)
        low, size = rim.min(0), np.ptp(rim, axis=0)
        corners = low + size * [[0.18, 0.05], [0.62, 0.0], [0.5, 0.62], [0.05, 0.7]]
        cv2.fillPoly(pane, [np.round(corners * 16).astype(np.int32)], 1.0, shift=4)
        pane = cv2.GaussianBlur(pane, (0, 0), size[0] * 0.02) * lens
        out += (np.array([0.86, 0.92, 0.97]) - out) * (0.10 * lens + 0.6 * pane)[..., None]
    return out.astype(np.float32)


def chosen(names=None):
    """Names of CASES: those given, or all.

    Raises:
        InputError: a name is not one of CASES.
    """
    wrong = sorted(set(names or ()) - set(CASES))
    if wrong:
        raise InputError(
            f"{', '.join(wrong)}: no such case; known: {', '.join(CASES)}; name some of these or none"
        )
    return names or tuple(CASES)


def write(head, folder, names=None, quality=93):
    """Paint cases into a folder: NAME.jpg.

    Args:
        head: head model.
        folder: Path; made if missing.
        names: which of CASES; None for all.

    Yields:
        Path of each picture once it is written.

    Raises:
        InputError: a name is not one of CASES.
    """
    wanted = chosen(names)
    folder.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        write_image(folder / f"{name}.jpg", paint_case(head, name), quality, PAINTED)
        yield folder / f"{name}.jpg"
