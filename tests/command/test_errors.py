"""Wrong input: one sentence with what is right, exit code 2, nothing left behind."""

import random

import pytest

from tests.wrong import SEED, Wrong, cases
from tests.wrong.refusal import fault, ran

SB3 = ("train", "population=ppo6", "learner=sb3")

CASES = {
    ("tournament", "rating=glicko"): "rating must be one of davidson, ml, paper, but is 'glicko'",
    ("tournament", "sprt.rounds=9", "sprt.elo0=0", "sprt.elo1=20"): (
        "sprt.elo0 must be below 0 and sprt.elo1 above it, but they are 0 and 20"
    ),
    ("tournament", "env=rps", "env.sides=3", "rating=davidson"): "rating=davidson is for games of two sides",
    ("tournament", "env=rps", "env.sides=3", "sprt.rounds=2"): "sprt.rounds=2 is for games of two sides",
    ("reproduce", "paper_fxed"): "what must be one of .*Did you mean paper_fixed",
    ("reproduce", "paper_fixed", "scale=0"): "scale must be > 0 and <= 1",
    ("reproduce",): "what must be given first",
    ("compare", "nowhere", "nobody"): "nowhere is no folder of a run",
    ("compare", "nowhere", "-m"): "compare does one thing at a time",
    ("trian",): "'trian' is no command.*Did you mean train",
    ("train", "selector=mcca"): "selector must be one of .*, mcaa, .*, but is 'mcca'.*Did you mean mcaa",
    ("train", "population=ppo5"): "population must be one of .*Did you mean ppo50",
    ("train", "-m", "selector=mcaa,berteem"): "'berteem'.*Did you mean berteam",
    ("train", "selecter=mcaa"): "selecter is no key.*Did you mean selector",
    ("train", "optimizer.protect=3"): r"optimizer.protect is no key.*optimizer.protect_new",
    ("train", "selector=mcaa", "selector.captain=uniform"): "selector.captain is no key",
    ("train", "epochs=-1"): "epochs must be >= 0, but is -1",
    ("train", "-m", "epochs=1,2,-3"): "epochs must be >= 0, but is -3",
    ("train", "epochs=many"): "epochs.*'many'",
    ("train", "epochs="): "epochs",
    ("train", "seed=nan"): "seed.*nan",
    ("train", "seed=-1"): "seed must be >= 0",
    ("train", "env.max_time_s=nan"): "env.max_time_s must be > 0",
    ("train", "env.max_time_s=inf"): "env.max_time_s must be > 0",
    ("train", "env.catch_radius_m=0"): "env.catch_radius_m must be > 0, but is 0",
    ("train", "env.world_size_m=[10,10]"): r"env.world_size_m.*but is 10",
    ("train", "env.reward=gold"): r"env.reward must be one of \(.*\) or module:function, but is 'gold'",
    ("train", "env.reward=sparce"): "env.reward must be .* Did you mean sparse?",
    ("train", "env.reward=os:path"): "env.reward must be a function, but 'os:path' is <module",
    (
        "train",
        "env.reward=nowhere:pay",
    ): "env.reward must be importable, but 'nowhere:pay' is not: Mod",
    ("train", "env.reward_weights.team_capture=3"): "env.reward_weights.team_capture is no key.*team_captured",
    ("train", "env.profile=cleen"): "env.profile must be one of .*Did you mean clean?",
    ("train", "env.catch_radius_m=100"): "env.catch_radius_m must be < 100, half of world_size_m",
    ("train", "env.agent_radius_m=60"): r"world_size_m\[0\] must be > 520.8, 8 times agent_radius_m.*\(65.1 m\)",
    ("train", "env.flag_homes_m=[[1,2]]"): "env.flag_homes_m must be two points",
    (
        "train",
        "env.wall_rule=bunce",
    ): "env.wall_rule must be one of bounce, drive_back, but is 'bunce'. Did you mean bounce?",
    ("tournament", "policies=[random,random]"): "policies must name each policy once, but has random",
    ("tournament", "teams=[2-5,0-9]"): "teams must be of 2 members from 0 to 6 each.*has '0-9'",
    ("tournament", "teams=[2-5,5-2]"): "teams must name each team once",
    ("tournament", "action_noise=2"): "action_noise must be >= 0 and <= 1",
    ("tournament", "env=rps", "random_starts=true"): "random_starts is for env=mctf",
    ("tournament", "policies=[random]"): r"policies=\['random'\] with team_size=2 gives 1 team",
    ("tournament", "policies=[attack_hard,defend_hart]"): "policies .*defend_hart.*Did you mean defend_hard?",
    ("train", "games_per_epoch=0"): "games_per_epoch must be >= 1",
    ("train", "selector.dropout=2"): "selector.dropout must be >= 0 and <= 0.99",
    ("train", "population=fixed_policies", "team_size=8"): "team_size must be at most 7",
    ("train", "population.islands.ppo64.size=0"): "population.islands.ppo64.size must be >= 1",
    ("train", "population.islands.ppo64.size=-2"): "population.islands.ppo64.size must be >= 1",
    ("train", "population=fixed_policies", "population.islands.random.size=2"): "islands.random.size must be 1",
    ("train", "population=ppo6", "learner.network=[]"): "learner.network must be 1 to 6 widths",
    ("train", "population=ppo6", "learner.n_steps=100"): "learner.n_steps must be a multiple of "
    "learner.minibatch_size=64, such as 64 or 128, but is 100",
    ("train", "population.islands.ppo96.learner.n_steps=50"): "islands.ppo96.learner.n_steps .* such as 64, but is 50",
    (
        "train",
        "population=ppo6",
        "learner=dqn",
        "learner.gradient_steps=0",
    ): "learner.gradient_steps must be >= 1, or -1",
    ("train", "population=ppo6", "learner=dqn", "learner.buffer_size=900000000"): "main.learner.buffer_size must be <= "
    r"\d+, but is 900000000: what is kept would take .* GiB of memory",
    ("train", "population=ppo6", "learner.n_steps=640000000"): "main.learner.n_steps must be <= ",
    ("train", "population=ppo6", "games_per_epoch=90000000"): "games_per_epoch must be <= ",
    ("train", "population=ppo6", "population.islands.main.size=100000", "learner.network=[2048,2048]"): "too many m",
    ("train", "population=ppo6", "learner.learning_rate=2e9"): "learning_rate must be > 0 and <= 1e.09, but is 20000",
    ("train", "epochs=5000000000"): "epochs must be >= 0 and <= 1e.09, but is 5000000000",
    ("train", "population=ppo6", "learner.minibatch_size=1"): "minibatch_size must be >= 2 with .*normalize_advantage",
    (
        "train",
        "population=imported",
        "population.members=[{file: a.zip, nam: x}]",
    ): "nam is no key here; there are file, name, trust. Did you mean name",
    ("train", "population=imported", "population.members=[{name: x}]"): "members.0..file must be given",
    (
        "train",
        *SB3[1:],
        "population.islands.main.size=50000",
        "learner.algorithm=DQN",
    ): "size=50000 is too many members of .* or too large buffers, which learner.options",
    ("train", "learner.network=[8]"): "learner.network has no effect with this population",
    (*SB3, "learner.algorithm=a2d"): r"learner.algorithm must be one of A2C, .*, but is 'a2d'. Did you mean A2C\?",
    (*SB3, "learner.algorithm=TD3"): "learner.algorithm cannot be TD3: its actions are continuous",
    (*SB3, "learner.algorithm=RecurrentPPO"): "learner.algorithm cannot be RecurrentPPO: its networks remember",
    (*SB3, "learner.options.n_step=8"): r"learner.options.n_step is no option of A2C. Did you mean n_steps\?",
    (*SB3, "learner.options.seed=8"): "learner.options.seed cannot be set: .* seed of the run",
    (*SB3, "learner.options.gamma=2"): "learner.options.gamma must be >= 0 and <= 1, but is 2",
    (*SB3, "learner.options=8"): "learner.options must be keywords with values",
    (
        *SB3,
        "learner.algorithm=PPO",
        "learner.options.n_steps=100",
    ): "learner.options.n_steps must be a multiple of .*=50",
    (*SB3, "learner.algorithm=PPO", "learner.options.batch_size=1"): "learner.options cannot be used, as PPO says",
    (*SB3, "learner.algorithm=DQN", "learner.options.train_freq=[1,episode]"): "train_freq must be a whole number",
    (*SB3, "learner.activation=elu"): "learner.activation must be one of relu, tanh, but is 'elu'",
    ("train", "-m", "learner=sb3", "population=ppo6", "learner.algorithm=A2C,SAC"): "learner.algorithm cannot be SAC",
    ("train", "env=rps", "population=fixed_policies"): "policies.*env=rps.*rock",
    ("train", "env=rps", "population=ppo6", "optimizer=mapelites"): "optimizer.opponents.*rock",
    ("train", "optimizer=mapelites", "optimizer.opponents=[]", "team_size=20"): (
        "optimizer.opponents must make at most 100,000 teams of team_size=20, .* its 7 policies make 230,230"
    ),
    ("train", "selector=mcaa", "optimizer.fitness=elo"): "selector=mcaa has none",
    ("train", "team_size=513"): "team_size must be >= 1 and <= 512, but is 513",
    ("train", "selector.exact_limit=0"): "selector.exact_limit must be >= 1, but is 0",
    ("train", "selector.valid_members=[0]"): r"valid_members must have an entry for each of the 2 places, but has 1\.",
    ("train", "selector.valid_members=[[],0]"): r"valid_members\[0\] must leave somebody for the place",
    ("train", "selector=mcaa", "selector.valid_members=[pp064,0]"): r"valid_members\[0\].*Did you mean ppo64",
    ("train", "selector=uniform", "selector.valid_members=[0,60]"): r"valid_members\[1\].*0 to 59\), but has 60",
    ("train", "selector.side=separate"): "selector.side=separate needs selector.dataset=per_side",
    ("train", "selector.observations=selv"): "selector.observations.use must be one of none, previous_game, self",
    ("train", "selector.observations=previous_game", "games_per_epoch=5"): "games_per_epoch must be even",
    (
        *("train", "env=rps", "population=ppo6", "selector.observations=previous_game"),
        *("opponents=past", "games_per_epoch=6"),
    ): "games_per_epoch less the 3 against opponents must be even with .*, but is 3",
    ("train", "selector.loss=l1"): "selector.weighting",
    ("train", "selector.opponents=average"): "selector.opponents=average needs selector.loss=l1",
    ("train", "selector=mcaa", "selector.top_fraction=0"): "selector.top_fraction must be > 0",
    ("train", "selector=psro", "selector.solver=nahs"): "selector.solver must be one of nash, replicator, uniform",
    ("train", "selector.heads=3"): "selector.*heads",
    ("train", "selector.minibatch_size=1000"): "selector.minibatch_size",
    (
        "train",
        "learner=dqn",
        "population=ppo6",
        "env=pettingzoo",
        "env.target=mctf:parallel_env",
        "+env.options.actions=continuous",
    ): "env.target: .* action space Box.*only Discrete is supported",
    ("train", "device=tpu"): "device must be one of auto, cpu, cuda",
    ("train", "out=/proc/none/here"): "out=/proc/none/here cannot be written",
    ("train", "-m", "out=x", "seed=0,1"): "out is one folder",
    ("train", "seed=0,1"): "seed.*multirun",
    ("train", "--frobnicate"): "--frobnicate",
    ("train", "epochs"): "'epochs' cannot be read as key=value",
    ("train", "épochs=3"): "pochs",
    ("train", "--config-dir", "nowhere"): "--config-dir must be a folder",
    ("tournament", "run=nowhere", "team_size=3"): "team_size has no effect with run=nowhere",
    ("train", "experiment=paper_fixed", "selector=mcaa"): "selector.captain is no key here; there are .*learning_rate",
    ("train", "evaluation.reference_teams=1"): "evaluation.reference_teams must be >= 2",
    ("tournament", "team_size=6"): "team_size=6 gives",
    ("tournament", "games_per_pair=0"): "games_per_pair must be >= 1",
    ("tournament", "run=nowhere"): "nowhere is no folder of a run",
    ("inspect", "nowhere"): "nowhere is no folder of a run",
    ("inspect",): "required: run",
    ("inspect", ".", "--top", "0"): "--top must be >= 1",
    ("evaluate",): "evaluate: run must be given first",
    ("evaluate", "nowhere"): "nowhere is no folder of a run",
    ("evaluate", "nowhere", "games_per_pair=0"): "games_per_pair must be >= 1, but is 0",
    ("evaluate", "nowhere", "teams_at_mst=9"): "teams_at_mst is no key.*Did you mean teams_at_most",
    ("evaluate", "nowhere", "-m"): "evaluate does one thing at a time",
    ("resume", "nowhere"): "nowhere is no folder of a run",
    ("report", "nowhere"): "nowhere is no folder of a run",
    ("report", ".", "./"): "The run . is named twice",
    ("report", "nowhere", "compare=nobody"): "compare=nobody is no folder that berteam compare wrote",
    ("train", "logger=tensorbord"): "logger must be one of csv, mlflow, tensorboard, wandb.*Did you mean tensorboard",
    ("train", "logger=wandb"): r"logger=wandb needs the package wandb.*pip install 'berteam-cli\[wandb\]'",
    ("train", "logger=mlflow"): r"logger=mlflow needs the package mlflow.*pip install 'berteam-cli\[mlflow\]'",
    ("list", "selecter"): "group must be one of .*Did you mean selector",
}


@pytest.mark.parametrize(("words", "said"), CASES.items(), ids=" ".join)
def test_wrong_input(words, said):
    assert fault(Wrong("case", words, said)) is None


MADE = 60  # `make faults` takes all of them


@pytest.fixture(scope="module")
def made():
    return random.Random(SEED).sample(cases(), MADE)


@pytest.mark.parametrize("k", range(MADE))
def test_wrong_input_that_a_generator_made(k, made):
    assert fault(made[k]) is None


def test_what_is_right_is_not_refused():
    code, out, err = ran(("train", "selector=mcaa", "seed=3", "--cfg", "job"))
    assert (code, err) == (0, "")
    assert "seed: 3" in out
    assert fault(Wrong("right", ("--version",), ".")) == "[right] berteam '--version': it ended with 0"


def test_as_a_process(process, tmp_path):
    done = process("train", "selector=mcca", code=2)
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
