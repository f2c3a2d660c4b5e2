"""Which code the words of a command trust."""

import pytest

from berteam_cli.errors import InputError
from berteam_cli.trust import told


@pytest.mark.parametrize(
    "words",
    [
        ["trust=soccer:parallel_env", "games=8", "trust=pay:mine"],
        ["games=8", "trust=[soccer:parallel_env,pay:mine]"],
        ["trust=[soccer:parallel_env, pay:mine]", "games=8"],
    ],
)
def test_several_are_named_one_by_one_or_in_a_list(words):
    assert told(words) == (("soccer:parallel_env", "pay:mine"), ["games=8"])


def test_none_is_named():
    assert told(["games=8", "trusting=x:y"]) == ((), ["games=8", "trusting=x:y"])


@pytest.mark.parametrize("value", ["soccer", "[]", "[soccer:parallel_env,pay]", "true"])
def test_what_is_no_import_path_is_refused(value):
    with pytest.raises(InputError, match="trust must be module:function, or a list of such"):
        told([f"trust={value}"])
