"""What users hold is frozen: the public names, what they take, and every verb with its options."""

import inspect
from operator import attrgetter
from pathlib import Path

import heavytop
from heavytop.cli import app

MADE = ("Motion", "Scene", "State", "Top")  # classes that users call; what others take is ours
MAKERS = [f"State.from_{each}" for each in ("constants", "quaternion", "rotation")]
MAKERS += ["State.kicked", "State.steady"]
MAKERS += ["Top.from_parts", "Top.from_solids"]

FROZEN = Path(__file__).with_name("public_names.txt").read_text("utf-8").splitlines()
COMMAND = "heavytop"  # with which the lines of the command and its verbs begin

CHANGED = """If that is meant, note it in CHANGELOG.md (what is gone, or takes something else,
breaks the programs of others) and freeze it:
python tests/docs/test_public_names.py > tests/docs/public_names.txt"""


def taken(function):
    """Return what a function takes, in a line: name= has a default, and * ends the places."""
    texts, kinds = [], inspect.Parameter
    for each in inspect.signature(function).parameters.values():
        if each.kind is kinds.KEYWORD_ONLY and "*" not in texts:
            texts.append("*")
        texts.append(each.name + "=" * (each.default is not kinds.empty))
    return ", ".join(texts)


def name_line(name):
    """Return a public name as it is frozen: a class that users do not make is a name alone."""
    value = attrgetter(name)(heavytop)
    return f"{name}({taken(value)})" if name in MADE or not inspect.isclass(value) else name


def verb_line(name, verb):
    """Return a verb as it is frozen: its arguments in their order, then its options by name."""
    arguments = [p.name for p in verb.params if p.param_type_name == "argument"]
    options = ["/".join(p.opts) for p in verb.params if p.param_type_name == "option"]
    return " ".join([name, *arguments, *sorted(options)])


def now():
    """Return the lines as they are now."""
    group, verbs = app, {name: app.get_command(None, name) for name in app.verbs}
    names = map(name_line, [*sorted(heavytop.__all__), *MAKERS])
    verbs = (verb_line(f"{COMMAND} {name}", verb) for name, verb in sorted(verbs.items()))
    return [*names, verb_line(COMMAND, group), *verbs]


def test_names_and_verbs_are_those_that_were_promised():
    assert now() == FROZEN, CHANGED
    assert set(heavytop.__all__) <= set(dir(heavytop))


if __name__ == "__main__":
    print(*now(), sep="\n")
