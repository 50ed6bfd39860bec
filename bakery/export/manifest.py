"""What the manifest says about an avatar, and the head as surfaces."""

from dataclasses import dataclass

import numpy as np

from bakery import __version__
from bakery.export import bundle as bundles
from bakery.export import hair_mesh, layout
from bakery.export.consent import Consent
from bakery.export.glb import EYES, EYES_NODE, HAIR_NODE, HEAD_NODE
from bakery.export.lod import COARSE, RATIOS, coarser, head_surfaces
from bakery.export.materials import RELIEF
from bakery.export.schema import VERSION
from bakery.export.tangents import with_tangents
from bakery.formats import record
from bakery.formats.mark import IPTC
from bakery.heads.base import CARDS, HeadModel
from bakery.types import EXPRESSIONS, Fit, Ingredient, Maker, Photo, Textures

GEOMETRY = 0.1  # mm at weight 1; less is no movement
WEAK = 1.0  # mm; less is only an approximation of the shape
ALBEDO = {
    "albedo": {
        "file": "albedo.exr",
        "part": "albedo",
        "layout": "RGB on the same atlas: share of white light that comes back; fit/light is the photo's",
    }
}


def levels_of_detail(head, neutral, mixes=(), ratios=RATIOS, lit=False):
    """The head at each ratio of its triangles: a list of Surfaces a level, finest first.

    The first arguments are those of `head_surfaces`, `ratios` that of `coarser`; `lit` gives tangents
    to what has a normal map then.

    Seen from so far that the coarsest level will do, lashes are gone.
    """
    pieces = head_surfaces(head, neutral, mixes)
    if lit:
        pieces = [with_tangents(one) if one.name == RELIEF else one for one in pieces]
    found = [coarser(piece, ratios) for piece in pieces]
    return [
        [piece for piece in level if ratio >= COARSE or piece.name not in CARDS]
        for ratio, level in zip(ratios, zip(*found))
    ]


def describe_levels(levels, hair=()):
    """What the manifest says of the levels of detail in head.glb.

    Args:
        levels, hair: lists of Surfaces a level.
    """
    found = []
    for number, pieces in enumerate(levels):
        eyes = [piece for piece in pieces if piece.name == EYES]
        others = [piece for piece in pieces if piece.name != EYES]
        found.append(_level(f"{HEAD_NODE}{number}", others))
        if eyes:
            found[-1]["eyes"] = _level(f"{EYES_NODE}{number}", eyes)
    for number, (level, pieces) in enumerate(zip(found, hair)):
        if pieces:
            level["hair"] = _level(f"{HAIR_NODE}{number}", pieces)
    return found


def _level(node, pieces):
    return {
        "node": node,
        "vertices": sum(len(piece.vertices) for piece in pieces),
        "triangles": sum(len(piece.faces) for piece in pieces),
    }


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
    generator: Maker  # of the textures
    detector: Maker  # of the landmarks
    recipe: str = ""  # SHA-256 over all that the bundle depends on; "" if unknown
    consent: Consent | None = None  # of the person shown, if it was given
    ingredients: tuple[Ingredient, ...] = ()  # the photos that carry a mark of their own


def manifest(baked: Baked, exported: list[dict], listed: list[dict]) -> dict:
    """Everything that avatar.json says, but for its digest of itself.

    Args:
        baked: Baked.
        exported: what each exporter says for the manifest, a list of tables.
        listed: the bundle's files, from export.bundle.list_files.
    """
    head = baked.head
    photo = [entry["path"] for entry in listed if entry["role"] == "photo"]
    return {
        "$schema": "urn:bakery:schema:avatar-1",
        "asset": {"version": VERSION, "generator": f"bakery {__version__}"},
        "conventions": layout.CONVENTIONS,
        "expressions": list(EXPRESSIONS),
        **_textures_table(baked.textures, baked.masks),
        "uv": {name: [round(x, 6) for x in box] for name, box in head.uv_rectangles.items()},
        "lods": [],
        "head": {
            "name": head.name,
            "licence": head.licence,
            "source": head.source,
            "sha256": head.digest,
        },
        "fit": _fit_table(baked.fit),
        "channels": channels(head, baked.textures, baked.masks),
        "warnings": [vars(finding) for finding in baked.findings],
        "provenance": _provenance(baked),
        **({"photo": photo[0]} if photo else {}),
        **_said(exported),
        "files": listed,
    }


