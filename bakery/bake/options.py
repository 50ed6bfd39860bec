"""What a bake is told: one record a table of the preset."""

from dataclasses import dataclass, field

from bakery.export.web import WebOptions
from bakery.settings import Settings, setting
from bakery.stages.assess import Limits
from bakery.stages.fit import FitOptions
from bakery.stages.segment import SegmentOptions
from bakery.stages.texture import TextureOptions


@dataclass(frozen=True)
class BundleOptions(Settings):
    """What goes into the bundle."""

    masks: int = setting(512, "side of the activation masks, at most", 16, 4096, unit="texels")
    glb: int = setting(
        1024, "side of the texture inside head.glb, at most", 64, 4096, unit="texels"
    )
    web: WebOptions = field(default_factory=WebOptions)


@dataclass(frozen=True)
class BuildOptions(Settings):
    """What `bakery build` is told; one field a table of the preset."""

    segment: SegmentOptions = field(default_factory=SegmentOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    texture: TextureOptions = field(default_factory=TextureOptions)
    bundle: BundleOptions = field(default_factory=BundleOptions)
    limits: Limits = field(default_factory=Limits)
