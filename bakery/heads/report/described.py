"""What each of the 52 shapes has to do, as Apple describes it, and what a head's shapes do.

The descriptions are ours, after those of ARFaceAnchor.BlendShapeLocation (ARKit documentation);
left and right are the subject's. The rules say how far named landmarks go at weight 1.
"""

from dataclasses import dataclass

import numpy as np

from bakery import landmarks as marks
from bakery.heads.base import weights
from bakery.types import EXPRESSIONS

AXES = {
    "left": (0, 1),
    "right": (0, -1),
    "up": (1, 1),
    "down": (1, -1),
    "out": (2, 1),
    "in": (2, -1),
}
OUTER_BROW = {"Left": (300, 293, 334, 276, 283, 282), "Right": (70, 63, 105, 46, 53, 52)}
INNER_BROWS = (66, 107, 65, 55, 296, 336, 295, 285)
CHEEK = {"Left": (330, 347, 348, 280), "Right": (101, 118, 119, 50)}  # below the eye
PUFF = {"Left": (425, 411, 427), "Right": (205, 187, 207)}
WING = {"Left": (358, 279, 331), "Right": (129, 49, 102)}
CORNER = {"Left": (291, 308), "Right": (61, 78)}
UPPER_LIP = {"Left": (269, 270, 267), "Right": (39, 40, 37)}
LOWER_LIP = {"Left": (314, 405, 321, 317, 402), "Right": (84, 181, 91, 87, 178)}
UPPER_MIDDLE, LOWER_MIDDLE = (0, 37, 267, 13), (17, 84, 314, 14)
LIPS = tuple(int(point) for point in marks.LIPS)
CHIN = (152, 148, 377)
LID = {"Left": (386, 374), "Right": (159, 145)}  # middle of the upper and of the lower lid
IRIS = {"Left": (473,), "Right": (468,)}
TOWARD = {"Left": "left", "Right": "right"}
AWAY = {"Left": "right", "Right": "left"}


@dataclass(frozen=True)
class Rule:
    """Some points go at least so far in a direction, or a gap between two changes so much."""

    what: str  # in words
    points: tuple  # landmarks; two of them for a gap
    way: str  # one of AXES, "open", "shut" or "narrow"
    least: float  # mm at weight 1


def _sided(name, text, *rules):
    """The rules of both sides of a shape; {} in a text stands for the side."""
    return {
        name + side: (text.format(side.lower()), tuple(rule(side) for rule in rules))
        for side in TOWARD
    }


