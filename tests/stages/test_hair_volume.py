"""Hair with volume: silhouettes with a known answer, and pictures that no hair can be made of."""

from dataclasses import fields

import cv2
import numpy as np
import pytest

from bakery.evaluate.hair.drawing import draw_hair
from bakery.geometry import camera as cameras
from bakery.geometry.raster import rasterize
from bakery.heads.file import load_head
from bakery.stages.hair import chart, make_hair
from bakery.stages.hair.atlas import map_cap, pack
from bakery.stages.hair.chart import COLUMNS, ROWS
from bakery.stages.hair.directions import flow, photographed
from bakery.stages.hair.mesh import WIDEST, WIDEST_HEM, _clipped, cap_surface, ribbons
from bakery.stages.hair.portrait import look
from bakery.stages.hair.presence import _held
from bakery.stages.hair.shell import PIERCED, _beside_lobes, _hidden, make_shell
from bakery.stages.hair.strands import grow
from bakery.stages.segment import BACKGROUND, EARS, HAIR, HAT, SKIN, Segmentation
from bakery.types import EXPRESSIONS, HAIR_TRIANGLES, Camera, Fit

SIDE = 400
DARK, SKINNY, GREY = (0.2, 0.12, 0.08), (0.8, 0.6, 0.5), (0.55, 0.6, 0.65)


@pytest.fixture(scope="module")
def head():
    return load_head()


@pytest.fixture(scope="module")
def fit():
    camera = Camera(
        1000.0, np.array([200.0, 190.0]), np.zeros(3), np.array([0, 0, -1100.0]), SIDE, SIDE
    )
    zero = np.zeros
    return Fit(
        "makehuman", camera, zero(1), zero(len(EXPRESSIONS)), zero(2), zero((9, 3)), zero(1),
        zero((468, 3)), zero((478, 2)),
    )  # fmt: skip


def bare(head, fit):
    """Where the head is in the photo, [H, W] bool."""
    points = cameras.to_camera(head.mean, fit.camera)
    faces = head.faces[head.part_faces("skin")]
    pixels = cameras.project_camera(points, fit.camera)
    return rasterize(pixels, -points[:, 2], faces, (SIDE, SIDE)).face >= 0


def painted(head, fit, hair, label=HAIR):
    """A photo [H, W, 3] whose hair is `hair` [H, W] bool, and its Segmentation."""
    skin = bare(head, fit)
    labels = np.where(skin, SKIN, BACKGROUND).astype(np.uint8)
    picture = np.where(skin[..., None], SKINNY, GREY).astype(np.float32)
    labels[hair] = label
    rng = np.random.default_rng(1)
    streaks = cv2.GaussianBlur(rng.normal(size=(SIDE, SIDE)), (0, 0), 0.7, None, 8)
    picture[hair] = DARK
    picture += (0.4 * streaks * hair)[..., None]
    picture = np.clip(picture, 0, 1).astype(np.float32)
    return picture, Segmentation(labels, (labels == SKIN).astype(np.float32))


def bob(head, fit, thick=22, down=95):
    """Hair so many pixels around the head, down to so many below its eyes; the face is free."""
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * thick + 1,) * 2)
    around = cv2.dilate(bare(head, fit).astype(np.uint8), disk) > 0
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    face = ((x - 200) / 58) ** 2 + ((y - 215) / 90) ** 2 < 1
    return around & ~face & (y < 190 + down) & ~((np.abs(x - 200) < 50) & (y > 215))


def drawn(mesh, head, fit, level=0):
    """How much of each pixel of the photo hair covers."""
    points = cameras.to_camera(head.mean, fit.camera)
    faces = head.faces[head.part_faces("skin")]
    depth = rasterize(
        cameras.project_camera(points, fit.camera), -points[:, 2], faces, (SIDE, SIDE), cull=True
    ).depth
    return draw_hair(mesh, fit.camera, depth, level)[..., 3]


@pytest.fixture(scope="module")
def made(head, fit):
    """A bob: its mask, and its mesh."""
    hair = bob(head, fit)
    return hair, make_hair(*painted(head, fit, hair), fit, head, head.mean)


def test_cells_of_places_and_places_of_cells(head):
    found = chart.make_chart(head, head.mean)
    cells = chart.grid()
    distance = found.skull + 7
    back, far = found.cell(found.place(cells, distance))
    np.testing.assert_allclose(back, cells, atol=1e-9)
    np.testing.assert_allclose(far, distance, atol=1e-9)


def test_the_chart_lies_on_the_skull_and_leaves_the_ears_out(head):
    found = chart.make_chart(head, head.mean)
    skin = head.mean[head.part_vertices("skin")]
    top = skin[skin[:, 1] > 60]
    cells, distance = found.cell(top)
    assert np.abs(distance - found.take(found.skull, cells)).mean() < 3  # a cell is 5 mm
    assert (found.ears - found.skull).max() > 6


