"""A head as a binary glTF file: levels of detail, 52 morph targets, embedded texture.

trimesh drops morph targets on export without a word, hence pygltflib. Shapes are stored sparse where
that is smaller. Materials are unlit: a photo texture carries its own light.
"""

from dataclasses import dataclass

import numpy as np
import pygltflib as gltf

from bakery.check import check_array
from bakery.export.glb_data import METRES, STILL, UNBENT, Writer
from bakery.export.glb_lit import add_variants
from bakery.formats.files import write_bytes

HEAD_NODE, EYES_NODE, HAIR_NODE = "head_LOD", "eyes_LOD", "hair_LOD"  # with the level's number
EYES = "eyes"  # material that has a node of its own: bones turn eyes while shapes move the lids
CLEAR = ("lashes", "tear")  # materials that are seen through, from both sides
HAIR = {"hair_cap": gltf.OPAQUE, "hair_cards": gltf.MASK, "hair_fringe": gltf.BLEND}  # alphaMode
CUT = 0.4  # alpha below which cards of hair are clear, in programs that do not sort them
GLOSS = 0.1  # roughness of the tear line


@dataclass(frozen=True)
class Surface:
    """A piece of the head with one material. One vertex for each pair of position and uv."""

    name: str  # of its material
    vertices: np.ndarray  # [V, 3] mm
    normals: np.ndarray  # [V, 3] unit
    uv: np.ndarray  # [V, 2] 0..1, origin top left
    faces: np.ndarray  # [F, 3] int
    shapes: np.ndarray  # [E, V, 3] mm, displacement at weight 1
    bends: np.ndarray | None = None  # [E, V, 3] what each shape at weight 1 adds to the normals
    # Of surfaces with a normal map, as export.tangents makes them: [V, 4] unit, and w of 1 or -1;
    # [E, V, 3] what each shape at weight 1 adds.
    tangents: np.ndarray | None = None
    twists: np.ndarray | None = None

    def __post_init__(self):
        count = len(self.vertices)
        check_array("Surface.vertices", self.vertices, (None, 3))
        check_array("Surface.normals", self.normals, (count, 3))
        check_array("Surface.uv", self.uv, (count, 2), low=0, high=1)
        check_array("Surface.faces", self.faces, (None, 3), low=0, high=count - 1)
        check_array("Surface.shapes", self.shapes, (None, count, 3))
        if self.bends is not None:
            check_array("Surface.bends", self.bends, (len(self.shapes), count, 3))
        if self.tangents is not None:
            check_array("Surface.tangents", self.tangents, (count, 4))
            check_array("Surface.twists", self.twists, (len(self.shapes), count, 3))


def write_glb(path, levels, shape_names, texture, cards, generator, hair=None, rig=None, lit=None):
    """Write a head: nodes of the finest level of detail in the scene, head, eyes and hair.

    The other levels are named by MSFT_lod. What they have in common with the finest stands once.

    Args:
        path: where to.
        levels: a list of Surfaces a level of detail, finest first, as lod.coarser makes them.
        shape_names: [E] names of the morph targets.
        texture: bytes of a JPEG or PNG, the atlas.
        cards: bytes of a PNG with alpha, the picture of the CLEAR materials, or None without them.
        generator: name and version of the program.
        hair: export.hair.Hair, or None without volume.
        rig: export.rig.Rig that carries all of it, or None without bones.
        lit: export.lit.Lit, for a second material of each surface, or None without.
    """
    made = Writer()
    document = begin(made, generator, texture, cards, hair)
    locks = [[]] * len(levels) if hair is None else hair.levels
    names = list(dict.fromkeys(piece.name for level in [*levels, *locks] for piece in level))
    document.materials = [material(name, len(document.textures) - 1) for name in names]
    roots = [] if rig is None else [rig.add(document, made)]
    carried = None if rig is None else rig.weights
    for node, kinds, shapes in (
        (HEAD_NODE, [[piece for piece in level if piece.name != EYES] for level in levels], shape_names),
        (EYES_NODE, [[piece for piece in level if piece.name == EYES] for level in levels], shape_names),
        (HAIR_NODE, locks, []),
    ):  # fmt: skip
        first, finest = len(document.nodes), {}
        for number, pieces in enumerate(kinds):
            if pieces:
                name = f"{node}{number}"
                add_mesh(document, made, name, pieces, names, shapes, carried, finest)
        if len(document.nodes) > first:
            roots.append(first)
        if len(document.nodes) > first + 1:
            others = list(range(first + 1, len(document.nodes)))
            document.nodes[first].extensions = {"MSFT_lod": {"ids": others}}
    if any(node.extensions for node in document.nodes):
        document.extensionsUsed.append("MSFT_lod")
    document.scenes = [gltf.Scene(name="avatar", nodes=roots)]  # no bone's name: three.js renames
    if lit is not None:
        add_variants(document, made, lit)
    write_document(path, document, made)


