"""Compares what levers do with the setting as it is: python docs/results/levers.py FOLDER ...

The first FOLDER is of a sweep that has the setting as it is, as of control.yaml or small.yaml; it and the others have a
lever in each other variant, as of ablations.yaml. Prints the mean difference of each variant to the setting as it is,
with intervals that hold for all variants at once with 95 % (Dunnett's test, which takes the spread over seeds for the
same everywhere).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import dunnett
from tables import AS_IT_IS, SHARES, markdown, variants

COMPARED = ("expected Elo", "won", "lost", "own games decided")


def differences(control: pd.DataFrame, found: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Returns a row a variant: differences to the control, in bold where they are beyond chance."""
    whole = {variant: figures for variant, figures in found.items() if len(figures) > 1}
    table = pd.DataFrame({"variant": [f"`{variant}`" for variant in whole]})
    table["seeds"] = [str(len(figures)) for figures in whole.values()]
    for figure in COMPARED:
        against = control[figure].to_numpy()
        samples = [figures[figure].to_numpy() for figures in whole.values()]
        # SciPy simulates its quantiles, to a percent or so; seeded, so that a table is repeated to the digit.
        tested = dunnett(*samples, control=against, random_state=np.random.default_rng(0))
        low, high = tested.confidence_interval()
        digits = 2 if figure in SHARES else 0
        said = [
            f"{x.mean() - against.mean():+.{digits}f} ± {half:.{digits}f}"
            for x, half in zip(samples, (high - low) / 2, strict=True)
        ]
        beyond = (low > 0) | (high < 0)
        table[figure] = [f"**{words}**" if sure else words for words, sure in zip(said, beyond, strict=True)]
    return table


if __name__ == "__main__":
    folders = [variants(Path(name)) for name in sys.argv[1:]]
    found = {variant: figures for folder in folders for variant, figures in folder.items() if variant != AS_IT_IS}
    print(markdown(differences(folders[0][AS_IT_IS], found)))
