"""What a bake is told: one record a table of the preset."""

from dataclasses import dataclass, field

from bakery.export.web import WebOptions
from bakery.settings import Settings, setting
from bakery.stages.assess import Limits
from bakery.stages.fit import FitOptions
from bakery.stages.segment import SegmentOptions
from bakery.stages.texture import TextureOptions


@dataclass(frozen=True)
class MaskOptions(Settings):
    """How to draw where expressions act."""

    # They are smooth, so that more texels would only cost space.
    resolution: int = setting(512, "side of the masks, at most", 16, 4096, unit="texels")


@dataclass(frozen=True)
class BundleOptions(Settings):
    """What goes into the bundle."""

    formats: tuple[str, ...] = setting(
        ("glb", "proxies", "preview", "web"),
        "what goes along besides textures and head, by exporters",
        count=(0, 20),
    )
    side: int = setting(
        1024, "side of the textures in other formats, at most", 64, 4096, unit="texels"
    )
    web: WebOptions = field(default_factory=WebOptions)


@dataclass(frozen=True)
class BuildOptions(Settings):
    """What `bakery build` is told; one field a table of the preset."""

    segment: SegmentOptions = field(default_factory=SegmentOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    texture: TextureOptions = field(default_factory=TextureOptions)
    mask: MaskOptions = field(default_factory=MaskOptions)
    bundle: BundleOptions = field(default_factory=BundleOptions)
    assess: Limits = field(default_factory=Limits)
