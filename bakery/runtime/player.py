"""The fast player: the frames of `render.draw`, many a second. The tests hold the two together.

What makes it fast: only the vertices that are shown move; only texels in sight are blended, in
squares that lie together; the textures carry the hair already (equation 4 is a mean, so hair over
the mean is the mean of hair over each); a median looks at visible texels only.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import to_encoded
from bakery.heads.base import CARDS, EYES, FOLLOW, PARTS, PROXIES, HeadModel
from bakery.heads.mouth import LIPS
from bakery.runtime import card_kernels, kernels, raster_kernels, shading
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import gaze_slide, lay_hair, nearest_gaze
from bakery.runtime.hair_cards import hair_cards
from bakery.runtime.lash_cards import card_sides, card_weights
from bakery.runtime.mouth import neighbours
from bakery.runtime.painted import Painted
from bakery.runtime.render import BEHIND, GRAY, SAMPLES, SHOWN, Frame, paintable
from bakery.types import Camera, Textures

Felt = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # see `_felt`
FAINT = 5e-4  # mask below which an expression is not felt in a square of texels
# Share of all weight that the last mouths together may have and still be left out of the median.
TAIL = 1e-5
LARGEST = 2048  # texels on a side that are played; more would take 1.4 GB and show no difference
LEVELS = 1 << 16  # steps of the table from linear to sRGB bytes
STEPS = (1 << 16) - 1  # of a texture's colour: the darkest step is 0.05 of an sRGB byte


@dataclass
class Workspace:
    """The buffers of one thread, for pictures of one size."""

    face: np.ndarray  # [H n, W n] int32
    best: np.ndarray  # [H n, W n] float32
    farthest: np.ndarray  # [ceil(H n / BLOCK), ceil(W n / BLOCK)] float32
    texels: np.ndarray  # [..., 4] float32: skin, mouth, both eyes, the hair's cap
    plain: np.ndarray  # [tiles] bool: squares of the skin that hold the neutral texture
    seen: np.ndarray  # [F] bool
    needed: np.ndarray  # [tiles] bool
    planes: np.ndarray  # [F, 9] float64
    marks: np.ndarray  # [h, w] bool
    cards: np.ndarray  # [H n, W n, 4] float32: hair, lashes and tear line
    touched: np.ndarray  # bool, as `farthest`: where there are any of them
    hiding: np.ndarray  # [H n, W n] float32: alpha of the hair alone
    color: np.ndarray  # [H, W, 4] float32: premultiplied colour, `Frame.face`
    alpha: np.ndarray  # [H, W] float32
    hair: np.ndarray  # [H, W, 4] float32: `Frame.hair`


class Player:
    """An avatar made ready to be drawn fast; threads may share it."""

    def __init__(self, avatar: Avatar, hair: bool = True) -> None:
        self.avatar, self.haired = avatar, hair
        head, textures = avatar.head, avatar.textures
        shown, cards = head.part_faces(*SHOWN), head.part_faces(*CARDS)
        used, compact = np.unique(head.faces[[*shown, *cards]], return_inverse=True)
        self.used = used  # [v] the vertices that are shown
        compact = compact.reshape(-1, 3).astype(np.int32)
        self.hair = hair_cards(textures.hair_mesh if hair else None)
        self.faces = np.concatenate([compact[: len(shown)], self.hair.cap + np.int32(len(used))])
        self.late = len(self.faces) - len(self.hair.cap) // 2  # the cap's inner side
        self.hair_faces = self.hair.cards + np.int32(len(used))
        self.card_faces = compact[len(shown) :]
        self.rest = np.ascontiguousarray(avatar.neutral[used], np.float32)
        basis = np.asarray(head.expression_basis[:, used], np.float32)
        self.basis = basis.reshape(len(basis), -1)  # [E, 3 v]
        self.centers = head.eye_centers(avatar.neutral)
        self.balls = [
            np.flatnonzero(head.follow[used] == FOLLOW.index("eye_" + eye)) for eye in EYES
        ]
        self._prepare_lips(head, avatar.neutral)
        self.size = min(textures.neutral.shape[0], LARGEST)  # T
        self.squares, self.unit = _squares(textures, hair, self.size)
        self.known = _shrunk(paintable(textures), self.size)  # [T, T]
        self.felt = _felt(np.asarray(avatar.masks, np.float32), self.size)
        self.mouths = np.ascontiguousarray(sortable(textures.mouths).transpose(1, 2, 3, 0))
        eyes = np.stack(np.split(np.asarray(textures.gaze, np.float32), 2, axis=2), 1)
        self.eyes = np.concatenate([eyes, np.ones_like(eyes[..., :1])], -1)  # [20, 2, h, w, 4]
        self.cap_texture, cap_corners = _piece(self.hair.texture, self.hair.cap_uv)
        sides = [(self.size, self.size), self.mouths.shape[:2], *[self.eyes.shape[2:4]] * 2]
        sides.append(self.cap_texture.shape[:2])
        starts = np.cumsum([0, *(height * width for height, width in sides)])
        self.texels = starts[-1]
        self.places = np.array([(n, w, h) for n, (h, w) in zip(starts, sides)])
        self.places = self.places[[0, 1, 2, 3, 0, 4]]  # the tongue lies on the skin's texture
        self._prepare_faces(head, shown, cap_corners)
        self._prepare_cards(head, cards)
        self.bytes = np.floor(
            to_encoded(np.arange(LEVELS, dtype=np.float32) / (LEVELS - 1)) * 255 + 0.5
        ).astype(np.uint8)

    def _prepare_lips(self, head: HeadModel, neutral: np.ndarray) -> None:
        """Lip landmarks as `texture_mouth.mouth_landmarks` gives them, linear in the weights."""

        def on(values: np.ndarray, points: np.ndarray) -> np.ndarray:  # [..., V, 3] -> [..., n, 3]
            corner = values[..., head.landmark_vertices[points], :]
            weights = head.landmark_barycentric[points]
            places: np.ndarray = np.einsum("...lkc,lk->...lc", corner, weights)
            return places

        ends, rest = on(neutral, marks.MOUTH_CORNERS), on(neutral, LIPS)
        scale = np.array([1, -1]) / np.linalg.norm(ends[0] - ends[1])
        self.lips_rest = (rest - rest.mean(0))[:, :2] * scale
        self.lips_basis = on(head.expression_basis, LIPS)[..., :2] * scale

    def _prepare_faces(self, head: HeadModel, shown: np.ndarray, cap: np.ndarray) -> None:
        """Where each face lies on its texture, and which squares of the skin it touches.

        Args:
            cap: [C, 3, 2] texels, of the faces of the hair's cap.
        """
        size = self.size
        sizes = {"mouth_sheet": self.mouths.shape[1::-1]}
        for eye in EYES:
            sizes["eye_cap_" + eye] = self.eyes.shape[3:1:-1]
        uv = head.uv[head.uv_faces[shown]].astype(np.float64)  # [F, 3, 2]
        self.corners = uv * size
        self.kind = np.zeros(len(shown), np.uint8)
        for number, name in enumerate(PROXIES, 1):
            mine = head.face_part[shown] == PARTS.index(name)
            self.kind[mine] = number
            if mine.any():
                left, top, width, height = head.uv_rectangles[name]
                local = (uv[mine] - [left, top]) / [width, height]
                self.corners[mine] = local * sizes[name]
        self.kind[head.face_part[shown] == PARTS.index("tongue")] = shading.TONGUE
        self.kind = np.concatenate([self.kind, np.full(len(cap), shading.CAP, np.uint8)])
        self.corners = np.concatenate([self.corners, cap])
        self.sheet = np.unique(self.faces[self.kind == 1])
        across = -(-size // kernels.TILE)
        low = np.clip((self.corners.min(1) - 1.5) // kernels.TILE, 0, across - 1).astype(int)
        high = np.clip((self.corners.max(1) + 1.5) // kernels.TILE, 0, across - 1).astype(int)
        high[(self.kind != 0) & (self.kind != shading.TONGUE)] = -1  # on no tile of the skin
        sides = np.maximum(high - low + 1, 0)
        counts = sides.prod(1)
        self.tile_start = np.cumsum([0, *counts]).astype(np.int32)
        face = np.repeat(np.arange(len(counts)), counts)
        row, column = np.divmod(np.arange(len(face)) - self.tile_start[face], sides[face, 0])
        self.tile_list = ((low[face, 1] + row) * across + low[face, 0] + column).astype(np.int32)
        self.corners = self.corners.astype(np.float32)

    def _prepare_cards(self, head: HeadModel, cards: np.ndarray) -> None:
        """Pieces of textures for lashes and hair; old bundles have no lashes in the hair layer."""
        layer = self.avatar.textures.hair
        piece, self.card_corners = _piece(
            np.asarray(layer, np.float32), head.uv[head.uv_faces[cards]]
        )
        if not piece[..., 3:].any():
            self.card_faces = self.card_faces[:0]
        self.card_texture = card_kernels.encoded(piece)
        self.card_sides = card_sides(head, cards)
        piece, self.hair_corners = _piece(self.hair.texture, self.hair.cards_uv)
        self.hair_texture = card_kernels.encoded(piece)

    @cached_property
    def layers(self) -> tuple[np.ndarray, np.ndarray | None]:
        """T_0 [T, T, 3] and the hair that lies on it [T, T, 4], for skin that something else paints."""
        neutral, layer = self.avatar.textures.neutral, self.avatar.textures.hair
        return _shrunk(neutral, self.size), _shrunk(layer, self.size) if self.haired else None

    def workspace(self, width: int, height: int) -> Workspace:
        """New buffers for pictures of this size."""
        fine, size = (height * SAMPLES, width * SAMPLES), self.size
        blocks = tuple(-(-side // raster_kernels.BLOCK) for side in fine)
        texels = np.ones((self.texels, 4), np.float32)
        texels[: size * size, 3] = self.known.ravel()
        texels[self.places[shading.CAP, 0] :] = self.cap_texture.reshape(-1, 4)
        return Workspace(
            np.empty(fine, np.int32), np.empty(fine, np.float32), np.empty(blocks, np.float32), texels,
            np.zeros(len(self.squares), bool), np.empty(len(self.faces), bool),
            np.empty(len(self.squares), bool), np.empty((len(self.faces), 9)),
            np.empty(self.mouths.shape[:2], bool), np.empty((*fine, 4), np.float32),
            np.empty(blocks, bool), np.empty(fine, np.float32),
            np.empty((height, width, 4), np.float32), np.empty((height, width), np.float32),
            np.empty((height, width, 4), np.float32),
        )  # fmt: skip

    def vertices(self, expression: np.ndarray, gaze: np.ndarray) -> np.ndarray:
        """The shown vertices [v, 3] mm, as `HeadModel.vertices` deforms them."""
        moved = np.empty_like(self.rest)
        kernels.deform(self.rest.ravel(), self.basis, expression, moved.reshape(-1))
        turn = rotation.yaw_pitch(*gaze).T
        for ball, center in zip(self.balls, self.centers):
            moved[ball] = (self.rest[ball] - center) @ turn + center
        return moved

    def draw_into(
        self,
        work: Workspace,
        camera: Camera,
        expression: np.ndarray,
        gaze: np.ndarray,
        dynamic: bool = True,
        known: bool = True,
        apart: bool = False,
        painted: Painted | None = None,
        shape: np.ndarray | None = None,
    ) -> None:
        """Draw a frame into a workspace; see `render.draw`. `known`: `Frame.face` too; `shape`: in place of `vertices`."""
        expression = np.asarray(expression, np.float32)
        textures = self.avatar.textures
        fine = cameras.crop(
            camera, 0, 0, camera.width * SAMPLES, camera.height * SAMPLES, float(SAMPLES)
        )
        shape = self.vertices(expression, gaze) if shape is None else shape
        moved = np.concatenate([shape, self.hair.vertices])
        points = cameras.to_camera(moved, fine)
        pixels = cameras.project_camera(points, fine)
        depth = -points[:, 2]
        depth[self.sheet] += BEHIND
        inverse = np.where(depth > 1e-6, 1 / np.where(depth > 1e-6, depth, 1), 0)
        box = raster_kernels.rasterize(
            pixels, inverse, self.faces, self.late, SAMPLES, work.face, work.best, work.farthest
        )
        raster_kernels.needed_tiles(
            work.face, box, SAMPLES, self.tile_start, self.tile_list, work.seen, work.needed
        )
        skin, mouth, *caps, _ = np.split(work.texels, self.places[[1, 2, 3, shading.CAP], 0])
        product = textures.key_weights * (expression if dynamic else 0 * expression)
        kernels.blend_tiles(
            work.needed, self.squares, self.unit, *self.felt, product.astype(np.float32),
            work.plain, skin.reshape(self.size, self.size, 4),
        )  # fmt: skip
        if painted is not None:
            painted.onto(skin.reshape(self.size, self.size, 4), *self.layers)
            work.plain[:] = False
        nearest = nearest_gaze(textures.gaze_directions, gaze)
        for cap, eye in zip(caps, self.eyes[nearest]):
            cap[:] = eye.reshape(-1, 4)
        slides = np.zeros((len(self.places), 2))
        slide = gaze_slide(gaze - textures.gaze_directions[nearest])
        slides[2:4] = slide * self.places[2:4, 1:]
        kernels.texture_planes(
            work.seen, pixels, inverse, self.faces, self.corners, self.kind, slides, work.planes
        )
        box_of_mouth = raster_kernels.reach(
            pixels[self.sheet], inverse[self.sheet], SAMPLES, camera.height, camera.width
        )
        if painted is not None:
            mouth[:, :3] = painted.mouth.reshape(-1, 3)
        elif kernels.mark_texels(
            work.face, box_of_mouth, SAMPLES, self.kind, 1, work.planes, work.marks
        ):
            self._mouth(work.marks, expression, mouth.reshape(*work.marks.shape, 4))
        topmost = self.hair.order(camera)[::-1]
        ones = np.ones(len(topmost), np.float32)
        locks = self.hair_faces[topmost], self.hair_corners[topmost], ones, *self.hair_texture
        shown = card_weights(camera, self.avatar.fit.camera, expression)[self.card_sides]
        lashes = self.card_faces[::-1], self.card_corners[::-1], shown[::-1], *self.card_texture
        where = work.best, work.farthest, work.touched, work.cards

        def shade(hair: bool, known: bool, color: np.ndarray, alpha: np.ndarray) -> None:
            shading.shade(
                work.face, box, SAMPLES, self.kind, work.planes, work.texels, self.places, known,
                work.cards, work.touched, work.hiding, hair, color, alpha,
            )  # fmt: skip

        work.touched[:] = False
        card_kernels.lay_cards(pixels, inverse, *locks, *where)
        if apart:
            shade(True, False, work.hair, work.alpha)
            work.hair[..., 3] = work.alpha
            work.touched[:] = False
        if known:
            card_kernels.keep_alpha(work.touched, work.cards, work.hiding)
        card_kernels.lay_cards(pixels, inverse, *lashes, *where)  # behind hair
        shade(False, known, work.color, work.alpha)

    def lips(self, expression: np.ndarray) -> np.ndarray:
        """The lip landmarks [40, 2] of a pose, as `mouth_landmarks` gives them."""
        moved: np.ndarray = self.lips_rest + np.tensordot(expression, self.lips_basis, 1)
        return moved.astype(np.float32)

    def _mouth(self, seen: np.ndarray, expression: np.ndarray, out: np.ndarray) -> None:
        order, weights = neighbours(self.avatar.textures.mouth_landmarks, self.lips(expression))
        enough = 1 + int(np.searchsorted(np.cumsum(weights), 1 - TAIL))
        kernels.median_texels(
            seen, self.mouths, order[:enough], weights[:enough].astype(np.float32), COLORS, out
        )  # fmt: skip

    def frame(
        self,
        work: Workspace,
        camera: Camera,
        expression: np.ndarray,
        gaze: np.ndarray,
        dynamic: bool = True,
        apart: bool = False,
        painted: Painted | None = None,
        shape: np.ndarray | None = None,
    ) -> Frame:
        """A `render.Frame`, with what the photo knows; `shape` as in `draw_into`."""
        self.draw_into(work, camera, expression, gaze, dynamic, True, apart, painted, shape)
        color = work.color.copy()
        hair = work.hair.copy() if apart and len(self.hair.vertices) else None
        return Frame(color[..., :3], work.alpha.copy(), color[..., 3], hair)

    def picture(
        self,
        work: Workspace,
        camera: Camera,
        expression: np.ndarray,
        gaze: np.ndarray,
        dynamic: bool = True,
        painted: Painted | None = None,
    ) -> np.ndarray:
        """The frame over plain grey: [H, W, 3] uint8 sRGB."""
        self.draw_into(work, camera, expression, gaze, dynamic, known=False, painted=painted)
        out = np.empty((*work.alpha.shape, 3), np.uint8)
        shading.encode_over(work.color, work.alpha, np.float32(GRAY), self.bytes, out)
        return out


def sortable(halves: np.ndarray) -> np.ndarray:
    """Half floats as uint16 that sort like them."""
    bits = np.ascontiguousarray(halves, np.float16).view(np.uint16)
    return np.where(bits & 0x8000, ~bits, bits | 0x8000)


def _colors() -> np.ndarray:
    numbers = np.arange(1 << 16, dtype=np.uint16)
    bits = np.where(numbers & 0x8000, numbers & 0x7FFF, ~numbers)
    return bits.view(np.float16).astype(np.float32)


COLORS = _colors()  # [65536] float32: the half float of each number of `sortable`


def _shrunk(picture: np.ndarray, size: int) -> np.ndarray:
    picture = np.asarray(picture, np.float32)
    if picture.shape[0] <= size:
        return picture
    return cv2.resize(picture, (size, size), interpolation=cv2.INTER_AREA)


def _piece(texture: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of a texture [T, T, 4] that faces lie on, and their corners [F, 3, 2] in its texels."""
    corners = uv.reshape(-1, 3, 2).astype(np.float64) * len(texture)
    low = np.maximum(np.floor(corners.min((0, 1), initial=len(texture))).astype(int) - 1, 0)
    high = np.ceil(corners.max((0, 1), initial=0)).astype(int) + 1
    piece = np.array(texture[low[1] : high[1], low[0] : high[0]], np.float32)
    return piece, (corners - low).astype(np.float32)


