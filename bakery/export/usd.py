"""A head as USD: a skeleton with skinned meshes and blend shapes, and two looks as a variant set.

Source: openusd.org, UsdSkel and the UsdPreviewSurface specification. The looks are those of
`export.materials`: `photo` gives off the texture and mirrors nothing, `lit` is shone on by lamps.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bakery.export.glb import CLEAR, HAIR, Surface
from bakery.export.glb_data import METRES, STILL
from bakery.export.materials import VARIANTS
from bakery.export.rig import MOST, Rig
from bakery.export.usd_materials import Looks
from bakery.formats.files import write_bytes
from bakery.formats.place import scratch
from bakery.formats.usdz import package

with contextlib.suppress(ImportError):  # of the extra usd; without it exporters.usd says so
    from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

ROOT = "/avatar"
POSE = f"{ROOT}/skeleton/pose"  # the animation
LAYER = "avatar.usdc"
LOOK = "look"  # variant set


@dataclass(frozen=True, eq=False)
class Contents:
    """What a USD file says of an avatar."""

    surfaces: Sequence[Surface]  # of the head
    shape_names: Sequence[str]  # [E]
    locks: Sequence[Surface]  # of the hair, without shapes
    rig: Rig
    pictures: Mapping[str, bytes]  # by export.usd_materials' names of files
    told: Mapping[str, str]  # about the file: generator, digital source type


def write_usd(path: Path, contents: Contents) -> None:
    """Write one .usdz file: metres, +y up, the face along +z."""
    with scratch() as folder:  # OpenUSD writes to paths alone
        layer = folder / LAYER
        stage = Usd.Stage.CreateNew(str(layer))
        _compose(stage, contents)
        stage.Save()
        write_bytes(path, package({LAYER: layer.read_bytes(), **contents.pictures}))


def _compose(stage: Usd.Stage, contents: Contents) -> None:
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.GetRootLayer().customLayerData = dict(contents.told)
    root = UsdSkel.Root.Define(stage, ROOT)
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    skeleton = _skeleton(stage, contents)
    looks = Looks(stage, f"{ROOT}/materials", contents.pictures)
    meshes = {}
    for piece in (*contents.surfaces, *contents.locks):
        mesh = _mesh(stage, piece)
        _bind(mesh, piece, contents, skeleton)
        meshes[mesh] = piece.name
    variants = root.GetPrim().GetVariantSets().AddVariantSet(LOOK)
    for look in VARIANTS:
        variants.AddVariant(look)
        variants.SetVariantSelection(look)
        materials = {name: looks.material(look, name) for name in meshes.values()}
        with variants.GetVariantEditContext():
            for mesh, name in meshes.items():
                looks.bind(mesh, materials[name])
    variants.SetVariantSelection(VARIANTS[0])


def _skeleton(stage, contents):
    """Joints by their paths, in the order of `Rig.carrying`; an animation that rests in all shapes."""
    above = {joint.name: joint.parent for joint in contents.rig.joints}
    place = {joint.name: joint.place for joint in contents.rig.joints}

    def joint_path(name):
        parent = above[name]
        return name if parent is None else f"{joint_path(parent)}/{name}"

    names = contents.rig.carrying
    paths = Vt.TokenArray([joint_path(name) for name in names])
    moved = [place[name] - (place[above[name]] if above[name] else 0) for name in names]
    skeleton = UsdSkel.Skeleton.Define(stage, f"{ROOT}/skeleton")
    skeleton.CreateJointsAttr(paths)
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([_moved(place[name]) for name in names]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([_moved(step) for step in moved]))
    pose = UsdSkel.Animation.Define(stage, POSE)
    pose.CreateJointsAttr(paths)
    pose.CreateTranslationsAttr(_vectors(np.array(moved)))
    pose.CreateRotationsAttr(Vt.QuatfArray([Gf.Quatf(1.0)] * len(names)))
    pose.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1, 1, 1)] * len(names)))
    pose.CreateBlendShapesAttr(Vt.TokenArray(list(contents.shape_names)))
    pose.CreateBlendShapeWeightsAttr(Vt.FloatArray([0.0] * len(contents.shape_names)))
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([pose.GetPath()])
    return skeleton


def _mesh(stage: Usd.Stage, piece: Surface) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, f"{ROOT}/{Tf.MakeValidIdentifier(piece.name)}")
    points = np.asarray(piece.vertices * METRES, np.float32)
    mesh.CreatePointsAttr(_vectors(points))
    mesh.CreateExtentAttr(_vectors(np.stack([points.min(0), points.max(0)])))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(piece.faces)))
    mesh.CreateFaceVertexIndicesAttr(
        Vt.IntArray.FromNumpy(np.ascontiguousarray(piece.faces, np.int32).ravel())
    )
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateNormalsAttr(_vectors(piece.normals))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateDoubleSidedAttr(piece.name in CLEAR or piece.name in HAIR)
    up = np.ascontiguousarray(piece.uv * (1, -1) + (0, 1), np.float32)  # USD's t grows upwards
    primvars = UsdGeom.PrimvarsAPI(mesh)
    kind = Sdf.ValueTypeNames.TexCoord2fArray
    primvars.CreatePrimvar("st", kind, UsdGeom.Tokens.vertex).Set(Vt.Vec2fArray.FromNumpy(up))
    return mesh


def _bind(mesh, piece, contents, skeleton):
    """Skin weights, and the shapes that move the mesh."""
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    joints, weights = contents.rig.weights(piece)
    binding.CreateJointIndicesPrimvar(False, MOST).Set(
        Vt.IntArray.FromNumpy(joints.astype(np.int32).ravel())
    )
    binding.CreateJointWeightsPrimvar(False, MOST).Set(Vt.FloatArray.FromNumpy(weights.ravel()))
    names, targets = [], []
    for number, (name, shape) in enumerate(zip(contents.shape_names, piece.shapes)):
        moving = np.flatnonzero(np.linalg.norm(shape, axis=1) > STILL)
        if not len(moving):
            continue
        target = UsdSkel.BlendShape.Define(mesh.GetPrim().GetStage(), f"{mesh.GetPath()}/{name}")
        target.CreateOffsetsAttr(_vectors(shape[moving] * METRES))
        target.CreateNormalOffsetsAttr(_vectors(piece.bends[number][moving]))
        target.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(moving.astype(np.int32)))
        names.append(name)
        targets.append(target.GetPath())
    if names:
        binding.CreateBlendShapesAttr(Vt.TokenArray(names))
        binding.CreateBlendShapeTargetsRel().SetTargets(targets)


def _moved(step):
    return Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*map(float, step)))


def _vectors(array):
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(array, np.float32))
