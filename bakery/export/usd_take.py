"""A take as time samples of a USD file: shapes by their weights, the head by its joint.

Source: openusd.org, UsdSkel, "Skel Animation".
"""

from __future__ import annotations

import contextlib
import io
import zipfile

import numpy as np

from bakery.export.glb_take import HEAD, quaternions
from bakery.export.usd import POSE
from bakery.formats.livelink import Take
from bakery.formats.place import scratch
from bakery.formats.usdz import package

with contextlib.suppress(ImportError):  # of the extra usd
    from pxr import Gf, Usd, UsdSkel, Vt


def with_take(data: bytes, take: Take) -> bytes:
    """A USD package that plays a take; a time code is a frame of it.

    Shapes go by their order, which is ours, further ones rest. Eyes look by the eyeLook shapes.

    Args:
        data: a .usdz file as `usd.write_usd` makes it.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    layer = next(iter(files))
    with scratch() as folder:
        (folder / layer).write_bytes(files[layer])
        stage = Usd.Stage.Open(str(folder / layer))
        _play(stage, take)
        stage.Save()
        files[layer] = (folder / layer).read_bytes()
    return package(files)


def _play(stage: Usd.Stage, take: Take) -> None:
    codes = np.round((take.seconds - take.seconds[0]) * take.rate, 6)
    stage.SetTimeCodesPerSecond(take.rate)
    stage.SetFramesPerSecond(take.rate)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(float(codes[-1]))
    pose = UsdSkel.Animation.Get(stage, POSE)
    count = len(pose.GetBlendShapesAttr().Get())
    weights = np.pad(take.weights, ((0, 0), (0, count - take.weights.shape[1])))
    shapes, turns = pose.GetBlendShapeWeightsAttr(), pose.GetRotationsAttr()
    joints = [str(path).rsplit("/", 1)[-1] for path in pose.GetJointsAttr().Get()]
    rest = [Gf.Quatf(1.0)] * len(joints)
    moves = take.head.any() and HEAD in joints
    for code, row, (x, y, z, w) in zip(codes.tolist(), weights, quaternions(take.head)):
        shapes.Set(Vt.FloatArray(row.tolist()), code)
        if moves:
            turned = list(rest)
            turned[joints.index(HEAD)] = Gf.Quatf(float(w), float(x), float(y), float(z))
            turns.Set(Vt.QuatfArray(turned), code)
