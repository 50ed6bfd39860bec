"""A head as a binary glTF file: levels of detail, 52 morph targets, embedded texture.

trimesh drops morph targets on export without a word, hence pygltflib. Shapes are stored sparse where
that is smaller. Materials are unlit: a photo texture carries its own light.
"""

from dataclasses import dataclass

import numpy as np
import pygltflib as gltf

from bakery.check import check_array
from bakery.formats.files import write_bytes

METRES = 0.001  # glTF's unit, from millimetres
STILL = 0.005  # mm; a vertex that moves less is at rest
HEAD_NODE, HAIR_NODE = "head_lod", "hair_lod"  # with the number of the level
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

    def __post_init__(self):
        count = len(self.vertices)
        check_array("Surface.vertices", self.vertices, (None, 3))
        check_array("Surface.normals", self.normals, (count, 3))
        check_array("Surface.uv", self.uv, (count, 2), low=0, high=1)
        check_array("Surface.faces", self.faces, (None, 3), low=0, high=count - 1)
        check_array("Surface.shapes", self.shapes, (None, count, 3))


def write_glb(path, levels, shape_names, texture, cards, generator, hair=None):
    """Write a head: one node a level of detail, the finest in the scene; its hair is its child.

    Args:
        path: where to.
        levels: a list of Surfaces a level of detail, finest first.
        shape_names: [E] names of the morph targets.
        texture: bytes of a JPEG or PNG, the atlas.
        cards: bytes of a PNG with alpha, the picture of the CLEAR materials, or None without them.
        generator: name and version of the program.
        hair: export.hair.Hair, or None without volume.
    """
    made = Writer()
    document = begin(made, generator, texture, cards, hair)
    document.extensionsUsed.append("MSFT_lod")
    locks = [[]] * len(levels) if hair is None else hair.levels
    names = list(dict.fromkeys(piece.name for level in [*levels, *locks] for piece in level))
    document.materials = [material(name, len(document.textures) - 1) for name in names]
    for number, level in enumerate(levels):
        add_mesh(document, made, f"{HEAD_NODE}{number}", level, names, shape_names)
    for number, pieces in enumerate(locks):
        if pieces:
            document.nodes[number].children = [len(document.nodes)]
            add_mesh(document, made, f"{HAIR_NODE}{number}", pieces, names, [])
    if len(levels) > 1:
        document.nodes[0].extensions = {"MSFT_lod": {"ids": list(range(1, len(levels)))}}
    document.scenes = [gltf.Scene(name="head", nodes=[0])]
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


def add_mesh(document, made, name, surfaces, materials, shape_names):
    shapes = {"weights": [0.0] * len(shape_names), "extras": {"targetNames": list(shape_names)}}
    document.meshes.append(
        gltf.Mesh(
            name=name,
            primitives=[primitive(made, piece, materials) for piece in surfaces],
            **(shapes if shape_names else {}),
        )
    )
    document.nodes.append(gltf.Node(name=name, mesh=len(document.meshes) - 1))


def primitive(made, piece, materials):
    """A glTF primitive of a Surface, its data added to a Writer."""
    return gltf.Primitive(
        attributes=gltf.Attributes(
            POSITION=made.accessor(piece.vertices * METRES, gltf.ARRAY_BUFFER, limits=True),
            NORMAL=made.accessor(_unit(piece.normals), gltf.ARRAY_BUFFER),
            TEXCOORD_0=made.accessor(piece.uv, gltf.ARRAY_BUFFER),
        ),
        indices=made.indices(piece.faces),
        material=materials.index(piece.name),
        mode=gltf.TRIANGLES,
        targets=[{"POSITION": made.displacement(shape)} for shape in piece.shapes],
    )


def _unit(normals):
    normals = np.asarray(normals, np.float64)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


class Writer:
    """Collects bytes, views and accessors."""

    def __init__(self):
        self.data = bytearray()
        self.views = []
        self.accessors = []
        self.resting = []  # accessors of shapes that move nothing

    def finish(self):
        """Give all shapes that move nothing one view of zeros.

        glTF takes accessors without a view for zeros; assimp, VTK, Bevy, glTFast and UnityGLTF
        refuse the file.
        """
        if self.resting:
            most = max(accessor.count for accessor in self.resting)
            zeros = self.view(bytes(12 * most), gltf.ARRAY_BUFFER)
            self.views[zeros].byteStride = 12  # which a view of several accessors must state
            for accessor in self.resting:
                accessor.bufferView, accessor.byteOffset = zeros, 0

    def view(self, content, target=None):
        """Append bytes, aligned to four; returns the view's index."""
        self.data.extend(bytes(-len(self.data) % 4))
        self.views.append(
            gltf.BufferView(
                buffer=0, byteOffset=len(self.data), byteLength=len(content), target=target
            )
        )
        self.data.extend(content)
        return len(self.views) - 1

    def accessor(self, array, target, limits=False):
        """Append float vectors [N, 2 or 3]; returns the accessor's index."""
        array = np.ascontiguousarray(array, np.float32)
        self.accessors.append(
            gltf.Accessor(
                bufferView=self.view(array.tobytes(), target),
                componentType=gltf.FLOAT,
                count=len(array),
                type=f"VEC{array.shape[1]}",
                **(_limits(array) if limits else {}),
            )
        )
        return len(self.accessors) - 1

    def indices(self, faces):
        """Append triangles; returns the accessor's index."""
        short = faces.max() < 65535
        flat = np.ascontiguousarray(faces, np.uint16 if short else np.uint32).ravel()
        self.accessors.append(
            gltf.Accessor(
                bufferView=self.view(flat.tobytes(), gltf.ELEMENT_ARRAY_BUFFER),
                componentType=gltf.UNSIGNED_SHORT if short else gltf.UNSIGNED_INT,
                count=len(flat),
                type=gltf.SCALAR,
            )
        )
        return len(self.accessors) - 1

    def displacement(self, shape):
        """Append a morph target [V, 3] mm: sparse, or plain where most vertices move."""
        moving = np.flatnonzero(np.linalg.norm(shape, axis=1) > STILL)
        values = np.where(np.isin(np.arange(len(shape)), moving)[:, None], shape * METRES, 0)
        values = values.astype(np.float32)
        wide = len(shape) > 65535
        if len(moving) * (16 if wide else 14) > 12 * len(shape):
            return self.accessor(values, gltf.ARRAY_BUFFER, limits=True)
        accessor = gltf.Accessor(
            byteOffset=None,  # none without a view
            componentType=gltf.FLOAT,
            count=len(shape),
            type=gltf.VEC3,
            **_limits(values),
        )
        if not len(moving):
            self.resting.append(accessor)
        else:
            index = moving.astype(np.uint32 if wide else np.uint16)
            accessor.sparse = gltf.Sparse(
                count=len(moving),
                indices=gltf.AccessorSparseIndices(
                    bufferView=self.view(index.tobytes()),
                    componentType=gltf.UNSIGNED_INT if wide else gltf.UNSIGNED_SHORT,
                ),
                values=gltf.AccessorSparseValues(bufferView=self.view(values[moving].tobytes())),
            )
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _limits(array):
    return {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
