"""What is seen of a run while it trains, worked by hand where nothing is left to chance."""

import io
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from rich.console import Console

from berteam_cli import build
from berteam_cli.acting import fixed_policies
from berteam_cli.config import checked
from berteam_cli.env.rps import Rps
from berteam_cli.errors import InputError
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.sight import ALL, BEST_MEMBER, BEST_TEAM, CHOICE, Line, Sight
from berteam_cli.evaluation.truth import fixture
from berteam_cli.evaluation.watching import Played, Watching, best_member, halves, sight
from berteam_cli.games import Games, arrangements
from berteam_cli.learner.fixed import Fixed
from berteam_cli.live import View
from berteam_cli.pace import Pace
from berteam_cli.population import Island
from berteam_cli.rating.bradley_terry import held_ratings
from berteam_cli.selector.base import TeamDistribution, unordered_teams
from berteam_cli.training import begin
from berteam_cli.workers import Workers
from tests.test_config import composed

ROCK, PAPER, SCISSORS = range(3)


def played(teams, elos, sides=2):
    """Games of teams of hands against all teams of hands, in every way to hold the sides."""
    teams = np.array(teams)
    games = Games(Rps(team_size=teams.shape[1], sides=sides), Workers(1))
    reference = Reference(unordered_teams(3, teams.shape[1]), np.array(elos, dtype=float), "")
    rng = np.random.default_rng(0)
    matches = fixture(games, fixed_policies(range(3)), teams, reference, len(arrangements(sides)), rng)
    outcomes, _ = games.play(matches.acting, matches.lineups, 1)
    return Played(games.env, teams, reference, matches, outcomes)


def shown(lines, who):
    return {line.opponent: tuple(line.results) for line in lines if line.who == who}


def test_hands_against_hands():
    seen = sight(3, played([[ROCK, ROCK], [PAPER, SCISSORS], [ROCK, ROCK]], [1000] * 6))
    won, drawn, lost = (2, 0, 0), (0, 2, 0), (0, 0, 2)
    rocks = {
        "rock + rock": drawn,
        "rock + paper": lost,  # whose paper beats both
        "rock + scissors": won,  # both beat its scissors
        "paper + paper": lost,
        "paper + scissors": lost,  # one of its hands is beaten, two of ours
        "scissors + scissors": won,
    }
    assert shown(seen.lines, BEST_MEMBER) == {**rocks, ALL: (4, 2, 6)}
    # Paper and scissors: one is beaten and two beat against rocks, both sides as many against rock + paper.
    both = {
        "rock + rock": won,
        "rock + paper": won,
        "rock + scissors": lost,
        "paper + paper": won,
        "paper + scissors": drawn,
        "scissors + scissors": lost,
    }
    added = {name: tuple(np.add(rocks[name], both[name])) for name in rocks}
    assert shown(seen.lines, CHOICE) == {**added, ALL: tuple(np.sum(list(added.values()), axis=0))}
    assert [line.members for line in seen.lines if line.who == BEST_MEMBER] == ["0-0"] * 7
    assert [line.members for line in seen.lines if line.who == CHOICE] == [*[""] * 6, "0-0 1-2"]
    assert seen.of(CHOICE).means.tolist() == [0, 0, 0, 0, 0, 0, 0, 1]
    rows = list(seen.rows())
    assert {row[0] for row in rows} == {3}
    assert len({len(row) for row in rows}) == 1


def test_the_choice_is_the_mean_of_its_teams():
    elos = [1100.0, 1000.0, 900.0]
    seen = sight(0, played([[ROCK], [PAPER], [PAPER], [SCISSORS]], elos))
    points = np.array([[1.0, 0, 2], [2, 1, 0], [0, 2, 1]])  # of each hand against rock, paper and scissors
    rated, widths = held_ratings(points, np.full((3, 3), 2.0), np.array(elos))
    assert seen.of(CHOICE).elo == pytest.approx(rated[[ROCK, PAPER, PAPER]].mean())
    assert seen.of(BEST_MEMBER).elo == pytest.approx(rated[SCISSORS])
    # The same hands from the other side are another line-up, and no copy.
    assert seen.of(BEST_MEMBER).half_width == pytest.approx(widths[SCISSORS])


def test_copies_of_one_team_leave_as_much_open_as_the_team_alone():
    seen = sight(0, played([[ROCK]] * 9, [1000.0, 1000, 1000]))
    assert seen.of(CHOICE).elo == pytest.approx(seen.of(BEST_MEMBER).elo)
    # But for the prior, a quarter of a game, which weighs less beside more games.
    assert seen.of(CHOICE).half_width == pytest.approx(seen.of(BEST_MEMBER).half_width, rel=0.03)


def test_of_one_drawn_team_nobody_knows_how_teams_scatter():
    seen = sight(0, played([[ROCK], [PAPER]], [1000.0, 1000, 1000]))
    assert np.isfinite(seen.of(CHOICE).elo)
    assert np.isnan(seen.of(CHOICE).half_width)
    assert "±" not in seen.spoken()


def test_the_best_team_is_not_the_luckiest():
    """The first wins where it is chosen, and loses where it is rated; the others always draw."""
    games = played([[ROCK, PAPER], [PAPER, PAPER], [ROCK, ROCK]], [1000] * 6)
    scores = np.full((3, 6, 2, 2), 0.5)
    held = games.fixture.held.reshape(3, 6, 2, 2)
    first = np.where(halves(6, 2)[:, :, np.newaxis], held[0], ~held[0])
    scores[0] = first
    lucky = replace(games, outcomes=replace(games.outcomes, scores=scores.reshape(-1, 2)))
    seen = sight(0, lucky).of(BEST_TEAM)
    assert seen.members == "0-1"
    assert tuple(seen.results) == (0, 0, 6)
    assert seen.elo < 800


