"""Chooses which learning agents should play together in adversarial team games.

training.py      the loop of the paper's Algorithm 1
selector/        who plays together: berteam, mcaa, psro, assessor, best_team, best_members, uniform
optimizer/       who stays in the population: coevolution, mapelites, fixed
learner/         how a member learns from its own steps: ppo, dqn, sb3; fixed and imported do not
env/             the games: mctf, rps
rating/          Elo
evaluation/      tournaments and the true strength of teams
"""

__version__ = "0.8.2"