def _said(exported):
    """What the exporters say, as one table; the extras of several stand side by side."""
    out = {}
    for table in exported:
        extras = out.get("extras", {}) | table.get("extras", {})
        out |= table
        if extras:
            out["extras"] = extras
    return out


def _fit_table(fit):
    table = record.fit_to_table(fit)
    del table["seconds"]  # a time would differ from bake to bake
    table["diagnostics"] = {k: v for k, v in table["diagnostics"].items() if "seconds" not in k}
    return table


def _provenance(baked):
    height, width = baked.photo.encoded.shape[:2]
    ingredients = [ingredient_table(one) for one in baked.ingredients]
    return {
        "input": {
            "sha256": baked.photo.sha256,
            "width": width,
            "height": height,
            "notes": list(baked.photo.notes),
        },
        "generator": baked.generator.name,
        "detector": baked.detector.name,
        "models": {"generator": _model(baked.generator), "detector": _model(baked.detector)},
        **({"recipe": baked.recipe} if baked.recipe else {}),
        "digitalSourceType": IPTC + baked.generator.source_type,
        **({"consent": vars(baked.consent)} if baked.consent else {}),
        **({"ingredients": ingredients} if ingredients else {}),
        "licences": {
            "bakery": "Apache-2.0",
            f"head model {baked.head.name}": baked.head.licence,
            "portrait": "as its owner says; the person shown must agree to the avatar",
        },
    }


def ingredient_table(found: Ingredient) -> dict:
    """What a manifest says of an input that carries a mark of its own."""
    claims = {
        "sha256": found.store,
        "generator": found.claimed_by,
        "digitalSourceTypes": list(found.claimed),
    }
    return {
        "sha256": found.sha256,
        **({"digitalSourceType": found.source_type} if found.source_type else {}),
        **(
            {"c2pa": {name: value for name, value in claims.items() if value}}
            if found.store
            else {}
        ),
    }


def _model(maker):
    """Version and digest of a Maker, as far as they are known."""
    known = {"version": maker.version, "sha256": maker.sha256}
    return {name: value for name, value in known.items() if value}


def _textures_table(textures, masks):
    """What stands in which part of the EXR files; export.bundle.write_textures puts it there."""
    values, counts = np.unique(textures.source, return_counts=True)
    mouths = len(textures.mouths)
    columns, rows = layout.mouth_grid(mouths)
    return {
        "keys": [
            {"name": name, "part": name, "weights": bundles.sparse(weights)}
            for name, weights in zip(textures.key_names, textures.key_weights)
        ],
        "hair": {
            "file": "hair.exr",
            "part": "hair",
            "layout": "RGBA over the face texture, colour multiplied by alpha; lashes in uv/cards",
        },
        **(
            {} if textures.hair_mesh is None else {"hair_mesh": hair_mesh.table(textures.hair_mesh)}
        ),
        **(ALBEDO if len(textures.albedo) else {}),
        "gaze": {
            "file": "gaze.exr",
            "parts": layout.gaze_parts(len(textures.gaze)),
            "directions": record.numbers(textures.gaze_directions, 4),
            "layout": "the cap of the left eye on the left, that of the right eye on the right",
        },
        "mouths": {
            "file": "mouth.exr",
            "parts": layout.mouth_parts(mouths),
            "columns": columns,
            "rows": rows,
            "landmarks": record.numbers(textures.mouth_landmarks, 5),
            "weights": [bundles.sparse(weights) for weights in textures.mouth_weights],
        },
        "masks": {
            "file": "masks.exr",
            "resolution": int(masks.shape[1]),
            "channels": {name: {"part": name, "channel": "Y"} for name in EXPRESSIONS},
        },
        "coverage": {
            "file": "coverage.exr",
            "source": "source",
            "facing": "facing",
            "values": {str(value): name for value, name in layout.SOURCES.items()},
            "shares": {
                layout.SOURCES[int(value)]: round(float(count / textures.source.size), 4)
                for value, count in zip(values, counts)
            },
        },
    }
