"""Bundles of strangers under `bakery preview`: refused in one line, or shown with every text as text.

Each differs from a good bundle in one thing and is sealed again as its author can. A page that comes all the
same must be built of the same elements with the same attributes as the good one's, run the same script, and
hold nothing of the files beside the bundle.
"""

import base64
import hashlib
import json
import os
import random
import shutil
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import base
import hidden

TEXTS = (
    "<script>zq()</script>", "</script><script>zq()</script>", "<!--<script>", "-->",
    "<img src=x onerror=zq()>", '"><svg/onload=zq()>', "' onmouseover='zq()", '" autofocus onfocus="zq()',
    "javascript:zq()", "{{script}}", "&lt;script&gt;zq()&lt;/script&gt;", "\\u003cscript>zq()", "]]><zq>",
    "</title><zq>", "</style><zq>", "${zq()}", "\u202egnp.zq", "zq\0", "zq\u2028", "zq\r\nX: y", "\ud800",
    "data:text/html,<zq>", "//evil.com/zq", "zq" * 9000, "../../secret.txt", "/etc/passwd", "constructor",
    "__proto__",
)  # fmt: skip
PATHS = (
    "../secret.txt", "web/../../secret.txt", "./../secret.txt", "/etc/passwd", "..\\secret.txt",
    "C:secret.txt", "web//../../secret.txt", "{absolute}", "%2e%2e/secret.txt",
    "web/%2e%2e/%2e%2e/secret.txt", "web", "", ".", "..", "web/./neutral.webp", "file:{absolute}",
    "~/secret.txt", "\\\\host\\secret", "web/../head.glb", "avatar.json", "secret.txt\0.webp", "../secret",
    "web/<script>zq()<script>", 'web/"onload="zq()',
)  # fmt: skip
WHOLE = 200  # changes of which a smaller count takes some of each kind
KINDS = ("a file more", "a picture", "an atlas")
SECRET = "Zq7Hidden4beside9the2bundle"
DESCRIPTION = "web/avatar.json"
NOTHING = "no change"
Change = Callable[[Path], str]


class Shape(HTMLParser):
    """Elements of a page with the names of their attributes, and the scripts that run."""

    def __init__(self, page: bytes):
        super().__init__(convert_charrefs=False)
        self.elements: list[tuple[str, ...]] = []
        self.scripts: list[str] = []
        self.inside = False
        self.feed(page.decode())
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, *(name for name, _ in attrs)))
        self.inside = tag == "script" and "type" not in dict(attrs)
        if self.inside:
            self.scripts.append("")
        for name, value in attrs:
            if name in ("src", "href", "action") and not (value or "").startswith(("data:,", "#")):
                self.elements.append((tag, name, value or ""))

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.scripts[-1] += data

    def handle_endtag(self, tag: str) -> None:
        self.inside = False


def show(row: base.Row, bundle: Path, place: Path, count: int, seed: int) -> str:
    """Show `count` changed bundles; what came of them in words."""
    from bakery.show.page import page

    good, rng = Shape(page(bundle)), random.Random(seed)
    secret = hidden.token("secret", SECRET)
    changes = [*_files(), *(_path(kind, path) for kind in KINDS for path in PATHS)]
    while len(changes) < max(count, WHOLE):
        changes.append(_text(rng) if rng.random() < 0.8 else _folder(rng))
    rng.shuffle(changes)
    changes.insert(
        0, lambda folder: NOTHING
    )  # so that not everything is refused for another reason
    shown = 0
    for number, change in enumerate(changes[:count]):
        outer = place / f"{number:03d}"
        folder = _linked(bundle, outer / "bundle.avatar")
        (outer / "secret.txt").write_text(SECRET)
        (outer / "secret").mkdir()
        (outer / "secret" / "avatar.json").write_text(SECRET)
        name = change(folder)
        if not folder.exists():  # it has another name now
            (folder,) = [path for path in outer.iterdir() if path.suffix == ".avatar"]
        before = base.content(outer)
        target = outer.parent / f"{number:03d}-out"
        module = number % 4 == 3
        words = ["--module", str(target / "site")] if module else ["-o", str(target / "page.html")]
        target.mkdir()
        end = base.run(["preview", str(folder), *words], place / "run")
        row.cases += 1
        written = [path for path in sorted(target.rglob("*")) if path.is_file()]
        wrong = _judged(end, written, good, secret, module)
        if name == NOTHING and end.code:
            wrong.append("a good bundle is refused")
        if base.content(outer) != before:
            wrong.append("something beside the page was written")
        for each in wrong:
            row.fail(f"bundle {number}, {name}: {each}")
        shown += end.code == 0
        if not wrong:
            shutil.rmtree(outer)
            shutil.rmtree(target)
    return f"{min(count, len(changes))} bundles, {shown} shown, the others refused"


def _judged(
    end: base.Ended, written: list[Path], good: Shape, secret: hidden.Token, module: bool
) -> list[str]:
    wrong = []
    for path in written:
        if any(form in path.read_bytes() for form in secret.forms):
            wrong.append(f"{path.name} holds what lies beside the bundle")
    if end.code == 0:
        for path in written:
            if path.name == "page.html":
                found = Shape(path.read_bytes())
                if found.elements != good.elements:
                    wrong.append("the page has other elements or attributes")
                if found.scripts != good.scripts:
                    wrong.append("the page runs another script")
        if not written:
            wrong.append("nothing was written, and no error told")
        return wrong
    lines = end.said.splitlines()
    if (
        end.code != 1
        or len(lines) != 1
        or not lines[0].startswith("bakery: ")
        or not lines[0].isprintable()
    ):
        wrong.append(f"exit code {end.code}, {len(lines)} lines: {end.said[-300:]!r}")
    if written:
        wrong.append("refused, and written all the same")
    return wrong


