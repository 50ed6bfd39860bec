"""`bakery` and `python -m bakery`: begins before anything is imported that takes time."""

import _thread
import os
import sys

# Threads of BLAS split sums, whose last bits then tell how many there were: a portrait would give
# other bytes on another machine. Cores are used by `bakery.parallel`. (OpenBLAS, Accelerate.)
os.environ |= {"OPENBLAS_NUM_THREADS": "1", "VECLIB_MAXIMUM_THREADS": "1"}


def _not_lost(ignored):
    """Python drops a KeyboardInterrupt in a destructor: it comes again, when the destructor is over."""
    if isinstance(ignored.exc_value, KeyboardInterrupt):
        _thread.start_new_thread(_thread.interrupt_main, ())
    else:
        sys.__unraisablehook__(ignored)


def main() -> None:
    """The command line, with Ctrl-C heard from the first import on."""
    sys.unraisablehook = _not_lost
    try:
        from bakery.cli.main import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("bakery: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
