"""What stands in the documents: blocks of code, and command lines."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
SHELL = ("", "sh", "bash")


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

    @property
    def file(self):
        """The path that one of its first two lines names, in a comment; None where none does."""
        named = [re.fullmatch(r"# ([\w./]+\.(?:py|yaml))", line) for line in self.lines[:2]]
        return next((x[1] for x in named if x), None)

    @property
    def commands(self):
        """Its lines that begin with berteam or make."""
        return called(self.lines) if self.language in SHELL else []


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


def inline_commands(page):
    """Returns the command lines that stand in the sentences of ``page``."""
    sentences = re.sub(r"^\s*```.*?^\s*```", "", page.read_text(), flags=re.S | re.M)
    return called(re.findall(r"(?<!`)`([^`\n]+(?:\n[^`\n]+)?)`(?!`)", sentences))


def called(lines):
    """Returns those of ``lines`` that begin with berteam or make, without comments."""
    plain = [" ".join(re.sub(r"\s+#.*", "", line).split()).removeprefix("$ ") for line in lines]
    return [line for line in plain if re.match(r"(berteam|make)( |$)", line)]
