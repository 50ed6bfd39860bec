"""What a bake is told: one record a table of the preset."""

from dataclasses import dataclass, field

from bakery.errors import InputError
from bakery.export.web import WebOptions
from bakery.stages.assess import Limits
from bakery.stages.fit import FitOptions
from bakery.stages.segment import SegmentOptions
from bakery.stages.texture import TextureOptions

RESOLUTIONS = (512, 4096)  # texels, least and most


@dataclass(frozen=True)
class BundleOptions:
    """What goes into the bundle."""

    masks: int = 512  # texels on a side of the activation masks
    web: WebOptions = field(default_factory=WebOptions)  # the copy for browsers
    glb: int = 1024  # texels on a side of the texture inside head.glb, at most


@dataclass(frozen=True)
class BuildOptions:
    """What `bakery build` is told; one field a table of the preset."""

    segment: SegmentOptions = field(default_factory=SegmentOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    texture: TextureOptions = field(default_factory=TextureOptions)
    bundle: BundleOptions = field(default_factory=BundleOptions)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        low, high = RESOLUTIONS
        if not low <= self.texture.resolution <= high:
            raise InputError(
                f"resolution {self.texture.resolution}; it must lie between {low} and {high} texels"
            )
        if not 16 <= self.bundle.masks <= high:
            raise InputError(f"bundle.masks {self.bundle.masks}; give 16 to {high} texels")
