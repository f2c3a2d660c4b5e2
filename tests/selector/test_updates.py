from functools import partial

import numpy as np
import pytest
import torch

from berteam_cli.outcomes import ABSENT, OPEN
from berteam_cli.selector import network as module
from berteam_cli.selector.embedders import EMBEDDERS, embedder
from berteam_cli.selector.masking import guessing_loss, masking_loss
from berteam_cli.selector.network import TeamNetwork, odds_of, seeded
from berteam_cli.selector.observations import Seen
from berteam_cli.selector.updates import untrained
from berteam_cli.selector.updates import updated as updated_by_parts
from berteam_cli.selector.winners import Examples, in_parts, minibatch, no_winners, pushed

torch.set_num_threads(1)
CPU = torch.device("cpu")


def made():
    with seeded(np.random.default_rng(0), CPU):
        network = TeamNetwork(4, 2, 1, 16, 2, 0.1, "append")
    return network, untrained(network, CPU)


def examples(teams, rows=None, lengths=None, weights=None):
    teams = np.asarray(teams)
    count, size = teams.shape
    return Examples(
        teams,
        np.ones(count) if weights is None else weights,
        np.zeros(count, dtype=np.int64),
        np.zeros((count, size, 0, 0), dtype=np.float16) if rows is None else rows,
        np.zeros((count, size), dtype=np.int64) if lengths is None else lengths,
        np.ones(count),
    )


def parts(network, shown):
    """Returns the parts in which the network reads ``shown``, as a selector takes it apart."""
    return in_parts(shown, network.rows(shown.teams.shape[1], *shown.rows.shape[1:3]))


def updated(network, learnt, minibatches, loss_of, rng, learning_rate, averaging=0.0):
    return updated_by_parts(
        network,
        learnt,
        (parts(network, shown) for shown in minibatches),
        loss_of,
        rng,
        learning_rate=learning_rate,
        averaging=averaging,
    )


def masking(network, shown, rng, drop_input=0.5, drop_player=0.1):
    return masking_loss(network, shown, 4, drop_input, drop_player, rng)


def step(network, learnt, teams, seed=0, minibatches=4, averaging=0.0):
    """Returns what some minibatches of sixteen of ``teams`` teach."""
    rng = np.random.default_rng(seed)
    drawn = (examples(np.array(teams)[rng.integers(len(teams), size=16)]) for _ in range(minibatches))
    return updated(network, learnt, drawn, masking, rng, learning_rate=1e-3, averaging=averaging)


def kinds(learnt):
    return learnt.weights, learnt.means, learnt.squares


def equal(one, other):
    return one.steps == other.steps and all(
        torch.equal(a[name], b[name]) for a, b in zip(kinds(one), kinds(other), strict=True) for name in a
    )


def test_every_weight_is_trained_and_the_old_ones_stay():
    network, start = made()
    copies = [{name: value.clone() for name, value in kind.items()} for kind in kinds(start)]
    after, loss = step(network, start, [[0, 1], [2, 3]])
    assert all(
        torch.equal(kind[name], copy[name]) for kind, copy in zip(kinds(start), copies, strict=True) for name in kind
    )
    # Attention to one source token and biases of keys have no gradient; all else moves, the head above all.
    moved = {name for name in start.weights if not torch.equal(start.weights[name], after.weights[name])}
    own = {f"writer.{name}" for name in ("head.weight", "head.bias", "tokens.weight", "joined.weight")}
    assert own | {"reader.sides.weight"} <= moved
    assert np.isfinite(loss)
    assert (start.steps, after.steps) == (0, 4)
    assert not any(value.requires_grad for kind in kinds(after) for value in kind.values())


def test_a_single_winner_becomes_almost_certain():
    network, learnt = made()
    learnt, _ = step(network, learnt, [[2, 0]], minibatches=200)
    odds = odds_of(network, learnt.weights, np.array([0]))
    first, then = odds(np.array([[OPEN, OPEN], [2, OPEN]]), np.array([0, 0]))
    assert first[0, 2] * then[1, 0] > 0.9


def test_adam_goes_on_where_it_stopped():
    network, start = made()
    one, _ = step(network, start, [[0, 1]])
    two, _ = step(network, one, [[0, 1]], seed=1, minibatches=1)
    for name, mean in two.means.items():
        gradient = (mean - 0.9 * one.means[name]) / 0.1
        square = 0.999 * one.squares[name] + 0.001 * gradient**2
        torch.testing.assert_close(two.squares[name], square, rtol=1e-3, atol=1e-8)
        moved = 1e-3 * (mean / (1 - 0.9**5)) / ((two.squares[name] / (1 - 0.999**5)).sqrt() + 1e-8)
        torch.testing.assert_close(two.weights[name], one.weights[name] - moved, rtol=1e-4, atol=1e-6)


