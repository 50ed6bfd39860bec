"""The copy for browsers: what it holds, what it says, and how large it gets."""

import json

import cv2
import numpy as np
import pytest

from bakery.errors import InputError
from bakery.export.validate import problems
from bakery.export.web import WebOptions, web_files
from bakery.export.web import files as web
from bakery.export.web.head import facts
from bakery.geometry.color import to_encoded, to_linear
from bakery.heads.base import weights
from bakery.stages.texture.mouth import mouth_landmarks

MEGABYTE = 2**20


@pytest.fixture(scope="module")
def whole(avatar):
    return web_files(avatar)[0]


def test_bundle_has_it_and_is_valid(bundle):
    manifest = json.loads((bundle / "avatar.json").read_text())
    listed = {entry["path"] for entry in manifest["files"]}
    assert {web.DESCRIPTION, web.HEAD} <= listed and problems(bundle) == []
    about = json.loads((bundle / web.DESCRIPTION).read_text())
    for name, atlas in about["atlases"].items():
        picture = cv2.imread(str(bundle / "web" / atlas["file"]), -1)
        height, width = picture.shape[:2]
        assert height % atlas["rows"] == 0 and width % atlas["columns"] == 0, name
        assert len(atlas["names"]) <= atlas["rows"] * atlas["columns"]


def test_lips_are_linear_in_the_weights(avatar):
    """What a browser adds up is what the reference measures on the deformed head."""
    lips = facts(avatar.head, avatar.neutral, avatar.fit)["lips"]
    mix = weights({"jawOpen": 0.6, "mouthPucker": 0.4, "mouthSmileLeft": 0.9, "eyeLookUpLeft": 1.0})
    found = np.array(lips["rest"]) + mix @ np.array(lips["shapes"])
    shape = avatar.head.vertices(avatar.neutral, mix)
    wanted = mouth_landmarks(avatar.head, avatar.neutral, shape).ravel()
    np.testing.assert_allclose(found, wanted, atol=1e-5)  # mouth widths


def test_straight_alpha_comes_back():
    """Colour over alpha, and back by a browser: where the layer is seen, nothing is lost."""
    rng = np.random.default_rng(0)
    alpha = cv2.GaussianBlur((rng.random((64, 64)) > 0.6).astype(np.float32), (0, 0), 4)
    alpha = np.clip(4 * alpha - 1, 0, 1)
    layer = np.dstack([np.full((64, 64, 3), 0.3) * alpha[..., None], alpha]).astype(np.float32)
    straight = web.straight_alpha(layer)
    np.testing.assert_allclose(
        to_linear(straight[..., :3]) * alpha[..., None], layer[..., :3], atol=3e-3
    )
    np.testing.assert_allclose(straight[alpha == 0][..., :3], to_encoded(0.3), atol=0.02)


def test_small_enough(avatar, whole):
    """The painted portrait has 3 mouths at 512 texels; the figures of real bakes are in the log."""
    small, _ = web_files(avatar, WebOptions(side=256, quality=85, photo=256, triangles=0.5))
    assert sum(map(len, small.values())) < 8 * MEGABYTE
    assert sum(map(len, whole.values())) < 20 * MEGABYTE
    assert len(small[web.HEAD]) < 0.75 * len(whole[web.HEAD])


def test_the_same_bytes_twice(avatar, whole):
    assert web_files(avatar)[0] == whole


@pytest.mark.parametrize(
    "wrong", [{"side": 16}, {"quality": 0}, {"photo": 10**6}, {"triangles": 0.0}]
)
def test_odd_sizes_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(InputError, match=f"WebOptions.{name}: .* to "):
        WebOptions(**wrong)
