"""The command line explains itself: descriptions, options, values, completion."""

import os
import subprocess
import sys
from typing import get_args

import pytest
import typer

from restore import Settings
from station.choices import FLAGS, Method, Shading
from station.cli import COMMANDS, app, main
from station.commands.options import Kinds

ROOT = typer.main.get_command(app)
SESSION = ROOT.commands["session"]
NAMED = {**ROOT.commands, **{f"session {name}": command for name, command in SESSION.commands.items()}}
REPORTING = [
    *("scan", "demo", "restore", "photos", "merge", "ocr", "colour", "verify", "repair", "reproduce", "reindex"),
    *("export", "batch", "watch", "query", "devices", "doctor", "trace", "calibrate", "session list", "session show"),
]
COLUMNS = 80


def help_of(words, capsys):
    assert main([*words.split(), "--help"]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("words", ["", *NAMED])
def test_help_fits_a_terminal_and_nothing_is_cut(words, capsys):
    lines = help_of(words, capsys).splitlines()
    assert max(map(len, lines)) <= COLUMNS
    assert not [line for line in lines if line.endswith("...") and not line.startswith("Usage:")]


@pytest.mark.parametrize("command", [*NAMED.values()], ids=[*NAMED])
def test_every_command_has_a_short_description_and_every_option_a_text(command):
    description = command.help.partition("\n")[0]
    assert len(description) <= 60
    assert description.endswith(".")
    assert [parameter.name for parameter in command.params if not parameter.help] == []


def test_every_command_is_listed_in_its_group(capsys):
    shown = help_of("", capsys)
    for title, commands in COMMANDS.items():
        section = shown.partition(f"\n{title}:\n")[2].partition("\n\n")[0]
        assert [line.split()[0] for line in section.splitlines() if line[2:3].strip()][-len(commands) :] == [*commands]
    assert "  session  " in shown.partition("\nVolumes:\n")[2]


def test_commands_are_quiet_or_verbose_and_those_that_report_do_it_in_json():
    for name, command in NAMED.items():
        options = {option for parameter in command.params for option in parameter.opts}
        assert name == "session" or {"-q", "--quiet", "-v", "--verbose", "--debug"} <= options
        assert name not in REPORTING or "--json" in options


def test_the_choices_are_those_of_the_library():
    fields = Settings.model_fields
    assert get_args(Method) == get_args(fields["method"].annotation)
    assert get_args(Shading) == get_args(fields["shading"].annotation)
    shown = {parameter.name: parameter.show_default for parameter in NAMED["restore"].params}
    for name in ("points", "dpi", "method", "shading", "white_balance"):
        assert shown[name] == str(fields[name].default).removesuffix(".0")


@pytest.mark.parametrize(
    ("words", "allowed"),
    [
        ("restore a.obj -o out --rotate 45", "give 0, 90, 180, 270 or auto"),
        ("restore a.obj -o out --method flat", "give isometric, sticks, springs, conformal or applicable"),
        ("restore a.obj -o out --shading no", "give keep or remove"),
        ("restore a.obj -o out --sheets each", "give auto, separate, largest or together"),
        ("restore a.obj -o out --outputs tif", "give names of tiff, map, mesh"),
        ("restore a.obj -o out --dpi high", "give a number"),
        ("restore a.obj -o out --points 1.5", "give a whole number"),
        ("restore a.obj -o out --unit feet", "use one of: mm, cm, m, in"),
        ("export book --to zip -o out", "give bagit, mets, iiif, pdf, tiff or mesh"),
        ("photos a.jpg -o out --scale big", "give card, none, or the page's width"),
    ],
)
def test_a_wrong_value_is_answered_with_those_that_are_allowed(words, allowed, capsys):
    assert main(words.split()) == 2
    message = capsys.readouterr().err
    assert allowed in message
    assert "Value error" not in message


def test_outputs_name_what_the_flags_name():
    assert Kinds(outputs="tiff, mesh").wanted == Kinds(tiff=True, mesh=True).wanted == {"tiff", "mesh"}
    assert Kinds(outputs=",".join(FLAGS)).wanted == set(FLAGS)


@pytest.mark.parametrize(("words", "found"), [("planish rep", "reproduce"), ("planish restore --rotate ", "270")])
def test_completion_in_bash(words, found):
    environment = {**os.environ, "_PLANISH_COMPLETE": "complete_bash", "COMP_WORDS": words}
    environment["COMP_CWORD"] = str(words.count(" "))
    start = [sys.executable, "-c", "from station.cli import main; main()"]
    done = subprocess.run(start, env=environment, capture_output=True, text=True, check=False)
    assert found in done.stdout.split()
