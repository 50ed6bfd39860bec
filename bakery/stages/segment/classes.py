"""What a pixel of a portrait can show, and the record of it."""

from dataclasses import dataclass

import numpy as np

from bakery.check import check_array
from bakery.settings import Settings, setting

LABELS = (
    "background", "skin", "hair", "clothes", "glasses", "eyes", "lips", "mouth", "hidden",
    "lens", "ears", "neck", "brows", "beard", "hat", "thing",
)  # fmt: skip
(
    BACKGROUND, SKIN, HAIR, CLOTHES, GLASSES, EYES, LIPS, MOUTH, HIDDEN,
    LENS, EARS, NECK, BROWS, BEARD, HAT, THING,
) = range(len(LABELS))  # fmt: skip
REGIONS = LABELS[: HIDDEN + 1]  # what steps that use a photo tell apart
# The region of each label. What a clear lens shows is up to who finds the lens.
REGION_OF = np.array(
    [*range(len(REGIONS)), GLASSES, SKIN, SKIN, SKIN, SKIN, CLOTHES, HIDDEN], np.uint8
)
METHODS = ("network", "colours")


@dataclass(frozen=True)
class Segmentation:
    """What each pixel of a portrait shows.

    `labels` say it to people; `regions` are what fit, textures and warnings go by: ears, neck, brows
    and beards are skin there, a hat is clothes, a clear lens is what is seen through it.
    """

    labels: np.ndarray  # [H, W] uint8 into LABELS
    skin: np.ndarray  # [H, W] float32 0..1: safe to unwrap; eyes, lips and mouth included
    regions: np.ndarray = None  # [H, W] uint8 into REGIONS; made by REGION_OF if not given
    shadow: np.ndarray | None = None  # [H, W] float32 0..1, hard cast shadow; None: not known

    def __post_init__(self):
        check_array("Segmentation.labels", self.labels, (None, None), high=len(LABELS) - 1)
        check_array("Segmentation.skin", self.skin, self.labels.shape, low=0, high=1)
        if self.regions is None:
            object.__setattr__(self, "regions", REGION_OF[self.labels])
        check_array("Segmentation.regions", self.regions, self.labels.shape, high=len(REGIONS) - 1)
        if self.shadow is not None:
            check_array("Segmentation.shadow", self.shadow, self.labels.shape, low=0, high=1)


@dataclass(frozen=True)
class SegmentOptions(Settings):
    """How the portrait is labelled. Lengths are shares of the face size."""

    method: str = setting("network", "what tells the classes apart", choices=METHODS)
    rounds: int = setting(3, "rounds of expectation maximisation, by colours", 1, 20)
    rim: float = setting(0.012, "skin this close to something else is left out", 0, 0.2)
    feather: float = setting(0.025, "width over which the mask rises behind the rim", 0.001, 0.5)


@dataclass(frozen=True, eq=False)
class Found:
    """Classes in the face frame, before they are brought to the photo's pixels; S is `prior.SIZE`."""

    shares: np.ndarray  # [4, S, S] float32 of background, skin, hair and clothes
    face: np.ndarray  # [S, S] bool, surely face
    glasses: np.ndarray  # [S, S] bool
    hidden: np.ndarray  # [S, S] bool
    labels: np.ndarray | None = None  # [S, S] uint8 into LABELS; None: the regions say all
    shadow: np.ndarray | None = None  # [S, S] float32 0..1
