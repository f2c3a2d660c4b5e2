"""How plots look: one drawing gives a picture with the light colours and a vector graphic that follows the page's."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from berteam_cli.errors import InputError
from berteam_cli.outcomes import Floats, Ints

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LIGHT = {"ink": "#26323c", "pale": "#5d6a75", "edge": "#d3dbe2", "card": "#fefeff", "rest": "#c3ccd4"}
"""Colours of text, of what stands back, of lines, of the ground and of what is not told apart."""
DARK = {"ink": "#e4eaef", "pale": "#a3b0ba", "edge": "#35414b", "card": "#1a2229", "rest": "#4a5762"}
SERIES = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#f0e442", "#8c510a", "#5e4fa2", "#1b7837")
"""Okabe and Ito's colours without black, which those with any colour vision tell apart, and three more."""
SERIES_DARK = (
    *("#3d9bdc", "#f0b429", "#22b98c", "#ef7a35", "#7cc9f5", "#dc96bf", "#efe66a", "#b8823f", "#9a8de0", "#5fb878"),
)
THEMED = {LIGHT[name]: f"var(--{name})" for name in LIGHT} | {color: f"var(--s{k})" for k, color in enumerate(SERIES)}
WIDTH_IN, HEIGHT_IN, DPI = 6.6, 3.7, 170
POINTS = 400
"""A curve has no more: as many as its plot has pixels to show."""
LONGEST = 30


@dataclass(frozen=True)
class Plot:
    """A plot of the page.

    Attributes:
        name: of its file, and within the page.
        title: above it.
        says: what it shows and what not to conclude.
        alt: the same for who does not see it, in a sentence.
        svg, png: the drawing; both empty where it could not be drawn, which ``says`` explains.
    """

    name: str
    title: str
    says: str
    alt: str = ""
    svg: str = ""
    png: bytes = b""


def check_matplotlib() -> None:
    """Checks that plots can be drawn.

    Raises:
        InputError: matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise InputError("berteam report needs matplotlib, which is not installed: pip install 'berteam-cli[report]'.")


@contextmanager
def styled() -> Iterator[None]:
    """Sets how everything drawn inside looks."""
    import matplotlib as mpl  # noqa: PLC0415 (an extra)

    pale, edge, ink = LIGHT["pale"], LIGHT["edge"], LIGHT["ink"]
    style: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": "berteam",
        "text.parse_math": False,
        "font.size": 9,
        "axes.titlesize": 9,
        "axes.titleweight": "regular",
        "axes.titlelocation": "left",
        "axes.edgecolor": edge,
        "axes.labelcolor": pale,
        "axes.titlecolor": ink,
        "axes.facecolor": "none",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": edge,
        "grid.linewidth": 0.5,
        "xtick.color": edge,
        "ytick.color": edge,
        "xtick.labelcolor": pale,
        "ytick.labelcolor": pale,
        "text.color": ink,
        "figure.facecolor": LIGHT["card"],
        "legend.frameon": False,
        "legend.fontsize": 8,
        "path.simplify": True,
        "path.simplify_threshold": 0.3,
    }
    with mpl.rc_context(style), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # the browser's fonts draw the text
        yield


def panels(rows: int = 1, height_in: float = HEIGHT_IN) -> tuple[Figure, list[Axes]]:
    """Returns an empty figure of ``rows`` plots below each other that share their horizontal axis."""
    from matplotlib.figure import Figure as Blank  # noqa: PLC0415 (an extra; no window system is asked for)

    figure = Blank(figsize=(WIDTH_IN, height_in), layout="constrained")
    return figure, list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])


def over_epochs(plot: Axes) -> None:
    """Makes the horizontal axis of a plot that of epochs, which are whole numbers."""
    plot.set_xlabel("epoch")
    ticks: Any = plot.xaxis.get_major_locator()  # matplotlib's own, which takes this
    ticks.set_params(integer=True)


def drawn(figure: Figure, name: str, title: str, says: str, alt: str) -> Plot:
    """Returns ``figure`` as a plot of the page."""
    vector, picture = io.StringIO(), io.BytesIO()
    figure.savefig(vector, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    figure.savefig(picture, format="png", dpi=DPI, metadata={"Software": None})
    return Plot(name, title, says, alt, inlined(vector.getvalue(), name), picture.getvalue())


def inlined(svg: str, name: str) -> str:
    """Returns a vector graphic as a page takes it: in the page's colours, with identifiers that no other plot has."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", svg)
    svg = re.sub(r'(<svg [^>]*?)width="[^"]*pt"', r"\1", re.sub(r'(<svg [^>]*?)height="[^"]*pt" ?', r"\1", svg))
    used = set(re.findall(r'(?:url\(#|href="#)([^)"]+)', svg))
    svg = re.sub(r'\sid="([^"]*)"', lambda found: f' id="{name}-{found[1]}"' if found[1] in used else "", svg)
    svg = re.sub(r'(url\(#|href="#)', rf"\g<1>{name}-", svg)
    svg = re.sub(r"((?:fill|stroke|stop-color): )(#\w{6})", lambda x: x[1] + THEMED.get(x[2], x[2]), svg)
    return re.sub(r"\n\s*", "\n", svg).strip()


def short(text: str, most: int = LONGEST) -> str:
    """Returns ``text`` in one line, cut where it is longer than ``most`` characters."""
    line = " ".join(str(text).split())
    return line if len(line) <= most else f"{line[: most - 1]}…"


def kept(count: int, most: int = POINTS) -> Ints:
    """Returns which of ``count`` points in order to draw: all, or ``most`` evenly spread ones, the ends among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def binned(x: Floats, values: Floats, most: int = POINTS) -> tuple[Floats, Floats]:
    """Returns the means of neighbouring points, at most ``most`` of them; NaN counts for nothing.

    Args:
        x: (L,) where the points are, in order.
        values: (L, C) curves.
        most: points to return.

    Returns:
        (K,) means of x and (K, C) means of the values, NaN where a bin has none.
    """
    size = -(-len(x) // most)
    starts = np.arange(0, len(x), size)
    known = np.isfinite(values)
    count = np.add.reduceat(known, starts, axis=0, dtype=float)
    total = np.add.reduceat(np.where(known, values, 0.0), starts, axis=0)
    with np.errstate(invalid="ignore"):
        means = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
    return np.add.reduceat(x.astype(float), starts) / np.diff([*starts, len(x)]), means


def pooled(epochs: int) -> str:
    """Returns what is said where curves of ``epochs`` points were pooled, nothing where they were not."""
    size = -(-epochs // POINTS)
    return "" if size == 1 else f" Each point is the mean of up to {size} neighbouring ones."
