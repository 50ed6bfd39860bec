"""The published schemas: which versions are read, what a table must hold, and its digest of itself."""

import json
from functools import cache

from bakery.errors import BundleError
from bakery.formats import record
from bakery.formats.files import digest
from bakery.paths import ASSETS

MANIFEST, WEB = "avatar-1.schema.json", "avatar-web-1.schema.json"
MAJOR, MINOR = 1, 1
VERSION = f"{MAJOR}.{MINOR}"  # that is written
BLANK = "0" * 64  # stands for the digest while it is computed
LONGEST = 160  # letters of a finding


@cache
def schema(name: str = MANIFEST) -> dict:
    """A published JSON Schema; that of the manifest, unless told otherwise."""
    return json.loads((ASSETS / "schema" / name).read_text(encoding="utf-8"))


@cache
def _validator(which: str):
    """The validator of a schema. Thousands of numbers are not looked at one by one: 0.10 s less."""
    import jsonschema

    usual = jsonschema.Draft202012Validator
    defined = schema(which)["$defs"]

    def items(validator, each, instance, schema):
        if not _numbers(instance, defined.get(each.get("$ref", "").removeprefix("#/$defs/"), each)):
            yield from usual.VALIDATORS["items"](validator, each, instance, schema)

    return jsonschema.validators.extend(usual, {"items": items})(schema(which))


def _numbers(values, each: dict) -> bool:
    """Whether these are a list of numbers, or of as many numbers each, and nothing more is asked."""
    if each == {"type": "number"}:
        return isinstance(values, list) and {int, float}.issuperset(map(type, values))
    size = each.get("minItems")
    return (
        each == {"type": "array", "minItems": size, "maxItems": size, "items": {"type": "number"}}
        and isinstance(values, list)
        and {list}.issuperset(map(type, values))
        and {size}.issuperset(map(len, values))
        and all({int, float}.issuperset(map(type, row)) for row in values)
    )


def read_version(name, table: dict) -> int:
    """The minor version of a table that is read.

    Args:
        name: how messages call the file.
        table: a manifest, or the description for browsers.

    Raises:
        BundleError: another major version, or none.
    """
    asset = table.get("asset")
    text = str(asset.get("version", "")) if isinstance(asset, dict) else ""
    major, dot, minor = text.partition(".")
    if not (dot and major.isdecimal() and minor.isdecimal() and len(text) < 20):
        raise BundleError(f"{name}: states no version; make the bundle again")
    if int(major) != MAJOR:
        raise BundleError(
            f"{name}: version {text}; {MAJOR}.x is read here; update bakery, or make the bundle again"
        )
    return int(minor)


def findings(name, table: dict, which: str = MANIFEST) -> tuple[list[str], list[str]]:
    """What a schema says of a table.

    Args:
        name: how messages call the file.
        table: what stands in it.
        which: file name of the schema.

    Returns:
        problems, and notes: what a newer minor version may have added.

    Raises:
        BundleError: of a version that is not read.
    """
    newer = read_version(name, table) > MINOR
    problems, notes = [], []
    for error in _validator(which).iter_errors(table):
        where = "/".join(str(step) for step in error.absolute_path) or "the outer table"
        added = error.validator == "additionalProperties" or (
            error.validator == "enum" and error.absolute_path[-1] == "role"
        )
        (notes if newer and added else problems).append(
            f"{name}: {where}: {error.message[:LONGEST]}"
        )
    lacking = sorted(set(map(str, table.get("extensionsRequired", ()))))
    if lacking and not problems:
        problems.append(f"{name}: needs extensions that are not known here: {', '.join(lacking)}")
    return problems, notes


def seal(table: dict) -> bytes:
    """The JSON bytes of a manifest with its digest of itself as the last entry."""
    table = {key: value for key, value in table.items() if key != "sha256"}
    data = record.dump(table | {"sha256": BLANK})
    before, _, after = data.rpartition(BLANK.encode())
    return before + digest(data).encode() + after


def seal_problem(data: bytes, table: dict) -> str | None:
    """What is wrong with the digest that a manifest carries, or None; before 1.1 it has none.

    Args:
        data: bytes of the manifest.
        table: what they say.
    """
    stated = table.get("sha256")
    if stated is None:
        return None
    mark = str(stated).encode("ascii", "replace")  # JSON can hold halves of letters
    if data.count(mark) == 1 and digest(data.replace(mark, BLANK.encode())) == stated:
        return None
    return "its SHA-256 of itself is another: changed since it was written"
