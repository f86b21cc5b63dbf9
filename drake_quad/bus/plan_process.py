"""A process of its own that makes plans, so that the loop of a robot's bus never waits for one."""

import pickle
import signal
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from drake_quad.errors import PlanningError
from drake_quad.planning.motion_plan import MotionPlan
from drake_quad.planning.plan_job import PlanJob
from drake_quad.util.parallel import without_script

GONE = "the process that makes plans has ended"


class PlanProcess:
    """Makes plans in another process, one after the other.

    It ends with the process that made it, however that ends.

    Args:
        first: Job with which it is tried, before anybody waits: once it has made that, all that
            it takes is loaded.

    Raises:
        PlanningError: There is no plan of that job.
    """

    def __init__(self, first: PlanJob) -> None:
        context = get_context("spawn")  # a fork would keep real-time priority and locked memory
        self._mine, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        with without_script():
            self.process.start()
        theirs.close()
        self._asked: tuple[int, int] | None = None
        while self.ask(first) is None:
            self._mine.poll(None)

    def ask(self, job: PlanJob) -> MotionPlan | None:
        """See `PlanMaker`.

        Raises:
            PlanningError: There is no plan, or the process has ended.
        """
        try:
            if self._asked != job.key:
                _send(self._mine, job)
                self._asked = job.key
                return None
            while self._mine.poll():
                key, plan, reason = _receive(self._mine)
                if key != job.key:
                    continue  # an answer that nobody waits for any more
                self._asked = None
                if reason:
                    raise PlanningError(reason)
                return plan  # type: ignore[no-any-return]
        except (EOFError, OSError):
            raise PlanningError(GONE) from None
        return None

    def close(self) -> None:
        """Ends the process."""
        self._mine.close()
        self.process.terminate()
        self.process.join(5.0)


def _send(end: Connection, what: object) -> None:
    """Sends by the protocol that keeps arrays that cannot be written to as they are.

    Kernels are compiled anew for arrays of another kind, for seconds, within the loop.
    """
    end.send_bytes(pickle.dumps(what, protocol=5))


def _receive(end: Connection) -> Any:
    return pickle.loads(end.recv_bytes())


def _serve(theirs: Connection) -> None:
    """Makes the plans that are asked for until the other end is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the loop's to answer
    while True:
        try:
            job: PlanJob = _receive(theirs)
        except (EOFError, OSError):
            return
        plan, reason = None, ""
        try:
            plan = job.make()
            plan.sample(0.0)  # what it works out when it is first asked for
            plan.contacts.feet_at(np.array([plan.duration]))
        except PlanningError as problem:
            reason = problem.reason
        except Exception as problem:
            reason = f"planning failed: {problem!r}"[:200]
        try:
            _send(theirs, (job.key, plan, reason))
        except (EOFError, OSError):
            return
