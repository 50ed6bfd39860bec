"""`bakery albedo` and `bakery evaluate albedo`."""

import numpy as np
import pytest

from bakery.evaluate import albedo as albedos
from bakery.formats import exr
from bakery.geometry import harmonics
from bakery.geometry.color import LUMA

SMALL = ["--preset", "small"]


def test_it_is_what_the_bundle_holds(portrait, bundle, bakery, tmp_path):
    photo, marks = portrait
    out, fit = tmp_path / "albedo.exr", tmp_path / "fit.json"
    given = [photo, "--landmarks", marks, *SMALL]
    done = bakery("albedo", *given, "-o", out)
    assert done.returncode == 0, done.stderr
    assert f"wrote {out}" in done.stderr and list(exr.read_exr(out)) == ["albedo"]
    assert out.read_bytes() == (bundle / "albedo.exr").read_bytes()
    assert bakery("fit", *given, "-o", fit).returncode == 0
    again = bakery("albedo", *given, "--fit", fit, "-o", out, "--overwrite")
    assert again.returncode == 0 and out.read_bytes() == (bundle / "albedo.exr").read_bytes()


def test_a_bundle_says_that_it_holds_albedo(bundle, avatar, bakery):
    albedo, neutral = (np.float32(x) for x in (avatar.textures.albedo, avatar.textures.neutral))
    assert albedo.shape == neutral.shape and 0 <= albedo.min() and albedo.max() <= 1
    assert "albedo" in bakery("inspect", bundle).stdout


@pytest.mark.parametrize(
    "arguments, code, word",
    [
        (["-o", "a.png"], 2, ".exr"),
        (["-o", "a.exr", "--fit", "none.json"], 1, "none.json"),
        ([], 2, "-o"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(portrait, bakery, tmp_path, arguments, code, word):
    photo, marks = portrait
    done = bakery("albedo", photo, "--landmarks", marks, *SMALL, *arguments, cwd=tmp_path)
    assert done.returncode == code and word in done.stderr and "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_is_asked_for(portrait, bakery, tmp_path):
    (tmp_path / "a.exr").write_bytes(b"mine")
    done = bakery("albedo", portrait[0], *SMALL, "-o", tmp_path / "a.exr")
    assert done.returncode == 1 and "--overwrite" in done.stderr
    assert (tmp_path / "a.exr").read_bytes() == b"mine"


@pytest.mark.parametrize("name", albedos.LIGHTS)
def test_the_lights_read_alike_on_a_meter(name):
    light = albedos.metered(albedos.studio_light(**albedos.LIGHTS[name]))
    shown = harmonics.irradiance(np.array([0.0, 0, 1]), light.irradiance()) @ LUMA
    assert shown == pytest.approx(albedos.METER, rel=1e-6)


def test_cielab_of_known_colours():
    """White, black, mid-grey by the definition of L*, and red by its published coordinates."""
    np.testing.assert_allclose(albedos.lab(np.ones(3, np.float32)), [100, 0, 0], atol=0.05)
    np.testing.assert_allclose(albedos.lab(np.zeros(3, np.float32)), [0, 0, 0], atol=0.05)
    np.testing.assert_allclose(albedos.lab(np.full(3, 0.184187, np.float32)), [50, 0, 0], atol=0.01)
    red = albedos.lab(np.array([1, 0, 0], np.float32))
    np.testing.assert_allclose(red, [53.24, 80.09, 67.20], atol=0.01)


def test_the_people_go_from_pale_to_dark(head):
    people = [albedos.person(head, number) for number in range(12)]
    assert [one.melanin for one in people] == [*albedos.MELANIN] * 2
    assert len({one.seed for one in people}) == 12
    tones = [albedos.lab(albedos.true_albedo(head, one, 128).mean((0, 1)))[0] for one in people[:6]]
    assert tones == sorted(tones, reverse=True)


def test_the_summary_tells_the_worst():
    rows = [
        {"lights": 1.0, "truth": 2.0, "views": 33.0},
        {"lights": 2.0, "truth": 4.0, "views": 31.0},
    ]
    assert albedos.summary(rows) == {
        "people": 2, "lights_mean": 1.5, "lights_worst": 2.0, "truth_mean": 3.0,
        "views_mean": 32.0, "views_worst": 31.0,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 3, 5])
def test_albedo_is_the_persons_own(head, number):
    """Within the requirement: 3 units of CIELAB between lights, 28 dB between views."""
    found = albedos.measure(head, albedos.person(head, number))
    assert found["lights"] < 3 and found["views"] > 28