def test_smoothing_keeps_what_is_even_and_the_sum_around():
    values = np.full((chart.ROWS, chart.COLUMNS), 3.0)
    np.testing.assert_allclose(chart.smooth(values, 9.0), 3.0)
    values = np.random.default_rng(0).normal(size=values.shape)
    assert chart.smooth(values, 9.0).std() < 0.4 * values.std()


def test_the_shell_reaches_the_outline(head, fit):
    """At the height of the brows, hair ends so far from the middle as it does in the photo."""
    hair = bob(head, fit)
    picture, labels = painted(head, fit, hair)
    portrait = look(picture, labels, fit, head, head.mean)
    shell = make_shell(portrait, head, head.mean)
    pixels, _ = portrait.pixels(shell.surface(chart.grid(), 1.0))
    row = np.abs(pixels[..., 1] - portrait.pixels(np.array([0, 10.0, -60]))[0][1]) < 6
    columns = np.flatnonzero(portrait.solid[int(portrait.pixels(np.array([0, 10.0, -60]))[0][1])])
    found = pixels[..., 0][row & (shell.there > 0.5)]
    wide = (found.max() - found.min()) / portrait.scale
    assert abs(wide - np.ptp(columns) / portrait.scale) < 10  # mm, of two sides


def test_hair_covers_its_silhouette_and_nothing_else(made, head, fit):
    hair, mesh = made
    cover = drawn(mesh, head, fit)
    inner = cv2.erode(hair.astype(np.uint8), np.ones((7, 7))) > 0
    outer = cv2.dilate(hair.astype(np.uint8), np.ones((7, 7))) > 0
    assert (cover[inner] > 0.5).mean() > 0.93
    assert (cover[~outer] > 0.5).mean() < 0.003
    found = cover > 0.5
    # The strip of 12 mm behind the hairline is the layer's on the skin, which is not drawn here.
    assert (found & hair).sum() / (found | hair).sum() > 0.84


def test_coarser_levels_agree(made, head, fit):
    hair, mesh = made
    for level, least in ((1, 0.82), (2, 0.72)):
        found = drawn(mesh, head, fit, level) > 0.5
        assert (found & hair).sum() / (found | hair).sum() > least
        assert (mesh.levels >> level & 1).sum() <= HAIR_TRIANGLES[level]


def test_long_hair_hangs_and_short_hair_does_not(made, head, fit):
    _, mesh = made
    assert mesh.hang[mesh.vertices[:, 1] > 0].max() == 0
    short = make_hair(*painted(head, fit, bob(head, fit, 12, 20)), fit, head, head.mean)
    assert short.vertices[:, 1].min() > mesh.vertices[:, 1].min() + 5


def test_hanging_hair_ends_lock_by_lock_but_not_as_a_comb(made, head, fit):
    """From behind: it was a comb of single cards below the cap, then a straight cut."""
    _, mesh = made
    behind = cameras.view(fit.camera, 180)
    cover = draw_hair(mesh, behind, np.full((SIDE, SIDE), np.inf))[:, 170:230, 3] > 0.5
    ends = SIDE - cover[::-1].argmax(0)
    assert 2 < ends.std() < 6  # mm
    assert np.median(ends) - ends.min() < 12  # no gap between locks goes up to the cap's end
    assert np.abs(np.diff(ends)).mean() < 2.5  # locks, not strands


def test_the_same_bytes_twice(made, head, fit):
    hair, mesh = made
    again = make_hair(*painted(head, fit, hair), fit, head, head.mean)
    for field in fields(mesh):
        np.testing.assert_array_equal(getattr(mesh, field.name), getattr(again, field.name))


def test_no_hair_above_the_brim_of_a_hat(head, fit):
    hair = bob(head, fit)
    picture, labels = painted(head, fit, hair)
    hat = hair & (np.arange(SIDE)[:, None] < 150)
    labels = Segmentation(np.where(hat, HAT, labels.labels).astype(np.uint8), labels.skin)
    mesh = make_hair(picture, labels, fit, head, head.mean)
    cover = drawn(mesh, head, fit)
    assert (cover[cv2.erode(hat.astype(np.uint8), np.ones((9, 9))) > 0] > 0.5).mean() < 0.02


def test_a_bald_top_stays_bald(head, fit):
    """Hair at the sides alone: no cap and no card stands on the crown, seen or unseen."""
    hair = bob(head, fit, 10, 20) & (np.arange(SIDE)[:, None] > 150)
    mesh = make_hair(*painted(head, fit, hair), fit, head, head.mean)
    faces = mesh.faces[mesh.kind == 0]
    crown = head.mean[head.part_vertices("skin"), 1].max()
    assert mesh.vertices[faces][..., 1].max() < crown - 12


