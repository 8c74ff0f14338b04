"""A thread that steps a session at a rate of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy

from .arrays import Array, ArrayLike
from .session import Felt, Session


class Loop:
    """Steps a session in a thread of its own: 1 / session.tick times a second.

    `pose(t)`: position of the first tool [m] at t [s] since the start, or None to leave it; called in each tick, so that it
    must be quick. `shown(felt)`: takes what the first tool feels, as a device would; may be left out. What either of them
    throws ends the loop, and `stop` throws it again. Python's pauses come through: `late` says by how much."""

    def __init__(self, session: Session, pose: Callable[[float], ArrayLike | None],
                 shown: Callable[[Felt], object] | None = None):
        self._session = session
        self._pose = pose
        self._shown = shown
        self._late: list[float] = []
        self._failure: BaseException | None = None
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="palpate loop", daemon=True)
        self.felt: Felt | None = None  # of the last tick

    def start(self) -> Loop:
        self._thread.start()
        return self

    def stop(self) -> None:
        """Ends the loop after the tick under way. Throws what ended it before."""
        self._ends.set()
        self._thread.join()
        if self._failure is not None:
            raise self._failure

    def __enter__(self) -> Loop:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def late(self) -> Array:
        """How much later than due each tick began [s]."""
        return numpy.array(self._late)

    def _run(self) -> None:
        try:
            start = due = time.monotonic()
            while not self._ends.is_set():
                now = time.monotonic()
                self._late.append(now - due)
                felt = self._session.step(self._pose(now - start))
                self.felt = felt
                if self._shown is not None:
                    self._shown(felt)
                due += self._session.tick
                wait = due - time.monotonic()
                if wait > 0:
                    time.sleep(wait)
                else:
                    due -= wait  # ticks that are missed are not made up for
        except BaseException as failure:  # noqa: BLE001 -- stop() throws it in the thread that asks
            self._failure = failure
