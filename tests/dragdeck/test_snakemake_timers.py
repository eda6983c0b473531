"""Snakemake's scheduler looks at its jobs once per timer, not once more with each job."""

import threading
from typing import Any

from snakemake.scheduling.job_scheduler import JobScheduler

from dragdeck.snakemake_timers import look_again_once


def test_looks_do_not_multiply_with_jobs() -> None:
    assert hasattr(JobScheduler, "_schedule_reevalutation")
    mended = type("Mended", (JobScheduler,), {})
    look_again_once(mended)
    scheduler: Any = object.__new__(mended)
    scheduler._open_jobs = threading.Semaphore(0)
    for _ in range(20):
        scheduler._schedule_reevalutation(0.01)
    assert scheduler._open_jobs.acquire(timeout=60)
    assert not scheduler._open_jobs.acquire(timeout=0.2)
    scheduler._schedule_reevalutation(0.01)
    assert scheduler._open_jobs.acquire(timeout=60)


def test_a_scheduler_without_timers_is_left_alone() -> None:
    other = type("Other", (), {})
    look_again_once(other)
    assert not hasattr(other, "_schedule_reevalutation")
