"""VRM 1.0: the head on a person's bones, with expressions, gaze and permissions.

Source: VRMC_vrm 1.0 (github.com/vrm-c/vrm-specification): humanoid, expressions, lookAt, meta; hair
that hangs swings by VRMC_springBone. The
52 shapes stand as custom expressions under ARKit's names, as programs for face tracking look for
them ("Perfect Sync"). What it permits is as little as the format can say: whoever publishes an
avatar has to agree with the person that it shows.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pygltflib as gltf

from bakery.export import glb
from bakery.export.glb import Surface
from bakery.export.glb_data import METRES, Writer
from bakery.export.hair import Hair
from bakery.export.rig import Rig
from bakery.export.skeleton import SKINNED, from_body, joint_weights, joints, to_body
from bakery.export.springs import LINKS, chain_joints, chain_weights, hair_chains, spring_table
from bakery.formats.targets import expression_weights
from bakery.heads.base import HeadModel, gaze_of, weights
from bakery.landmarks import BEFORE_EARS
from bakery.types import EXPRESSIONS

PRESETS = {  # expression of VRM -> ours
    "happy": "laugh", "angry": "anger", "sad": "sadness", "surprised": "surprise",
    "relaxed": "smile=0.5", "aa": "viseme:AA", "ih": "viseme:IH", "ou": "viseme:OU",
    "ee": "viseme:EE", "oh": "viseme:OH", "blink": "eyeBlinkLeft=1,eyeBlinkRight=1",
    "blinkLeft": "eyeBlinkLeft=1", "blinkRight": "eyeBlinkRight=1",
    "lookUp": "eyeLookUpLeft=1,eyeLookUpRight=1", "lookDown": "eyeLookDownLeft=1,eyeLookDownRight=1",
    "lookLeft": "eyeLookOutLeft=1,eyeLookInRight=1", "lookRight": "eyeLookInLeft=1,eyeLookOutRight=1",
    "neutral": "",
}  # fmt: skip
EMOTIONS = ("happy", "angry", "sad", "surprised", "relaxed")  # that hold back blinking and speech
LOOKS = {  # part of lookAt -> the shape whose angle at weight 1 it is
    "rangeMapHorizontalInner": "eyeLookInLeft", "rangeMapHorizontalOuter": "eyeLookOutLeft",
    "rangeMapVerticalDown": "eyeLookDownLeft", "rangeMapVerticalUp": "eyeLookUpLeft",
}  # fmt: skip
LICENCE = "https://vrm.dev/licenses/1.0/"
HEAD, LOCKS = "head", "hair"  # nodes


def write_vrm(
    path: Path,
    head: HeadModel,
    neutral: np.ndarray,
    surfaces: list[Surface],
    pictures: tuple[bytes, bytes | None, Hair | None],
    thumbnail: bytes,
    generator: str,
    source_type: str,
) -> None:
    """Write a head as VRM.

    Args:
        neutral: [V, 3] mm, the person's shape.
        surfaces: of the finest level of detail, in the head's space.
        pictures: JPEG of the atlas, PNG of the lashes or None, hair or None.
        thumbnail: a square PNG or JPEG of the avatar.
        generator: name and version of the program.
        source_type: IPTC digital source type, a URL.
    """
    made = Writer()
    texture, cards, hair = pictures
    document = glb.begin(made, generator, texture, cards, hair)
    locks = [] if hair is None else hair.levels[0]
    names = list(dict.fromkeys(piece.name for piece in (*surfaces, *locks)))
    document.materials = [glb.material(name, len(document.textures) - 1) for name in names]
    kind = "image/png" if thumbnail.startswith(b"\x89PNG") else "image/jpeg"
    document.images.append(
        gltf.Image(name="thumbnail", mimeType=kind, bufferView=made.view(thumbnail))
    )
    bones = joints(head, neutral)
    places = {bone.name: bone.place for bone in bones}
    pivot = from_body(places["head"])
    hanging = np.concatenate([piece.vertices for piece in locks] or [np.zeros((0, 3))])
    chains = hair_chains(hanging, pivot)
    links = chain_joints(chains)
    number = {bone.name: index for index, bone in enumerate([*bones, *links])}
    swinging = [name for chain in chains for name in chain.names()[:LINKS]]
    carried = partial(_carried, head, neutral, chains, pivot)
    rig = Rig([*bones, *links], [*SKINNED, *swinging], carried)
    roots = [rig.add(document, made)]
    for name, pieces, shapes in ((HEAD, surfaces, EXPRESSIONS), (LOCKS, locks, ())):
        if pieces:
            roots.append(len(document.nodes))
            placed = [_placed(piece) for piece in pieces]
            glb.add_mesh(document, made, name, placed, names, shapes, rig.weights)
    document.scenes = [gltf.Scene(name="avatar", nodes=roots)]
    document.extensionsUsed.append("VRMC_vrm")
    document.extensions["VRMC_vrm"] = {
        "specVersion": "1.0",
        "meta": _meta(generator, source_type, len(document.images) - 1),
        "humanoid": {"humanBones": {bone.name: {"node": number[bone.name]} for bone in bones}},
        "firstPerson": {
            "meshAnnotations": [{"node": node, "type": "thirdPersonOnly"} for node in roots[1:]]
        },
        "expressions": _expressions(roots[1]),
        "lookAt": _look_at(head, neutral, places["head"]),
    }
    if chains:
        width = np.ptp(to_body(neutral[head.landmark_vertices[BEFORE_EARS]])[..., 0])
        document.extensionsUsed.append("VRMC_springBone")
        document.extensions["VRMC_springBone"] = spring_table(chains, number, places, width)
    glb.write_document(path, document, made)


def _carried(head, neutral, chains, pivot, piece):
    """How much the bones of SKINNED and of chains of hair carry a Surface in the body's space."""
    points = from_body(piece.vertices * METRES)
    swinging = chain_weights(chains if piece.name in glb.HAIR else (), points, pivot)
    still = joint_weights(head, neutral, points) * (1 - swinging.sum(1, keepdims=True))
    free = np.zeros((len(points), LINKS * len(chains) - swinging.shape[1]))
    return np.concatenate([still, swinging, free], 1)


