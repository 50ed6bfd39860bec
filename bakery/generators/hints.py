"""What an expression does to the skin, as planes for the network: strain, and folds to expect."""

from bakery.generators.expected_folds import fold_plane
from bakery.generators.strain import landmark_fragments, strain_plane
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics


def hints(subject, conditions, camera=None, wanted=("strain", "folds")):
    """The planes of a target [H, W, 2] uint8, by name.

    Args:
        subject: generators.base.Subject.
        conditions: Conditions.
        camera: Camera of the planes; None: that of the conditions.
        wanted: names of planes; others are passed over.
    """
    planes = {}
    if not {"strain", "folds"} & set(wanted):
        return planes
    head, expression, camera = subject.head, conditions.expression, camera or conditions.camera
    pixels = cameras.project(head.landmarks(conditions.vertices), camera)
    found = landmark_fragments(head, pixels, (camera.height, camera.width))
    if "strain" in wanted:
        planes["strain"] = strain_plane(head, expression, pixels, found)
    if "folds" in wanted:
        light = harmonics.turned(subject.light, subject.light_rotation.T)
        planes["folds"] = fold_plane(head, expression, light, found)
    return planes
