"""`bakery` and `python -m bakery`: begins before anything is imported that takes time."""

import os
import sys

# Threads of BLAS split sums, whose last bits then tell how many there were: a portrait would give
# other bytes on another machine. Cores are used by `bakery.parallel`. (OpenBLAS, Accelerate.)
os.environ |= {"OPENBLAS_NUM_THREADS": "1", "VECLIB_MAXIMUM_THREADS": "1"}


def main() -> None:
    """The command line, with Ctrl-C heard from the first import on."""
    try:
        from bakery.cli.main import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("bakery: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