@pytest.mark.parametrize(
    "kind",
    [
        "none", "speck", "all", "above", "line",
        pytest.param("noise", marks=pytest.mark.slow),  # 2.8 s
    ],
)  # fmt: skip
def test_masks_that_no_hair_has(kind, head, fit):
    hair = np.zeros((SIDE, SIDE), bool)
    rng = np.random.default_rng(3)
    if kind == "speck":
        hair[100:103, 200:203] = True
    elif kind == "all":
        hair[:] = True
    elif kind == "above":
        hair[:20, :60] = True
    elif kind == "noise":
        hair = rng.random((SIDE, SIDE)) < 0.5
    elif kind == "line":
        hair[:, 199:201] = True
    mesh = make_hair(*painted(head, fit, hair), fit, head, head.mean)
    if kind in ("none", "speck"):
        assert mesh is None
    if mesh is not None:
        assert np.isfinite(mesh.vertices).all() and np.isfinite(mesh.texture).all()
        assert (mesh.texture[..., :3] >= 0).all() and mesh.texture[..., 3].max() <= 1


def test_a_shaved_head_has_no_volume(head, fit):
    hair = bob(head, fit, 2, -10)
    picture, labels = painted(head, fit, hair)
    picture[hair] = np.array(SKINNY) - 0.05
    assert make_hair(picture, labels, fit, head, head.mean) is None


@pytest.mark.parametrize("degrees", [0, 30, 90, 135])
def test_directions_of_stripes(degrees, head, fit):
    hair = bob(head, fit)
    picture, labels = painted(head, fit, hair)
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    turn = np.radians(degrees)
    across = x * np.sin(turn) + y * np.cos(turn)  # rows go down
    picture[hair] = (0.3 + 0.15 * np.sin(across * 2 * np.pi / 3.5))[hair][:, None]
    portrait = look(picture, labels, fit, head, head.mean)
    angle, sure = photographed(portrait)
    inner = cv2.erode(portrait.solid.astype(np.uint8), np.ones((25, 25))) > 0
    off = np.degrees(np.abs((angle - turn + np.pi / 2) % np.pi - np.pi / 2))[inner]
    assert np.median(off) < 4 and sure[inner].mean() > 0.2


def test_an_ear_that_is_seen_lies_before_the_hair(head, fit):
    hair = bob(head, fit)
    picture, labels = painted(head, fit, hair)
    points = cameras.project(head.mean[head.part_vertices("skin")], fit.camera)
    rim = points[(head.mean[head.part_vertices("skin"), 1] < 20)]
    left = int(rim[:, 0].min())
    ear = np.zeros_like(hair)
    ear[185:235, left - 2 : left + 14] = True
    shown = Segmentation(np.where(ear, EARS, labels.labels).astype(np.uint8), labels.skin)
    under, free = (
        make_shell(look(picture, seen, fit, head, head.mean), head, head.mean)
        for seen in (labels, shown)
    )
    before = chart.azimuth() < -0.7
    before &= chart.azimuth() > -1.2
    rows = slice(chart.DOME + 12, chart.DOME + 20)
    assert free.there[rows][:, before].sum() <= under.there[rows][:, before].sum()


@pytest.mark.parametrize("wide, hangs", [(7, False), (20, True)])
def test_a_rim_beside_a_lobe_is_the_ear_itself(wide, hangs, head, fit):
    """Ears in the shade and earrings are taken for hair: they stand out less than hair over an ear."""
    right = cv2.dilate(bare(head, fit).astype(np.uint8), np.ones((1, 2 * wide + 1))) > 0
    y, x = np.mgrid[:SIDE, :SIDE]
    right &= (x < 160) & (y > 150) & (y < 290) & ~((x > 130) & (y > 215))
    chart_ = chart.make_chart(head, head.mean)
    portrait = look(*painted(head, fit, right), fit, head, head.mean)
    found = _beside_lobes(portrait, chart_, cameras.position(fit.camera))
    assert found.tolist() == [hangs, False]


@pytest.mark.parametrize(
    "first, last, beside, hidden",
    [(0, 0, False, True), (20, 80, True, False), (60, 80, True, True), (60, 80, False, False)],
)
def test_a_lobe_alone_looks_out_of_hair_that_hangs_over_its_ear(first, last, beside, hidden):
    """Rows of an ear 10 mm wide, whose upper half is at row 30; no rows: it is not seen at all."""
    ear = np.zeros((100, 40), bool)
    ear[first:last, 10:20] = True
    assert _hidden(ear, 30.0, beside, 1.0) is hidden


