"""Errors that the user can mend. The command line shows each as one line and exits with 1."""


class BakeryError(Exception):
    """Base of all errors whose message says what was found, what is needed, what to do."""


class InputError(BakeryError):
    """A file, folder or option cannot be used as it is."""


class FitError(BakeryError):
    """The head model could not be placed in the photo."""


class ModelError(BakeryError):
    """A head model or a network's weights are missing or damaged."""


class BundleError(BakeryError):
    """A bundle is incomplete, damaged or unsafe."""
