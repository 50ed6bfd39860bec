"""Packets as the app Live Link Face sends them, written by what readers of others say of them."""

import struct

import numpy as np

from bakery.formats.livelink import EYES, HEAD

# PyLiveLinkFace's FaceBlendShape: Unreal's order, which is not that of the app's CSV.
SHAPES = """EyeBlinkLeft EyeLookDownLeft EyeLookInLeft EyeLookOutLeft EyeLookUpLeft EyeSquintLeft
EyeWideLeft EyeBlinkRight EyeLookDownRight EyeLookInRight EyeLookOutRight EyeLookUpRight
EyeSquintRight EyeWideRight JawForward JawLeft JawRight JawOpen MouthClose MouthFunnel MouthPucker
MouthLeft MouthRight MouthSmileLeft MouthSmileRight MouthFrownLeft MouthFrownRight MouthDimpleLeft
MouthDimpleRight MouthStretchLeft MouthStretchRight MouthRollLower MouthRollUpper MouthShrugLower
MouthShrugUpper MouthPressLeft MouthPressRight MouthLowerDownLeft MouthLowerDownRight
MouthUpperUpLeft MouthUpperUpRight BrowDownLeft BrowDownRight BrowInnerUp BrowOuterUpLeft
BrowOuterUpRight CheekPuff CheekSquintLeft CheekSquintRight NoseSneerLeft NoseSneerRight
TongueOut""".split()
NAMES = [*SHAPES, *HEAD, *EYES]
DEVICE = b"$C0FFEE00-0000-4000-8000-0123456789AB"  # with its length, 36, as its first byte


def packet(values=None, frame=1000, part=0.0, rate=(60, 1), subject="phone", count=61):
    """A packet; `values` by column name, others 0. None: no face is seen."""
    data = struct.pack("<i", 6)[:4] + DEVICE
    name = subject.encode()
    data += struct.pack("!i", len(name)) + name
    if values is None:
        return data
    numbers = [values.get(column, 0.0) for column in NAMES] + [0.0] * (count - len(NAMES))
    return (
        data
        + struct.pack("!if2ib", frame, part, *rate, count)
        + struct.pack(f"!{count}f", *numbers)
    )


MOVING = ["JawOpen", "MouthClose", "MouthSmileLeft", "MouthSmileRight", "MouthPucker", "MouthFunnel",
          "BrowInnerUp", "BrowDownLeft", "BrowDownRight", "EyeBlinkLeft", "EyeBlinkRight",
          "CheekSquintLeft"]  # fmt: skip


def recording(count, moving=MOVING, seed=5):
    """Values of a face and a head that move: [count] tables by column name."""
    rng = np.random.default_rng(seed)
    speed = {name: rng.uniform(1, 7) for name in [*moving, *HEAD, *EYES]}
    rows = []
    for number in range(count):
        wave = {name: float(np.sin(speed[name] * number / 60)) for name in speed}
        rows.append(
            {name: 0.3 * value if name in HEAD + EYES else 0.4 + 0.4 * value
             for name, value in wave.items()}
        )  # fmt: skip
    return rows
