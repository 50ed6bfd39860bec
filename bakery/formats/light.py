"""Lights to show an avatar in: presets/lights, harmonics as JSON, pictures of the surroundings.

All come out as a light of `geometry.harmonics` in head space: it belongs to the world that the head
looks out of, so that a camera that goes round the head sees the lit side and the dark one.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio

from bakery import preset
from bakery.errors import InputError, no_such
from bakery.formats import record
from bakery.formats.files import read_bytes
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA

KIND = "lights"  # the folder of the presets
EXPOSURE = 10.0  # stops, the most that a light may ask for
STRONGEST = 1e6  # of a number that describes a light
LARGEST_MAP = 4096  # pixels a side; a light needs no more than 64
KEYS = {"sky", "ground", "lamps", "exposure"}


def read_light(name: str) -> np.ndarray:
    """A light by its name or file.

    Its mean over all directions is 1, so that lights of any unit expose a face alike, but for the
    stops of its own `exposure`.

    Args:
        name: of presets/lights; or a file: .toml as those, .json with `light`, nine rows of RGB
            (relative to the camera if it is a fit), or .exr, the surroundings
            (`harmonics.of_map`).

    Returns:
        [9, 3] linear, head space.

    Raises:
        UsageProblem: no such light.
        InputError: the file cannot be used.
    """
    path = Path(name)
    if name in preset.names(KIND) or path.suffix.lower() == ".toml":
        table = preset.load(KIND, name)
        return _exposed(name, _of_table(name, table), table)
    if not os.path.lexists(path):
        advice = "or give a .toml, .json or .exr file"
        raise no_such("--light: no light", name, preset.names(KIND), advice)
    if path.suffix.lower() == ".exr":
        return _exposed(name, harmonics.of_map(_read_map(path)), {})
    table = record.parse(path, read_bytes(path, record.LARGEST_JSON))
    light = _numbers(name, table, "light", (9, 3))
    if "camera" in table:  # a fit's light is that of its photo, whose camera looks at a turned head
        turn = rotation.matrix(record.read_fit(path).camera.rotation)
        light = harmonics.turned(light, turn.T)
    return _exposed(name, light, table)


def _of_table(name: str, table: dict[str, Any]) -> np.ndarray:
    """The light [9, 3] of a hemisphere of sky, one of ground, and lamps."""
    if unknown := sorted(set(table) - KEYS):
        raise no_such(f"{name}: no setting", unknown[0], sorted(KEYS))
    sky, ground = (_numbers(name, table, key, (3,)) for key in ("sky", "ground"))
    light = np.zeros((9, 3))
    light[0] = (sky + ground) / 2 / harmonics.C0
    light[1] = (sky - ground) / 2 / harmonics.C1
    lamps = table.get("lamps", [])
    if not (isinstance(lamps, list) and all(isinstance(lamp, dict) for lamp in lamps)):
        raise InputError(f"{name}: lamps; give [[lamps]] with azimuth, elevation and color")
    for lamp in lamps:
        angles = [float(_numbers(name, lamp, key, ())) for key in ("azimuth", "elevation")]
        color = _numbers(name, lamp, "color", (3,))
        light += harmonics.lamp(harmonics.direction(*angles), color)
    return light


def _numbers(name: str, table: dict[str, Any], key: str, shape: tuple[int, ...]) -> np.ndarray:
    """An array of a table."""
    wanted = {(): "a number", (3,): "three numbers", (9, 3): "nine rows of three numbers"}[shape]
    try:
        found = np.array(table[key], np.float64)
        good = found.shape == shape and np.abs(found).max() <= STRONGEST  # false for nan
    except (KeyError, ValueError, TypeError, OverflowError):
        good = False
    if not good:
        raise InputError(f"{name}: {key}; give {wanted}, at most {STRONGEST:g}")
    return found


def _exposed(name: str, light: np.ndarray, table: dict[str, Any]) -> np.ndarray:
    """A light brought to the mean 1 and to the exposure that it asks for."""
    stops = float(_numbers(name, {"exposure": 0.0} | table, "exposure", ()))
    mean = float(harmonics.C0 * light[0] @ LUMA)
    if mean <= 1e-9 or light[0].min() < 0:
        raise InputError(f"{name}: no light comes from it; give one that is not black")
    if abs(stops) > EXPOSURE:
        raise InputError(f"{name}: exposure {stops:g}; at most {EXPOSURE:g} stops")
    return light * (2**stops / mean)


def _read_map(path: Path) -> np.ndarray:
    """The pixels [H, W, 3] of an OpenEXR file of any packing."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()  # or it is printed when the program ends
        raise InputError(f"{path}: no OpenEXR file that can be read; give a latitude-longitude map")
    try:
        spec = source.spec()
        if max(spec.width, spec.height) > LARGEST_MAP or spec.depth > 1:
            raise InputError(
                f"{path}: {spec.width}x{spec.height}; make the map {LARGEST_MAP} wide at most"
            )
        if not {"R", "G", "B"} <= set(spec.channelnames) or spec.width != 2 * spec.height:
            raise InputError(
                f"{path}: {spec.width}x{spec.height} of {', '.join(spec.channelnames)[:40]}; a map "
                "has R, G and B and is twice as wide as high"
            )
        pixels = source.read_image(oiio.FLOAT)
        if pixels is None:
            raise InputError(f"{path}: damaged ({source.geterror()[:80]}); give another map")
        order = [spec.channelnames.index(name) for name in "RGB"]
    finally:
        source.close()
    picture = np.asarray(pixels, np.float64).reshape(spec.height, spec.width, -1)[..., order]
    if not np.isfinite(picture).all() or picture.min() < 0:
        raise InputError(f"{path}: holds numbers that no light has; give another map")
    return picture