def test_no_hair_ends_within_an_ear(head, fit):
    shell = make_shell(
        look(*painted(head, fit, bob(head, fit, 12, -20)), fit, head, head.mean), head, head.mean
    )
    stands = shell.chart.ears - shell.chart.skull > PIERCED
    within = stands & (shell.radius < shell.chart.ears)
    assert within.any() and shell.there[within].max() == 0 and shell.there[~stands].max() > 0.9


def test_triangles_are_cut_at_a_line():
    """Of the unit square cut at x = 0.25, three quarters are left."""
    cells = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    points, kept = _clipped(cells, cells[:, 0] - 0.25, faces)
    a, b, c = (points[kept[:, k]] for k in range(3))
    area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert (area > 0).all()
    np.testing.assert_allclose(area.sum(), 0.75)


def test_cards_do_not_overlap_in_the_atlas():
    rng = np.random.default_rng(5)
    layout = pack(rng.uniform(8, 18, 300), rng.uniform(15, 130, 300), 1024)
    taken = np.zeros((1024, 1024), int)
    for left, top, wide, tall in zip(layout.left, layout.top, layout.width, layout.height):
        taken[top : top + tall, left : left + wide] += 1
    assert taken.max() == 1 and taken[: int(0.3 * 1024)].sum() == 0
    assert taken.mean() > 0.4  # most of the room below the cap is used


@pytest.fixture(scope="module")
def locks(head, fit):
    """A shell of two locks that hang 100 mm apart from the neck: beside it, the shell is square to the chart."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    hair = bob(head, fit, 16, 40)
    hair |= (np.abs(np.abs(x - 200) - 85) < 28) & (y > 190) & (y < 340)
    picture, seen = painted(head, fit, hair)
    portrait = look(picture, seen, fit, head, head.mean)
    return portrait, make_shell(portrait, head, head.mean)


def test_cards_keep_their_width_where_the_shell_is_square_to_the_chart(locks):
    """They were up to ten times as wide, and showed the photo as a smear."""
    portrait, shell = locks
    assert shell.sides()[0][shell.there > 0.5].max() > 25  # of 3.75 degrees
    wisps = grow(shell, flow(portrait, shell, *photographed(portrait))[0], 300, 14.0, 90.0)
    edges, _ = ribbons(shell, wisps, portrait.camera)
    wide = np.linalg.norm(edges[:, :, 1] - edges[:, :, 0], axis=-1).max(1)
    most = np.where(wisps.hem, WIDEST_HEM, WIDEST)
    # Either edge is moved three times, and then stands off by itself.
    assert np.percentile(wide / (wisps.width * most), 95) < 1.3


def test_length_of_wisps_is_that_of_their_lines(locks):
    portrait, shell = locks
    wisps = grow(shell, flow(portrait, shell, *photographed(portrait))[0], 300, 14.0, 90.0)
    along = np.linalg.norm(np.diff(wisps.points, axis=1), axis=-1).sum(1)
    assert (along < 1.02 * wisps.length + 0.1).all()  # knots cut corners
    assert np.median(along / wisps.length) > 0.95
    assert wisps.length[~wisps.hem].max() <= 90.0


def test_places_on_the_cap_and_cells_of_them(locks):
    portrait, shell = locks
    surface, inner = cap_surface(shell, portrait)
    cap = map_cap(shell, surface, inner, 80)
    cells = np.random.default_rng(2).uniform(0, 1, (200, 2)) * [COLUMNS, 80]
    np.testing.assert_allclose(cap.cells(cap.places(cells)), cells, atol=1e-9)
    np.testing.assert_allclose(cap.places(np.array([[0, 0], [COLUMNS, 80]])), [[0, 0], [1, 1]])


def test_what_is_seen_and_wide_has_room_on_the_cap(locks):
    """Locks beside the neck have more columns than the back of the head."""
    portrait, shell = locks
    surface, inner = cap_surface(shell, portrait)
    wide = np.diff(map_cap(shell, surface, inner, 80).columns)
    beside = np.unravel_index((shell.sides()[0] * (shell.seen > 0.5)).argmax(), shell.seen.shape)[1]
    assert wide[beside] > 2 * wide[[0, -1]].max() and wide.min() > 0.2 / COLUMNS


def test_bits_that_hang_by_nothing_are_dropped():
    there = np.zeros((ROWS, COLUMNS))
    there[:50] = 1
    there[70:73, 20:23] = 1
    held = _held(there)
    assert held[:50].all() and not held[50:].any()
    around = np.zeros((ROWS, COLUMNS))
    around[40:50, :30] = around[40:50, -30:] = 1  # one piece, around the back
    assert np.array_equal(_held(around), around)
