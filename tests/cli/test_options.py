"""What an option takes is read in one place: names in a list, folders, files, changes."""

from pathlib import Path

import pytest
from typer import BadParameter

from heavytop.cli import options


def test_names_have_no_blanks_around_them():
    assert options.names("--methods", " auto ,\tstrang=50") == ("auto", "strang=50")
    assert options.names("--methods", None) is None


@pytest.mark.parametrize("text", ["", ",", "cusp, ,auto"])
def test_an_empty_name_is_the_fault_of_its_option(text):
    with pytest.raises(BadParameter, match="a name is empty") as refused:
        options.names("--cases", text)
    assert refused.value.param_hint == "--cases"


def test_an_empty_name_is_no_folder():
    assert options.named_folder("out") == Path("out")
    with pytest.raises(BadParameter, match="the name of a folder cannot be empty"):
        options.named_folder("")


def test_digits_are_a_change_of_the_scene():
    scene = options.read("sicm-kicked", ["start.phidot=-14"], 9)
    assert (scene.start.phidot, scene.digits) == (-14, 9)
    assert options.read("sicm-kicked", None).digits == 12
