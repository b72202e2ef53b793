"""A real Dask scheduler and real workers on this machine."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from realizer.core.errors import RealizerError
from realizer_studio.batch.dask_cluster import DaskCluster
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Outcome, Worker

# It is not imported here: every process of pytest-xdist would.
pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="needs the cluster extra")


def start(*arguments: str) -> subprocess.Popen[str]:
    """A Dask program that has printed that it is ready."""
    command = [sys.executable, "-W", "ignore", "-m", "dask", *arguments, "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def said(process: subprocess.Popen[str], words: str) -> str:
    """The first line on its standard error with these words."""
    assert process.stderr is not None
    seen = ""
    for line in process.stderr:
        if words in line:
            return line
        seen += line
    raise AssertionError(seen)


@pytest.fixture
def scheduler() -> Iterator[str]:
    process = start("scheduler", "--host", "127.0.0.1", "--port", "0")
    try:
        yield said(process, "Scheduler at:").split()[-1]
    finally:
        process.kill()
        process.communicate()


@pytest.fixture
def workers(scheduler: str, tmp_path: Path) -> Iterator[list[subprocess.Popen[str]]]:
    options = ("--no-nanny", "--nthreads", "1", "--host", "127.0.0.1", "--local-directory", str(tmp_path))
    processes = [start("worker", scheduler, *options) for _ in range(2)]
    try:
        for process in processes:
            said(process, "Registered to:")
        yield processes
    finally:
        for process in processes:
            process.kill()
            process.communicate()


def by_name(outcomes: list[Outcome]) -> dict[str, Outcome]:
    return {outcome.row["document"]: outcome for outcome in outcomes}


@pytest.mark.slow
def test_cluster_gives_the_outputs_of_one_worker_although_one_is_killed(
    scheduler: str, workers: list[subprocess.Popen[str]], tasks: list[Task], options: Options
) -> None:
    here = Worker(options)
    expected = by_name([here.perform(task) for task in tasks])
    crew = DaskCluster(options, scheduler)
    try:
        outcomes = crew.perform(tasks)
        got = [next(outcomes)]
        os.kill(workers[0].pid, signal.SIGKILL)
        got += outcomes
    finally:
        crew.close()
    assert len(got) == len(tasks)
    assert by_name(got) == expected


def test_cluster_names_the_loss_of_its_scheduler(tasks: list[Task], options: Options) -> None:
    scheduler = start("scheduler", "--host", "127.0.0.1", "--port", "0")

    def given() -> Iterator[Task]:
        yield tasks[0]
        scheduler.kill()
        scheduler.communicate()
        yield from tasks[1:]

    crew = DaskCluster(options, said(scheduler, "Scheduler at:").split()[-1])
    try:
        with pytest.raises(RealizerError, match="the scheduler is gone"):
            list(crew.perform(given()))
    finally:
        crew.close()


def test_cluster_names_an_address_without_a_scheduler(
    options: Options, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("realizer_studio.batch.dask_cluster.PATIENCE", 0.2)
    with pytest.raises(RealizerError, match="wanted a Dask scheduler there"):
        DaskCluster(options, "tcp://127.0.0.1:9")


def test_cluster_warns_that_it_waits_for_a_worker(
    scheduler: str, options: Options, caplog: pytest.LogCaptureFixture
) -> None:
    cluster = DaskCluster(options, scheduler)
    assert list(cluster.perform([])) == []
    cluster.close()
    assert f"--dask {scheduler}: waiting for a worker, it has none yet" in caplog.text
