"""Games against others than the population: who learns from them, and what hears nothing of them."""

import numpy as np
import pytest

from berteam_cli import build
from berteam_cli.archiving import archive_rows
from berteam_cli.config import checked
from berteam_cli.errors import InputError
from berteam_cli.evaluation.likeness import likeness
from berteam_cli.opponents.base import EXPLOITER, PAST, SCRIPTED
from berteam_cli.outcomes import NOBODY, Experience
from berteam_cli.population import policies
from berteam_cli.selector.base import measured
from berteam_cli.training import begin, epoch
from tests.opponents.makers import EXPLOITERS, FOUR, parts
from tests.test_config import composed

SCRIPTED_THIRD = ["opponents=scripted", "opponents.scripted_share=0.34", "opponents.scripted=[rock,paper]"]
OUTSIDERS = {3, 4, 5, 6, 7, 8}  # members of ppo96 and dqn64


@pytest.mark.parametrize("selector", ["mcaa", "best_team"])
def test_scripted_games_are_not_rated_and_the_selector_does_not_hear_of_them(selector):
    """After an epoch all is as if its games among the population had been all, but for what members learnt."""
    met = parts(*SCRIPTED_THIRD, f"selector={selector}")
    alone = parts("games_per_epoch=8", f"selector={selector}")
    (with_guests, report), (without, plain) = epoch(begin(met), met), epoch(begin(alone), alone)
    np.testing.assert_array_equal(report.outcomes.lineups.teams, plain.outcomes.lineups.teams)
    np.testing.assert_array_equal(report.outcomes.scores, plain.outcomes.scores)
    for name in ("fitness", "games", "captain_games", "age", "parent"):
        np.testing.assert_array_equal(getattr(with_guests.population, name), getattr(without.population, name))
    told, untold = (x.selector.tensors(run.selection) for x, run in ((met, with_guests), (alone, without)))
    assert {k: v.tolist() for k, v in told.items()} == {k: v.tolist() for k, v in untold.items()}
    assert with_guests.played == 12


def test_members_learn_from_games_against_scripted_policies():
    made = parts(*SCRIPTED_THIRD)
    _, report = epoch(begin(made), made)
    assert {guest.kind for guest in report.met.teams} == {SCRIPTED}
    teams = np.concatenate([report.outcomes.lineups.teams, report.met.outcomes.lineups.teams])
    assert len(teams) == 12
    places = np.bincount(teams[teams < 6], minlength=6)
    assert {learnt.row: learnt.steps for _, learnt in report.learnt} == dict(enumerate(places))
    assert places.sum() == 12 * 4 - 4 * 2


def test_a_guest_stands_on_one_side_without_a_captain():
    made = parts(*SCRIPTED_THIRD, "env.sides=3", "games_per_epoch=60")
    _, report = epoch(begin(made), made)
    lineups, sides = report.met.outcomes.lineups, np.array([guest.side for guest in report.met.teams])
    np.testing.assert_array_equal((lineups.teams >= 6).all(axis=2), np.arange(3) == sides[:, np.newaxis])
    np.testing.assert_array_equal((lineups.captains == NOBODY), np.arange(3) == sides[:, np.newaxis])
    assert set(sides) == {0, 1, 2}
    np.testing.assert_array_equal(report.met.beaten, 1 - report.met.outcomes.scores[np.arange(len(sides)), sides])


def test_scripted_teams_are_those_named():
    made = parts(*SCRIPTED_THIRD, "games_per_epoch=120")
    _, report = epoch(begin(made), made)
    assert {guest.name for guest in report.met.teams} == {"rock-rock", "rock-paper", "paper-paper"}
    # Against two rocks nobody wins who shows scissors twice; what the games say must fit the names.
    for guest, team in zip(report.met.teams, report.met.outcomes.lineups.teams, strict=True):
        assert sorted(team[guest.side] - 6) == sorted(["rock", "paper"].index(x) for x in guest.name.split("-"))


