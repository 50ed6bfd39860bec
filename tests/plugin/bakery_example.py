"""A plug-in package with one of each kind, as small as can be: what an author starts from.

Its entry points stand in `entry_points.txt`, as an installed package has them. `tests/test_plugin.py`
runs bakery's conformance tests on it, and bakery with it.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from bakery.detectors.network import load
from bakery.heads.base import HeadModel
from bakery.heads.file import load_head
from bakery.landmarks import face_size
from bakery.runtime.avatar import Avatar
from bakery.stages.atlas import Atlas, Visibility
from bakery.stages.segment import Segmentation
from bakery.stages.texture.hair import Mattes
from bakery.types import Conditions, Fit, Generated, HairMesh, Landmarks, Photo


class MirrorDetector:
    """The mean of what the built-in network sees in a picture and in its mirror image."""

    name = "mirrored"

    def __init__(self) -> None:
        self.network = load()
        self.sha256 = self.network.sha256
        head = load_head("makehuman")
        marks = head.landmarks(head.mean)
        # Which point takes whose place in the mirror: the nearest one on the mean head, +x its left.
        mirrored = marks * [-1, 1, 1]
        self.order = np.linalg.norm(mirrored[:, None] - marks[None], axis=-1).argmin(0)

    def detect(self, image: np.ndarray) -> list[Landmarks]:
        """See bakery.detectors.base.Detector."""
        mirror = np.ascontiguousarray(image[:, ::-1])
        seen = [self._turned(face.points, image.shape[1]) for face in self.network.detect(mirror)]
        return [
            replace(face, points=(face.points + points) / 2)
            for face in self.network.detect(image)
            for points in seen
            if np.linalg.norm(face.points - points, axis=1).mean() < 0.1 * face_size(face.points)
        ]

    def _turned(self, points: np.ndarray, width: int) -> np.ndarray:
        """Points [478, 2] of the mirror image as points of the picture itself."""
        turned: np.ndarray = points[self.order] * [-1, 1] + [width, 0]
        return turned


class StillGenerator:
    """Every picture is the deformed neutral: no fold, no teeth that the photo did not show."""

    name = "still"
    source_type = "compositeSynthetic"
    sha256 = ""

    def generate(
        self, subject: object, conditions: Conditions, interior_only: bool = False
    ) -> Generated:
        """See bakery.generators.base.Generator."""
        picture = conditions.deformed_neutral
        nothing = np.zeros_like(picture)
        return Generated(picture, nothing + 1, nothing, nothing[..., 0])


def large_head() -> HeadModel:
    """The built-in head, a tenth larger."""
    head = load_head("makehuman")
    return replace(
        head,
        name="large",
        mean=head.mean * np.float32(1.1),
        identity_basis=head.identity_basis * np.float32(1.1),
        expression_basis=head.expression_basis * np.float32(1.1),
    )


class RedHair:
    """A red cap, half clear, wherever the photo shows hair."""

    name = "red"
    sha256 = ""

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """See bakery.hair.base.Hair."""
        from bakery.geometry.sample import bilinear

        alpha = 0.5 * atlas.paint(bilinear(mattes.hair, visibility.pixels))[..., None]
        return (np.concatenate([alpha, 0 * alpha, 0 * alpha, alpha], -1)).astype(np.float32)

    def mesh(
        self,
        photo: Photo,
        segmentation: Segmentation,
        fit: Fit,
        head: HeadModel,
        neutral: np.ndarray,
    ) -> HairMesh | None:
        """See bakery.hair.base.Hair; this hair has no volume."""
        return None


class PointsExporter:
    """The neutral shape as the vertices of an OBJ file."""

    name, sha256, suffix, place = "points", "", ".obj", "exports/points.obj"

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See bakery.exporters.base.Exporter."""
        lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in avatar.neutral]
        target.write_text("\n".join(lines) + "\n")
        return {"extras": {"points": len(lines)}}


@click.command()
@click.argument("name", default="world")
def greet(name: str) -> None:
    """Greet NAME."""
    click.echo(f"hello {name}")
