"""Populations of fixed policies, in which a copy is seen by its policy."""

import numpy as np

from berteam_cli.learner.fixed import Fixed
from berteam_cli.optimizer.breeding import Breeding
from berteam_cli.optimizer.coevolution import Coevolution
from berteam_cli.optimizer.fitness import CaptainElo
from berteam_cli.optimizer.perturbing import Perturbation
from berteam_cli.population import Island, founded
from berteam_cli.workers import Workers

RULE = CaptainElo(32, 0)
COPIES = Breeding(Perturbation((1.0, 1.0, 1.0), 1.0, (), ()), 0.0, 0.0)  # children are their parents


def islands(*sizes):
    made, first = [], 0
    for k, size in enumerate(sizes):
        indices = list(range(first, first + size))
        made.append(Island(f"island{k}", first, size, Fixed(tuple(indices), tuple("abcdefghijkl"))))
        first += size
    return tuple(made)


def population(places, fitness, age=0):
    people = founded(places, 0.0, np.random.default_rng(0))
    people.fitness[:] = fitness
    people.age[:] = age
    return people


def coevolution(places, cls=Coevolution, **settings):
    usual = {"replacements": 1, "elites": 1, "protect_new": 5, "draw_protected": True, "breeding": COPIES}
    return cls(places, RULE, Workers(1), **(usual | settings))


def policies_of(places, people):
    return np.concatenate(
        [i.learner.policies(m, explore=False).fixed for i, m in zip(places, people.minds, strict=True)]
    )
