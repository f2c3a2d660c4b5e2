import math

import numpy as np
import pytest
import torch

from berteam_cli.outcomes import OPEN
from berteam_cli.selector import network as module
from berteam_cli.selector.network import POSITIONS, TeamNetwork, odds_of, seeded, sinusoids

torch.set_num_threads(1)
CPU = torch.device("cpu")


def made(members=5, team_size=3, position="append", layers=2, width=16, heads=2, seed=0):
    with seeded(np.random.default_rng(seed), CPU):
        network = TeamNetwork(members, team_size, layers, width, heads, 0.1, position)
    return network, {name: value.detach() for name, value in network.named_parameters()}


def teams_of(count, members, team_size, seed=0):
    return np.random.default_rng(seed).integers(OPEN, members, size=(count, team_size))


def test_the_paper_s_sizes_have_the_known_number_of_parameters():
    network, _ = made(members=7, team_size=2, layers=3, width=128, heads=4)
    count = {name: sum(p.numel() for p in part.parameters()) for name, part in network.named_children()}
    assert count["tokens"] == 9 * 128  # 7 members, MASK and source
    assert count["joined"] == 32_896
    assert count["transformer"] == 1_389_056
    assert count["head"] == 7 * 129


@pytest.mark.parametrize("position", POSITIONS)
@pytest.mark.parametrize(("members", "team_size"), [(1, 1), (5, 4), (6, 1)])
def test_odds_are_chances_of_the_members_alone(position, members, team_size):
    odds = odds_of(*made(members, team_size, position))
    chances = odds(teams_of(9, members, team_size))
    assert chances.shape == (9, team_size, members)
    assert chances.dtype == np.float64
    np.testing.assert_allclose(chances.sum(axis=2), 1.0, rtol=1e-14)


def test_odds_are_the_softmax_of_the_network_s_logits_without_dropout():
    network, weights = made()
    teams = teams_of(6, 5, 3)
    network.eval()
    with torch.no_grad():
        expected = torch.softmax(network(torch.from_numpy(teams)), dim=-1).numpy()
    network.train()
    np.testing.assert_allclose(odds_of(network, weights)(teams), expected, atol=1e-6)


def test_dropout_is_off_when_asked_for_odds_and_on_in_training():
    network, weights = made()
    odds, teams = odds_of(network, weights), teams_of(6, 5, 3)
    first = odds(teams)
    network.train()
    assert np.array_equal(first, odds(teams))
    network.train()
    with seeded(np.random.default_rng(1), CPU), torch.no_grad():
        assert not torch.equal(network(torch.from_numpy(teams)), network(torch.from_numpy(teams)))


@pytest.mark.parametrize("part", ["dropped", "encoder", "decoder"])
def test_dropout_acts_in_every_part_and_on_every_team_by_itself(part):
    network, _ = made()
    for name, module_ in (("dropped", network.dropped), *network.transformer.named_children()):
        module_.train(name == part)
    with seeded(np.random.default_rng(1), CPU), torch.no_grad():
        one, other = network(torch.from_numpy(np.tile(teams_of(1, 5, 3), (2, 1))))
    assert not torch.allclose(one, other, atol=1e-4)


def test_open_places_show_mask_and_the_encoder_reads_the_source():
    network, weights = made(members=5)
    full, open_ = np.array([[0, 1, 2]]), np.array([[0, OPEN, 2]])
    for token, seen_in_full, seen_in_open in ((5, False, True), (6, True, True), (1, True, False), (3, False, False)):
        tokens = weights["tokens.weight"].clone()
        tokens[token] += torch.linspace(-1, 1, 16)
        changed = odds_of(network, weights | {"tokens.weight": tokens})
        for teams, seen in ((full, seen_in_full), (open_, seen_in_open)):
            assert np.allclose(changed(teams), odds_of(network, weights)(teams), atol=1e-6) != seen


def test_large_requests_are_cut_without_a_trace(monkeypatch):
    odds, teams = odds_of(*made()), teams_of(11, 5, 3)
    whole = odds(teams)
    monkeypatch.setattr(module, "ROWS", 4)
    np.testing.assert_allclose(odds(teams), whole, atol=1e-6)


def test_every_place_is_seen_from_every_other():
    odds = odds_of(*made())
    open_, first, last = odds(np.array([[OPEN, OPEN, OPEN], [2, OPEN, OPEN], [OPEN, OPEN, 2]]))
    for place in range(3):
        assert not np.allclose(open_[place], first[place])
        assert not np.allclose(open_[place], last[place])


@pytest.mark.parametrize("position", POSITIONS)
def test_only_position_none_makes_places_alike(position):
    odds = odds_of(*made(position=position))
    teams = np.array([[3, OPEN, 1], [OPEN, 1, 3]])
    one, other = odds(teams)
    alike = np.allclose(one, other[[2, 0, 1]], atol=1e-6)  # the members went round, and so do the odds
    assert alike == (position == "none")


def test_sinusoids_by_hand():
    code = sinusoids(3, 4).numpy()
    np.testing.assert_allclose(code[0], [0, 1, 0, 1])
    np.testing.assert_allclose(code[2], [math.sin(2), math.cos(2), math.sin(0.02), math.cos(0.02)], rtol=1e-6)


def test_seeded_gives_the_generator_s_stream_and_leaves_torch_s_own():
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    drawn = []
    for seed in (1, 1, 2):
        with seeded(np.random.default_rng(seed), CPU):
            drawn.append(torch.rand(3))
    assert torch.equal(torch.rand(3), expected)
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])