def test_averages_count_each_step_so_much_of_the_next():
    network, start = made()
    assert start.used is start.weights
    learnt, newest = start, []
    for seed in range(3):
        learnt, _ = step(network, learnt, [[0, 1], [2, 3]], seed, minibatches=1, averaging=0.5)
        newest.append(learnt.weights)
    assert learnt.used is learnt.averages
    for name, average in learnt.averages.items():
        expected = (newest[0][name] + 2 * newest[1][name] + 4 * newest[2][name]) / 7
        torch.testing.assert_close(average, expected, rtol=1e-5, atol=1e-7)


def test_averaging_changes_nothing_that_is_trained():
    network, start = made()
    plain, _ = step(network, start, [[0, 1], [2, 3]])
    averaged, _ = step(network, start, [[0, 1], [2, 3]], averaging=0.9)
    assert equal(plain, averaged)
    assert plain.averages == {}
    assert plain.used is plain.weights


def test_chance_comes_from_the_generator_alone():
    network, start = made()
    teams = [[0, 1], [2, 3], [1, 1]]
    torch.manual_seed(3)
    expected = torch.rand(2)
    torch.manual_seed(3)
    one, _ = step(network, start, teams)
    assert torch.equal(torch.rand(2), expected)
    assert equal(one, step(network, start, teams)[0])
    assert not equal(one, step(network, start, teams, seed=1)[0])


def test_dropout_is_on_in_training_and_draws_from_the_generator():
    network, start = made()
    with seeded(np.random.default_rng(0), CPU):
        plain = TeamNetwork(4, 2, 1, 16, 2, 0.0, "append")
    losses = []
    for prepared in (network.eval, network.train, plain.train):  # odds leave a network in eval mode
        after, loss = step(prepared(), start, [[0, 1], [2, 3]])
        losses.append(loss)
    assert losses[0] == losses[1]
    assert abs(losses[0] - losses[2]) > 1e-3
    assert equal(after, step(plain, start, [[0, 1], [2, 3]])[0])


def test_the_network_s_own_weights_do_not_matter_and_do_not_change():
    network, start = made()
    one, _ = step(network, start, [[0, 1], [2, 3]])
    assert all(torch.equal(value, start.weights[name]) for name, value in network.named_parameters())
    with torch.no_grad():
        for value in network.parameters():
            value.zero_()
    assert equal(one, step(network, start, [[0, 1], [2, 3]])[0])


def seeing(name, dropout=0.1):
    with seeded(np.random.default_rng(0), CPU):
        network = TeamNetwork(4, 5, 1, 16, 2, dropout, "append", 1, embedder(name, 4, 16, 2, 2, dropout))
    return network, untrained(network, CPU)


def mixed(count, seed=0):
    """Returns teams of one to five members, and what some of them saw."""
    rng = np.random.default_rng(seed)
    own = np.arange(5) < rng.integers(1, 6, size=(count, 1))
    lengths = np.where(own & (rng.random((count, 5)) < 0.7), rng.integers(1, 7, size=(count, 5)), 0)
    rows = rng.normal(size=(count, 5, 6, 4)).astype(np.float16)
    weights = rng.random(count)
    return examples(np.where(own, rng.integers(4, size=(count, 5)), ABSENT), rows, lengths, weights / weights.mean())


def every_place(network, shown, _rng):
    """Returns the loss of guessing all places of empty teams: unlike that of masking, no chance is in it."""
    own = shown.teams != ABSENT
    logits = network(np.where(own, OPEN, ABSENT), shown.sides, shown.rows, shown.lengths)
    return guessing_loss(logits, *map(torch.from_numpy, (shown.teams, own, shown.weights.astype(np.float32))))


@pytest.mark.parametrize("name", EMBEDDERS)
def test_a_minibatch_in_parts_teaches_what_the_whole_does(name, monkeypatch):
    network, start = seeing(name, dropout=0.0)
    shown = mixed(13)
    found, sizes = [], []
    for numbers in (module.NUMBERS, 75_000):
        monkeypatch.setattr(module, "NUMBERS", numbers)
        found.append(updated(network, start, [shown], every_place, np.random.default_rng(2), learning_rate=1e-3))
        sizes.append([len(part) for part, _ in parts(network, shown)])
    assert sizes[0] == [13]
    assert len(sizes[1]) > 2
    assert sizes[1][0] > 1
    assert sum(sizes[1]) == 13
    (whole, loss), (cut, cut_loss) = found
    np.testing.assert_allclose(cut_loss, loss, rtol=1e-5)
    assert whole.steps == cut.steps == 1
    for parameter, mean in whole.means.items():  # after one step, a tenth of the gradient
        torch.testing.assert_close(cut.means[parameter], mean, atol=1e-7, rtol=1e-4, msg=parameter)


