"""Pictures to textures: T_0 of the photo, and what the generator painted, unwrapped onto the atlas.

`neutral` makes T_0 with eyes, lids and hair; `keys`, `gaze` and `mouth` unwrap what was generated.
"""

from dataclasses import dataclass

VIEWS = (0.0, 40.0, -40.0)  # degrees of yaw that each key expression is painted from


@dataclass(frozen=True)
class TextureOptions:
    """What to bake."""

    resolution: int = 1024  # T, texels on a side
    views: tuple[float, ...] = VIEWS
    mouths: int = 300  # at most as many poses
