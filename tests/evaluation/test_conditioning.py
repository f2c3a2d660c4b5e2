import numpy as np
import pytest
import torch

from berteam_cli import build
from berteam_cli.config import checked
from berteam_cli.evaluation import conditioning
from berteam_cli.evaluation.conditioning import Encounters, encounters
from berteam_cli.evaluation.reference import Reference, reference
from berteam_cli.rating.bradley_terry import held_ratings
from berteam_cli.training import begin, epoch
from tests.test_config import composed

torch.set_num_threads(1)


@pytest.mark.parametrize(("team_size", "epochs"), [(1, 60), (2, 160)])
def test_after_one_game_the_winning_answer_is_found(team_size, epochs):
    """Each pure team of hands has one that always beats it: the best response's value is 1 (O4)."""
    words = ["experiment=unknown_opponent", f"team_size={team_size}"]
    parts = build.parts(checked(composed(*words)))
    run = begin(parts)
    for _ in range(epochs):
        run, _ = epoch(run, parts)
    met = encounters(run, parts, reference(parts.games, 28), 60, np.random.default_rng(0))
    assert met.after.mean() > 0.95
    assert met.after.mean(axis=1).min() > 0.85
    assert met.before.mean() < 0.75
    elos = met.elos()
    assert elos["gain"][1] > 0


def test_opponents_stand_in_any_order_as_their_elos_ask(monkeypatch):
    met = []

    def noted(run, parts, acting, theirs, rng):
        met.extend(theirs.tolist())
        return np.zeros((2, len(theirs)))

    monkeypatch.setattr(conditioning, "met", noted)
    parts = build.parts(checked(composed("experiment=unknown_opponent", "team_size=2")))
    known, run = reference(parts.games, 28), begin(parts)
    encounters(run, parts, known, 60, np.random.default_rng(0))
    first = run.population.size
    for k, (a, b) in enumerate(known.teams + first):
        orders = [tuple(team) for team in met[60 * k : 60 * (k + 1)]]
        assert set(orders) == {(a, b), (b, a)}
        assert a == b or 15 < orders.count((a, b)) < 45


def test_elos_are_those_of_a_player_who_met_everybody_and_gain_is_their_difference():
    rng = np.random.default_rng(1)
    anchors = Reference(np.array([[0], [1]]), np.array([900.0, 1100.0]), "made up")
    before, after = rng.choice([0.0, 0.5, 1.0], size=(2, 2, 30), p=[0.3, 0.3, 0.4])
    met = Encounters(anchors, before, after)
    elos = met.elos()
    for name, scores in (("before", before), ("after", after)):
        by_hand, half = held_ratings(scores.sum(axis=1)[np.newaxis], np.full((1, 2), 30.0), anchors.elos)
        assert elos[name][0] == pytest.approx(by_hand[0])
        assert elos[name][1] < elos[name][0] < elos[name][2]
        # Draws scatter less than the width of decided games says.
        assert 0.5 * half[0] < (elos[name][2] - elos[name][1]) / 2 < 1.1 * half[0]
    assert elos["gain"][0] == pytest.approx(elos["after"][0] - elos["before"][0])
