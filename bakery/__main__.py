"""`bakery` and `python -m bakery`: begins before anything is imported that takes time."""

import sys


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
