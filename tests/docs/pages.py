"""What stands in the documents: blocks of code, and command lines."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        language: what stands behind the fence.
        section: the last heading of the second level before it.
        lines: of the block.
    """

    language: str
    section: str
    lines: tuple[str, ...]

    @property
    def text(self):
        return "\n".join(self.lines) + "\n"


def blocks(page):
    """Returns the fenced blocks of ``page``, a path."""
    found, section, inside = [], "", None
    for line in page.read_text().splitlines():
        fence = re.match(r"\s*```(\w*)", line)
        if inside is None and fence:
            inside = (fence[1], [])
        elif inside is not None and fence:
            found.append(Block(inside[0], section, tuple(inside[1])))
            inside = None
        elif inside is not None:
            inside[1].append(line)
        elif line.startswith("## "):
            section = line[3:]
    assert inside is None, f"{page}: a block has no end"
    return found


def outside_blocks(page):
    """Returns the text of ``page`` without its fenced blocks."""
    return re.sub(r"^\s*```.*?^\s*```", "", page.read_text(), flags=re.S | re.M)


def command_lines(page):
    """Returns the command lines of ``page`` in order, those in blocks first: whatever begins with berteam or make."""
    shown = [line for block in blocks(page) if block.language in ("", "sh", "bash") for line in block.lines]
    shown += re.findall(r"`([^`]+)`", outside_blocks(page))
    lines = [re.sub(r"\s+#.*", "", line).strip().removeprefix("$ ") for line in shown]
    return [line for line in lines if re.match(r"(berteam|make)( |$)", line)]
