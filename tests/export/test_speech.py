"""head.glb with visemes and what else other programs ask for: names, shapes, size."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bakery.export.validate_glb import glb_problems
from bakery.formats.targets import OTHERS, expression_weights, other_weights
from bakery.plugins import plug_in
from bakery.types import EXPRESSIONS

VALIDATOR = Path(__file__).resolve().parents[2] / "node_modules" / "gltf-validator"
VALIDATE = (
    "require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[2])"
    ")).then(r => console.log(JSON.stringify(r.issues)))"
)
VISEMES = "sil PP FF TH DD kk CH SS nn RR aa E I O U".split()
MORE = "mouthOpen mouthSmile eyesClosed eyesLookUp eyesLookDown".split()


@pytest.fixture(scope="module")
def made(hairy, tmp_path_factory):
    path = tmp_path_factory.mktemp("speech") / "a.glb"
    plug_in("exporters", "glb-speech").export(hairy, path, 1024)
    return path


def test_names_are_those_of_oculus_and_five_more():
    assert list(OTHERS) == [f"viseme_{name}" for name in VISEMES] + MORE
    mixes = dict(zip(OTHERS, other_weights()))
    assert not mixes["viseme_sil"].any()
    np.testing.assert_array_equal(mixes["viseme_aa"], expression_weights("viseme:AA"))
    smile = {EXPRESSIONS[k]: mixes["mouthSmile"][k] for k in np.flatnonzero(mixes["mouthSmile"])}
    assert smile == {"mouthSmileLeft": 1, "mouthSmileRight": 1}


def test_each_name_is_a_target_that_does_what_its_shapes_do(made, glb):
    document, rest = glb[0](made.read_bytes())
    names = [*EXPRESSIONS, *OTHERS]
    for mesh in document["meshes"]:
        if not mesh["name"].startswith("hair"):
            assert mesh["extras"]["targetNames"] == names
            assert all(len(one["targets"]) == len(names) for one in mesh["primitives"])

    def read(accessor):
        accessor = document["accessors"][accessor]
        out, sparse = np.zeros((accessor["count"], 3), np.float32), accessor.get("sparse")
        if not sparse:  # most vertices move; its view may go on for coarser levels
            start = document["bufferViews"][accessor["bufferView"]]["byteOffset"] + 8
            return np.frombuffer(rest, np.float32, out.size, start).reshape(-1, 3)
        if sparse:
            index, values = (
                document["bufferViews"][sparse[key]["bufferView"]]["byteOffset"] + 8
                for key in ("indices", "values")
            )
            rows = np.frombuffer(rest, np.uint16, sparse["count"], index)
            out[rows] = np.frombuffer(rest, np.float32, 3 * sparse["count"], values).reshape(-1, 3)
        return out

    skin = document["meshes"][0]["primitives"][0]["targets"]
    closed, smile = (
        (
            read(skin[names.index(other)]["POSITION"]),
            sum(read(skin[names.index(f"{one}{side}")]["POSITION"]) for side in ("Left", "Right")),
        )
        for other, one in (("eyesClosed", "eyeBlink"), ("mouthSmile", "mouthSmile"))
    )
    for found, wanted in (closed, smile):
        assert np.abs(wanted).max() > 3e-3  # metres
        np.testing.assert_allclose(found, wanted, atol=2.1e-4)  # twice what is taken for rest


def test_it_is_a_good_file_of_less_than_ten_megabytes(made, hairy_bundle):
    assert made.stat().st_size < 10e6 and (hairy_bundle / "head.glb").stat().st_size < 8e6
    meshes = [f"{what}_LOD{level}" for what in ("head", "eyes") for level in range(4)]
    still = [f"hair_LOD{level}" for level in range(4)]
    assert glb_problems("a.glb", made.read_bytes(), meshes, 1, still) == []
    if not VALIDATOR.exists() or shutil.which("node") is None:
        pytest.skip("needs `npm install gltf-validator` in the checkout")
    command = ["node", "-e", VALIDATE, str(VALIDATOR), str(made)]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert said["numErrors"] == 0 and said["numWarnings"] == 0, said["messages"][:5]
