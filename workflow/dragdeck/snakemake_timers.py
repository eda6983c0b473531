"""One timer at a time for Snakemake's scheduler."""

import threading
from typing import Any


def look_again_once(scheduler: type[Any]) -> None:
    """Let a scheduler wait with one timer for its next look at the jobs.

    Up to 9.27 at least, each look while jobs wait for a core starts a timer for another, also the
    look when a job ends. So there are more with each job: a hundred a second after a hundred jobs.
    In a plan of 24 runs, Snakemake took a third of a core while LIGGGHTS ran.

    Parameters
    ----------
    scheduler : type
        ``snakemake.scheduling.job_scheduler.JobScheduler``. Without the method that starts timers,
        it is left as it is.
    """
    if not hasattr(scheduler, "_schedule_reevalutation"):
        return
    waiting = threading.Event()

    def start(self: Any, delay_s: float) -> None:
        if waiting.is_set():
            return
        waiting.set()

        def look() -> None:
            waiting.clear()
            self._open_jobs.release()

        timer = threading.Timer(delay_s, look)
        timer.daemon = True
        timer.start()

    scheduler._schedule_reevalutation = start
