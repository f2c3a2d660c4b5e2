import os
import subprocess
import sys
import threading

import pytest
import torch

from berteam_cli.workers import Workers, available_cores


@pytest.mark.parametrize("count", [1, 3])
def test_results_come_in_order(count):
    assert Workers(count).map(lambda x: x * x, range(20)) == [x * x for x in range(20)]


@pytest.mark.parametrize("count", [1, 2])
def test_an_error_is_raised(count):
    with pytest.raises(ZeroDivisionError):
        Workers(count).map(lambda x: 1 / x, [1, 0, 2])


def test_every_thread_leaves_torch_one(count=2):
    together = threading.Barrier(count)

    def threads(_):
        together.wait(10)
        return torch.get_num_threads(), threading.get_ident()

    said = Workers(count).map(threads, range(count))
    assert {threads for threads, _ in said} == {1}
    assert len({name for _, name in said}) == count


def test_there_is_a_core():
    assert available_cores() >= 1


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system does not say which cores a process has")
def test_only_the_cores_a_process_may_use_count():
    said = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); "
    said += "from berteam_cli.workers import available_cores; print(available_cores())"
    assert subprocess.run([sys.executable, "-c", said], capture_output=True, text=True, check=True).stdout == "1\n"
