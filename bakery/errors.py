"""Errors that the user can mend. The command line shows each as one line and exits with 1 or 2."""

from collections.abc import Iterable


class BakeryError(Exception):
    """Base of all errors whose message says what was found, what is needed, what to do."""


class InputError(BakeryError):
    """A file, folder or option cannot be used as it is."""


class UsageProblem(InputError):
    """An option or a preset asks for what there is not: wrong usage, exit code 2."""


class FitError(BakeryError):
    """The head model could not be placed in the photo."""


class ModelError(BakeryError):
    """A head model or a network's weights are missing or damaged."""


class BundleError(BakeryError):
    """A bundle is incomplete, damaged or unsafe."""


# What libraries say, who have errors of their own for it: OpenCV, C++, torch, oneDNN, safetensors (a panic).
NO_MEMORY = (
    "Insufficient memory", "bad_alloc", "allocate memory", "could not create a primitive",
    "PyObject pointer is null",
)  # fmt: skip


def lacks_memory(error: BaseException | None) -> bool:
    """Whether an error, or one that it came of, says that there is not enough memory."""
    while error is not None:
        if isinstance(error, MemoryError) or any(text in str(error) for text in NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def nearest(name: object, known: Iterable[object]) -> str | None:
    """The known name that is most like a mistyped one, or None; upper and lower case are alike."""
    from difflib import get_close_matches

    by_lower = {str(word).lower(): str(word) for word in known}
    return next(
        (by_lower[near] for near in get_close_matches(str(name).lower(), by_lower, 1)), None
    )


def no_such(what: str, name: object, known: Iterable[object], advice: str = "") -> UsageProblem:
    """The UsageProblem for a name that is not known.

    Args:
        what: begins the message, such as "no preset".
        known: the names there are; they are listed unless they are many and one is near.
        advice: ends the message.
    """
    names = [str(word) for word in known]
    near = nearest(name, names)
    says = [f"{what} '{name:.60}'"] + [f"did you mean '{near}'?"] * (near is not None)
    if near is None or len(names) <= 12:
        says.append(f"known: {', '.join(names) or 'none'}")
    return UsageProblem("; ".join(says + [advice] * bool(advice)).replace("?;", "?"))
