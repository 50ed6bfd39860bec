"""Takes that openfacefx writes of text: in Python, on the page, and what the mouth does with them."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bakery.formats.livelink import read_take
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

TEXT, SECONDS = "Mama may buy a boat.", 2.0


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    pytest.importorskip("openfacefx")
    path = tmp_path_factory.mktemp("speech") / "line.livelink.csv"
    command = ["naive", "--text", TEXT, "--duration", str(SECONDS), "--retarget", "arkit"]
    subprocess.run(
        [sys.executable, "-m", "openfacefx", *command, "-o", path], check=True, capture_output=True
    )
    return path


def test_it_is_a_take_of_the_length_of_the_line(written):
    take = read_take(written)
    assert take.rate == 60 and take.seconds[-1] == pytest.approx(SECONDS, abs=1 / 60)
    assert take.notes == ()
    moving = {EXPRESSIONS[k] for k in np.flatnonzero(take.weights.max(0) > 0.1)}
    assert {"jawOpen", "mouthFunnel", "mouthPucker", "mouthPressLeft"} <= moving
    assert not take.head.any()


def test_the_mouth_opens_and_closes_as_the_text_has_it(written):
    """Five sounds of closed lips (m, m, m, b, b), and a vowel behind each."""
    jaw = read_take(written).weights[:, EXPRESSION_INDEX["jawOpen"]]
    syllables = np.count_nonzero(np.diff((jaw > 0.5 * jaw.max()).astype(int)) == 1)
    assert jaw.max() > 0.3 and syllables == 5


def test_animate_plays_it(written, bakery, bundle, tmp_path):
    done = bakery(
        "animate", bundle, "--curves", written, "-o", tmp_path / "a.mp4", "--size", 64, "--frames", "0:8"
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.mp4").stat().st_size > 0


def test_the_page_reads_the_same_values(written, node, tmp_path):
    (tmp_path / "takes.json").write_text(json.dumps({"speech": written.read_text()}))
    (tmp_path / "names.json").write_text(json.dumps(EXPRESSIONS))
    script = Path(__file__).parent / "livelink.mjs"
    seen = json.loads(node(script, tmp_path / "takes.json", tmp_path / "names.json"))["speech"]
    take = read_take(written)
    np.testing.assert_allclose(seen["seconds"], take.seconds, atol=1e-9)
    np.testing.assert_allclose(seen["weights"], take.weights, atol=1e-6)
