"""The fits of a clip: one identity, and the camera, expression and gaze of each frame.

A folder holds them in two files, both of arrays (`formats.npz`):

    identity.npz   head, head_sha256, identity [I], residual [468, 3], focal, center [2], size [2]
    frames.npz     identity_sha256, seconds [N], found [N], rotation [N, 3], translation [N, 3],
                   expression [N, 52], gaze [N, 2]
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery.bake.fitting import check_head, fitted_neutral
from bakery.check import check_array
from bakery.errors import InputError
from bakery.formats import record
from bakery.formats.files import digest_file
from bakery.geometry import camera as cameras
from bakery.heads.base import HeadModel
from bakery.types import EXPRESSIONS, Camera, Fit

IDENTITY, FRAMES = "identity.npz", "frames.npz"
AGAIN = "write both again with `bakery track --fits`"
# Of each frame; the rest is one for all of them.
ROWS = ("seconds", "found", "rotation", "translation", "expression", "gaze")


@dataclass(frozen=True, eq=False)
class ClipFit:
    """One head model in every frame of a clip of N frames, as it was fitted: nothing is smoothed."""

    head: str  # name of the head model
    head_sha256: str
    identity: np.ndarray  # [I] standard deviations from the mean head
    residual: np.ndarray  # [468, 3] mm, what the linear model leaves at the landmarks
    focal: float  # pixels
    center: np.ndarray  # [2] pixels, principal point
    size: np.ndarray  # [2] pixels, width and height of the frames
    seconds: np.ndarray  # [N], as the clip says, increasing
    found: np.ndarray  # [N] bool: the face was seen; rows without it are filled, see `motion.gaps`
    rotation: np.ndarray  # [N, 3] axis-angle, radians: head space -> camera space
    translation: np.ndarray  # [N, 3] mm
    expression: np.ndarray  # [N, E] weights 0..1
    gaze: np.ndarray  # [N, 2] degrees: yaw to the subject's left, pitch up

    def __post_init__(self) -> None:
        """
        Raises:
            ValueError: arrays that do not go together or are out of range.
        """
        count = len(self.seconds)
        check_array("ClipFit.identity", self.identity, (None,))
        check_array("ClipFit.residual", self.residual, (468, 3))
        check_array("ClipFit.center", self.center, (2,))
        check_array("ClipFit.size", self.size, (2,), low=1, high=65536)
        check_array("ClipFit.seconds", self.seconds, (None,))
        check_array("ClipFit.rotation", self.rotation, (count, 3))
        check_array("ClipFit.translation", self.translation, (count, 3))
        check_array("ClipFit.expression", self.expression, (count, len(EXPRESSIONS)), low=0, high=1)
        check_array("ClipFit.gaze", self.gaze, (count, 2))
        if self.found.shape != (count,) or self.found.dtype != bool:
            raise ValueError(f"ClipFit.found: needs {count} truth values")
        if not (np.isfinite(self.focal) and self.focal > 0):
            raise ValueError(f"ClipFit.focal: {self.focal}")
        if count < 1 or (np.diff(self.seconds) <= 0).any():
            raise ValueError("ClipFit.seconds: needs at least one row, and times that increase")

    def camera(self, number: int) -> Camera:
        """The camera of one frame, from 0."""
        width, height = (int(n) for n in self.size)
        return Camera(
            self.focal, self.center, self.rotation[number], self.translation[number], width, height
        )

    def fit(self, number: int, head: HeadModel) -> Fit:
        """One frame, from 0, as a Fit; light and albedo are not known: white from everywhere, none.

        Raises:
            InputError: another head.
        """
        light = np.zeros((9, 3))
        light[0] = 1
        fit = Fit(
            head=self.head,
            camera=self.camera(number),
            identity=self.identity,
            expression=self.expression[number],
            gaze=self.gaze[number],
            light=light,
            albedo=np.zeros(0),
            residual=self.residual,
            landmarks_projected=np.zeros((0, 2)),
            head_sha256=self.head_sha256,
        )
        check_head("the clip's fits", fit, head)
        shape = head.vertices(fitted_neutral(head, fit), fit.expression, fit.gaze)
        places = head.landmarks(shape).astype(np.float64)
        return replace(fit, landmarks_projected=cameras.project(places, fit.camera))


def write_fits(folder: Path, fits: ClipFit) -> None:
    """Write the two files of a ClipFit; each takes its place when it is complete.

    Raises:
        DiskError: the folder cannot be written.
    """
    table = {name: np.asarray(value) for name, value in vars(fits).items()}
    rows = {name: table.pop(name) for name in ROWS}
    sha256 = record.write_arrays(Path(folder) / IDENTITY, table)
    record.write_arrays(Path(folder) / FRAMES, {"identity_sha256": np.array(sha256), **rows})


def read_fits(folder: Path) -> ClipFit:
    """The ClipFit that `write_fits` wrote.

    Raises:
        InputError: a file is missing or damaged, or they are of two clips.
    """
    one, many = Path(folder) / IDENTITY, Path(folder) / FRAMES
    alone = ("head", "head_sha256", "identity", "residual", "focal", "center", "size")
    table = record.read_arrays(one, alone)
    rows = record.read_arrays(many, ("identity_sha256", *ROWS))
    if str(rows["identity_sha256"]) != digest_file(one):
        raise InputError(f"{folder}: {IDENTITY} and {FRAMES} are of two clips; {AGAIN}")
    try:
        return ClipFit(
            **{name: table[name] for name in alone} | {name: rows[name] for name in ROWS}
            | {name: str(table[name]) for name in ("head", "head_sha256")}
            | {"focal": float(table["focal"])}
        )  # fmt: skip
    except (ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(f"{folder}: {reason}; {AGAIN}") from None
