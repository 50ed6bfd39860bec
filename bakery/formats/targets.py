"""Reads presets/expressions: named expressions, gaze directions, mouth poses; and weights as text."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from bakery.errors import UsageProblem, no_such
from bakery.preset import find
from bakery.settings import shown
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

LISTED = "`bakery shapes` lists all"  # ends the message about a name that is not known
PLAIN = "named"  # of NAMED: its expressions go by their names alone
NAMED = {"named": PLAIN, "keys": "key", "visemes": "viseme"}  # file -> before the names in it

# Names of other programs -> ours: the visemes of Oculus, and five more of Ready Player Me.
OTHERS = {
    **{f"viseme_{name}": f"viseme:{name.upper()}"
       for name in "sil PP FF TH DD kk CH SS nn RR aa".split()},
    "viseme_E": "viseme:EE", "viseme_I": "viseme:IH", "viseme_O": "viseme:OH",
    "viseme_U": "viseme:OU", "mouthOpen": "jawOpen=0.7",
    "mouthSmile": "mouthSmileLeft,mouthSmileRight", "eyesClosed": "eyeBlinkLeft,eyeBlinkRight",
    "eyesLookUp": "eyeLookUpLeft,eyeLookUpRight",
    "eyesLookDown": "eyeLookDownLeft,eyeLookDownRight",
}  # fmt: skip


def weight_rows(tables: Sequence[Mapping[str, float]], where: object) -> np.ndarray:
    """Mappings of ARKit names to weights as [n, E] float32.

    Raises:
        UsageProblem: a name that ARKit does not have, or a weight outside 0..1.
    """
    out = np.zeros((len(tables), len(EXPRESSIONS)), np.float32)
    for row, table in enumerate(tables):
        for name, weight in table.items():
            if name not in EXPRESSION_INDEX:
                raise no_such(f"{where}: no shape", name, EXPRESSIONS, LISTED)
            if not 0 <= weight <= 1:
                raise UsageProblem(f"{where}: {name} is {shown(weight)}; needs a weight of 0 to 1")
            out[row, EXPRESSION_INDEX[name]] = weight
    return out


def read_keys(path: str | Path) -> tuple[tuple[str, ...], np.ndarray]:
    """Key expressions: names and weights [K, E]."""
    tables = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    return tuple(tables), weight_rows(list(tables.values()), path)


def named_expressions() -> dict[str, dict[str, float]]:
    """Every expression with a name: {name: {shape: weight}}.

    Those of expressions/named.toml have plain names, as "laugh"; key expressions and visemes say
    so, as "key:smile" and "viseme:AA".
    """
    found = {}
    for file, kind in NAMED.items():
        path = find(f"expressions/{file}.toml")
        for name, table in tomllib.loads(path.read_text(encoding="utf-8")).items():
            found[name if kind == PLAIN else f"{kind}:{name}"] = table
    return found


def parse_weights(text, where, alone=None):
    """The numbers of "jawOpen=0.6,mouthPucker=1": {name: weight}.

    Args:
        where: how messages call the text.
        alone: what a name without a number means; None refuses it.

    Raises:
        UsageProblem: an entry of another form, or a name that comes twice.
    """
    table = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = (part.strip() for part in item.partition("="))
        if name in table:
            raise UsageProblem(f"{where}: {name} comes twice; give it once")
        try:
            table[name] = float(value) if equals or alone is None else alone
        except ValueError:
            raise UsageProblem(f"{where}: '{item}'; give NAME=VALUE, as jawOpen=0.6") from None
    return table


def expression_weights(text: str) -> np.ndarray:
    """The weights [E] float32 of expressions by name, as "laugh", "laugh=0.5,viseme:AA=0.3".

    Each name may have a strength of 0..1; single shapes may be among them. What several say about
    one shape adds up, to 1 at most.

    Raises:
        UsageProblem: a name or strength that there is not.
    """
    known = named_expressions() | {name: {name: 1.0} for name in EXPRESSIONS}
    where, total = "expression", np.zeros(len(EXPRESSIONS), np.float32)
    for name, strength in parse_weights(text, where, alone=1.0).items():
        if name not in known:
            raise no_such(f"no {where}", name, known, LISTED)
        if not 0 <= strength <= 1:
            raise UsageProblem(f"{where}: {name} is {strength}; needs a strength of 0 to 1")
        total += np.float32(strength) * weight_rows([known[name]], name)[0]
    return np.minimum(total, 1)


@cache
def other_weights() -> np.ndarray:
    """What each of OTHERS means in ARKit's shapes: [20, E] float32."""
    return np.stack([expression_weights(ours) for ours in OTHERS.values()])


def read_gaze(path: str | Path) -> np.ndarray:
    """Gaze directions [n, 2] degrees."""
    return np.array(tomllib.loads(Path(path).read_text(encoding="utf-8"))["directions"], float)


def read_mouths(path: str | Path) -> np.ndarray:
    """Mouth poses [M, E]."""
    return weight_rows(json.loads(Path(path).read_text(encoding="utf-8")), path)
