"""Maximum likelihood of another library beside ours."""

import choix
import numpy as np

from berteam_cli.rating.bradley_terry import ratings
from berteam_cli.rating.elo import points


def test_choix_finds_the_same_elos():
    rng = np.random.default_rng(0)
    wins = rng.integers(200, 500, (6, 6))
    np.fill_diagonal(wins, 0)
    games = (wins + wins.T).astype(float)
    listed = [(i, j) for i in range(6) for j in range(6) for _ in range(wins[i, j])]
    theirs = choix.opt_pairwise(6, listed, alpha=0.0)
    # The prior, a quarter of a drawn game beside some 3,000, moves nobody by a tenth of a point.
    np.testing.assert_allclose(ratings(wins.astype(float), games)[0], points(theirs - theirs.mean()), atol=0.1)
