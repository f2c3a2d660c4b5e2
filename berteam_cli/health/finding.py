"""What was found."""

from __future__ import annotations

from dataclasses import dataclass

OK, NOTE, PROBLEM = "ok", "note", "problem"


@dataclass(frozen=True)
class Finding:
    """One line.

    Attributes:
        status: OK; NOTE: berteam works, but not as it could; PROBLEM: it does not, or soon will not.
        subject: what was examined.
        said: what was found.
        do: what to do about it.
    """

    status: str
    subject: str
    said: str
    do: str = ""

    def __str__(self) -> str:
        """Returns the line."""
        return f"{self.status:<8} {self.subject:<9} {self.said}" + (f"; {self.do}" if self.do else "")