def _squares(textures: Textures, hair: bool, size: int) -> tuple[np.ndarray, np.float32]:
    """T_0 and the keys, hair on them, cut into tiles.

    Returns:
        [tiles, 1 + K, 3, TILE TILE] uint16, and what one step is worth.
    """
    side = kernels.TILE
    across = -(-size // side)
    layers = []
    for texture in (textures.neutral, *textures.keys):
        layer = np.asarray(texture, np.float32)
        layers.append(_shrunk(lay_hair(layer, textures.hair) if hair else layer, size))
    unit = max(1.0, *(float(layer.max()) for layer in layers)) / STEPS
    out = np.zeros((across * across, len(layers), 3, side * side), np.uint16)
    for number, layer in enumerate(layers):
        whole = np.zeros((across * side, across * side, 3), np.uint16)
        whole[:size, :size] = np.clip(layer, 0, None) / unit + 0.5
        cut = whole.reshape(across, side, across, side, 3).transpose(0, 2, 4, 1, 3)
        out[:, number] = cut.reshape(-1, 3, side * side)
    return out, np.float32(unit)


def _felt(masks: np.ndarray, size: int) -> Felt:
    """The masks [E, m, m] cut into tiles with a border: what `kernels.blend_tiles` wants of them."""
    coarse, side = masks.shape[1], kernels.TILE
    middle = (np.arange(size) + 0.5) * (coarse / size) - 0.5
    low = np.floor(middle).astype(int)
    first = low[::side]  # the first mask texel that each row of tiles reads, -1 for the border
    place = low - np.repeat(first, side)[:size]
    reach = int(place.max()) + 2
    index = np.clip(first[:, None] + np.arange(reach), 0, coarse - 1)  # [across, r]
    found, which, count = [], [], []
    for rows in index:
        band = masks[:, rows]
        for columns in index:
            cut = band[:, :, columns]
            kept = np.flatnonzero(cut.max((1, 2)) > FAINT)
            found.append(cut[kept])
            which.append(kept)
            count.append(len(kept))
    start = np.cumsum([0, *count]).astype(np.int64)
    return (
        np.concatenate(found).reshape(start[-1], -1), start, np.concatenate(which).astype(np.int32),
        place.astype(np.int32), (middle - low).astype(np.float32),
    )  # fmt: skip
