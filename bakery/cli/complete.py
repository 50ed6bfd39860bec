"""What the shell completes: names of presets, plug-ins, heads, shapes, settings and expressions.

A key press must not wait for numpy, so shapes and settings are read from a list that
`python -m bakery.cli.complete` writes; a test keeps it true.
"""

import json
from pathlib import Path

from click.shell_completion import CompletionItem

ANGLES = "head", "gaze"  # `motion.retarget` has them; it imports numpy
WORDS = Path(__file__).resolve().parents[1] / "assets" / "completion.json"


def presets(context, parameter, incomplete):
    """Names for --preset."""
    from bakery import preset

    return _items(preset.names("builds"), incomplete, files=True)


def lights(context, parameter, incomplete):
    """Names for --light."""
    from bakery import preset

    return _items(preset.names("lights"), incomplete, files=True)


def plug_ins(group):
    """A completer of the names of an entry-point group, such as "generators"."""

    def complete(context, parameter, incomplete):
        from importlib.metadata import entry_points

        return _items((entry.name for entry in entry_points(group=f"bakery.{group}")), incomplete)

    return complete


def heads(context, parameter, incomplete):
    """Names for --head: the built-in ones; an imported one may be found by `bakery heads list`."""
    folder = WORDS.parent / "heads"
    return _items(sorted(path.stem for path in folder.glob("*.npz")), incomplete, files=True)


def weights(context, parameter, incomplete):
    """Names for --weights: the shape behind the last comma."""
    return _last(words()["shapes"], incomplete)


def shapes(context, parameter, incomplete):
    """Names of shapes, each a word of its own."""
    return _items(words()["shapes"], incomplete)


def gains(context, parameter, incomplete):
    """Names for --gain: the shape or angle behind the last comma."""
    return _last([*words()["shapes"], *ANGLES], incomplete)


def expressions(context, parameter, incomplete):
    """Names of expressions behind the last comma: `bakery shapes` lists them."""
    return _last([*words()["expressions"], *words()["shapes"]], incomplete)


def settings(of="build"):
    """A completer of the keys for --set."""

    def complete(context, parameter, incomplete):
        return [
            CompletionItem(f"{key}=", help=about)
            for key, about in words()["settings"][of].items()
            if key.startswith(incomplete)
        ]

    return complete


def words():
    """The list that is kept beside the package."""
    return json.loads(WORDS.read_text(encoding="utf-8"))


def _items(names, incomplete, files=False):
    found = [CompletionItem(name) for name in names if name.startswith(incomplete)]
    return found + [CompletionItem(incomplete, type="file")] * files


def _last(names, incomplete):
    before, comma, last = incomplete.rpartition(",")
    return [CompletionItem(f"{before}{comma}{n}=") for n in names if n.startswith(last)]


def made():
    """The words, from the code that they describe: {"shapes", "expressions", "settings"}."""
    from bakery.cli.options import SETTINGS, options_class
    from bakery.formats.targets import named_expressions
    from bakery.settings import listing
    from bakery.types import EXPRESSIONS

    return {
        "shapes": list(EXPRESSIONS),
        "expressions": list(named_expressions()),
        "settings": {
            of: {
                key: "; ".join(filter(None, [allowed.range, allowed.about]))
                for key, _, _, allowed in listing(options_class(of)())
            }
            for of in SETTINGS
        },
    }


if __name__ == "__main__":
    WORDS.write_text(json.dumps(made(), indent=1) + "\n", encoding="utf-8")