@pytest.mark.parametrize("selector", ["mcaa", "psro", "berteam"])
def test_exploiters_are_never_chosen(selector):
    small = ["selector.width=16", "selector.layers=1", "selector.heads=2", "selector.train_every=1"]
    small += ["selector.batch_size=8", "selector.minibatch_size=4"]
    made = parts(*EXPLOITERS, f"selector={selector}", *(small if selector == "berteam" else []), population=FOUR)
    run = begin(made)
    for _ in range(2):
        run, report = epoch(run, made)
        assert not OUTSIDERS & set(report.outcomes.lineups.teams.ravel())
        for guest, team in zip(report.met.teams, report.met.outcomes.lineups.teams, strict=True):
            outside = [bool(OUTSIDERS & set(side)) for side in team]
            assert outside == [side == guest.side and guest.kind == EXPLOITER for side in range(2)]
    assert [guest.kind for guest in report.met.teams] == [PAST] * 3 + [EXPLOITER] * 6
    rng = np.random.default_rng(0)
    assert not OUTSIDERS & set(measured(made.selector, run.selection, rng).teams.ravel())
    assert not OUTSIDERS & set(made.selector.sample(run.selection, 200, rng).ravel())
    assert made.selector.captains(run.selection)[list(OUTSIDERS)].sum() == 0
    assert {x.island for x in report.replaced} <= {0, 3}
    if selector == "berteam":
        alike = likeness(run, made, np.full(12, np.nan))
        assert {row[1] for row in alike["neighbours"]} == set(range(12)) - OUTSIDERS
        assert {row[4] for row in alike["neighbours"]} == set(range(12)) - OUTSIDERS
        assert [row[2] for row in alike["embeddings"] if row[1] == "all"] == [6]


def test_exploiters_have_no_cells():
    made = parts(*EXPLOITERS, "optimizer=mapelites", "optimizer.opponents=[]", "optimizer.archive=cvt", population=FOUR)
    run, _ = epoch(begin(made), made)
    islands = [island.name for island in made.optimizer.islands]
    assert [row[1] for row in archive_rows(run, made)] == [islands[0], islands[3]]


def test_exploiters_learn_and_are_neither_rated_nor_replaced():
    made = parts(*EXPLOITERS, "optimizer.replacements=12", "opponents.exploiter_score=1", population=FOUR)
    run, replaced = begin(made), []
    for _ in range(3):
        run, report = epoch(run, made)
        islands = {i for i, learnt in report.learnt if learnt.steps}
        assert {1, 2} <= islands
        replaced += report.replaced
    assert {x.island for x in replaced} == {0, 3}
    np.testing.assert_array_equal(run.population.age[3:9], 3)
    np.testing.assert_array_equal(run.population.games[3:9], 0)
    np.testing.assert_array_equal(run.population.fitness[3:9], 0)
    assert run.population.fitness.any()  # copies add to the sum, and the mean is taken of those who are rated
    assert abs(run.population.fitness.sum()) < 1e-12


def test_exploiters_are_frozen_and_begin_anew():
    words = ["opponents.exploiter_epochs=2", "opponents.exploiter_score=1", "opponents.snapshot_every=100"]
    made = parts(*EXPLOITERS, *words, "optimizer.protect_new=100", population=FOUR)
    run = begin(made)
    run, _ = epoch(run, made)
    assert [x.key for x in run.league.pool] == [(0, NOBODY)]
    run, _ = epoch(run, made)
    assert [x.key for x in run.league.pool] == [(0, NOBODY), (2, 1), (2, 2)]
    np.testing.assert_array_equal(run.population.age, [2] * 3 + [0] * 6 + [2] * 3)
    assert [(x.island, x.began, x.record) for x in run.league.attempts] == [(1, 2, (0, 0)), (2, 2, (0, 0))]
    now = policies(made.optimizer.islands, run.population, explore=True).weights
    ours, theirs = run.league.pool[1:]
    np.testing.assert_array_equal(ours.members, [3, 4, 5])
    np.testing.assert_array_equal(theirs.members, [6, 7, 8])
    assert not np.isclose(now[3:6], ours.policies.weights).all(axis=1).any()
    founders = run.league.pool[0]
    np.testing.assert_array_equal(founders.members, [0, 1, 2, 9, 10, 11])


