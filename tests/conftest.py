"""What all tests share."""

import os

import pytest
import torch
from hypothesis import HealthCheck, settings

# A kernel's first call compiles for longer than hypothesis allows an example by default.
settings.register_profile("kernels", deadline=None, suppress_health_check=[HealthCheck.too_slow], max_examples=50)
settings.load_profile("kernels")

# Ray's workers give way to all other processes by default, which on two busy cores is to stand still.
os.environ["RAY_worker_niceness"] = "0"  # noqa: SIM112 (as Ray spells it)


@pytest.fixture(autouse=True)
def one_torch_thread():
    torch.set_num_threads(1)
