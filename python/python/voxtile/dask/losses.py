"""Workers and schedulers that end while somebody waits for their answers."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any

import distributed

from ..errors import VoxtileError

# Its types are not complete.
_dask: Any = distributed


@contextmanager
def told(*, use_less: str, then: str) -> Iterator[None]:
    """Makes such a loss an error that says what to do: how a task would take less memory, and what to do then."""
    try:
        yield
    except _dask.KilledWorker as error:
        raise VoxtileError(
            f"{error.last_worker.address}: this worker and others have ended over one task; perhaps memory was short:"
            f" {use_less}, or workers with more, and {then}"
        ) from error
    except (CancelledError, _dask.comm.CommClosedError) as error:
        # The second while an answer is on its way.
        raise VoxtileError(f"{error}; {then}, with a client of a scheduler that runs") from error
