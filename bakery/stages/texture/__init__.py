"""Pictures to textures: T_0 of the photo, and what the generator painted, unwrapped onto the atlas.

`neutral` makes T_0 with eyes, lids and hair, `rest` takes the expression out of it; `keys`, `gaze` and
`mouth` unwrap what was generated.
"""

from dataclasses import dataclass

from bakery.settings import Settings, setting

METHODS = ("none", "mirror", "quick", "synthesize")  # of completing skin, see `complete`
VIEWS = (0.0, 40.0, -40.0)  # degrees of yaw that each key expression is painted from


@dataclass(frozen=True)
class TextureOptions(Settings):
    """What to bake."""

    resolution: int = setting(1024, "side of the textures", 512, 4096, unit="texels")
    views: tuple[float, ...] = setting(
        VIEWS, "yaw of each view that key expressions are painted from", -60, 60,
        unit="degrees", count=(1, 9),
    )  # fmt: skip
    mouths: int = setting(300, "mouth poses that are baked", 1, 300)
    complete: str = setting(
        "quick", "how skin that the photo does not show is filled in",
        choices=METHODS,
    )  # fmt: skip
    glasses: str = setting(
        "remove", "frames of glasses: taken off, or kept as a layer over the skin",
        choices=("remove", "keep"),
    )  # fmt: skip
    neutral: str = setting(
        "rest", "neutral skin and shape of a photo with an expression", choices=("rest", "keep")
    )
