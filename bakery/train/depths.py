"""How far features of the face stand ahead, measured on photographs of turned heads.

From the front depth is not seen. In a head that is turned, what stands ahead moves to a side: over
many people the slope of that move against the sine of the turn is what the model lacks in depth.
"""

import numpy as np

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.heads.build import learn, makehuman, parallax
from bakery.heads.build.control import FLIP
from bakery.heads.build.parallax import Depths
from bakery.heads.place import offsets_from
from bakery.stages.fit import FitOptions, Shape, landmark_fit, landmark_model, sideways
from bakery.stages.fit.person import Shot
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

SIDEWAYS = [
    EXPRESSION_INDEX[part + side] for part in ("mouth", "jaw") for side in ("Left", "Right")
]
SMILE = [EXPRESSION_INDEX["mouthSmile" + side] for side in ("Left", "Right")]


def learn_depths(raw, known, points, sizes):
    """Give the mean of the default head, and its smile, the depth that turned faces show.

    Args:
        raw: Raw, from `heads.build.wheel.read_wheel`; known: what `recipe.learn_all` found.
        points, sizes: as for `missing_depths`.

    Returns:
        (what was done, the mapping that `makehuman.build` takes as `known`).
    """
    head = makehuman.build(raw, known=known)
    control = makehuman.prepare(raw, known)
    matrix, twin = learn.landmark_matrix(control, head), sideways.twins(head)
    lacks = missing_depths(head, points, sizes)
    shift = parallax.depth_shift(head, lacks)
    depth = np.tensordot(shift, control.sliders[..., 2].astype(float), 1)
    # Lids and eyeballs fit each other: the rest of the head moves.
    depth -= (matrix @ depth)[np.concatenate(marks.EYES)].mean()
    smile = known["smile"].copy()
    smile[:, 2] += parallax.smile_depth(control, matrix, lacks)
    found = {**known, "depth": depth.astype(np.float32), "smile": smile}
    places = matrix @ makehuman.prepare(raw, found).mean
    found["positions"] = ((places + places[twin] * FLIP) / 2).astype(np.float32)
    moved = np.sqrt(((matrix @ depth)[parallax.SEEN] ** 2).mean())
    lips = lacks.smile[parallax.STEADY].mean() - lacks.smile[marks.LIPS].mean()
    return (
        f"depth: features moved by {moved:.1f} mm, told by turns of {lacks.turned:.1f} degrees; "
        f"lips of smiles stand {lips:.1f} mm ahead"
    ), found


def fits_of(head, points, sizes):
    """Fit a head to people's points as a bake does, without their colours.

    Args:
        head: HeadModel with landmarks.
        points: [N, 478, 2] pixels of faces, of which some are turned; sizes: [N, 2].

    Yields:
        (points [468, 2], Camera, Shape, landmarks of the shape [468, 3] mm) of each face.
    """
    options = FitOptions()
    model = landmark_model(head, options.modes)
    start = Shape(np.zeros(len(head.identity_basis)), np.zeros(len(EXPRESSIONS)))
    for face, size in zip(points, sizes):
        width, height = map(int, size)
        focal = options.focal * max(width, height)
        shot = Shot(face, np.ones(len(face)), focal, width, height)
        camera, shape = landmark_fit(
            head, model, shot.start(model), start, shot.points, shot.confidence, options
        )
        yield face[: marks.FACE], camera, shape, model.points(shape)


def missing_depths(head, points, sizes):
    """What a head lacks in depth, from `fits_of` people: Depths. Both sides are taken alike."""
    model, twin = landmark_model(head, FitOptions().modes), sideways.twins(head)
    aside, slope, smiling = [], [], []
    for face, camera, shape, _ in fits_of(head, points, sizes):
        weights = shape.expression.copy()
        weights[SIDEWAYS] = 0
        person = model.points(Shape(shape.identity, weights))
        person = (person + person[twin] * FLIP) / 2
        side = side_of(camera)
        move = offsets_from(person, camera, face) @ side
        aside.append((move + move[twin]) / 2)
        slope.append(side[2])
        smiling.append(weights[SMILE].mean())
    slope = np.array(slope)
    rows = np.stack([np.ones(len(slope)), slope, slope * smiling], 1)
    _, rest, more = np.linalg.lstsq(rows, np.array(aside), rcond=None)[0]
    return Depths(rest, more, float(np.degrees(np.sqrt((np.arcsin(slope) ** 2).mean()))))


def measure_turned(head, points, sizes):
    """How well a head fits turned faces, by name: points in percent of the eye distance, and how far
    the mouth is thought to go to a side where the head is turned."""
    errors, slopes, mouths = [], [], []
    for face, camera, shape, places in fits_of(head, points, sizes):
        miss = np.linalg.norm(cameras.project(places, camera) - face, axis=1)
        errors.append(miss / marks.face_size(face))
        slopes.append(np.degrees(np.arcsin(side_of(camera)[2])))
        left, right = (
            shape.expression[EXPRESSION_INDEX["mouth" + side]] for side in ("Left", "Right")
        )
        mouths.append(left - right)
    error, spread = 100 * np.mean(errors, axis=0), np.std(slopes) * np.std(mouths)
    common = float(np.cov(slopes, mouths, ddof=0)[0, 1] / spread) if spread > 0 else 0.0
    parts = {"eyes": np.concatenate(marks.EYES), "nose": marks.NOSE, "lips": marks.LIPS}
    return {
        **{
            f"turned: {name}, %": round(float(error[part].mean()), 3)
            for name, part in parts.items()
        },
        "turned: mouthLeft less mouthRight, rms": round(float(np.std(mouths)), 3),
        "turned: its correlation with the turn": round(common, 2),
    }


def side_of(camera):
    """Unit vector [3] in head space: the head's own x axis as the picture shows it."""
    ahead = cameras.position(camera)
    ahead /= np.linalg.norm(ahead)  # from the head to the camera
    side = np.array([1.0, 0, 0]) - ahead[0] * ahead
    unit: np.ndarray = side / np.linalg.norm(side)
    return unit
