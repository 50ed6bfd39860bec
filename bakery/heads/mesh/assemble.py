"""From a mesh file to a head model: the whole way."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery.errors import InputError, ModelError
from bakery.heads.base import PROXIES
from bakery.heads.build import flatten
from bakery.heads.build.orbit import lay_lids
from bakery.heads.mesh import flesh as fleshes
from bakery.heads.mesh import openings, parts, pose, register
from bakery.heads.mesh.read import pieces, read_surface, simplified
from bakery.heads.patch import boxed, join
from bakery.heads.proxies import mouth_proxy
from bakery.heads.report.penetrate import DEEP, PAIRS, Contacts
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

TOPOLOGIES = ("auto", "file", "built-in")
BACK, STEPS_BACK = 0.5, 12  # mm a step, and steps, that teeth go back until they leave the lips


@dataclass(frozen=True)
class MeshOptions:
    """How a mesh becomes a head."""

    up: str | None = None  # axis of the file that points up; None finds it
    units: str | None = None  # of `pose.UNITS`; None finds it
    topology: str = "auto"  # whose triangles the skin has: the file's, or the built-in head's
    triangles: int = 60_000  # of the skin at most; what has more is thinned out
    licence: str = "unknown; ask its owner"
    source: str = ""  # the file's name if empty


def import_mesh(path, built_in, look, name, options=MeshOptions()):
    """Make a head model of a mesh file.

    Args:
        path: OBJ, PLY, GLB or glTF.
        built_in: HeadModel whose shapes, people and inner parts are carried over.
        look: function (Surface, built-in HeadModel, up) -> `pose.Seen`.
        name: of the new head; options: MeshOptions.

    Returns:
        (HeadModel, what was found and assumed: lines for people).

    Raises:
        InputError: the file cannot be used, no face is found, or what was asked for does not go.
    """
    surface = read_surface(path)
    seen = look(surface, built_in, options.up)
    posed = pose.pose(surface, seen, pose.shape_of(built_in), options.units)
    surface, labels = posed.surface, pieces(posed.surface.faces)
    main = skin_piece(posed, labels)
    whole = surface.take(labels == main)
    skin = simplified(whole, options.triangles)
    about = [f"{len(surface.faces):,} triangles in {labels.max() + 1} pieces", *posed.about]
    if skin is not whole:
        about.append(
            f"skin: thinned out from {len(whole.faces):,} to {len(skin.faces):,} triangles"
        )
    laid = register.lay(built_in, posed, skin)
    seated = parts.seat(laid)
    told = parts.tell(surface, labels, main, laid, seated)
    balls, own_eyes = parts.balls(surface, told, laid)
    about.append(f"eyes: {'placed as in' if own_eyes else 'not in'} the file; round ones made anew")
    whose = "file" if parts.has_mouth(told) else "built-in head"
    about.append(f"mouth: teeth and gums of the {whose}")
    if told.dropped:
        about.append(f"{told.dropped} pieces that are no eye, tooth, gum or tongue left out")
    inner = [*parts.eye_patches(balls), *parts.mouth_patches(surface, told, laid, seated)]

    def assembled(flesh):
        body = lay_lids(flesh.patches[0], balls, seal=0.0)
        jaw_open = body.expression[EXPRESSION_INDEX["jawOpen"]]
        sheet = mouth_proxy(flesh.lips, body.mean, body.identity, body.expression, jaw_open)
        patches = [body, *flesh.patches[1:], *inner, boxed(sheet, flatten.BOXES["mouth_sheet"])]
        middle = (balls[0].center + balls[1].center) / 2
        patches = [replace(patch, mean=patch.mean - middle) for patch in patches]
        source = options.source or Path(path).name
        places = {part: flatten.BOXES[part] for part in (*PROXIES, "cards")}
        head = join(patches, name, options.licence, source, places)
        head, back = teeth_back(fleshes.marked(head, flesh, middle))
        if back:
            about.append(f"mouth: teeth moved back by {back:.1f} mm, out of the lips")
        return head, about + flesh.about

    if options.topology != "built-in":
        found = openings.find(skin, laid)
        trouble = f"{' and '.join(found.sealed)} shut or filled in the mesh" if found.sealed else ""
        if not trouble:
            try:
                return assembled(fleshes.of_file(skin, found, laid))
            except ModelError as error:
                trouble = str(error).split(";")[0]
        if options.topology == "file":
            raise InputError(
                f"{path}: {trouble}, so its own triangles cannot be kept; --topology built-in lays "
                "the built-in head's over it"
            )
        about.append(f"{trouble}: its own triangles are not kept")
    return assembled(fleshes.of_built_in(laid))


def skin_piece(posed, labels):
    """Which piece of a surface is the skin: the one that most landmarks lie on."""
    from scipy.spatial import cKDTree

    surface = posed.surface
    piece = np.zeros(len(surface.vertices), int)
    piece[surface.faces] = labels[:, None]
    sure = posed.weight > np.median(posed.weight) / 2
    nearest = cKDTree(surface.vertices).query(posed.points[sure])[1]
    return int(np.bincount(piece[nearest]).argmax())


def teeth_back(head):
    """The head with its teeth, gums and tongue as far back as it takes to leave the lips at rest.

    Returns:
        (HeadModel, mm).
    """
    inner = head.part_vertices(*parts.MOUTH)
    contacts, none = Contacts(head), np.zeros(len(EXPRESSIONS))
    best, least = head, np.inf
    for step in range(STEPS_BACK + 1):
        mean = head.mean.copy()
        mean[inner, 2] -= BACK * step
        depth = contacts.depths(mean, none)[PAIRS[0]].max(initial=0.0)
        if depth < least:
            best, least, back = mean, depth, BACK * step
        if depth <= DEEP:
            break
    return (replace(head, mean=best), back) if back else (head, 0.0)