def begin(made, generator, texture, cards, hair):
    """A document with the pictures of a head; the arguments are those of `write_glb`."""
    document = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator=generator))
    kind = "image/png" if texture.startswith(b"\x89PNG") else "image/jpeg"
    document.images = [gltf.Image(name="neutral", mimeType=kind, bufferView=made.view(texture))]
    document.samplers = [
        gltf.Sampler(
            magFilter=gltf.LINEAR,
            minFilter=gltf.LINEAR_MIPMAP_LINEAR,
            wrapS=gltf.CLAMP_TO_EDGE,
            wrapT=gltf.CLAMP_TO_EDGE,
        )
    ]
    document.textures = [gltf.Texture(source=0, sampler=0)]
    clear = {"cards": cards, "hair": None if hair is None else hair.picture}
    for name, picture in clear.items():
        if picture is not None:
            source = len(document.images)
            view = made.view(picture)
            document.images.append(gltf.Image(name=name, mimeType="image/png", bufferView=view))
            document.textures.append(gltf.Texture(source=source, sampler=0))
    document.extensionsUsed = ["KHR_materials_unlit"]
    return document


def write_proxies(path, proxies: list[Surface], shape_names, generator: str) -> None:
    """Write the meshes that carry the pictures of mouth and eyes: a node each, without a picture.

    They have a file of their own because engines draw all scenes of a file: over the head's own
    mouth and eyes.

    Args:
        path: where to.
        proxies: Surfaces, by the names of their rectangles in the atlas; uv are the atlas's.
        shape_names: [E] names of the morph targets.
        generator: name and version of the program.
    """
    made = Writer()
    document = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator=generator))
    document.extensionsUsed = ["KHR_materials_unlit"]
    names = [piece.name for piece in proxies]
    document.materials = [_unlit(name) for name in names]
    for piece in proxies:
        add_mesh(document, made, piece.name, [piece], names, shape_names)
    document.scenes = [gltf.Scene(name="proxies", nodes=list(range(len(names))))]
    write_document(path, document, made)


def write_document(path, document, made):
    made.finish()
    document.scene = 0
    document.accessors = made.accessors
    document.bufferViews = made.views
    document.buffers = [gltf.Buffer(byteLength=len(made.data))]
    document.set_binary_blob(bytes(made.data))
    write_bytes(path, b"".join(document.save_to_bytes()))


def material(name, last):
    """The material of a surface; hair has the last picture."""
    if name in CLEAR:
        return _clear_material(name)
    if name in HAIR:
        return hair_material(name, last)
    made = _unlit(name)
    made.pbrMetallicRoughness.baseColorTexture = gltf.TextureInfo(index=0)
    return made


def _unlit(name):
    return gltf.Material(
        name=name,
        pbrMetallicRoughness=gltf.PbrMetallicRoughness(metallicFactor=0.0, roughnessFactor=0.9),
        alphaMode="OPAQUE",
        alphaCutoff=None,
        extensions={"KHR_materials_unlit": {}},
    )


