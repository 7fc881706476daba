"""Errors for workers and schedulers that are lost during a call."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any

import distributed

from ..errors import VoxtileError

# The type hints of `distributed` are incomplete.
_dask: Any = distributed


@contextmanager
def explained(*, use_less: str, then: str) -> Iterator[None]:
    """Replaces the exception of a lost worker or scheduler by an error with a remedy. ``use_less`` describes how a task
    uses less memory, ``then`` what to do next.
    """
    try:
        yield
    except _dask.KilledWorker as error:
        raise VoxtileError(
            f"{error.last_worker.address}: this and other workers were lost on the same task, perhaps out of memory:"
            f" {use_less}, or workers with more memory, and {then}"
        ) from error
    except (CancelledError, _dask.comm.CommClosedError) as error:
        # A lost connection while a result is being received.
        raise VoxtileError(f"{error}; {then}, with a client of a running scheduler") from error
