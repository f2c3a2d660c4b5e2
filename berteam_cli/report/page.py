"""The page: everything in one file, which asks for nothing from anywhere."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files

import pandas as pd

from berteam_cli.report.drawing import DARK, LIGHT, SERIES, SERIES_DARK, Plot
from berteam_cli.report.film import Replay
from berteam_cli.report.overview import written
from berteam_cli.report.source import Source


@dataclass(frozen=True)
class Section:
    """What the page says of a run.

    Attributes:
        key: within the page.
        source: the run.
        figures: that sum it up, by name.
        plots: in the order of the page.
        replay: a game.
        tables: of its evaluation, by what stands above them.
    """

    key: str
    source: Source
    figures: dict[str, str]
    plots: list[Plot]
    replay: Replay
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)


@dataclass(frozen=True)
class Report:
    """What is on the page.

    Attributes:
        title: of the page.
        sections: one a run.
        rows: the runs side by side; empty with one run.
        comparisons: tables of comparisons by what stands above them.
    """

    title: str
    sections: list[Section]
    rows: list[dict[str, str]] = field(default_factory=list)
    comparisons: dict[str, pd.DataFrame] = field(default_factory=dict)


def html(report: Report) -> str:
    """Returns the page. All text in it that comes from folders and configs is escaped."""
    body = "".join(
        (
            overview(report.rows),
            *(compared(k, said, table) for k, (said, table) in enumerate(report.comparisons.items())),
            *(of_run(section, several=len(report.sections) > 1) for section in report.sections),
        )
    )
    parts = {"STYLE": style(), "TITLE": escape(report.title), "NAV": navigation(report), "BODY": body}
    page = files("berteam_cli.report").joinpath("page.html").read_text(encoding="utf-8")
    pieces = []
    for place, content in parts.items():
        before, page = page.split(f"<!--{place}-->", 1)
        pieces += [before, content]
    return "".join([*pieces, page])


def style() -> str:
    """Returns the style sheet with the colours of both palettes."""
    sheet = files("berteam_cli.report").joinpath("page.css").read_text(encoding="utf-8")
    light = {**LIGHT, **{f"s{k}": color for k, color in enumerate(SERIES)}}
    dark = {**DARK, **{f"s{k}": color for k, color in enumerate(SERIES_DARK)}}
    for place, colors in (("LIGHT", light), ("DARK", dark)):
        sheet = sheet.replace(f"/*{place}*/", " ".join(f"--{name}: {color};" for name, color in colors.items()))
    return sheet


def navigation(report: Report) -> str:
    """Returns links to the parts of the page."""
    links = [("overview", "Runs")] if report.rows else []
    links += [(f"compared-{k}", said) for k, said in enumerate(report.comparisons)]
    for section in report.sections:
        if len(report.sections) > 1:
            links.append((section.key, section.source.folder.name))
            continue
        links += [(f"{section.key}-{plot.name}", plot.title) for plot in section.plots]
        links += [(f"{section.key}-tables", "Tables of the evaluation")] if section.tables else []
        links += [(f"{section.key}-replay", section.replay.title), (f"{section.key}-config", "Config and manifest")]
    return "".join(f'<li><a href="#{escape(key)}">{escape(said)}</a></li>' for key, said in links)


def overview(rows: list[dict[str, str]]) -> str:
    """Returns the runs side by side."""
    if not rows:
        return ""
    return f'<section id="overview"><h2>Runs</h2>{table(list(rows[0]), [list(row.values()) for row in rows])}</section>'


def compared(k: int, said: str, frame: pd.DataFrame) -> str:
    """Returns a table of a comparison."""
    return f'<section id="compared-{k}"><h2>{escape(said)}</h2>{framed(frame)}</section>'


def framed(frame: pd.DataFrame) -> str:
    """Returns a table of a run or of a comparison."""
    rows = [[written(value) for value in row] for row in frame.itertuples(index=False)]
    return table([str(column).replace("_", " ") for column in frame.columns], rows)


def table(columns: list[str], rows: list[list[str]]) -> str:
    """Returns a table, which scrolls by itself where it is wider than the page."""
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="Table"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def of_run(section: Section, *, several: bool) -> str:
    """Returns the part of the page about a run."""
    source, key = section.source, escape(section.key)
    remark = f'<p class="remark" role="note">{spoken(source.remark)}</p>' if source.remark else ""
    figures = "".join(f"<div><dt>{escape(x)}</dt><dd>{escape(y)}</dd></div>" for x, y in section.figures.items())
    heading = f"<h2>{escape(str(source.folder))}</h2>" if several else "<h2>In short</h2>"
    command = " ".join(map(str, source.manifest["command"]))
    made = f"<p>Made by <code>{escape(command)}</code>, started {escape(str(source.manifest['started']))}.</p>"
    plots = "".join(plotted(section.key, plot) for plot in section.plots if plot.svg)
    tables = "".join(f"<h3>{escape(said)}</h3>{framed(frame)}" for said, frame in section.tables.items())
    facts = escape(json.dumps(source.manifest, indent=1, ensure_ascii=False))
    config = escape(source.config or "There is no config.yaml in the folder.")
    return (
        f'<section id="{key}">{heading}{remark}<dl class="figures">{figures}</dl>{made}'
        f'<div class="plots">{plots}</div><div id="{key}-tables">{tables}</div>{watched(section)}{absent(section)}'
        f'<div id="{key}-config"><h3>Config and manifest</h3>'
        f"<details><summary>config.yaml: every value of the run</summary><pre>{config}</pre></details>"
        f"<details><summary>manifest.json: versions, seed, times</summary><pre>{facts}</pre></details></div></section>"
    )


def plotted(key: str, plot: Plot) -> str:
    """Returns a plot with its heading and what it says."""
    name, title, says = escape(f"{key}-{plot.name}"), escape(plot.title), spoken(plot.says)
    drawing = plot.svg.replace("<svg ", f'<svg role="img" aria-label="{escape(plot.alt)}" ', 1)
    for mark in ("url(#", 'href="#', ' id="'):  # the same plot of another run is on the page too
        drawing = drawing.replace(f"{mark}{plot.name}-", f"{mark}{name}-")
    return (
        f'<figure class="plot" id="{name}"><h3>{title}</h3>'
        f'<div class="wide" tabindex="0" role="group" aria-label="{title}">{drawing}</div>'
        f"<figcaption>{says}</figcaption></figure>"
    )


def absent(section: Section) -> str:
    """Returns what could not be drawn, and which command helps."""
    missing = [plot for plot in section.plots if not plot.svg]
    told = ((escape(f"{section.key}-{x.name}"), escape(x.title), spoken(x.says)) for x in missing)
    items = "".join(f'<li id="{name}"><strong>{title}</strong>: {says}</li>' for name, title, says in told)
    return f'<div class="absent"><h3>What is not here</h3><ul>{items}</ul></div>' if missing else ""


def watched(section: Section) -> str:
    """Returns the replay, in a frame of its own so that its script is alone."""
    replay, key = section.replay, escape(f"{section.key}-replay")
    heading = f'<div id="{key}" class="replay"><h3>{escape(replay.title)}</h3><p>{spoken(replay.says)}</p>'
    if not replay.page:
        return f"{heading}</div>"
    return (
        f'{heading}<iframe sandbox="allow-scripts" title="{escape(replay.title)}" srcdoc="{escape(replay.page)}">'
        f'</iframe><p class="hint">Tab leads into the game, Space plays and pauses it.</p>'
        f'<p class="printed">The game is not on paper: open the page in a browser to play it.</p></div>'
    )


def spoken(text: str) -> str:
    """Returns escaped text in which what stands between ` is shown as a command."""
    parts = escape(text).split("`")
    return "".join(f"<code>{part}</code>" if k % 2 and k < len(parts) - 1 else part for k, part in enumerate(parts))
