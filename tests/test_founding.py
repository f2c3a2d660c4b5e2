"""Which learner a population's config gives."""

import pytest
import torch

from berteam_cli import build
from berteam_cli.config import checked
from berteam_cli.errors import InputError
from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.ppo import Ppo
from berteam_cli.learner.sb3 import Sb3
from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.learner.stacked_ppo import StackedPpo
from tests.test_config import composed


def learners(*words):
    return [type(x.learner) for x in build.parts(checked(composed(*words))).optimizer.islands]


def test_on_the_processor_members_learn_in_compiled_functions_and_on_a_gpu_stacked(monkeypatch):
    assert learners() == [Ppo, Ppo, Dqn, Dqn]
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda: (2**30, 2**31))
    assert learners("device=cuda") == learners("device=auto") == [StackedPpo, StackedPpo, StackedDqn, StackedDqn]
    assert learners("device=cpu") == [Ppo, Ppo, Dqn, Dqn]
    assert learners("device=cuda", "population=ppo6", "learner=sb3") == [Sb3]
    with pytest.raises(InputError, match=r"dqn96.learner.buffer_size must be <= .* may take 1.0 GiB of 2.0 GiB"):
        learners("device=cuda", "population.islands.dqn96.learner.buffer_size=200000")
    parts = build.parts(checked(composed("device=cuda")))
    assert {x.learner.device for x in parts.optimizer.islands} == {"cuda"} == {parts.selector.device}


def test_a_run_that_is_only_looked_at_is_on_the_processor(monkeypatch, tmp_path):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    config = checked(composed("device=cuda"))
    with pytest.raises(InputError, match="device=cuda needs a CUDA device"):
        build.parts(config)
    assert type(build.parts_to_read(config, tmp_path).optimizer.islands[0].learner) is Ppo


def test_every_setting_of_a_learner_reaches_it():
    parts = build.parts(checked(composed("population=ppo6", "learner.clip_range_vf=0.3", "learner.target_kl=0.02")))
    learner = parts.optimizer.islands[0].learner
    assert (learner.clip_range_vf, learner.target_kl) == (0.3, 0.02)
    words = ["population=ppo6", "learner=dqn", "learner.tau=0.5", "learner.n_steps=3", "learner.activation=tanh"]
    learner = build.parts(checked(composed(*words))).optimizer.islands[0].learner
    assert (learner.tau, learner.n_steps, learner.smooth) == (0.5, 3, True)


def test_settings_that_nobody_names_are_those_of_stable_baselines():
    from inspect import signature  # noqa: PLC0415

    from stable_baselines3 import DQN, PPO  # noqa: PLC0415

    def defaults(kind):
        return {name: x.default for name, x in signature(kind).parameters.items()}

    names = {"batch_size": "minibatch_size", "ent_coef": "entropy_coef", "vf_coef": "value_coef"}
    ours = vars(build.parts(checked(composed("population=ppo6"))).optimizer.islands[0].learner)
    theirs = {names.get(name, name): value for name, value in defaults(PPO).items()}
    shared = ours.keys() & theirs.keys()
    assert len(shared) == 13
    assert {name: ours[name] for name in shared} == {name: theirs[name] for name in shared}

    names = {"exploration_initial_eps": "exploration_initial", "exploration_final_eps": "exploration_final"}
    ours = vars(build.parts(checked(composed("population=ppo6", "learner=dqn"))).optimizer.islands[0].learner)
    theirs = {names.get(name, name): value for name, value in defaults(DQN).items()}
    theirs["buffer_size"] = 10_000  # the paper's; a million steps of 50 members take 18 GB
    shared = ours.keys() & theirs.keys()
    assert len(shared) == 13
    assert {name: ours[name] for name in shared} == {name: theirs[name] for name in shared}
