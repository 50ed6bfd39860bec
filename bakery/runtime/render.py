"""Draw a frame of an avatar: the clear reference of every player."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_linear
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import EYES, PARTS
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import face_texture, gaze_slide, lay_hair, nearest_gaze
from bakery.runtime.cards import lay_picture
from bakery.runtime.hair_cards import hair_cards, hair_layer, paint_cap
from bakery.runtime.lash_cards import card_weights, lay_cards
from bakery.runtime.mouth import mouth_picture
from bakery.runtime.painted import Painted
from bakery.runtime.relight import hair_shine, relit, skin_without
from bakery.stages.texture.mouth import mouth_landmarks
from bakery.types import Camera, Textures

SAMPLES = 2  # per pixel and axis
SHOWN = ("skin", "eye_socket", "mouth_sheet", "eye_cap_left", "eye_cap_right", "tongue")
# The mouth proxy stands this far behind its place where it hides the tongue: else a tongue that comes
# out would end at a line between the lips. At rest, and in each mouth that is baked, the tongue is
# 15 mm behind it (9 mm with rolled lips), and the skin beside it hides as much of it as before.
BEHIND = 8.0  # mm
GRAY = 0.18  # linear, behind the head


@dataclass(frozen=True)
class Frame:
    """One drawn picture."""

    color: np.ndarray  # [H, W, 3] float32 linear, premultiplied by alpha
    alpha: np.ndarray  # [H, W] float32: share of the pixel that the head covers
    face: np.ndarray  # [H, W] float32: share that shows skin the photo knows, eyes or mouth
    # [H, W, 4] float32 linear, premultiplied: hair with volume, kept apart from the rest
    hair: np.ndarray | None = None


def draw(
    avatar: Avatar,
    vertices: np.ndarray,
    camera: Camera,
    expression: np.ndarray,
    gaze: np.ndarray,
    dynamic: bool = True,
    hair: bool = True,
    light: np.ndarray | None = None,
    apart: bool = False,
    painted: Painted | None = None,
) -> Frame:
    """Draw a deformed avatar.

    Args:
        avatar: runtime.avatar.Avatar.
        vertices: [V, 3] mm, deformed.
        camera: Camera of the picture.
        expression: [E] weights for eq. 4.
        gaze: [2] degrees.
        dynamic: False shows T_0 alone.
        hair: False leaves the hair out, layer and mesh.
        light: [9, 3] as `formats.light.read_light` gives it; None is the photo's own.
        apart: whether hair with volume is left to `over_photo`, which lays it over the photo too.
        painted: skin and mouth that something else painted for this frame.

    Returns:
        Frame.
    """
    head, textures = avatar.head, avatar.textures
    still = np.zeros_like(expression)
    skin = face_texture(textures, avatar.masks, expression if dynamic else still)
    if painted is not None:
        painted.onto(skin, np.asarray(textures.neutral, np.float32), None)
    layer = textures.hair if hair else None
    if light is not None:
        skin = skin_without(avatar, skin, layer)
    elif layer is not None:
        skin = lay_hair(skin, layer)
    fine = cameras.crop(
        camera, 0, 0, camera.width * SAMPLES, camera.height * SAMPLES, float(SAMPLES)
    )
    locks = hair_cards(textures.hair_mesh if hair else None)
    drawn = np.concatenate([vertices, locks.vertices])
    points = cameras.to_camera(drawn, fine)
    pixels, distance = cameras.project_camera(points, fine), -points[:, 2]
    distance[head.part_vertices("mouth_sheet")] += BEHIND
    faces = head.part_faces(*SHOWN)
    count = len(faces)
    corners = np.concatenate([head.faces[faces], len(vertices) + locks.cap])
    places = np.concatenate([head.uv[head.uv_faces[faces]], locks.cap_uv])
    found = rasterize(pixels, distance, corners, (fine.height, fine.width), cull=True)
    hit = found.face >= 0
    on_head = replace(found, face=np.where(found.face < count, found.face, -1))
    part = np.where(on_head.face >= 0, head.face_part[faces[on_head.face]], 255)
    uv = interpolate(found, places)
    color = bilinear(skin, uv * skin.shape[0]) * hit[..., None]

    if painted is None:
        mouth = mouth_picture(textures, mouth_landmarks(head, avatar.neutral, vertices))
    else:
        mouth = painted.mouth
    proxies = {"mouth_sheet": mouth}
    nearest = nearest_gaze(textures.gaze_directions, gaze)
    eyes = np.asarray(textures.gaze[nearest], np.float32)
    slide = gaze_slide(gaze - textures.gaze_directions[nearest])
    half = eyes.shape[1] // 2
    for which, eye in enumerate(EYES):
        proxies["eye_cap_" + eye] = np.ascontiguousarray(eyes[:, which * half : (which + 1) * half])
    for name, picture in proxies.items():
        mine = part == PARTS.index(name)
        if mine.any():
            left, top, width, height = head.uv_rectangles[name]
            local = (uv[mine] - [left, top]) / [width, height]
            if name != "mouth_sheet":
                local = local - slide
            color[mine] = bilinear(picture, local * picture.shape[1::-1])
    shine = np.ones_like(locks.vertices)
    if light is not None:
        color = relit(avatar, color, on_head, faces, vertices, light)
        shine = hair_shine(avatar, locks.normals, light)
    paint_cap(color, found, count, uv, locks, shine)

    known = bilinear(paintable(textures), uv * skin.shape[0]) * hit
    known = np.where((part != PARTS.index("skin")) & (part != 255), 1, known).astype(np.float32)
    capped = found.face >= count
    known[capped] = 0
    hit = hit.astype(np.float32)
    layer = np.asarray(textures.hair, np.float32)
    shown = card_weights(camera, avatar.fit.camera, expression)
    lay_cards(color, hit, known, found.depth, head, pixels, distance, layer, shown)
    planes = [color, hit, known]
    if len(locks.vertices):
        own = hair_layer(
            color, capped, found.depth, camera, pixels[len(vertices) :],
            distance[len(vertices) :], locks, shine,
        )  # fmt: skip
        if apart:
            planes.append(own)
        else:
            lay_picture(color, hit, own)
            known *= 1 - own[..., 3]
    size = (camera.width, camera.height)
    return Frame(
        *(cv2.resize(x.astype(np.float32), size, interpolation=cv2.INTER_AREA) for x in planes)
    )


def paintable(textures: Textures) -> np.ndarray:
    """Where skin comes from the photo [T, T] float32: only there it may cover the photo again."""
    known = np.isin(textures.source, (1, 2)).astype(np.float32)
    size = known.shape[0]
    return smoothstep(0.35, 0.9, cv2.GaussianBlur(known, (0, 0), size / 170)).astype(np.float32)


def over_gray(frame: Frame, gray: float = GRAY) -> np.ndarray:
    """The frame over a plain background: [H, W, 3] linear."""
    return frame.color + (1 - frame.alpha[..., None]) * gray


def in_photo(avatar: Avatar) -> np.ndarray:
    """Where the vertices of the portrait's own face lie in the portrait: [V, 2] pixels."""
    fit = avatar.fit
    return cameras.project(
        avatar.head.vertices(avatar.neutral, fit.expression, fit.gaze), fit.camera
    )


