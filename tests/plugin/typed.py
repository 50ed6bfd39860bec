"""Read by mypy alone (`make lint`): what the example and bakery bring is what bakery asks for."""

from bakery_example import MirrorDetector, PointsExporter, RedHair, StillGenerator, large_head

from bakery.detectors.base import Detector, PlacingDetector
from bakery.detectors.network import NetworkDetector
from bakery.detectors.placing import NearestFace
from bakery.exporters import exr, glb, head, preview, web
from bakery.exporters.base import Exporter
from bakery.generators.base import Generator
from bakery.generators.pagan import PaganGenerator
from bakery.generators.rendered import RenderedGenerator
from bakery.hair.base import Hair
from bakery.hair.layer import HairLayer, NoHair
from bakery.heads.base import HeadModel

DETECTORS: list[type[Detector]] = [MirrorDetector, NetworkDetector]
PLACING: list[type[PlacingDetector]] = [NetworkDetector, NearestFace]
GENERATORS: list[type[Generator]] = [StillGenerator, RenderedGenerator, PaganGenerator]
HAIR: list[type[Hair]] = [RedHair, HairLayer, NoHair]
HEAD: HeadModel = large_head()
EXPORTERS: list[type[Exporter]] = [
    PointsExporter, exr.ExrExporter, glb.GlbExporter, glb.ProxiesExporter, head.HeadExporter,
    preview.PreviewExporter, web.WebExporter,
]  # fmt: skip