def test_exploiters_that_found_what_they_sought_begin_anew_at_once():
    """And those that lost everything do not, whatever their estimate owes to its prior."""
    attempts = {}
    for score in ("0.01", "1"):
        words = ["opponents.exploiter_epochs=0", f"opponents.exploiter_score={score}", "opponents.exploit_share=0.5"]
        made = parts(*EXPLOITERS, *words, population=FOUR)
        run, _ = epoch(begin(made), made)
        attempts[score] = run.league.attempts
    assert {x.began for x in attempts["1"]} == {0}
    lost = [x.record.beaten / x.record.games for x in attempts["1"]]
    assert [x.began for x in attempts["0.01"]] == [int(1 - share > 0.01) for share in lost]
    assert 1.0 in lost and min(lost) < 0.99


def test_second_games_answer_games_among_the_population_alone():
    """The half that answers is of the population's games, and what was seen of guests is kept from the selector."""
    small = ["selector.width=16", "selector.layers=1", "selector.heads=2", "selector.captain=berteam"]
    words = ["selector=berteam", "selector.observations.use=previous_game", *small]
    made = parts(*words, "opponents=past", "opponents.past_share=0.34")
    run, report = epoch(begin(made), made)
    assert (len(report.outcomes.scores), len(report.met.teams), run.played) == (8, 4, 12)
    assert sum(learnt.steps for _, learnt in report.learnt) == 12 * 4 - 4 * 2
    with pytest.raises(InputError, match=r"games_per_epoch less the 3 against opponents must be even .* but is 9\."):
        parts(*words, "opponents=past", "opponents.past_share=0.25")


def test_experience_of_the_first_games():
    rows = np.arange(6)
    whole = Experience(rows.reshape(3, 2), *(rows.reshape(3, 2) for _ in range(3)), rows[:3], rows[:3] > 0)
    np.testing.assert_array_equal(whole.of_first(2, 3).members, [[0, 1], [2, 3]])
    each = Experience(rows.reshape(6, 1), *(rows.reshape(6, 1) for _ in range(3)), rows, rows > 0)
    np.testing.assert_array_equal(each.of_first(2, 3).members.ravel(), [0, 1, 2, 3])
    assert len(whole.of_first(0, 3).members) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["opponents=past", "opponents.past_share=1"], "opponents.past_share=1.0 must leave at least one game"),
        (
            [
                "opponents=league",
                "opponents.past_share=0.6",
                "opponents.scripted_share=0.4",
                "opponents.scripted=[rock]",
            ],
            "opponents.past_share=0.6, opponents.scripted_share=0.4 must leave at least one game of games_per_epoch=12",
        ),
        (["opponents=past", "opponents.past_share=0.01"], "opponents.past_share must be 0, or >= 0.0416667"),
        (["opponents=past", "opponents.pool_size=1"], "opponents.pool_size must be >= 2"),
        (["opponents=scripted", "opponents.scripted=[rok]"], r"opponents.scripted .* Did you mean rock\?"),
        (["opponents=scripted", "opponents.scripted=[]"], "opponents.scripted must name fixed policies"),
        (
            [*EXPLOITERS, "opponents.exploiters=[ppo46]"],
            r"opponents.exploiters must be one of dqn64, .* but is 'ppo46'",
        ),
        ([*EXPLOITERS, "opponents.exploiters=[ppo64,ppo96,dqn64,dqn96]"], "opponents.exploiters must leave an island"),
        ([*EXPLOITERS, "opponents.exploiters=[]"], "opponents.exploit_share needs opponents.exploiters"),
        ([*EXPLOITERS, "opponents.exploit_share=0"], "opponents.exploit_share must be > 0"),
        ([*EXPLOITERS, "selector.valid_members=[ppo96,null]"], r"selector.valid_members\[0\] must name more than"),
    ],
)
def test_what_does_not_go_together_is_refused(words, said):
    with pytest.raises(InputError, match=f"^{said}"):
        parts(*words, population=FOUR)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["opponents=past", "optimizer=fixed"], "opponents=past needs members that learn"),
        (
            [*EXPLOITERS, "opponents.exploiters=[attackers]"],
            r"opponents\.exploiters must name islands whose members",
        ),
    ],
)
def test_somebody_must_learn(words, said):
    with pytest.raises(InputError, match=f"^{said}"):
        build.parts(checked(composed("experiment=quickstart", *words)))
