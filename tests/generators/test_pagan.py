"""The trained generator: closed forms, crops against frames, folding, bad files."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose
from safetensors.torch import save_file

from bakery.detectors.blocks import fold
from bakery.errors import ModelError
from bakery.generators import pagan
from bakery.generators.channels import BLOT, condition_channels, expression_channels
from bakery.generators.interior import FRAME_SCALE, interior_shade
from bakery.generators.shade import EYES, is_part
from bakery.generators.unet import (
    INPUTS,
    NetworkOptions,
    UNet,
    input_channels,
    interpret,
    network_input,
    parts_of,
    to_encoded,
    to_linear,
)
from bakery.geometry import color as colors
from bakery.heads.base import MOUTH, PARTS
from bakery.heads.file import load_head
from bakery.stages.condition import condition, face_camera
from bakery.types import EXPRESSION_INDEX, Camera, Fit

TINY = NetworkOptions(channels=(8, 8, 8))


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def random_network(options=TINY, seed=0):
    """A network whose weights and statistics are not those it begins with."""
    torch.manual_seed(seed)
    network = UNet(options)
    for name, value in network.state_dict().items():
        if value.is_floating_point():
            value.copy_(torch.rand_like(value) * 0.5 + (0.5 if "var" in name else -0.25))
    return network.eval()


def random_batch(height, width, seed=1):
    rng = np.random.default_rng(seed)
    return {
        name: torch.from_numpy(rng.integers(0, 256, (1, n, height, width)).astype(np.uint8))
        for name, n in INPUTS.items()
    }


def test_colours_are_those_of_the_geometry():
    values = torch.linspace(0, 1, 50)
    assert_allclose(to_linear(values), colors.to_linear(values.numpy()), atol=1e-6)
    assert_allclose(to_encoded(values), colors.to_encoded(values.numpy()), atol=1e-6)


def test_an_untrained_network_changes_little():
    """The last layer is zero and alpha begins at sigmoid(-3): the deformed neutral, 5% grey."""
    deformed = torch.rand(1, 3, 16, 16)
    x = torch.rand(1, sum(INPUTS.values()), 16, 16)
    with torch.no_grad():
        change = interpret(UNet(TINY)(x), deformed)
    share = 1 / (1 + np.exp(3))
    grey = colors.to_linear(np.array(0.5))
    expected = colors.to_linear(deformed.numpy()) * (1 - share) + grey * share
    assert_allclose(change.ratio, 0, atol=1e-6)
    assert_allclose(change.alpha, share, atol=1e-5)
    assert_allclose(change.picture, colors.to_encoded(expected), atol=1e-5)


def test_plain_head_is_a_picture():
    network = UNet(replace(TINY, head="plain"))
    outputs = network(torch.rand(1, sum(INPUTS.values()), 16, 16))
    change = interpret(outputs, torch.rand(1, 3, 16, 16))
    assert outputs.shape == (1, 3, 16, 16)
    assert_allclose(change.picture.detach(), 0.5, atol=1e-6)
    assert change.alpha.min() == 1


def test_folding_changes_nothing():
    network = random_network()
    folded = UNet(TINY, folded=True)
    folded.load_state_dict(fold(network))
    x = torch.rand(2, sum(INPUTS.values()), 32, 32)
    with torch.no_grad():
        # Two orders of summing single-precision products.
        assert_allclose(folded.eval()(x), network(x), rtol=1e-3, atol=1e-4)


def test_a_crop_agrees_with_the_frame_away_from_its_border():
    """Normalisation that looks at the whole picture would break this."""
    network = random_network()
    x = network_input(random_batch(128, 128))
    with torch.no_grad():
        whole, part = network(x), network(x[..., 16:112, 24:120])
    inner = (part - whole[..., 16:112, 24:120])[..., 44:52, 44:52].abs().max()
    assert inner < 1e-4 * whole.abs().max()


def test_normals_keep_their_sign():
    batch = random_batch(8, 8)
    batch["normals"][:] = torch.tensor([1, 128, 255], dtype=torch.uint8)[None, :, None, None]
    found = network_input(batch, ("normals",))
    assert_allclose(found[0, :, 0, 0], [-1, 0, 1])


def test_shade_leaves_skin_alone_and_darkens_deep_places():
    part = np.full((64, 64), PARTS.index("skin"), np.uint8)
    part[20:44, 10:54] = PARTS.index("teeth_upper")
    part[20:44, 32:54] = PARTS.index("mouth_cavity")
    normals = np.zeros((64, 64, 3), np.int8)
    normals[..., 2] = 127
    depth = np.full((64, 64), 240, np.uint8)
    depth[part == PARTS.index("mouth_cavity")] = 200  # 38 mm further back
    shade = interior_shade(SimpleNamespace(part=part, normals=normals, depth=depth), 1.0)
    assert_allclose(shade[part == PARTS.index("skin")], 1)
    assert shade[32, 43] < 0.35 * shade[32, 20] < 0.35


@pytest.fixture(scope="module")
def target():
    """A smile of the mean head: what a generator is given."""
    head = load_head("makehuman")
    neutral = head.mean
    camera = Camera(
        900.0, np.array([128.0, 128.0]), np.zeros(3), np.array([0, 0, -700.0]), 256, 256
    )
    fit = Fit(
        "makehuman", camera, np.zeros(1), np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(1),
        np.zeros((468, 3)), np.zeros((478, 2)),
    )  # fmt: skip
    camera = face_camera(fit, head, neutral, size=512)
    expression = np.zeros(52, np.float32)
    expression[EXPRESSION_INDEX["jawOpen"]] = 0.5
    texture = np.full((64, 64, 3), 0.4, np.float32)
    return head, condition(head, neutral, texture, expression, (0.0, 0.0), camera)


@pytest.fixture
def generator():
    """A network of random weights, folded as in use."""
    folded = UNet(TINY, folded=True)
    folded.load_state_dict(fold(random_network()))
    return pagan.PaganGenerator(folded, half=False)


class Observation:
    """The fields of a Subject that the network looks at."""

    def __init__(self, head, photo):
        self.head, self.photo, self.lids = head, photo, None
        self.neutral, self.light, self.light_rotation = head.mean, np.ones((9, 3)), np.eye(3)


def test_generated_picture_is_what_its_parts_say(target, generator):
    head, conditions = target
    photo = np.full((512, 512, 3), 90, np.uint8)
    made = generator.generate(Observation(head, photo), conditions, interior_only=True)
    alpha = made.alpha[..., None]
    expected = conditions.deformed_neutral * made.ratio * (1 - alpha) + made.color * alpha
    assert_allclose(made.image, expected, atol=1e-6)
    assert made.alpha.max() > 0.01
    channels = condition_channels(head, conditions)
    outside = channels.face == 0
    assert outside.any() and made.alpha[outside].max() == 0
    skin = outside & (channels.part == PARTS.index("skin"))
    assert_allclose(made.ratio[skin], 1)


def test_interior_alone_is_painted_as_in_the_whole(target, generator):
    """Eyes and mouth to the bit; skin stays as it is, and all of it where neither is seen."""
    head, conditions = target
    subject = Observation(head, np.full((512, 512, 3), 90, np.uint8))
    made = generator.generate(subject, conditions, interior_only=True)
    log_ratio, shade, color, alpha = generator.share(subject, conditions)
    near = cv2.dilate(is_part(conditions.part, *EYES, *MOUTH).astype(np.uint8), np.ones((9, 9))) > 0
    for found, wanted in (
        (made.ratio, np.exp(log_ratio) * shade[..., None]), (made.color, color), (made.alpha, alpha)
    ):  # fmt: skip
        np.testing.assert_array_equal(found[near], wanted[near])
    far = ~cv2.dilate(near.astype(np.uint8), np.ones((401, 401))).astype(bool)
    np.testing.assert_array_equal(made.image[far], conditions.deformed_neutral[far])
    skin = np.where(near, np.uint8(PARTS.index("skin")), conditions.part)
    made = generator.generate(subject, replace(conditions, part=skin), interior_only=True)
    np.testing.assert_array_equal(made.image, conditions.deformed_neutral)
    assert made.alpha.max() == 0 and made.ratio.min() == made.ratio.max() == 1


def test_the_networks_share_is_the_training_picture(target, generator):
    """What training minimises is the picture that inference makes."""
    head, conditions = target
    subject = Observation(head, np.full((512, 512, 3), 90, np.uint8))
    log_ratio, light, color, alpha = (
        part[..., None] if part.ndim == 2 else part for part in generator.share(subject, conditions)
    )
    skin = conditions.deformed_neutral * np.exp(log_ratio) * light
    image = skin * (1 - alpha) + color * alpha
    channels = condition_channels(head, conditions)
    shade = interior_shade(channels, FRAME_SCALE * 512)
    expressed = expression_channels(subject, conditions)
    stack = input_channels(channels, pagan.aligned_photo(subject, conditions), shade, expressed)
    batch = {k: torch.from_numpy(v.transpose(2, 0, 1)[None].copy()) for k, v in stack.items()}
    with torch.no_grad():
        change = interpret(generator.network(network_input(batch)), batch["deformed"].float() / 255)
    whole = channels.face == 255
    picture = colors.to_encoded(np.clip(image, 0, 1))[whole]
    # Bytes of the input and a head that is not exactly 165 mm high.
    difference = np.abs(picture - change.picture[0].permute(1, 2, 0).numpy()[whole])
    assert np.percentile(difference, 99) < 0.02


def test_the_photo_tells_nothing_of_the_mouth(target):
    """Where the target shows a mouth the photo is one colour, whatever lay there; elsewhere it stays."""
    head, conditions = target
    channels = condition_channels(head, conditions)
    mouth = is_part(conditions.part, *MOUTH)
    photo = np.random.default_rng(0).integers(0, 256, (512, 512, 3)).astype(np.uint8)
    seen = input_channels(channels, photo, np.ones((512, 512), np.float32), {})["photo"]
    assert mouth.sum() > 500 and seen.dtype == np.uint8
    np.testing.assert_array_equal(seen[mouth], np.broadcast_to(BLOT, (mouth.sum(), 3)))
    np.testing.assert_array_equal(seen[~mouth], photo[~mouth])


def test_photo_follows_the_head_and_not_the_jaw(target):
    head, conditions = target
    photo = np.zeros((512, 512, 3), np.uint8)
    photo[256:] = 200  # the lower half of the face
    assert conditions.expression[EXPRESSION_INDEX["jawOpen"]] == 0.5
    for down in (0, 40):
        camera = replace(conditions.camera, center=conditions.camera.center + [0, down])
        aligned = pagan.aligned_photo(Observation(head, photo), replace(conditions, camera=camera))
        assert aligned.shape == (512, 512, 3)
        assert np.flatnonzero(aligned[:, 256, 0] > 100)[0] == 256 + down


def test_weights_come_back(tmp_path):
    network = random_network()
    path = tmp_path / "w.safetensors"
    from bakery.train.pagan.export import write

    write(network, path)
    loaded = pagan.load(path, half=False)
    assert loaded.network.options == TINY
    x = torch.rand(1, sum(INPUTS.values()), 32, 32)
    with torch.no_grad():
        # Half precision keeps 11 bits of each weight.
        assert_allclose(loaded.network(x), network(x), rtol=0.05, atol=0.05)


def test_bad_weights_are_errors(tmp_path):
    with pytest.raises(ModelError, match="no weights of a generator"):
        pagan.load(tmp_path / "missing.safetensors")
    other = tmp_path / "other.safetensors"
    save_file({"a": torch.zeros(2)}, other)
    with pytest.raises(ModelError, match="holds no generator"):
        pagan.load(other)
    save_file({"a": torch.zeros(2)}, other, {"generator": '{"kind": "bakery generator 1"}'})
    with pytest.raises(ModelError, match="another network"):
        pagan.load(other)


def test_a_subject_without_photo_is_a_wrong_call(target):
    head, conditions = target
    generator = pagan.PaganGenerator(UNet(TINY, folded=True), half=False)
    with pytest.raises(ValueError, match="photo"):
        generator.generate(Observation(head, None), conditions)


def test_other_scales_are_painted_at_the_training_scale(generator):
    """A strip at twice the scale is painted small, and the change is enlarged."""
    smooth = {
        name: np.tile(np.linspace(0, 255, 64).astype(np.uint8)[None, :, None], (64, 1, n))
        for name, n in INPUTS.items()
    }
    large = {name: layer.repeat(2, 0).repeat(2, 1) for name, layer in smooth.items()}
    same = generator.paint_scaled(smooth, 1.0)
    assert_allclose(same, generator.paint(smooth))
    twice = generator.paint_scaled(large, 2.0)
    for k in range(7):
        assert_allclose(
            twice[..., k], cv2.resize(same[..., k], (128, 128)), atol=2e-5
        )  # OpenCV's own


def test_a_picture_painted_is_that_of_the_network():
    """`paint` cuts the picture into squares and pads it by itself; the network is the reference."""
    folded = UNet(TINY, folded=True)
    folded.load_state_dict(fold(random_network()))
    rng = np.random.default_rng(3)
    unit = 2 ** len(TINY.channels)
    height, width = 5 * unit - 3, 3 * unit
    layers = {
        name: rng.integers(0, 256, (height, width, n), np.uint8) for name, n in INPUTS.items()
    }
    batch = {
        name: torch.from_numpy(np.pad(layer, ((0, 3), (0, 0), (0, 0))).transpose(2, 0, 1)[None])
        for name, layer in layers.items()
    }
    with torch.inference_mode():
        wanted = torch.cat(parts_of(folded(network_input(batch))), 1)[0].permute(1, 2, 0).numpy()
    painted = pagan.PaganGenerator(folded, half=False).paint(layers)
    assert np.ptp(wanted, axis=(0, 1)).min() > 0.01
    assert_allclose(painted, wanted[:height], atol=1e-5)  # sums of floats in another order


@pytest.mark.parametrize("head", ["change", "plain"])
def test_bits_mean_what_the_parts_do(head):
    """In bfloat16 the outputs are looked up; `parts_of` is the reference."""
    options = replace(TINY, head=head)
    folded = UNet(options, folded=True)
    network = UNet(options)
    torch.nn.init.normal_(network.head.weight, std=0.3)
    folded.load_state_dict(fold(network))
    generator = pagan.PaganGenerator(folded, half=True)
    rng = np.random.default_rng(5)
    layers = {name: rng.integers(0, 256, (40, 56, n), np.uint8) for name, n in INPUTS.items()}
    found = generator.paint(layers)
    generator._meanings = None
    wanted = generator.paint(layers)
    assert np.ptp(wanted[..., 3:6]) > 0.1
    assert_allclose(found, wanted, atol=1e-6, rtol=1e-5)  # powers of one number or of many


@pytest.mark.parametrize(("wanted", "side"), [(223.8, 224), (219.8, 224), (213.0, 213), (61.0, 61)])
def test_what_is_resized_anyway_is_painted_without_padding(wanted, side):
    """As far as 2% of its scale allow it; the shipped network's coarsest pixel is 32 wide."""
    assert pagan.PaganGenerator(UNet(NetworkOptions(), folded=True))._side(wanted) == side
