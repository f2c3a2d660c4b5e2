"""Rock, paper, scissors between teams: a game of one step whose equilibria are known.

Every member of a team shows a hand to every member of the other team. The team that wins more of these duels wins the
game.
"""

from rps.game import HANDS, duels_won

__all__ = ["HANDS", "duels_won"]
