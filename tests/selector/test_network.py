import numpy as np
import pytest
import torch

from berteam_cli.outcomes import ABSENT, OPEN
from berteam_cli.selector import network as module
from berteam_cli.selector.embedders import EMBEDDERS, embedder
from berteam_cli.selector.network import LONGEST, POSITIONS, TeamNetwork, by_owner, odds_of, seeded
from berteam_cli.selector.observations import Seen

torch.set_num_threads(1)
CPU = torch.device("cpu")
ONE = np.zeros(1, dtype=np.int64)  # the only side


def made(members=5, team_size=3, position="append", layers=2, width=16, heads=2, seed=0, sides=1, sees=None):
    with seeded(np.random.default_rng(seed), CPU):
        reader = None if sees is None else embedder(sees, 4, width, heads, 2, 0.1)
        network = TeamNetwork(members, team_size, layers, width, heads, 0.1, position, sides, reader)
    return network, {name: value.detach() for name, value in network.named_parameters()}


def asker(network, weights):
    """Returns the odds where nothing is known of any team."""
    odds = odds_of(network, weights, ONE)
    return lambda teams, places=None: odds(teams, np.zeros(len(teams), dtype=np.int64), places)


def teams_of(count, members, team_size, seed=0):
    return np.random.default_rng(seed).integers(OPEN, members, size=(count, team_size))


def seen_of(sources, players=2, seed=0):
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(sources, players, 6, 4)).astype(np.float16)
    return Seen(rows, rng.integers(1, 7, size=(sources, players)))


def zeros(count):
    return np.zeros(count, dtype=np.int64)


def count_of(part):
    return sum(weight.numel() for weight in part.parameters())


def test_the_paper_s_sizes_have_the_known_number_of_parameters():
    network, _ = made(members=7, team_size=2, layers=3, width=128, heads=4)
    assert count_of(network.reader.encoder) + count_of(network.writer.decoder) == 1_389_056
    assert count_of(network.reader.sides) + count_of(network.writer.tokens) == 9 * 128  # side, 7 members, MASK
    assert count_of(network.writer.joined) == 32_896
    assert count_of(network.writer.head) == 7 * 129
    assert count_of(network) == 1_389_056 + 32_896 + 9 * 128 + 7 * 129


def test_with_the_lstm_the_paper_s_sizes_have_the_published_sum():
    network = TeamNetwork(7, 2, 3, 128, 4, 0.1, "append", 1, embedder("lstm", 45, 128, 4, 2, 0.1))
    assert count_of(network.reader.embedder) == 221_696
    assert count_of(network) == 1_645_831 - 128  # it has a token for a team


@pytest.mark.parametrize("position", POSITIONS)
@pytest.mark.parametrize(("members", "team_size"), [(1, 1), (5, 4), (6, 1)])
def test_odds_are_chances_of_the_members_alone(position, members, team_size):
    chances = asker(*made(members, team_size, position))(teams_of(9, members, team_size))
    assert chances.shape == (9, team_size, members)
    assert chances.dtype == np.float64
    np.testing.assert_allclose(chances.sum(axis=2), 1.0, rtol=1e-14)


def test_odds_are_the_softmax_of_the_network_s_logits_without_dropout():
    network, weights = made(sees="lstm", sides=2)
    teams, sides, seen = teams_of(6, 5, 3), np.array([0, 1, 1, 0, 1, 0]), seen_of(6)
    network.eval()
    with torch.no_grad():
        logits = network(*map(torch.from_numpy, (teams, sides, seen.rows, seen.lengths)))
    network.train()
    found = odds_of(network, weights, sides, seen)(teams, np.arange(6))
    np.testing.assert_allclose(found, torch.softmax(logits, dim=-1).numpy(), atol=1e-6)


def test_dropout_is_off_when_asked_for_odds_and_on_in_training():
    network, weights = made(sees="lstm")
    network.train()
    teams, seen = teams_of(6, 5, 3), seen_of(6)
    answers = []
    for _ in range(2):
        odds = odds_of(network, weights, zeros(6), seen)
        for _ in range(2):
            network.train()
            answers.append(odds(teams, np.arange(6)))
    assert all(np.array_equal(answers[0], answer) for answer in answers)
    network.train()
    with seeded(np.random.default_rng(1), CPU), torch.no_grad():
        one, other = (network(torch.from_numpy(teams), torch.from_numpy(zeros(6))) for _ in range(2))
    assert not torch.equal(one, other)


@pytest.mark.parametrize("part", ["dropped", "encoder", "decoder"])
def test_dropout_acts_in_every_part_and_on_every_team_by_itself(part):
    network, _ = made()
    parts = {"dropped": network.writer.dropped, "encoder": network.reader.encoder, "decoder": network.writer.decoder}
    network.eval()
    parts[part].train()
    teams = torch.from_numpy(np.tile(teams_of(1, 5, 3), (2, 1)))
    with seeded(np.random.default_rng(1), CPU), torch.no_grad():
        one, other = network(teams, torch.from_numpy(zeros(2)))
    assert not torch.allclose(one, other, atol=1e-4)


