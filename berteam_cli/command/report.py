"""berteam report: one or several runs as a page that needs no network, with a picture of each plot beside it."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

from berteam_cli.config_commands import ReportConfig
from berteam_cli.errors import InputError
from berteam_cli.folder import new_folder, write_whole
from berteam_cli.quiet import written
from berteam_cli.report import archive, chosen, course, members, opponents, overview, page, strength, watched
from berteam_cli.report.drawing import Plot, check_matplotlib, styled
from berteam_cli.report.film import best_game
from berteam_cli.report.page import Report, Section
from berteam_cli.report.source import Source
from berteam_cli.terminal import end
from berteam_cli.trust import trusted

PAGE = "report.html"
PLOTS = (
    *(strength.elos, chosen.teams, strength.against_probability, chosen.captains, chosen.islands, members.fitness),
    *(members.aggression, archive.cells, members.embeddings, strength.crosstable, watched.elos, watched.results),
    *(opponents.past, course.learning, course.selecting, course.timing),
)


def report(config: ReportConfig, _: str, out: Path | None) -> float:
    """Writes the page of ``config.runs``; returns NaN, having no figure to tell.

    Args:
        config: checked.
        out: folder to write into; None has it in the run's, or under outputs/ for several.

    Raises:
        InputError: matplotlib is missing, a folder is no run, a table cannot be read or the page is there already.
    """
    sources = read(config)
    folder = out or place(sources)
    if (folder / PAGE).exists() and config.on_exists != "overwrite":
        raise InputError(f"{folder / PAGE} exists already; name another folder with out=DIR, or on_exists=overwrite.")
    several = len(sources) > 1
    with styled():
        sections = [section(f"run{k}", source, config.seed) for k, source in enumerate(sources, start=1)]
    tables = {} if config.compare is None else overview.compared(Path(config.compare))
    rows = [overview.row_of(source) for source in sources] if several else []
    title = f"{len(sources)} runs" if several else f"Run {sources[0].folder}"
    text = page.html(Report(title, sections, rows, tables))
    for x in sections:
        for plot in x.plots:
            picture = folder / (f"{x.key}_{plot.name}.png" if several else f"{plot.name}.png")
            if plot.png:
                write_whole(picture, partial(Path.write_bytes, data=plot.png))
            else:
                picture.unlink(missing_ok=True)  # of an earlier report
    write_whole(folder / PAGE, lambda part: part.write_text(text, encoding="utf-8"))
    written(folder)
    end(folder, sorted([PAGE, *(path.name for path in folder.glob("*.png"))]), f"open {folder / PAGE} in a browser")
    return math.nan


def read(config: ReportConfig) -> list[Source]:
    """Returns the runs.

    Raises:
        InputError: matplotlib is missing, a folder is no run, or ``config.compare`` is no comparison.
    """
    check_matplotlib()
    folders = [Path(run) for run in config.runs]
    if not folders:
        raise InputError("berteam report needs the folder of a run, such as berteam report outputs/train/DATE.")
    twice = sorted({str(x) for x in folders if sum(x.resolve() == y.resolve() for y in folders) > 1})
    if twice:
        raise InputError(f"The run {twice[0]} is named twice.")
    if config.compare is not None and not overview.is_comparison(Path(config.compare)):
        raise InputError(f"compare={config.compare} is no folder that berteam compare wrote: it has no comparison.csv.")
    trust = trusted(config.trust)
    return [Source.of(folder, trust) for folder in folders]


def place(sources: list[Source]) -> Path:
    """Returns where the page goes if nothing else is said."""
    return sources[0].folder / "report" if len(sources) == 1 else new_folder("report")


def section(key: str, source: Source, seed: int) -> Section:
    """Returns what the page says of a run."""
    plots: list[Plot] = [made for plot in PLOTS if (made := plot(source)) is not None]
    return Section(key, source, overview.headline(source), plots, best_game(source, seed), overview.evaluated(source))