def _linked(bundle: Path, folder: Path) -> Path:
    """A bundle whose files share their bytes with another's, so that 200 of them fit on a disk."""
    shutil.copytree(bundle, folder, copy_function=os.link)
    return folder


def _put(path: Path, data: bytes) -> None:
    path.unlink(missing_ok=True)  # else the bytes of all bundles change
    path.write_bytes(data)


def _sealed(folder: Path, change: Callable[[dict], None], name: str = "avatar.json") -> None:
    """Change a table of a bundle; hashes are made to fit again."""
    from bakery.export.schema import seal

    table = json.loads((folder / name).read_text())
    change(table)
    if name == "avatar.json":
        _put(folder / name, seal(table))
        return
    data = json.dumps(table).encode()
    _put(folder / name, data)
    _sealed(folder, lambda manifest: _entry(manifest, name).update(_about(data)))


def _about(data: bytes) -> dict[str, Any]:
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}


def _entry(manifest: dict, name: str) -> dict:
    return next(entry for entry in manifest["files"] if entry["path"] == name)


def _leaves(value: Any, kind: type, place: tuple = ()) -> list[tuple]:
    """Places of all values of a type in a table."""
    if isinstance(value, dict | list):
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        return [found for key, each in pairs for found in _leaves(each, kind, (*place, key))]
    return [place] if isinstance(value, kind) else []


def _set(table: Any, place: tuple, value: Any) -> None:
    for step in place[:-1]:
        table = table[step]
    table[place[-1]] = value


def _text(rng: random.Random) -> Change:
    """A hostile text in place of one in a table, or as the name of an entry."""
    text, name = rng.choice(TEXTS), rng.choice(("avatar.json", "avatar.json", DESCRIPTION))
    as_key = rng.random() < 0.25

    def change(folder: Path) -> str:
        table = json.loads((folder / name).read_text())
        places = _leaves(table, str)
        kinds = sorted({tuple(step for step in place if isinstance(step, str)) for place in places})
        kind = rng.choice(kinds)  # of files there are many, of names few
        place = rng.choice([p for p in places if tuple(s for s in p if isinstance(s, str)) == kind])
        if as_key:
            place = (
                *next(p for p in (place[:-1], place[:-2], ()) if isinstance(_get(table, p), dict)),
                text,
            )
        try:
            _sealed(folder, lambda each: _set(each, place, text), name)
        except UnicodeEncodeError:  # half a pair: JSON can say it, UTF-8 cannot
            _put(folder / name, json.dumps(table | {"note": text}).encode())
        return f"{name}: {'/'.join(map(str, place))[:60]} = {text[:30]!r}"

    return change


def _get(table: Any, place: tuple) -> Any:
    for step in place:
        table = table[step]
    return table


def _folder(rng: random.Random) -> Change:
    """A hostile name of the folder, which is the page's title."""
    usable = [
        text
        for text in TEXTS
        if "\0" not in text and "/" not in text and len(text) < 99 and text.isascii()
    ]
    text = rng.choice([*usable, "zq\u202egnp", "{{data}}", "&lt;zq&gt;", "zq\n<zq>", "<zq>"])

    def change(folder: Path) -> str:
        folder.rename(folder.parent / f"{text}.avatar")
        return f"folder {text!r}"

    return change


def _path(kind: str, path: str) -> Change:
    """A path that leads out, of a file more or in place of one, in the manifest or in web/avatar.json."""

    def change(folder: Path) -> str:
        new = path.format(absolute=folder.parent / "secret.txt")
        entry = {"path": new, "role": "web", **_about(SECRET.encode())}
        if kind == "a file more":
            _sealed(folder, lambda manifest: manifest["files"].append(entry))
        elif kind == "a picture":
            _sealed(folder, lambda manifest: _entry(manifest, "web/neutral.webp").update(path=new))
        else:
            first = next(iter(json.loads((folder / DESCRIPTION).read_text())["atlases"]))
            _sealed(folder, lambda each: each["atlases"][first].update(file=new), DESCRIPTION)
        return f"{kind} is {path!r}"

    return change


def _files() -> list[Change]:
    """Links and what is no file, at places of the bundle."""

    def link(name: str, target: str) -> Change:
        def change(folder: Path) -> str:
            path, away = folder / name, folder.parent / "away"
            path.rename(away)
            path.symlink_to(target or away)
            return f"{name} is a link to {target or 'itself, elsewhere'}"

        return change

    def pipe(folder: Path) -> str:
        (folder / "web" / "neutral.webp").unlink()
        os.mkfifo(folder / "web" / "neutral.webp")
        return "a pipe"

    def nested(folder: Path) -> str:
        _put(folder / "avatar.json", b"[" * 200_000)
        return "200,000 tables in each other"

    def picture(folder: Path) -> str:
        data = base64.b64decode("PHN2ZyBvbmxvYWQ9InpxKCkiPjwvc3ZnPg==")  # an SVG that runs a script
        _put(folder / "web" / "neutral.webp", data)
        _sealed(folder, lambda manifest: _entry(manifest, "web/neutral.webp").update(_about(data)))
        return "an SVG in place of a picture"

    names = ("web", DESCRIPTION, "web/neutral.webp", "avatar.json", "face.exr", "preview.png")
    return [
        *(link(name, target) for name in names for target in ("", "../secret.txt", "/etc/passwd", "..")),
        pipe, nested, picture,
    ]  # fmt: skip
