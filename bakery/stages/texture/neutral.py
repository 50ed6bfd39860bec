"""T_0: the neutral texture of one person, with eyes, lids and hair, from one fitted photo."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np

from bakery.generators.base import Subject
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import LUMA, to_linear
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.landmarks import FACE
from bakery.parallel import beside
from bakery.stages.atlas import Atlas, Visibility, make_atlas, make_view, visibility_of
from bakery.stages.condition import condition
from bakery.stages.face_frame import neutral_picture
from bakery.stages.fit.rest import presence, shown
from bakery.stages.texture.calm import calmed, cheeks_of
from bakery.stages.texture.complete import INFERRED, PAINTED, CompleteAlbedo, complete
from bakery.stages.texture.creases import even_corners, even_wings, filled
from bakery.stages.texture.eyes import eye_maps, paint_eyes, with_lit_eyes
from bakery.stages.texture.glasses import frame_layer, laid_over
from bakery.stages.texture.hair import Mattes, hair_layer
from bakery.stages.texture.interior import paint_interior
from bakery.stages.texture.lashes import lay_lashes
from bakery.stages.texture.lids import lid_skin
from bakery.stages.texture.nostrils import one_pair
from bakery.stages.texture.rejoin import rejoined
from bakery.stages.texture.rest import RestBasis, change_of
from bakery.stages.texture.seam import closed_lips
from bakery.stages.texture.teeth import likely_teeth, teeth_color
from bakery.stages.texture.unwrap import PartialAlbedo, unwrap_albedo
from bakery.types import Fit, Landmarks, Photo

CHANGED = 0.1  # log ratio from which skin no longer counts as observed
LIFTED = (0.2, 0.5)  # log of a change of light: the strip beside hair is shown up to it, is not
TINT = 60  # share of the atlas over which that strip has the tint of the skin below
TINTED = 1.0  # log, by which its tint is changed at most
# Log by which the strip is lighter than the skin below: at most, and from which it is not shown.
GLARE = 0.25, 0.9
SHADE = 0.12  # log by which it may be darker than the skin below: more is a stain on evened skin
# Share of hair around, from which all of that is the shade of a fringe, up to which none is.
AMONG = 0.3, 0.08
DARK = 1e-3  # linear; below it no ratio is told


@dataclass(frozen=True)
class Prepared:
    """One person before any expression is painted."""

    subject: Subject
    source: np.ndarray  # [T, T] uint8, codes of texture_complete
    facing: np.ndarray  # [T, T] float32 0..1
    hair: np.ndarray  # [T, T, 4] float32 linear, colour multiplied by alpha


@dataclass(frozen=True, eq=False)
class SkinView:
    """The skin of one photo on the atlas, and the head as it was cut out of the photo."""

    atlas: Atlas
    on_skin: Atlas  # of the skin alone
    visibility: Visibility  # of that one
    vertices: np.ndarray  # [V, 3] mm, the shape as it stands in the photo
    image: np.ndarray  # [h, w, 3] float32 linear, no finer than the atlas can hold
    mattes: Mattes  # of that image, as are the next two
    points: np.ndarray  # [L, 2] pixels
    fit: Fit
    partial: PartialAlbedo


def unwrap_skin(
    photo: Photo,
    landmarks: Landmarks,
    fit: Fit,
    neutral: np.ndarray,
    head: HeadModel,
    mattes: Mattes,
    resolution: int,
) -> SkinView:
    """Cut the head out of a photo and unwrap its skin; arguments as for `prepare`."""
    atlas = make_atlas(head, resolution)
    vertices = head.vertices(neutral, fit.expression, fit.gaze)
    image, mattes, points, local = _cut_out(
        photo, mattes, landmarks.points, fit, head, vertices, resolution
    )
    on_skin = atlas.take("skin")
    visibility = visibility_of(on_skin, make_view(vertices, head, local.camera, edge=0.75))
    partial = unwrap_albedo(image, mattes, points, local, head, vertices, on_skin, visibility)
    return SkinView(atlas, on_skin, visibility, vertices, image, mattes, points, local, partial)


def prepare(
    photo: Photo,
    landmarks: Landmarks,
    fit: Fit,
    neutral: np.ndarray,
    head: HeadModel,
    mattes: Mattes,
    resolution: int,
    hair: Callable[..., np.ndarray] = hair_layer,
    rest: RestBasis | None = None,
    method: str = "quick",
    glasses: bool = False,
    keep: Callable[[Callable[[], CompleteAlbedo]], CompleteAlbedo] | None = None,
) -> Prepared:
    """Complete T_0, the eyes and the hair of one person.

    Args:
        photo: Photo.
        landmarks: Landmarks of the face in it.
        fit: Fit of the same photo.
        neutral: [V, 3] mm, the fitted neutral shape with its residual warp.
        mattes: Mattes of the photo.
        resolution: T.
        hair: what makes the hair, as `hair.base.Hair.layer`.
        rest: takes the photo's expression out of the skin; None keeps it.
        method: how skin that the photo does not show is completed, of texture.METHODS.
        glasses: keep their frames, in the layer of the hair.
        keep: takes a function that makes the completed skin, and gives that back, made or kept; None
            keeps nothing.

    Returns:
        Prepared.
    """
    view = unwrap_skin(photo, landmarks, fit, neutral, head, mattes, resolution)
    atlas, on_skin, local = view.atlas, view.on_skin, view.fit

    def completed() -> CompleteAlbedo:
        return complete(view.partial, head, view.vertices, on_skin, method)

    def layer() -> np.ndarray:
        return hair(view.image, view.mattes, head, on_skin, view.visibility)

    with beside(layer) as hairy:
        skin = keep(completed) if keep else completed()
    blank = np.zeros((8, 8, 3), np.float32)
    drawn = condition(head, neutral, blank, fit.expression, fit.gaze, local.camera)
    eyes = eye_maps(
        with_lit_eyes(view.image, view.points, skin.lift, head),
        view.mattes.occluder,
        view.points,
        local,
        head,
        view.vertices,
        drawn.part,
        drawn.depth,
        skin.tone,
    )
    texture = view.partial.lit(skin.albedo).reshape(-1, 3)
    source = skin.source.reshape(-1)
    facing = view.partial.seen.reshape(-1)[on_skin.index]
    texture[on_skin.index] = one_pair(texture[on_skin.index], facing, head, on_skin)
    if rest is not None:
        seen = texture[on_skin.index]
        expression = shown(fit)
        made = seen * np.exp(change_of(rest, head, on_skin, expression))
        share = presence(head, expression)
        made = filled(made, head, on_skin, share)
        made = even_wings(made, head, on_skin, share)
        plain = view.partial.plain.reshape(-1)[on_skin.index]
        if share:
            cheeks = cheeks_of(made, plain, head, on_skin)
            made = calmed(made, plain, cheeks, head, on_skin, share)
            made = rejoined(made, seen, cheeks, head, on_skin, share)
        made = closed_lips(made, facing, head, neutral, on_skin, landmarks.points)
        made = even_corners(made, head, on_skin, share)
        texture[on_skin.index] = made
        change = np.abs(np.log(np.maximum(made, DARK) / np.maximum(seen, DARK))).max(1)
        source[on_skin.index[change > CHANGED]] = INFERRED
    sclera = eyes.ball[:, 128, :].reshape(-1, 3)  # the horizontal meridian of both balls
    white = np.percentile(sclera, 75, axis=0)
    usual = likely_teeth(view.image, view.points)
    teeth = teeth_color(view.image, view.points, usual)
    for rows, colors in (
        paint_eyes(eyes, head, neutral, atlas),
        paint_interior(head, neutral, atlas, teeth, usual),
    ):
        texture[atlas.index[rows]] = colors
        source[atlas.index[rows]] = PAINTED
    texture = atlas.fill_gutter(texture.reshape(resolution, resolution, 3))
    lids = lid_skin(head, neutral, texture, atlas)
    turn = rotation.matrix(fit.camera.rotation)
    over = _lit_strip(hairy(), skin.lift, texture, view)
    if glasses:
        frames = frame_layer(view.image, view.mattes.frame, on_skin, view.visibility)
        over = laid_over(over, frames)
    over = atlas.fill_gutter(over)
    return Prepared(
        Subject(
            head,
            neutral,
            texture,
            eyes,
            lids,
            fit.light,
            turn,
            neutral_picture(photo.encoded, landmarks.points, fit, head, neutral, texture),
        ),
        source.reshape(resolution, resolution),
        view.partial.seen * view.partial.on_skin,
        lay_lashes(over, texture, head, white),
    )


def _lit_strip(
    over: np.ndarray, lift: np.ndarray, texture: np.ndarray, view: SkinView
) -> np.ndarray:
    """The layer of the hair [T, T, 4] whose strip of skin is as light as the skin beside it was made.

    Where that takes much the strip lies in shadow: it is left to the skin below. Its tint is that of the
    skin below: what is near hair lies in its shade, which is redder, and evened skin has no lamp's colour.
    It is hardly lighter than that skin, which has no glare, and little darker, but among strands, as
    a fringe's shade is.

    Args:
        lift: [T, T] log, as of CompleteAlbedo.
        texture: [T, T, 3] linear, the skin below.
    """
    strip, strands = (
        view.on_skin.paint(bilinear(matte, view.visibility.pixels))
        for matte in (view.mattes.strip, view.mattes.hair)
    )
    seen = view.on_skin.paint(view.visibility.visible.astype(np.float32))  # not what lies behind it
    share = seen * strip / np.maximum(strip + strands, 1e-3)
    beside = diffuse(lift[..., None].astype(np.float32), (lift != 0).astype(np.float32))[..., 0]
    out = over * (1 - share * smoothstep(*LIFTED, np.abs(beside)))[..., None]
    out[..., :3] *= np.exp(share * beside)[..., None]
    own, below = (
        np.log(np.maximum(color, DARK))
        for color in (out[..., :3] / np.maximum(out[..., 3:], DARK), texture)
    )
    off = normalized_blur(below - own, (share * out[..., 3]).astype(np.float32), len(over) / TINT)
    level = (off @ LUMA)[..., None]
    out *= 1 - share[..., None] * smoothstep(*GLARE, -level)
    hairy = cv2.GaussianBlur(seen * strands, (0, 0), len(over) / TINT)[..., None]
    brighter = np.clip(level - SHADE, 0, LIFTED[0]) * smoothstep(*AMONG, hairy)
    change = np.minimum(level + GLARE[0], 0) + brighter + np.clip(off - level, -TINTED, TINTED)
    out[..., :3] *= np.exp(share[..., None] * change)
    return out.astype(over.dtype)


def _cut_out(photo, mattes, points, fit, head, vertices, resolution):
    """The head out of the photo, no finer than the atlas can hold.

    Returns:
        linear image, its Mattes, landmarks [L, 2] and Fit, all in its own pixels.
    """
    pixels = cameras.project(vertices[head.part_vertices("skin")], fit.camera)
    face = cameras.project(head.landmarks(vertices)[:FACE], fit.camera)
    low = np.maximum(np.floor(pixels.min(0)) - 8, 0)
    high = np.minimum(np.ceil(pixels.max(0)) + 8, [photo.encoded.shape[1], photo.encoded.shape[0]])
    # A face takes about half of the atlas's side; 1.2 pixels a texel lose nothing when sampled.
    scale = min(1.0, 1.2 * 0.55 * resolution / max(np.ptp(face[:, 1]), 1))
    (x0, y0), (x1, y1) = low.astype(int), high.astype(int)

    def shrink(part):
        # By the very scale of the camera: to whole pixels a side, the far end lies a pixel beside.
        area = cv2.INTER_AREA
        return cv2.resize(part, None, fx=scale, fy=scale, interpolation=area) if scale < 1 else part

    linear = shrink(to_linear(photo.encoded[y0:y1, x0:x1]))
    camera = cameras.crop(fit.camera, x0, y0, linear.shape[1], linear.shape[0], scale)
    layers = Mattes(*(shrink(getattr(mattes, f.name)[y0:y1, x0:x1]) for f in fields(Mattes)))
    return linear, layers, (points - [x0, y0]) * scale, replace(fit, camera=camera)
