import warnings

import pytest

from berteam_cli.report.course import timing
from berteam_cli.report.drawing import styled
from berteam_cli.report.source import Source
from tests.long_run import long_run


@pytest.mark.parametrize("epochs", [1, 3])
def test_the_seconds_of_one_epoch_are_bars_and_need_no_legend(tmp_path, epochs):
    long_run(tmp_path / "run", epochs, every=1)
    with warnings.catch_warnings(), styled():
        warnings.simplefilter("error")
        plot = timing(Source.of(tmp_path / "run"))
    assert plot.alt.startswith("Seconds an epoch by part")
