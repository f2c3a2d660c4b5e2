"""Fictitious play by the real command."""

import pytest

from tests.command.test_train import UNTIMED, read

WORDS = ["experiment=fictitious_rps", "epochs=4", "games_per_epoch=8", "selector.batch_size=32"]
WORDS += ["selector.minibatch_size=16", "selector.reservoir=100", "record_every=2", "checkpoint_every=2"]


def test_resumed_it_ends_in_the_same_bytes(berteam, tmp_path):
    berteam("train", *WORDS, "out=whole")
    berteam("train", *WORDS, "epochs=2", "out=halves")
    berteam("train", *WORDS, "out=halves", "on_exists=resume")
    for name in UNTIMED:
        whole, halves = ((tmp_path / folder / f"{name}.csv").read_bytes() for folder in ("whole", "halves"))
        assert whole == halves, name
    states = [
        (tmp_path / folder / "checkpoint" / "epoch_00000004" / "tensors.safetensors").read_bytes()
        for folder in ("whole", "halves")
    ]
    assert states[0] == states[1]
    shares = read(tmp_path / "whole", "team_distribution").query("epoch == 4").probability * 100
    assert ((shares - shares.round()).abs() < 1e-9).all()  # of a hundred teams
    assert shares.sum() == pytest.approx(100)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["selector.loss=mlm"], "selector.opponents=average needs selector.loss=l1"),
        (["selector.weighting=false"], "selector.loss=l1 needs selector.weighting=true"),
        (["selector.observations.use=previous_game"], "selector.opponents=average needs selector.observations.use"),
        (["selector.reservoir=0"], "selector.reservoir must be >= 1"),
        (["selector.entropy_clip=1.5"], "selector.entropy_clip must be >= 0 and <= 1"),
    ],
)
def test_what_does_not_go_together_is_said_in_a_sentence(words, said, berteam):
    assert said in berteam("train", *WORDS, *words, code=2).stderr