DESCRIBED = {
    **_sided(
        "browDown",
        "outer part of the {} eyebrow goes down",
        lambda s: Rule("outer brow", OUTER_BROW[s], "down", 1.0),
    ),
    "browInnerUp": (
        "inner part of both eyebrows goes up",
        (Rule("inner brows", INNER_BROWS, "up", 2.0),),
    ),
    **_sided(
        "browOuterUp",
        "outer part of the {} eyebrow goes up",
        lambda s: Rule("outer brow", OUTER_BROW[s], "up", 2.0),
    ),
    "cheekPuff": (
        "both cheeks go outward",
        (
            Rule("left cheek", PUFF["Left"], "left", 2.0),
            Rule("right cheek", PUFF["Right"], "right", 2.0),
        ),
    ),
    **_sided(
        "cheekSquint",
        "cheek around and below the {} eye goes up",
        lambda s: Rule("cheek", CHEEK[s], "up", 0.5),
    ),
    **_sided("eyeBlink", "lids of the {} eye close", lambda s: Rule("lids", LID[s], "shut", 7.0)),
    **_sided(
        "eyeLookDown",
        "{} lids as in a look down",
        lambda s: Rule("upper lid", LID[s][:1], "down", 1.5),
        lambda s: Rule("iris", IRIS[s], "down", 3.0),
    ),
    **_sided(
        "eyeLookIn",
        "{} lids as in a look at the nose",
        lambda s: Rule("iris", IRIS[s], AWAY[s], 4.0),
    ),
    **_sided(
        "eyeLookOut",
        "{} lids as in a look away from the nose",
        lambda s: Rule("iris", IRIS[s], TOWARD[s], 4.0),
    ),
    **_sided(
        "eyeLookUp",
        "{} lids as in a look up",
        lambda s: Rule("upper lid", LID[s][:1], "up", 1.0),
        lambda s: Rule("iris", IRIS[s], "up", 3.0),
    ),
    **_sided(
        "eyeSquint",
        "face around the {} eye contracts",
        lambda s: Rule("lower lid", LID[s][1:], "up", 0.5),
        lambda s: Rule("lids", LID[s], "shut", 1.5),
    ),
    **_sided("eyeWide", "lids of the {} eye widen", lambda s: Rule("lids", LID[s], "open", 1.5)),
    "jawForward": ("lower jaw goes forward", (Rule("chin", CHIN, "out", 3.0),)),
    "jawLeft": ("lower jaw goes to the left", (Rule("chin", CHIN, "left", 3.0),)),
    "jawOpen": (
        "lower jaw opens",
        (Rule("chin", CHIN, "down", 15.0), Rule("lips", (13, 14), "open", 15.0)),
    ),
    "jawRight": ("lower jaw goes to the right", (Rule("chin", CHIN, "right", 3.0),)),
    "mouthClose": (
        "lips close whatever the jaw does (here: from jawOpen 1)",
        (Rule("lips", (13, 14), "shut", 15.0),),
    ),
    **_sided(
        "mouthDimple",
        "{} corner of the mouth goes back",
        lambda s: Rule("corner", CORNER[s], "in", 0.5),
    ),
    **_sided(
        "mouthFrown",
        "{} corner of the mouth goes down",
        lambda s: Rule("corner", CORNER[s], "down", 2.0),
    ),
    "mouthFunnel": (
        "both lips contract into an open shape",
        (
            Rule("lips", (13, 14), "open", 4.0),
            Rule("corners", (61, 291), "narrow", 8.0),
            Rule("lips", LIPS, "out", 1.0),
        ),
    ),
    "mouthLeft": ("both lips go to the left", (Rule("lips", LIPS, "left", 3.0),)),
    **_sided(
        "mouthLowerDown",
        "{} side of the lower lip goes down",
        lambda s: Rule("lower lip", LOWER_LIP[s], "down", 1.5),
    ),
    **_sided(
        "mouthPress",
        "{} side of the lower lip is pressed upward",
        lambda s: Rule("lower lip", LOWER_LIP[s], "up", 0.3),
    ),
    "mouthPucker": (
        "both closed lips contract and press together",
        (Rule("corners", (61, 291), "narrow", 10.0), Rule("lips", LIPS, "out", 2.0)),
    ),
    "mouthRight": ("both lips go to the right", (Rule("lips", LIPS, "right", 3.0),)),
    "mouthRollLower": (
        "lower lip goes toward the inside of the mouth",
        (Rule("lower lip", LOWER_MIDDLE, "in", 0.5),),
    ),
    "mouthRollUpper": (
        "upper lip goes toward the inside of the mouth",
        (Rule("upper lip", UPPER_MIDDLE, "in", 0.5),),
    ),
    "mouthShrugLower": (
        "lower lip goes outward",
        (Rule("lower lip", LOWER_MIDDLE, "out", 0.5),),
    ),
    "mouthShrugUpper": (
        "upper lip goes outward",
        (Rule("upper lip", UPPER_MIDDLE, "out", 0.5),),
    ),
    **_sided(
        "mouthSmile",
        "{} corner of the mouth goes up",
        lambda s: Rule("corner", CORNER[s], "up", 2.0),
    ),
    **_sided(
        "mouthStretch",
        "{0} corner of the mouth goes to the {0}",
        lambda s: Rule("corner", CORNER[s], TOWARD[s], 3.0),
    ),
    **_sided(
        "mouthUpperUp",
        "{} side of the upper lip goes up",
        lambda s: Rule("upper lip", UPPER_LIP[s], "up", 1.5),
    ),
    **_sided(
        "noseSneer",
        "{} side of the nose rises around the nostril",
        lambda s: Rule("wing of the nose", WING[s], "up", 0.7),
    ),
    "tongueOut": ("tongue comes out", (Rule("tip of the tongue", (), "out", 10.0),)),
}


def moved(head, name, rule):
    """How far [mm] a rule's points go at weight 1 of a shape, the way the rule says."""
    start = weights({"jawOpen": 1.0}) if name == "mouthClose" else np.zeros(len(EXPRESSIONS))
    before = head.vertices(head.mean, start).astype(float)
    after = head.vertices(head.mean, np.maximum(start, weights({name: 1.0}))).astype(float)
    if not rule.points:
        tongue = head.part_vertices("tongue")
        tip = tongue[before[tongue, 2].argmax()]
        return float(after[tip, 2] - before[tip, 2])
    points = list(rule.points)
    a, b = head.landmarks(before)[points], head.landmarks(after)[points]
    if rule.way in AXES:
        axis, sign = AXES[rule.way]
        return float(sign * (b - a)[:, axis].mean())
    if rule.way == "narrow":
        return float(np.abs(a[0] - a[1])[0] - np.abs(b[0] - b[1])[0])
    opened = (b[0] - b[1])[1] - (a[0] - a[1])[1]  # the upper point comes first
    return float(opened if rule.way == "open" else -opened)


def table(head):
    """The shapes of a head against their descriptions, as Markdown."""
    lines = ["| shape | what it has to do | measured at weight 1, mm (at least) |", "|---|---|---|"]
    for name in EXPRESSIONS:
        text, rules = DESCRIBED[name]
        found = "; ".join(
            f"{rule.what} {rule.way} {moved(head, name, rule):.1f} ({rule.least:g})"
            for rule in rules
        )
        lines.append(f"| {name} | {text} | {found} |")
    return "\n".join(lines) + "\n"
