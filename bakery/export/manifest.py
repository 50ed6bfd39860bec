"""What the manifest says about an avatar, and the head as surfaces."""

from dataclasses import dataclass

import numpy as np

from bakery import __version__
from bakery.export import bundle as files
from bakery.export.lod import COARSE, SHARES, head_surfaces, simplify
from bakery.formats import record
from bakery.heads.base import CARDS, HeadModel
from bakery.types import EXPRESSIONS, Fit, Photo, Textures

GEOMETRY = 0.1  # mm at weight 1; less is no movement
WEAK = 1.0  # mm; less is only an approximation of the shape
IPTC = "http://cv.iptc.org/newscodes/digitalsourcetype/"


def levels_of_detail(head, neutral):
    """The head at each share of its triangles.

    Returns:
        a list of Surfaces a level, finest first; the Surfaces of the carriers. Seen from so far that
        the coarsest level will do, lashes are gone.
    """
    surfaces, carriers = head_surfaces(head, neutral)
    levels = []
    for share in SHARES:
        shown = [piece for piece in surfaces if share >= COARSE or piece.name not in CARDS]
        levels.append([simplify(piece, share) for piece in shown])
    return levels, carriers


def channels(head, textures, masks):
    """What each of the 52 channels moves: name -> status, millimetres, keys that it blends in.

    `both`, `geometry`, `texture` and `none` say what there is; `approximate` that the geometry
    moves so little that the shape is only hinted at.
    """
    moved = np.linalg.norm(head.expression_basis, axis=2).max(1)
    table = {}
    for index, name in enumerate(EXPRESSIONS):
        keys = [
            key for key, weights in zip(textures.key_names, textures.key_weights) if weights[index]
        ]
        painted = bool(keys and masks[index].any()) or name.startswith("eyeLook")
        shaped = moved[index] > GEOMETRY or name.startswith("eyeLook")
        status = {
            (True, True): "both",
            (True, False): "geometry",
            (False, True): "texture",
            (False, False): "none",
        }[shaped, painted]
        if shaped and moved[index] < WEAK:
            status = "approximate"
        table[name] = {"status": status, "millimetres": round(float(moved[index]), 3), "keys": keys}
    return table


@dataclass(frozen=True, eq=False)
class Baked:
    """Everything that a bundle is made of."""

    photo: Photo
    fit: Fit
    head: HeadModel
    textures: Textures
    masks: np.ndarray  # [E, m, m] float32 0..1
    findings: list  # of assess.Finding
    generator: object  # generators.base.Generator
    detector: str  # what found the landmarks


def manifest(baked, levels, web):
    """Everything that avatar.json says, but for the list of files.

    Args:
        baked: Baked.
        levels: from `levels_of_detail`.
        web: table of runtime.web.web_files.
    """
    head, photo, fit = baked.head, baked.photo, baked.fit
    textures, masks = baked.textures, baked.masks
    height, width = photo.encoded.shape[:2]
    fitted = record.fit_to_table(fit)
    del fitted["seconds"]  # a time would differ from bake to bake
    fitted["diagnostics"] = {k: v for k, v in fitted["diagnostics"].items() if "seconds" not in k}
    return {
        "$schema": "urn:bakery:schema:avatar-1",
        "asset": {"version": "1.0", "generator": f"bakery {__version__}"},
        "conventions": files.CONVENTIONS,
        "expressions": list(EXPRESSIONS),
        **files.describe_textures(textures, masks),
        "uv": {name: [round(x, 6) for x in box] for name, box in head.uv_rectangles.items()},
        "lods": [
            {
                "node": f"head_lod{number}",
                "vertices": sum(len(piece.vertices) for piece in level),
                "triangles": sum(len(piece.faces) for piece in level),
            }
            for number, level in enumerate(levels)
        ],
        "head": {
            "name": head.name,
            "licence": head.licence,
            "source": head.source,
            "sha256": head.digest,
        },
        "fit": fitted,
        "channels": channels(head, textures, masks),
        "warnings": [vars(finding) for finding in baked.findings],
        "provenance": {
            "input": {
                "sha256": photo.sha256,
                "width": width,
                "height": height,
                "notes": list(photo.notes),
            },
            "generator": baked.generator.name,
            "detector": baked.detector,
            "digitalSourceType": IPTC + baked.generator.source_type,
            "licences": {
                "bakery": "Apache-2.0",
                f"head model {head.name}": head.licence,
                "portrait": "as its owner says; the person shown must agree to the avatar",
            },
        },
        "web": web,
    }
