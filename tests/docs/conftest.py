"""The real command, as in tests/command."""

from tests.command.conftest import berteam  # noqa: F401
