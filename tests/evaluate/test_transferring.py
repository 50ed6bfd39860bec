"""The transfer measured: flat people whose right answers are known."""

import json

import numpy as np
import pytest
from safetensors.numpy import save_file

from bakery.errors import InputError
from bakery.evaluate import transferring

SIZE = 256


@pytest.fixture(scope="module")
def performers(tmp_path_factory, head):
    """Three grey people; whoever acts gets darker by 51 of 255, all over."""
    folder = tmp_path_factory.mktemp("performers")
    for number, level in enumerate((102, 153, 204)):
        textures = np.full((4, SIZE, SIZE, 3), level, np.uint8)
        textures[1:] -= 51
        arrays = {"textures": textures, "seen": np.full((4, SIZE, SIZE), 255, np.uint8)}
        about = {"performer": json.dumps({"head": head.name})}
        save_file(arrays, folder / f"performer-{number:05d}.safetensors", about)
    return folder


def lazy(source, source_neutral, target_neutral, *seen):
    """Half of the way."""
    return target_neutral + (source - source_neutral) / 2


def test_known_answers(performers, tmp_path):
    found = list(transferring.measure(performers, lazy, 2, tmp_path))
    assert [name.split(",")[0] for name, _ in found[::2]] == ["0 for 1", "1 for 2", "2 for 0"]
    assert all(not name.endswith("expression 0") for name, _ in found)
    for _, scores in found:
        assert scores["delta"].l1 == pytest.approx(0, abs=1e-6)
        assert scores["transfer"].l1 == pytest.approx(0.1, abs=1e-6)
        assert scores["neutral"].l2 == pytest.approx(0.04, abs=1e-6)
        assert scores["transfer"].mouth == pytest.approx(20, abs=1e-3)
    told = transferring.summary([scores for _, scores in found])
    assert told["pairs"] == 6 and told["transfer"]["l1"] == pytest.approx(0.1, abs=1e-6)
    assert told["against_delta"]["ssim"] < 0
    assert len(list(tmp_path.glob("*.png"))) == 3


def test_the_command(bakery, performers, tmp_path):
    done = bakery("evaluate", "transfer", performers, "--expressions", 1)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(rows) == 4 and rows[-1]["pairs"] == 3
    assert rows[-1]["transfer"]["l1"] < rows[-1]["neutral"]["l1"]
    done = bakery("evaluate", "transfer", tmp_path)
    assert done.returncode == 1 and "bakery synth performers" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_one_person_is_too_few(tmp_path):
    with pytest.raises(InputError, match="at least 2"):
        next(transferring.measure(tmp_path, lazy))
