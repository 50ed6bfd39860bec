"""One self-contained HTML file that plays a bundle: no server, no network, a strict policy.

Whatever comes from the bundle is put where a browser reads it as text only: JSON with every `<`
escaped, base64, or escaped text. The one script and the one style are allowed by their hashes.
"""

import base64
import hashlib
import html
import json
import unicodedata
from pathlib import Path

from bakery import preset
from bakery.errors import BundleError, ModelError
from bakery.export import bundle
from bakery.export.validate import problems
from bakery.export.web import files as web
from bakery.formats import mark, record
from bakery.formats.light import KIND, read_light
from bakery.paths import ASSETS

ASSETS = ASSETS / "viewer"
MODULE = ("avatar.js", "avatar.d.ts", "index.html")  # what others embed
TITLE = 80  # characters
SHOWN = 6  # problems of a bundle that a message lists


def page(folder, watch=None, derive=None, live=False):
    """The page of a bundle.

    Args:
        folder: the bundle.
        watch: token of the state that is shown; a page with one asks its server for a newer state.
        derive: function (folder) -> files of web/, for bundles that were baked without them.
        live: whether its server sends a stream of Live Link Face (`show.live`).

    Returns:
        bytes of the HTML file.

    Raises:
        BundleError: anything is wrong with the bundle.
    """
    folder = Path(folder)
    manifest, files = _checked(folder, derive)
    description = record.parse(web.DESCRIPTION, files[web.DESCRIPTION])
    named = {name: dict(table) for name, table in preset.load("expressions", "named").items()}
    about = {
        "title": plain(folder.name.removesuffix(".avatar")) or "avatar",
        "named": named,
        "facts": _facts(manifest),
        "lights": {name: record.numbers(read_light(name), 5) for name in preset.names(KIND)},
        "watch": watch,
        "live": live,
    }
    script, style = asset("page.js"), asset("page.css")
    pieces = {
        "policy": policy(script, style, bool(watch)),
        "title": html.escape(about["title"]),
        "style": style,
        "script": script,
        "data": "\n".join(_data(description, about, files)),
    }
    text = _filled(asset("page.html"), pieces)
    said = mark.of_manifest(manifest)
    return text.replace("<title>", mark.page_head(said) + "\n<title>", 1).encode()


def _checked(folder, derive):
    """The manifest and the files of web/ of a bundle that nothing is wrong with."""
    manifest = bundle.read_manifest(folder)
    if found := problems(folder):
        more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
        listed = "; ".join(found[:SHOWN]) + more
        raise BundleError(f"{folder}: not shown, for something is wrong: {listed}; bake it again")
    return manifest, _web_files(folder, manifest, derive)


def site(folder, derive=None):
    """Files for a page of one's own: the module, its types, the bundle, and a page to begin with.

    Args:
        folder, derive: as for `page`.

    Returns:
        name -> bytes.

    Raises:
        BundleError: anything is wrong with the bundle.
    """
    files = dict(_checked(Path(folder), derive)[1])
    for name in MODULE:
        files[name] = asset(name).encode()
    return files


def asset(name):
    """The text of a built file of the viewer.

    Raises:
        ModelError: the installation is incomplete.
    """
    try:
        return (ASSETS / name).read_text(encoding="utf-8")
    except OSError:
        raise ModelError(
            f"{ASSETS / name}: missing; install bakery again, or run `make viewer` in a checkout"
        ) from None


def plain(name):
    """A name as one line of visible text: no control characters, none that turn the direction."""
    kept = "".join(c for c in name if unicodedata.category(c)[0] != "C")
    return " ".join(kept.split())[:TITLE]


def policy(script, style, watching):
    """What the browser may do for this page: run this script and this style, nothing else."""
    rules = {
        "default-src": "'none'",
        "script-src": allowed(script),
        "style-src": allowed(style),
        "img-src": "data: blob:",
        "media-src": "blob:",
        "connect-src": "'self'" if watching else "'none'",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def allowed(text: str) -> str:
    """How a policy names one script or style: by its hash."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


def _web_files(folder, manifest, derive):
    listed = [entry["path"] for entry in manifest["files"] if entry["role"] == "web"]
    if web.DESCRIPTION not in listed:
        if derive is None:
            raise BundleError(f"{folder}: lacks {web.DESCRIPTION}; bake it again")
        return derive(folder)
    return {name: bundle.read_file(folder, manifest, name) for name in listed}


def _facts(manifest):
    """What the page tells about the bundle: pairs of text."""
    source = mark.type_name(manifest["provenance"]["digitalSourceType"])
    warnings = "; ".join(plain(found["message"]) for found in manifest["warnings"]) or "none"
    return [
        ["Made by", plain(manifest["asset"]["generator"])],
        ["Head", plain(manifest["head"]["name"])],
        ["Source type", plain(source)],
        ["Mouths", str(len(manifest["mouths"]["landmarks"]))],
        ["Gaze pictures", str(len(manifest["gaze"]["parts"]))],
        ["Warnings", warnings],
    ]


def _data(description, about, files):
    yield _json("description", description)
    yield _json("page", about)
    wanted = [web.head_path(description)] + [
        f"{web.FOLDER}/{atlas['file']}" for atlas in description["atlases"].values()
    ]
    for name in wanted:
        if name not in files:
            raise BundleError(f"{name}: named by {web.DESCRIPTION}, but not there; bake it again")
        place = html.escape(name.removeprefix(web.FOLDER + "/"))
        text = base64.b64encode(files[name]).decode()
        yield f'<script type="application/octet-stream" id="file:{place}">{text}</script>'


def _json(name, table):
    text = json.dumps(table, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    text = text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return f'<script type="application/json" id="{name}">{text}</script>'


def _filled(template, pieces):
    """The template with each {{name}} replaced once, whatever the pieces themselves hold."""
    out = []
    for part in template.split("{{"):
        name, closed, rest = part.partition("}}")
        out.append(pieces[name] + rest if closed and name in pieces else part)
    return "".join(out)