def test_open_places_show_mask_and_the_encoder_reads_the_side():
    network, weights = made(members=5)
    full, open_ = np.array([[0, 1, 2]]), np.array([[0, OPEN, 2]])
    mask, side = ("writer.tokens.weight", 5), ("reader.sides.weight", 0)
    member, nobody = ("writer.tokens.weight", 1), ("writer.tokens.weight", 3)
    for (name, token), seen_in_full, seen_in_open in (
        (mask, False, True),
        (side, True, True),
        (member, True, False),
        (nobody, False, False),
    ):
        tokens = weights[name].clone()
        tokens[token] += torch.linspace(-1, 1, 16)
        changed = asker(network, weights | {name: tokens})
        for teams, seen in ((full, seen_in_full), (open_, seen_in_open)):
            assert np.allclose(changed(teams), asker(network, weights)(teams), atol=1e-6) != seen


def test_tokens_of_sides_tell_them_apart():
    odds = odds_of(*made(sides=3), np.array([2, 0, 1]))
    team = np.array([[0, OPEN, 2]])
    one, other, third = odds(np.tile(team, (3, 1)), np.arange(3))
    for a, b in ((one, other), (other, third), (one, third)):
        assert np.abs(a - b).max() > 1e-4
    np.testing.assert_allclose(odds_of(*made(sides=3), np.array([2]))(team, ONE)[0], one, atol=1e-6)


def test_large_requests_are_cut_without_a_trace(monkeypatch):
    teams, places, sources = teams_of(11, 5, 3), np.arange(11) % 3, np.arange(11) % 4
    odds, each = asker(*made()), odds_of(*made(sees="lstm"), zeros(4), seen_of(4))
    requests = (
        lambda: odds(teams),
        lambda: odds(teams, places),
        lambda: each(teams, sources),
        lambda: each(teams, sources, places),
    )
    whole = [request() for request in requests]
    monkeypatch.setattr(module, "ROWS", 4)
    for before, request in zip(whole, requests, strict=True):
        np.testing.assert_allclose(request(), before, atol=1e-6)


def test_one_place_of_each_team_is_as_among_all():
    teams, places, rng = teams_of(50, 5, 3), np.random.default_rng(1).integers(3, size=50), np.random.default_rng(2)
    for odds, sources in (
        (odds_of(*made(), ONE), 1),
        (odds_of(*made(sides=2), np.arange(2)), 2),
        (odds_of(*made(sees="mean"), zeros(1), seen_of(1)), 1),
        (odds_of(*made(sees="mean"), zeros(20), seen_of(20)), 20),
    ):
        known = rng.integers(sources, size=50)
        expected = odds(teams, known)[np.arange(50), places]
        np.testing.assert_allclose(odds(teams, known, places), expected, atol=1e-6)


@pytest.mark.parametrize("position", POSITIONS)
def test_a_team_is_the_same_among_longer_ones(position):
    network, weights = made(team_size=5, position=position)
    odds, small = asker(network, weights), np.array([[3, OPEN], [OPEN, OPEN]])
    padded = np.pad(small, ((0, 0), (0, 3)), constant_values=ABSENT)
    mixed = np.concatenate([padded, teams_of(4, 5, 5)])
    np.testing.assert_allclose(odds(mixed)[:2, :2], odds(small), atol=1e-5)
    np.testing.assert_allclose(odds(mixed)[2:], odds(mixed[2:]), atol=1e-5)
    places = np.array([1, 0, 4, 3, 2, 0])
    np.testing.assert_allclose(odds(mixed, places)[:2], odds(small, places[:2]), atol=1e-5)
    network.eval()
    both = (network(torch.from_numpy(teams), torch.from_numpy(zeros(2))) for teams in (padded, small))
    torch.testing.assert_close(next(both)[:, :2], next(both), atol=1e-5, rtol=0)


def test_the_longest_team_has_its_odds_in_bounded_pieces():
    teams = teams_of(3, 7, LONGEST)
    chances = asker(*made(members=7, team_size=LONGEST))(teams, np.array([0, 100, LONGEST - 1]))
    np.testing.assert_allclose(chances.sum(axis=1), 1.0, rtol=1e-14)
    wide, _ = made(members=500, team_size=LONGEST, layers=3, width=128, heads=4)
    assert wide.train().rows(LONGEST) == 1
    assert wide.rows(2, 2, 43) < wide.rows(2, 2, 5) < wide.rows(2) == wide.rows(2, 2, 0)
    assert 1 < wide.eval().rows(LONGEST) < wide.rows(10) < wide.rows(2) < wide.rows(1)


