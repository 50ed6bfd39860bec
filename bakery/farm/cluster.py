"""Bakes on a dask cluster: every photo once, also when a worker dies.

Photos, bundles and the files that options name are found by their paths: scheduler, workers and
this process see the same file system. A task whose worker dies runs again elsewhere; a bundle that
the dead worker had finished is fresh then and stays.
"""

import socket
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from bakery.bake.batch import Outcome, bake
from bakery.bake.pipeline import Request, source_digest
from bakery.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

WAIT = 20  # seconds for the scheduler to answer
_turn = Lock()  # numba's threads serve one caller at a time, whatever --nthreads the worker has


def bake_on(address: str, requests: Sequence[Request]) -> Iterator[Outcome]:
    """Bake many portraits on a cluster, as they are done; one that fails does not stop the others.

    Args:
        address: of the scheduler, as tcp://host:8786.

    Raises:
        InputError: dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import as_completed
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise InputError("--dask needs dask: pip install 'bakery[dask]'") from None
    wanted = source_digest()
    with _client(address) as client:
        waiting = {
            client.submit(run_task, one, wanted, pure=False, key=f"bakery-{number}-{one.photo.name}"): one
            for number, one in enumerate(map(_absolute, requests))
        }  # fmt: skip
        for future in as_completed(list(waiting)):
            one = waiting[future]
            try:
                yield future.result()
            except KilledWorker as error:
                yield _failed(one, f"{_workers(error)} died with it, perhaps for lack of memory")
            except Exception as error:  # of the cluster: a bake's own are told by its outcome
                yield _failed(one, f"{type(error).__name__}: {str(error).splitlines()[0]}")


def run_task(request: Request, source: str) -> Outcome:
    """Bake one portrait on a worker, unless it is fresh.

    Args:
        source: `pipeline.source_digest` of who asked; another program would make other bytes.
    """
    if source_digest() != source:
        return _failed(
            request, f"{socket.gethostname()} has another bakery; install the same there"
        )
    with _turn:
        return bake(request)


def _client(address: str) -> "Client":
    from distributed import Client

    try:
        return Client(address, timeout=WAIT)
    except (OSError, ValueError) as error:  # ValueError: no such kind of address
        why = str(error).splitlines()[0] if str(error) else "no answer"
        raise InputError(
            f"{address}: no dask scheduler there ({why}); start `dask scheduler` and give its address"
        ) from None


def _absolute(request: Request) -> Request:
    """The same bake for a process with another working directory."""

    def here(path: Path | None) -> Path | None:
        return None if path is None else path.absolute()

    return replace(
        request,
        photo=request.photo.absolute(),
        output=request.output.absolute(),
        expressions=here(request.expressions),
        landmarks=here(request.landmarks),
        head=str(Path(request.head).absolute()) if Path(request.head).is_file() else request.head,
    )


def _failed(request: Request, error: str) -> Outcome:
    return Outcome(str(request.photo), str(request.output), "failed", error=error)


def _workers(error: object) -> str:
    count = int(getattr(error, "allowed_failures", 0)) + 1
    return f"{count} workers" if count > 1 else "its worker"
