import numpy as np
import pytest
import torch

from berteam_cli.selector import outcome_network
from berteam_cli.selector.outcome_network import OutcomeNetwork, foretold


@pytest.fixture
def network():
    torch.manual_seed(0)
    return OutcomeNetwork(6, 8)


def test_the_order_of_members_does_not_matter_and_sides_are_alike(network):
    teams = torch.tensor([[[0, 1, 5], [2, 2, 3], [4, 0, 1]]])
    logits = network(teams)
    torch.testing.assert_close(network(teams.flip(2)), logits)
    torch.testing.assert_close(network(teams.flip(1)), logits.flip(1))
    assert logits.shape == (1, 3)


@pytest.mark.parametrize("rivals", [1, 2])
def test_foretold_scores_are_the_mean_of_the_shares(network, rivals, monkeypatch):
    rng = np.random.default_rng(0)
    teams, against = rng.integers(6, size=(5, 3)), rng.integers(6, size=(4, rivals, 3))
    often = np.array([1, 3, 1, 2])
    expected = [
        np.mean(
            [
                torch.softmax(network(torch.from_numpy(np.concatenate([team[np.newaxis], x])[np.newaxis])), 1)[
                    0, 0
                ].item()
                for x in against.repeat(often, axis=0)
            ]
        )
        for team in teams
    ]
    np.testing.assert_allclose(foretold(network, teams, against, often), expected, atol=1e-6)
    monkeypatch.setattr(outcome_network, "NUMBERS", 1)  # one team at a time
    np.testing.assert_allclose(foretold(network, teams, against, often), expected, atol=1e-6)