def _placed(piece):
    """A surface in the body's space, still in millimetres."""
    return replace(piece, vertices=(to_body(piece.vertices) / METRES).astype(np.float32))


def _expressions(node):
    """The presets by our named expressions and visemes, the 52 shapes as they are."""
    presets = {}
    for name, ours in PRESETS.items():
        mixed = expression_weights(ours) if ours else np.zeros(len(EXPRESSIONS))
        held = "blend" if name in EMOTIONS else "none"
        presets[name] = {
            "isBinary": False,
            "morphTargetBinds": _binds(node, mixed),
            "overrideBlink": held,
            "overrideLookAt": "none",
            "overrideMouth": held,
        }
    custom = {
        name: {"isBinary": False, "morphTargetBinds": _binds(node, weights({name: 1.0}))}
        for name in EXPRESSIONS
    }
    return {"preset": presets, "custom": custom}


def _binds(node, mixed):
    return [
        {"node": node, "index": int(index), "weight": round(float(mixed[index]), 4)}
        for index in np.flatnonzero(mixed)
    ]


def _look_at(head, neutral, joint):
    """Gaze by the shapes, which move the lids along; the angle of each at weight 1."""
    eyes = to_body(np.asarray(head.eye_centers(neutral)).mean(0)) - joint
    table = {"type": "expression", "offsetFromHeadBone": [round(float(x), 5) for x in eyes]}
    for part, shape in LOOKS.items():
        angle = float(np.abs(gaze_of(weights({shape: 1.0}))).max())
        table[part] = {"inputMaxValue": angle, "outputScale": 1.0}
    return table


def _meta(generator, source_type, thumbnail):
    return {
        "name": "avatar",
        "version": "1",
        "authors": [f"made with {generator}"],
        "copyrightInformation": f"Synthetic media ({source_type}); the person shown must agree",
        "licenseUrl": LICENCE,
        "thumbnailImage": thumbnail,
        "avatarPermission": "onlyAuthor",
        "allowExcessivelyViolentUsage": False,
        "allowExcessivelySexualUsage": False,
        "commercialUsage": "personalNonProfit",
        "allowPoliticalOrReligiousUsage": False,
        "allowAntisocialOrHateUsage": False,
        "creditNotation": "required",
        "allowRedistribution": False,
        "modification": "prohibited",
    }
