"""The bundle: everything that was baked, written into one folder by the exporters."""

import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bakery.bake.fitting import own_head
from bakery.bake.options import BundleOptions
from bakery.export import bundle as bundles
from bakery.export import signed
from bakery.export.manifest import Baked, manifest
from bakery.exporters.base import Exporter
from bakery.exporters.exr import ExrExporter
from bakery.exporters.head import HeadExporter
from bakery.exporters.web import WebExporter
from bakery.formats import image, mark
from bakery.formats.place import staged
from bakery.formats.signing import Credentials
from bakery.parallel import side_by_side
from bakery.plugins import plug_in
from bakery.runtime.avatar import Avatar

CORE = (ExrExporter(), HeadExporter())  # what a bundle is; players need nothing else


def write_bundle(
    target: Path,
    baked: Baked,
    options: BundleOptions,
    keep_photo: bool = False,
    overwrite: bool = False,
    credentials: Credentials | None = None,
) -> None:
    """Write a bundle.

    Args:
        target: the bundle's folder.
        baked: everything that it is made of.
        options: which formats go along, and how large.
        keep_photo: whether the photo goes into the bundle.
        overwrite: whether an older bundle may be replaced.
        credentials: what signs it, if it is signed.

    Raises:
        BakeryError: the place is taken, the disk is full, or an exporter refuses the avatar.
    """
    head, neutral = own_head(baked.head, baked.fit)
    kept = baked.photo.encoded if keep_photo else None
    avatar = Avatar(head, neutral, baked.fit, baked.textures, baked.masks, kept)
    with staged(target, overwrite) as folder:

        def run(exporter: Exporter) -> Callable[[], dict[str, Any]]:
            def export() -> dict[str, Any]:
                place = folder / exporter.place
                place.parent.mkdir(parents=True, exist_ok=True)
                return exporter.export(avatar, place, options.side)

            return export

        def photo() -> dict[str, Any]:
            if kept is not None:
                image.write_image(folder / "photo.png", kept)
            return {}

        jobs: list[Callable[[], dict[str, Any]]] = [
            *(run(one) for one in exporters(options)),
            *(run(one) for one in CORE),
            photo,
        ]
        said = list(side_by_side(operator.call, jobs))
        mark.stamp(folder, mark.of_ours(baked.generator.source_type, baked.photo.sha256))
        if credentials:
            signed.sign_preview(folder, credentials)
        table = manifest(baked, said, bundles.list_files(folder))
        bundles.write_manifest(folder, table)
        if credentials:
            signed.write_signature(folder, table, credentials)


def exporters(options: BundleOptions) -> list[Exporter]:
    """The exporters that a preset names, in its order.

    Raises:
        UsageProblem: there is none of a name.
    """
    return [
        WebExporter(options.web) if name == "web" else plug_in("exporters", name)
        for name in options.formats
    ]
