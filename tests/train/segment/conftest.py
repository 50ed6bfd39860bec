"""One folder of painted portraits for all tests of the segmentation's training."""

import numpy as np
import pytest
import torch

from bakery.heads.file import load_head
from bakery.synth import portrait_shards
from bakery.synth.portraits import PortraitOptions


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Networks this small gain nothing from threads, and lose much where other tests run beside."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="session")
def head():
    return load_head("makehuman")


@pytest.fixture(scope="session")
def painted(tmp_path_factory):
    """A folder of four painted portraits."""
    folder = tmp_path_factory.mktemp("bank")
    people = portrait_shards.PEOPLE
    portrait_shards.PEOPLE = 2
    try:
        list(portrait_shards.write("makehuman", folder, 4, 5, options=PortraitOptions(scenes=2)))
    finally:
        portrait_shards.PEOPLE = people
    return folder


@pytest.fixture(scope="session")
def congress(tmp_path_factory, painted):
    """A folder of "photos" of painted people before a grey wall, with their points."""
    import cv2

    root = tmp_path_factory.mktemp("portraits")
    (root / "train").mkdir()
    table = portrait_shards.read(painted)
    names = []
    for k, (image, alpha) in enumerate(zip(table["image"], table["alpha"])):
        share = alpha[..., None] / 255
        wall = np.array([120, 140, 160]) + np.random.default_rng(k).normal(size=(256, 256, 3))
        picture = np.round(image * share + wall * (1 - share)).astype(np.uint8)
        names.append(f"train/{k}.png")
        cv2.imwrite(str(root / names[-1]), picture[..., ::-1])
    np.savez(root / "dense478.npz", names=np.array(names), points=table["points"])
    return root
