"""A page of many bundles: a picture and a line of each, sorted by what needs a look first.

One HTML file beside the bundles, whose previews it shows. Names and messages are escaped text; the
one script and the one style are allowed by their hashes.
"""

import html
import logging
import os
import time
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from bakery.bake.batch import Outcome, summary
from bakery.export.layout import PREVIEW
from bakery.formats.files import write_bytes
from bakery.formats.mark import MIXED, page_head
from bakery.show.page import allowed

log = logging.getLogger(__name__)
NAME = "index.html"
# By it a page is known as ours; `page_head` has it.
MARK = '<meta name="generator" content="bakery '
ORDER = ("failed", "warned", "baked", "fresh")
STYLE = """
body{font:15px/1.4 system-ui,sans-serif;margin:1.5rem;background:#161616;color:#ddd}
table{border-collapse:collapse;width:100%}
th,td{text-align:left;padding:.4rem .8rem;border-bottom:1px solid #333;vertical-align:top}
th button{font:inherit;color:inherit;background:none;border:0;padding:0;cursor:pointer;text-decoration:underline}
img{width:40rem;max-width:55vw;display:block;background:#333;aspect-ratio:5/1;object-fit:cover;object-position:top}
.failed td{background:#4a1c1c}.warned td{background:#3d3316}
a{color:inherit}
"""
SCRIPT = """
for (const [column, button] of [...document.querySelectorAll('th button')].entries()) {
  let up = true;
  button.addEventListener('click', () => {
    const body = document.querySelector('tbody');
    const key = (row) => row.cells[column].dataset.key ?? row.cells[column].textContent;
    const rows = [...body.rows].sort((a, b) => key(a).localeCompare(key(b), undefined, {numeric: true}));
    body.append(...(up ? rows : rows.reverse()));
    up = !up;
  });
}
"""


def write_contact_page(folder: Path, outcomes: Sequence[Outcome]) -> Path | None:
    """Write the page of a folder's bundles; one of an earlier run is replaced.

    Returns:
        Its path, or None where a file of somebody else has its name.
    """
    path = Path(folder) / NAME
    try:
        with open(path, encoding="utf-8", errors="replace") as there:
            ours = MARK in there.read(1000)
    except FileNotFoundError:
        ours = True
    except OSError:
        ours = False
    if not ours:
        log.warning("%s: is not a contact sheet of bakery and stays; none is written", path)
        return None
    write_bytes(path, contact_page(Path(folder), outcomes).encode())
    return path


def contact_page(folder: Path, outcomes: Sequence[Outcome]) -> str:
    """The page's HTML.

    Args:
        folder: where it will lie; bundles are named from there.
        outcomes: in any order.
    """
    rows = sorted(outcomes, key=lambda one: (ORDER.index(_kind(one)), one.bundle))
    columns = ("bundle", "state", "seconds", "what to look at")
    head = "".join(f"<th><button>{name}</button></th>" for name in columns)
    rules = (
        f"default-src 'none'; img-src 'self' file:; style-src {allowed(STYLE)}; "
        f"script-src {allowed(SCRIPT)}; base-uri 'none'; form-action 'none'"
    )
    made = time.strftime("%Y-%m-%d %H:%M")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n{page_head(MIXED, "WebPage")}\n'
        f'<meta http-equiv="Content-Security-Policy" content="{rules}">\n'
        f"<title>{len(rows)} avatars</title><style>{STYLE}</style></head><body>\n"
        f"<h1>{len(rows)} avatars</h1><p>{html.escape(summary(outcomes))}; {made}</p>\n"
        f"<table><thead><tr>{head}</tr></thead><tbody>\n"
        + "\n".join(_row(Path(folder), one) for one in rows)
        + f"\n</tbody></table><script>{SCRIPT}</script></body></html>\n"
    )


def _kind(one: Outcome) -> str:
    return "warned" if one.warnings and one.state != "failed" else one.state


def _row(folder: Path, one: Outcome) -> str:
    kind = _kind(one)
    place = Path(os.path.relpath(one.bundle, folder))
    name = html.escape(place.name.removesuffix(".avatar"))
    if one.state == "failed":
        shown = name
    else:
        address = html.escape(quote(f"{place.as_posix()}/{PREVIEW}"), quote=True)
        shown = f'<a href="{address}"><img loading="lazy" alt="" src="{address}">{name}</a>'
    notes = html.escape(one.error or ", ".join(one.warnings))
    seconds = f"{one.seconds:.1f}" if one.seconds else ""
    cells = f'<td data-key="{name}">{shown}</td><td data-key="{ORDER.index(kind)}">{one.state}</td>'
    return f'<tr class="{kind}">{cells}<td>{seconds}</td><td>{notes}</td></tr>'
