"""Rock, paper, scissors between teams: a game of one step whose equilibria are known.

Every member of a team shows a hand. A hand is beaten if anybody of another team shows the one that beats it, and the
team with fewest beaten hands wins; where several have fewest, it is a draw between them and the others have lost.

Between two teams of one member that is the usual game: its equilibrium shows every hand with the same chance. With two,
a pair of different hands beats two of the three pairs of equal hands and loses to one: the only equilibrium shows each
of the three pairs of different hands with the same chance, and never two equal hands.
"""

from rps.game import HANDS, hands_beaten

__all__ = ["HANDS", "hands_beaten"]