def portrait_at(avatar: Avatar, camera: Camera) -> tuple[Avatar, np.ndarray]:
    """The portrait in another size.

    Args:
        avatar: its photo is kept.
        camera: the portrait's own camera, scaled.

    Returns:
        the avatar as `over_photo` wants it, and its photo [H, W, 3] float32 linear.
    """
    if avatar.photo is None:
        raise ValueError("portrait_at: the avatar has no photo; bake it with --keep-photo")
    # By the camera's own scale: in a picture of whole (for videos, even) pixels that were stretched to
    # fit, its far edge would lie up to a pixel beside the face.
    scale = camera.focal / avatar.fit.camera.focal
    smooth = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    photo = cv2.resize(avatar.photo, None, fx=scale, fy=scale, interpolation=smooth)
    right, below = camera.width - photo.shape[1], camera.height - photo.shape[0]
    photo = cv2.copyMakeBorder(photo, 0, max(below, 0), 0, max(right, 0), cv2.BORDER_REPLICATE)
    photo = photo[: camera.height, : camera.width]
    portrait = replace(avatar, fit=replace(avatar.fit, camera=camera))
    return portrait, to_linear(photo).astype(np.float32)


def over_photo(
    avatar: Avatar,
    frame: Frame,
    vertices: np.ndarray,
    linear_photo: np.ndarray,
    source: np.ndarray | None = None,
) -> np.ndarray:
    """The frame over the portrait itself: [H, W, 3] linear.

    What lies around the face (hair, ears, neck) is taken from the photo, pulled along with the
    surface it borders on, so that a jaw that drops leaves no second jaw behind.

    Args:
        frame: drawn with the portrait's camera, hair with volume `apart`.
        vertices: [V, 3] mm as drawn.
        linear_photo: [H, W, 3].
        source: `in_photo(avatar)`, for those who draw many frames.
    """
    head, camera = avatar.head, avatar.fit.camera
    source = in_photo(avatar) if source is None else source
    faces = head.part_faces("skin")
    points = cameras.to_camera(vertices, camera)
    found = rasterize(
        cameras.project_camera(points, camera), -points[:, 2], head.faces[faces],
        (camera.height, camera.width), cull=True,
    )  # fmt: skip
    across, down = (np.arange(n) + 0.5 for n in (camera.width, camera.height))
    here = np.stack(np.meshgrid(across, down), -1).astype(np.float32)
    flow = interpolate(found, source[head.faces[faces]]).astype(np.float32) - here
    inside = found.face >= 0
    away = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 3)
    reach = 0.12 * camera.height
    weight = np.where(inside, 1.0, np.clip(away / reach - 1, 0, 1)).astype(np.float32)
    flow = diffuse(np.where(inside[..., None], flow, 0), weight)
    around = bilinear(linear_photo, here + flow)
    share = np.minimum(frame.alpha, frame.face)[..., None]
    own = frame.color / np.maximum(frame.alpha, 1e-3)[..., None]
    picture: np.ndarray = own * share + around * (1 - share)
    if frame.hair is not None:
        lay_picture(picture, np.ones_like(frame.alpha), frame.hair)
    return picture