@pytest.mark.parametrize("name", EMBEDDERS)
def test_what_was_seen_matters_and_whoever_saw_nothing_is_not_there(name):
    network, weights = made(sees=name)
    teams, seen, known = teams_of(4, 5, 3), seen_of(4), np.arange(4)
    without = odds_of(network, weights, zeros(4))(teams, known)
    with_ = odds_of(network, weights, zeros(4), seen)(teams, known)
    assert np.abs(with_ - without).max(axis=(1, 2)).min() > 1e-4
    nobody = odds_of(network, weights, zeros(4), Seen(seen.rows, np.zeros((4, 2), dtype=np.int64)))(teams, known)
    np.testing.assert_allclose(nobody, without, atol=1e-5)

    present = np.array([[True, True], [False, False], [True, False], [False, True]])
    some = odds_of(network, weights, zeros(4), Seen(seen.rows, np.where(present, seen.lengths, 0)))(teams, known)
    np.testing.assert_allclose(some[0], with_[0], atol=1e-5)
    np.testing.assert_allclose(some[1], without[1], atol=1e-5)
    for row, player in ((2, 0), (3, 1)):  # as if the other had never been there
        own = Seen(seen.rows[[row], player : player + 1], seen.lengths[[row], player : player + 1])
        alone = odds_of(network, weights, ONE, own)(teams[[row]], ONE)
        np.testing.assert_allclose(some[row], alone[0], atol=1e-5)


def test_steps_beyond_what_was_seen_do_not_matter():
    network, weights = made(sees="lstm")
    teams, seen = teams_of(4, 5, 3), seen_of(4)
    rows = np.where(np.arange(6)[:, np.newaxis] < seen.lengths[..., np.newaxis, np.newaxis], seen.rows, np.nan)
    padded = Seen(np.pad(rows, ((0, 0), (0, 0), (0, 3), (0, 0)), constant_values=9.0), seen.lengths)
    found, expected = (odds_of(network, weights, zeros(4), x)(teams, np.arange(4)) for x in (padded, seen))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_each_known_thing_reaches_its_own_teams():
    network, weights = made(sees="lstm", sides=2)
    teams, seen, sides = teams_of(6, 5, 3), seen_of(3), np.array([1, 0, 1])
    odds, known = odds_of(network, weights, sides, seen), np.array([2, 0, 0, 1, 2, 2])
    picked = odds(teams, known)
    for row, k in enumerate(known):
        one = odds_of(network, weights, sides[[k]], seen[[k]])
        np.testing.assert_allclose(one(teams, zeros(6))[row], picked[row], atol=1e-5)
    other = odds(teams, (known + 1) % 3)
    assert np.abs(other - picked).max(axis=(1, 2)).min() > 1e-4


def test_the_order_of_players_does_not_matter():
    network, weights = made(sees="lstm")
    teams, seen = teams_of(4, 5, 3), seen_of(4)
    turned = Seen(seen.rows[:, ::-1].copy(), seen.lengths[:, ::-1].copy())
    found, expected = (odds_of(network, weights, zeros(4), x)(teams, np.arange(4)) for x in (turned, seen))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_networks_that_share_the_known_things_answer_for_their_own():
    own = [odds_of(*made(seed=seed), zeros(4)) for seed in (1, 2)]
    odds, teams, known = by_owner(own, np.array([0, 1, 1, 0])), teams_of(7, 5, 3), np.array([0, 1, 2, 3, 3, 2, 1])
    for places in (None, np.arange(7) % 3):
        found = odds(teams, known, places)
        for row, owner in enumerate([0, 1, 1, 0, 0, 1, 1]):
            assert np.allclose(found[row], own[owner](teams, known, places)[row], atol=1e-6)
            assert not np.allclose(found[row], own[1 - owner](teams, known, places)[row], atol=1e-3)
    alone = odds(teams[:1], known[:1])
    np.testing.assert_allclose(alone, own[0](teams[:1], known[:1]), atol=1e-6)


def test_every_place_is_seen_from_every_other():
    odds = asker(*made())
    open_, first, last = odds(np.array([[OPEN, OPEN, OPEN], [2, OPEN, OPEN], [OPEN, OPEN, 2]]))
    for place in range(3):
        assert not np.allclose(open_[place], first[place])
        assert not np.allclose(open_[place], last[place])


@pytest.mark.parametrize("position", POSITIONS)
def test_only_position_none_makes_places_alike(position):
    odds = asker(*made(position=position))
    teams = np.array([[3, OPEN, 1], [OPEN, 1, 3]])
    one, other = odds(teams)
    alike = np.allclose(one, other[[2, 0, 1]], atol=1e-6)  # the members went round, and so do the odds
    assert alike == (position == "none")


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
