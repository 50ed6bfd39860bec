"""What surfaces are made of where lamps shine on them; both glTF and USD say so in words of their own."""

from dataclasses import dataclass

VARIANTS = ("photo", "lit")  # the photo's light in the texture, without lamps; or lamps
RELIEF = "skin"  # material with the normal map and a picture of roughness
WET = "tear"  # is lit in both variants
# Roughness as glTF and UsdPreviewSurface have it, of materials without a picture of it; by eye.
ROUGH = {"eyes": 0.12, "teeth": 0.3, "tongue": 0.4, "lashes": 0.7}
HAIR_ROUGH = 0.85  # its gloss lies across the strands, which neither format can say
# Index of refraction: skin and tongue, cornea; of others 1.5, as both formats take it.
REFRACTION = {RELIEF: 1.4, "tongue": 1.4, "eyes": 1.376}


@dataclass(frozen=True, eq=False)
class Lit:
    """Pictures of the atlas for materials that are lit."""

    color: bytes  # JPEG, sRGB-encoded: albedo, with the hair that lies on the skin
    roughness: bytes  # JPEG: green is roughness, blue (metal) is 0
    normal: bytes  # PNG: x along u, y up in the picture, z outwards, each as (x + 1) / 2