def test_parts_hold_every_example_once_and_in_order():
    network, shown = seeing("mean")[0].train(), mixed(13)
    network.rows = lambda *_: 5
    teams = [part.teams for part, _ in parts(network, shown)]
    assert [len(part) for part in teams] == [5, 5, 3]
    assert np.array_equal(np.concatenate(teams), shown.teams)


@pytest.mark.parametrize("name", EMBEDDERS)
def test_the_embedder_is_trained_by_examples_that_saw_something(name):
    network, start = seeing(name)
    shown = mixed(16)
    for lengths, share, trained in (
        (shown.lengths, 0.5, True),
        (np.zeros_like(shown.lengths), 0.5, False),
        (shown.lengths, 1.0, False),  # all forgotten
    ):
        minibatches = [examples(shown.teams, shown.rows, lengths)] * 4
        loss_of = partial(masking, drop_input=share)
        after, loss = updated(network, start, minibatches, loss_of, np.random.default_rng(0), learning_rate=1e-3)
        moved = [not torch.equal(start.weights[n], after.weights[n]) for n in start.weights if "embedder" in n]
        assert all(moved) if trained else not any(moved)
        assert np.isfinite(loss)


def test_what_was_seen_is_learnt_and_so_is_the_choice_without_it():
    network, learnt = seeing("mean", dropout=0.0)

    def minibatches(count):
        rng = np.random.default_rng(1)
        for _ in range(count):
            kind = rng.integers(2, size=64)
            rows = np.where(kind, 1.0, -1.0)[:, None, None, None] * np.ones((1, 2, 3, 4))
            yield examples(np.column_stack([kind, kind]), rows.astype(np.float16), np.full((64, 2), 3))

    learnt, _ = updated(network, learnt, minibatches(150), masking, np.random.default_rng(0), learning_rate=5e-3)
    assert learnt.steps == 150
    open_, known = np.array([[OPEN, OPEN], [OPEN, OPEN]]), np.arange(2)
    rows = np.array([1.0, -1.0], np.float16)[:, None, None, None] * np.ones((1, 2, 3, 4), np.float16)
    seen = Seen(rows, np.full((2, 2), 3))
    one, other = odds_of(network, learnt.weights, np.zeros(2, dtype=np.int64), seen)(open_, known)
    assert one[:, 1].min() > 0.9
    assert other[:, 0].min() > 0.9
    blind = odds_of(network, learnt.weights, np.array([0]))(open_[:1], known[:1])[0]
    assert np.all(np.abs(blind[:, :2] - 0.5) < 0.25)


def test_teams_of_several_sizes_are_learnt_from_one_ring():
    with seeded(np.random.default_rng(0), CPU):
        network = TeamNetwork(4, 3, 1, 16, 2, 0.1, "append")
    pairs, triples = np.array([[2, 0], [0, 2]]), np.array([[1, 3, 1], [3, 3, 1]])
    ring = no_winners(64, 3)
    for _ in range(16):
        padded = np.pad(pairs, ((0, 0), (0, 1)), constant_values=ABSENT)
        ring = pushed(ring, examples(np.concatenate([padded, triples])), 4)
    rng, learnt = np.random.default_rng(0), untrained(network, CPU)
    minibatches = (minibatch([ring], 32, 0.0, rng) for _ in range(250))
    learnt, _ = updated(network, learnt, minibatches, masking, rng, learning_rate=3e-3)
    odds = odds_of(network, learnt.weights, np.array([0]))

    def chances(*team):
        return odds(np.array([team]), np.array([0]))[0]

    assert np.all(np.abs(chances(OPEN, OPEN, ABSENT)[:2, [0, 2]] - 0.5) < 0.15)
    assert chances(2, OPEN, ABSENT)[1, 0] > 0.9
    assert chances(0, OPEN, ABSENT)[1, 2] > 0.9
    assert chances(OPEN, OPEN, OPEN)[:, [1, 3]].sum(axis=1).min() > 0.9  # nothing of the pairs
    assert chances(1, 3, OPEN)[2, 1] > 0.9
