"""ICT-FaceKit's neutral mesh without its shapes against ICT-FaceKit with them: the same smiles."""

import numpy as np
import pytest

from bakery.cli.options import build_options
from bakery.evaluate import report
from bakery.heads import ict
from bakery.heads.file import load_head, save_head
from bakery.heads.mesh.assemble import MeshOptions, import_mesh
from bakery.heads.mesh.look import look
from bakery.plugins import plug_in

PEOPLE = ("003", "018", "032", "102")  # of london/val: closed, slight and toothy smiles
MOUTHS = 40  # a toothy smile is among them
WORSE = 1.0  # dB that carried shapes may lose against the head's own


def write_obj(path, source):
    """The bare neutral mesh: no uv, no shapes."""
    with open(path, "w", encoding="utf-8") as out:
        out.writelines(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in source.mean)
        for quad in source.quads:
            out.write("f " + " ".join(str(corner + 1) for corner in quad if corner >= 0) + "\n")


@pytest.fixture(scope="module")
def folder(shared, tmp_path_factory):
    """Heads `ict` with its own shapes and `ictmesh` with the built-in head's."""
    out = tmp_path_factory.mktemp("heads")
    source = ict.read(shared / "heads" / "ict_facekit_light.npz")
    save_head(out / "ict.npz", ict.build(source))
    write_obj(out / "neutral.obj", source)
    detector = plug_in("detectors", "network")
    head, about = import_mesh(
        out / "neutral.obj",
        load_head(),
        lambda surface, head, up: look(surface, detector.detect, head, up),
        "ictmesh",
        MeshOptions(topology="file", licence=ict.LICENCE, source=ict.SOURCE),
    )
    assert "unit: cm assumed" in " ".join(about)
    save_head(out / "ictmesh.npz", head)
    return out


@pytest.mark.slow
def test_carried_shapes_smile_as_well(shared, folder, monkeypatch):
    monkeypatch.setenv("BAKERY_HEADS", str(folder))
    options = build_options("small", ["texture.views=[0.0]"])
    painter = plug_in("generators", "rendered")
    smile = {
        name: {
            result.name: result.smile.hull_psnr
            for result in report.avatars(
                shared / "portraits", load_head(name), painter, options, MOUTHS, None, PEOPLE
            )
        }
        for name in ("ict", "ictmesh")
    }
    for person in PEOPLE:
        print(person, *(f"{smile[name][person]:.2f}" for name in smile))
        assert smile["ictmesh"][person] >= smile["ict"][person] - WORSE
    mean = {name: np.mean(list(found.values())) for name, found in smile.items()}
    assert mean["ictmesh"] >= mean["ict"] - WORSE
