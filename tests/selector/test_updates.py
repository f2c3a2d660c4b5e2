import numpy as np
import torch

from berteam_cli.outcomes import OPEN
from berteam_cli.selector.network import TeamNetwork, odds_of, seeded
from berteam_cli.selector.updates import untrained, updated
from berteam_cli.selector.winners import no_winners, pushed

torch.set_num_threads(1)
CPU = torch.device("cpu")
SETTINGS = {"minibatches": 4, "size": 16, "weight_half_life": 0.0, "learning_rate": 1e-3, "averaging": 0.0}


def made():
    with seeded(np.random.default_rng(0), CPU):
        network = TeamNetwork(4, 2, 1, 16, 2, 0.1, "append")
    return network, untrained(network, CPU)


def winners_of(teams):
    return pushed(no_winners(50, 2), np.array(teams), np.ones(len(teams)))


def kinds(learnt):
    return learnt.weights, learnt.means, learnt.squares


def equal(one, other):
    return one.steps == other.steps and all(
        torch.equal(a[name], b[name]) for a, b in zip(kinds(one), kinds(other), strict=True) for name in a
    )


def test_every_weight_is_trained_and_the_old_ones_stay():
    network, start = made()
    copies = [{name: value.clone() for name, value in kind.items()} for kind in kinds(start)]
    after, loss = updated(network, start, winners_of([[0, 1], [2, 3]]), np.random.default_rng(0), **SETTINGS)
    assert all(
        torch.equal(kind[name], copy[name]) for kind, copy in zip(kinds(start), copies, strict=True) for name in kind
    )
    # Attention to one source token and biases of keys have no gradient; all else moves, the head above all.
    moved = {name for name in start.weights if not torch.equal(start.weights[name], after.weights[name])}
    assert {"head.weight", "head.bias", "tokens.weight", "joined.weight"} <= moved
    assert np.isfinite(loss)
    assert (start.steps, after.steps) == (0, 4)
    assert not any(value.requires_grad for kind in kinds(after) for value in kind.values())


def test_a_single_winner_becomes_almost_certain():
    network, learnt = made()
    learnt, _ = updated(
        network, learnt, winners_of([[2, 0]]), np.random.default_rng(0), **SETTINGS | {"minibatches": 200}
    )
    odds = odds_of(network, learnt.weights)
    first, then = odds(np.array([[OPEN, OPEN], [2, OPEN]]))
    assert first[0, 2] * then[1, 0] > 0.9


def test_adam_goes_on_where_it_stopped():
    network, start = made()
    one, _ = updated(network, start, winners_of([[0, 1]]), np.random.default_rng(0), **SETTINGS)
    two, _ = updated(network, one, winners_of([[0, 1]]), np.random.default_rng(1), **SETTINGS | {"minibatches": 1})
    for name, mean in two.means.items():
        gradient = (mean - 0.9 * one.means[name]) / 0.1
        square = 0.999 * one.squares[name] + 0.001 * gradient**2
        torch.testing.assert_close(two.squares[name], square, rtol=1e-3, atol=1e-8)
        step = 1e-3 * (mean / (1 - 0.9**5)) / ((two.squares[name] / (1 - 0.999**5)).sqrt() + 1e-8)
        torch.testing.assert_close(two.weights[name], one.weights[name] - step, rtol=1e-4, atol=1e-6)


def test_averages_count_each_step_so_much_of_the_next():
    network, start = made()
    assert start.used is start.weights
    one_step = SETTINGS | {"minibatches": 1, "averaging": 0.5}
    rng, learnt, newest = np.random.default_rng(0), start, []
    for _ in range(3):
        learnt, _ = updated(network, learnt, winners_of([[0, 1], [2, 3]]), rng, **one_step)
        newest.append(learnt.weights)
    assert learnt.used is learnt.averages
    for name, average in learnt.averages.items():
        expected = (newest[0][name] + 2 * newest[1][name] + 4 * newest[2][name]) / 7
        torch.testing.assert_close(average, expected, rtol=1e-5, atol=1e-7)


def test_averaging_changes_nothing_that_is_trained():
    network, start = made()
    winners = winners_of([[0, 1], [2, 3]])
    plain, _ = updated(network, start, winners, np.random.default_rng(0), **SETTINGS)
    averaged, _ = updated(network, start, winners, np.random.default_rng(0), **SETTINGS | {"averaging": 0.9})
    assert equal(plain, averaged)
    assert plain.averages == {}
    assert plain.used is plain.weights


def test_chance_comes_from_the_generator_alone():
    network, start = made()
    winners = winners_of([[0, 1], [2, 3], [1, 1]])
    torch.manual_seed(3)
    expected = torch.rand(2)
    torch.manual_seed(3)
    one, _ = updated(network, start, winners, np.random.default_rng(0), **SETTINGS)
    assert torch.equal(torch.rand(2), expected)
    again, _ = updated(network, start, winners, np.random.default_rng(0), **SETTINGS)
    other, _ = updated(network, start, winners, np.random.default_rng(1), **SETTINGS)
    assert equal(one, again)
    assert not equal(one, other)


def test_dropout_is_on_in_training_and_draws_from_the_generator():
    network, start = made()
    with seeded(np.random.default_rng(0), CPU):
        plain = TeamNetwork(4, 2, 1, 16, 2, 0.0, "append")
    winners = winners_of([[0, 1], [2, 3]])
    losses = []
    for prepared in (network.eval, network.train, plain.train):  # odds leave a network in eval mode
        after, loss = updated(prepared(), start, winners, np.random.default_rng(0), **SETTINGS)
        losses.append(loss)
    assert losses[0] == losses[1]
    assert abs(losses[0] - losses[2]) > 1e-3
    assert equal(after, updated(plain, start, winners, np.random.default_rng(0), **SETTINGS)[0])


def test_the_network_s_own_weights_do_not_matter_and_do_not_change():
    network, start = made()
    winners = winners_of([[0, 1], [2, 3]])
    one, _ = updated(network, start, winners, np.random.default_rng(0), **SETTINGS)
    assert all(torch.equal(value, start.weights[name]) for name, value in network.named_parameters())
    with torch.no_grad():
        for value in network.parameters():
            value.zero_()
    again, _ = updated(network, start, winners, np.random.default_rng(0), **SETTINGS)
    assert equal(one, again)