@pytest.mark.parametrize(("opponents", "sides"), list(product([1, 2, 3, 28], [2, 3, 5])))
def test_halves_are_alike(opponents, sides):
    each = len(arrangements(sides))
    half = halves(opponents, each)
    assert (half.sum(axis=1) == each // 2).all()
    if opponents % 2 == 0:
        assert len(set(half.sum(axis=0))) == 1  # every way to hold the sides as often


def test_among_three_sides_a_team_stands_alone_and_with_copies():
    seen = sight(0, played([[ROCK], [PAPER], [PAPER]], [1000.0, 1000, 1000], sides=3))
    # Paper loses to scissors alone or in a crowd, beats rock, and draws against itself: 3 of 6 ways each.
    results = {"rock": (6, 0, 0), "paper": (0, 6, 0), "scissors": (0, 0, 6), ALL: (6, 6, 6)}
    assert shown(seen.lines, BEST_MEMBER) == results
    assert seen.of(BEST_MEMBER).elo == pytest.approx(1000)


@pytest.fixture(scope="module")
def parts():
    return build.parts(checked(composed("env=rps", "population=ppo6", "selector=mcaa")))


def test_the_best_member_is_the_fittest_that_learns(parts):
    (island,) = parts.optimizer.islands
    hands = Island("hands", 0, 3, Fixed((0, 1, 2), Rps(2).fixed_policies))
    mixed = replace(parts.optimizer, islands=(hands, replace(island, first=3)))
    people = begin(parts).population
    fitness, games = np.full(9, 0.5), np.zeros(9, dtype=int)
    fitness[[1, 7]] = 0.9, 0.7
    assert best_member(mixed, replace(people, fitness=fitness, games=games)) == 7
    fixed = replace(parts.optimizer, islands=(hands,))
    assert best_member(fixed, replace(people, fitness=fitness[:3], games=games[:3])) == 1
    # A moving average begins at 0.5, which who never played keeps: whoever played and kept it goes before.
    fitness[7], games[5] = 0.4, 3
    assert best_member(mixed, replace(people, fitness=fitness, games=games)) == 5


def test_the_best_member_is_none_whom_nobody_can_choose(parts):
    (island,) = parts.optimizer.islands
    both = (replace(island, size=3), replace(island, name="exploiters", first=3, size=3, exploits=True))
    fitness = np.array([0.2, 0.5, 0.1, 0.4, 0.9, 0.3])
    people = replace(begin(parts).population, fitness=fitness)
    assert best_member(replace(parts.optimizer, islands=both), people) == 1


def test_a_look_is_the_same_whoever_takes_it_and_changes_nothing(parts):
    run, learner = begin(parts), parts.optimizer.islands[0].learner
    before = {name: x.clone() for name, x in learner.tensors(run.population.minds[0]).items()}
    reference = Reference(unordered_teams(3, 2), np.full(6, 1000.0), "")
    looks = [Watching(parts, every, 4, reference).look(run) for every in (1, 5)]
    assert list(map(str, looks[0].rows())) == list(map(str, looks[1].rows()))
    assert looks[0].of(CHOICE).results.sum() == 4 * 6 * 2
    other = Watching(parts, 1, 4, reference).look(replace(run, epoch=1))
    assert other.of(CHOICE).members != looks[0].of(CHOICE).members
    after = learner.tensors(run.population.minds[0])
    assert all((before[name] == after[name]).all() for name in before)


def test_who_has_no_fixed_policies_cannot_be_looked_at():
    alone = Rps(team_size=2, fixed_policies=(), standard_policies=0)
    build.check_watched(0, alone)
    build.check_watched(10, Rps(team_size=2))
    with pytest.raises(InputError, match=r"^evaluate_every must be 0 with env=rps, .* but is 10\.$"):
        build.check_watched(10, alone)


def test_effective_teams_are_shown_where_all_teams_are_listed(parts):
    view, teams, chances = View(parts, 40, Pace(0, 40), begin(parts)), np.array([[0, 1], [2, 2]]), np.array([0.5, 0.5])
    view.tell(begin(parts), 0, TeamDistribution(teams, chances))
    assert view.figures()["effective teams"] == "2.0 (epoch 0)"
    view.tell(begin(parts), 0, TeamDistribution(teams, chances / 2, 0.5, 1000, chances))
    assert view.figures()["effective teams"] == "-"
    assert view.figures()["favourite team"] == "0-1 (0.250)"


@pytest.mark.parametrize("columns", [40, 140])
def test_on_a_terminal(parts, columns):
    view = View(parts, 40, Pace(0, 40), begin(parts))
    choice = Line(CHOICE, ALL, np.array([12, 60, 28]), np.zeros(8), "0-1", 947.4, 30.6)
    best = Line(BEST_TEAM, ALL, np.array([1, 1, 1]), np.zeros(8), "0-1", 1010.2, 99.0)
    said = "against the fixed teams: expected Elo 947 ±31, best 1,010, 12 % won 60 % drawn (epoch 20)"

    def drawn():
        out = io.StringIO()
        Console(file=out, width=columns).print(view)
        return " ".join(out.getvalue().split())

    assert "against" not in drawn()
    view.tell(begin(parts), 0, None, Sight(20, [choice, best]))
    view.tell(begin(parts), 0, None)  # the next epoch, without a look
    assert drawn().endswith(said)