def _clear_material(name):
    """Lashes are unlit like the skin; fluid shows its painting and mirrors the lamps of the viewer."""
    material = gltf.Material(
        name=name,
        pbrMetallicRoughness=gltf.PbrMetallicRoughness(
            baseColorTexture=gltf.TextureInfo(index=1), metallicFactor=0.0, roughnessFactor=0.9
        ),
        alphaMode=gltf.BLEND,
        alphaCutoff=None,
        doubleSided=True,
    )
    if name == "tear":
        material.pbrMetallicRoughness.roughnessFactor = GLOSS
        material.pbrMetallicRoughness.baseColorFactor = [0.0, 0.0, 0.0, 1.0]
        material.emissiveTexture = gltf.TextureInfo(index=1)
        material.emissiveFactor = [1.0, 1.0, 1.0]
    else:
        material.extensions = {"KHR_materials_unlit": {}}
    return material


def hair_material(name, picture):
    material = _unlit(name)
    material.pbrMetallicRoughness.baseColorTexture = gltf.TextureInfo(index=picture)
    material.alphaMode, material.doubleSided = HAIR[name], True
    material.alphaCutoff = CUT if HAIR[name] == gltf.MASK else None
    return material


def add_mesh(document, made, name, surfaces, materials, shape_names, carried=None, finest=None):
    """Add a node with a mesh of Surfaces.

    Args:
        document, made: what is added to.
        name: of the node and the mesh.
        materials: names of the document's materials.
        shape_names: [E] names of the morph targets.
        carried: a function that says which joints of skin 0 carry a Surface, each [V, 4] (Rig.weights),
            or None without bones.
        finest: material -> (Surface, its primitive) of a finer level, from which is taken what is
            the same; those that are not in it are added.
    """
    finest = {} if finest is None else finest
    shapes = {"weights": [0.0] * len(shape_names), "extras": {"targetNames": list(shape_names)}}
    primitives = []
    for piece in surfaces:
        finer = finest.get(piece.name)
        if finer and np.array_equal(piece.vertices, finer[0].vertices[: len(piece.vertices)]):
            primitives.append(_coarser_primitive(made, piece, finer[1]))
            continue
        primitives.append(primitive(made, piece, materials))
        if carried is not None:
            attributes = primitives[-1].attributes
            joints, weights = carried(piece)
            attributes.JOINTS_0, attributes.WEIGHTS_0 = made.vectors(joints), made.vectors(weights)
        finest[piece.name] = piece, primitives[-1]
    mesh = gltf.Mesh(name=name, primitives=primitives, **(shapes if shape_names else {}))
    document.meshes.append(mesh)
    skin = None if carried is None else 0
    document.nodes.append(gltf.Node(name=name, mesh=len(document.meshes) - 1, skin=skin))


def primitive(made, piece, materials):
    """A glTF primitive of a Surface, its data added to a Writer."""
    tangents = None if piece.tangents is None else made.vectors(piece.tangents)
    return gltf.Primitive(
        attributes=gltf.Attributes(
            POSITION=made.vectors(piece.vertices * METRES, limits=True),
            NORMAL=made.vectors(_unit(piece.normals)),
            TANGENT=tangents,
            TEXCOORD_0=made.vectors(piece.uv),
        ),
        indices=made.indices(piece.faces),
        material=materials.index(piece.name),
        mode=gltf.TRIANGLES,
        targets=[_target(made, piece, number) for number in range(len(piece.shapes))],
    )


def _target(made, piece, number):
    shape = made.differences(piece.shapes[number] * METRES, STILL * METRES, limits=True)
    if piece.bends is None:
        return {"POSITION": shape}
    target = {"POSITION": shape, "NORMAL": made.differences(piece.bends[number], UNBENT)}
    if piece.twists is not None:
        target["TANGENT"] = made.differences(piece.twists[number], UNBENT)
    return target


def _coarser_primitive(made, piece, finer):
    """A primitive of the first vertices of another one, between faces of its own."""
    count, known = len(piece.vertices), vars(finer.attributes)
    first = {name: made.first(index, count) for name, index in known.items() if index is not None}
    return gltf.Primitive(
        attributes=gltf.Attributes(**first),
        indices=made.indices(piece.faces),
        material=finer.material,
        mode=gltf.TRIANGLES,
        targets=[
            {name: made.first(index, count) for name, index in target.items()}
            for target in finer.targets
        ],
    )


def _unit(normals):
    normals = np.asarray(normals, np.float64)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
