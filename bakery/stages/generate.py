"""Conditions to a picture: the generator at work, and a check of what it gives back (paGAN section 4)."""

from bakery.check import check_array
from bakery.errors import ModelError
from bakery.generators.base import Generator, Subject
from bakery.types import Conditions, Generated


def generate(
    generator: Generator, subject: Subject, conditions: Conditions, interior_only: bool = False
) -> Generated:
    """Paint one target of a subject.

    Args:
        generator: generators.base.Generator.
        subject: generators.base.Subject.
        conditions: Conditions of the target.
        interior_only: whether the caller looks at eyes and mouth alone.

    Returns:
        Generated, of the size of the conditions.

    Raises:
        ModelError: the generator gave back something of another shape, or numbers that are not
            finite. A plug-in is named, so that its author can be asked.
    """
    made = generator.generate(subject, conditions, interior_only)
    size = conditions.part.shape
    try:
        check_array("image", made.image, (*size, 3))
        check_array("ratio", made.ratio, (*size, 3))
        check_array("color", made.color, (*size, 3))
        check_array("alpha", made.alpha, size)
    except (ValueError, AttributeError, TypeError) as error:
        raise ModelError(
            f"generator '{generator.name}': {error}; use another --generator, or mend it"
        ) from None
    return made
