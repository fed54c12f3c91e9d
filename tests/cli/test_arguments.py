"""Options: every one is described, takes what its record takes, and whatever else is refused in one line."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cli.conftest import Refused, Told
from house.source import REPOSITORY
from spacearm.cli import COMMANDS, main
from spacearm.cli.arguments import _flags, parsed
from spacearm.cli.bench_command import MbmOptions, SpaceOptions
from spacearm.cli.certify_command import Options as CertifyOptions
from spacearm.cli.doctor_command import Options as DoctorOptions
from spacearm.cli.paper_command import Options as PaperOptions
from spacearm.cli.plan_command import Options as PlanOptions
from spacearm.cli.report_command import Options as ReportOptions
from spacearm.cli.robustness_command import Options as RobustnessOptions
from spacearm.cli.view_command import Options as ViewOptions
from spacearm.core.errors import SettingsError
from spacearm.study.paper_problem import PaperSettings
from spacearm.swarm import NAMED_SETTINGS

RECORDS: dict[str, Any] = {
    "bench mbm": MbmOptions,
    "bench space": SpaceOptions,
    "certify": CertifyOptions,
    "doctor": DoctorOptions,
    "paper": PaperOptions,
    "plan": PlanOptions,
    "report": ReportOptions,
    "robustness": RobustnessOptions,
    "view": ViewOptions,
}
UNITS = {"--radii": "[m]", "--tolerance": "[m]", "--link-radius": "[m]", "--search": "[ms]", "--budget": "[ms]"}


def test_every_command_is_tested_here() -> None:
    assert {command.split()[0] for command in RECORDS} == set(COMMANDS)


def described(record: Any) -> Iterator[tuple[str, str]]:
    """Yield each field that is an option, and its line under Attributes."""
    text = (inspect.getdoc(record) or "").partition("Attributes:")[2]
    hints = typing.get_type_hints(record)
    names = [field.name for field in dataclasses.fields(record)]
    found = re.findall(r"^    (\w+): (.+(?:\n {8}.+)*)", text, re.MULTILINE)
    lines = {name: " ".join(line.split()) for name, line in found}
    assert list(lines) == names, "a field has no line under Attributes, or lines are out of order"
    for name in names:
        if dataclasses.is_dataclass(hints[name]):
            yield from described(hints[name])
        else:
            yield name, lines[name]


@pytest.mark.parametrize("command", RECORDS)
def test_help_describes_every_option_with_default_and_unit(command: str, told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = told([*command.split(), "--help"])
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    assert out.isascii()
    text = " ".join(out.split())
    for flag, _ in _flags(RECORDS[command]):
        assert re.search(rf" {flag}[ ,]", text)
    for name, line in described(RECORDS[command]):
        assert re.search(rf"{re.escape(line)} \((default: [^)]+|required)\)", text), name
        assert UNITS.get(f"--{name.replace('_', '-')}", "") in line


def test_the_page_of_the_command_line_names_every_option_and_command() -> None:
    page = (REPOSITORY / "docs" / "command_line.md").read_text(encoding="utf-8")
    for command, record in RECORDS.items():
        section = page.partition(f"\n## {command.split()[0]}\n")[2].partition("\n## ")[0]
        rows = "".join(line for line in section.splitlines(keepends=True) if line.startswith("|"))
        missing = [flag for flag, _ in _flags(record) if not re.search(rf"`([^`]*, )?{flag}\b", rows)]
        assert not missing, command
        unknown = set(re.findall(r"`(--[\w-]+)", rows)) - {flag for one in RECORDS.values() for flag, _ in _flags(one)}
        assert not unknown, command


@pytest.mark.parametrize("columns", ["0", "1", "24", "x"])
def test_help_ends_however_narrow_the_terminal(columns: str, told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    code, out, _ = told(["paper", "--help"])
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80


def test_the_help_knows_every_named_method() -> None:
    line = dict(described(PaperOptions))["methods"]
    assert set(NAMED_SETTINGS) <= set(re.findall(r"[\w-]+", line))


@pytest.mark.parametrize(("arguments", "code"), [((), 2), (("-h",), 0), (("--help",), 0)])
def test_spacearm_alone_shows_what_there_is(arguments: tuple[str, ...], code: int, told: Told) -> None:
    found, out, err = told(arguments)
    assert found == code
    shown, silent = (out, err) if code == 0 else (err, out)
    assert silent == ""
    for command, what in COMMANDS.items():
        assert re.search(rf"^  {command} +{re.escape(what)}$", shown, re.MULTILINE)


def test_the_version_names_the_kernel(told: Told) -> None:
    code, out, err = told(["--version"])
    assert (code, err) == (0, "")
    assert re.fullmatch(r"spacearm \d+\.\d+\.\d+ \(kernel [\w-]+, .+\)\n", out)


finite = st.floats(1e-6, 10, allow_subnormal=False)
drawn_settings = st.builds(
    lambda cut, **rest: PaperSettings(weights=(cut[0], cut[1] - cut[0], 1 - cut[1]), **rest),
    cut=st.tuples(st.floats(0, 1), st.floats(0, 1)).map(lambda pair: (min(pair), max(pair))),
    runs=st.integers(1, 100_000),
    methods=st.lists(st.sampled_from(list(NAMED_SETTINGS)), min_size=1, unique=True).map(tuple),
    modes=st.lists(st.sampled_from(["goal", "literal"]), min_size=1, unique=True).map(tuple),
    radii=st.lists(finite, min_size=1, max_size=4, unique=True).map(tuple),
    tolerance=finite,
    link_radius=st.floats(0, 10),
    constraints=st.sampled_from(["feasible-first", "penalty"]),
    seed=st.integers(0, 2**63 - 1),
    threads=st.none() | st.integers(1, 64),
)


@given(drawn_settings, st.booleans(), st.booleans())
def test_settings_written_as_options_are_read_back(settings: PaperSettings, figures: bool, json: bool) -> None:
    words = ["-o", "out"]
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        words.append(f"--{field.name.replace('_', '-')}")
        words += [str(one) for one in (value if isinstance(value, tuple) else (value,))]
    words += ["--figures"] if figures else []
    words += ["--json"] if json else []
    read = parsed(PaperOptions, words, command="paper")
    assert read == PaperOptions(output=Path("out"), experiment=settings, figures=figures, json=json)


def test_options_left_out_keep_their_defaults() -> None:
    read = parsed(PaperOptions, ["--output=out"], command="paper")
    assert read == PaperOptions(output=Path("out"))
    plan = parsed(PlanOptions, ["-oout", "a.yaml", "--seed", "none"], command="plan")
    assert plan == PlanOptions(problem=Path("a.yaml"), output=Path("out"))


@given(st.lists(st.text("-=orun3. \n\t", max_size=8) | st.sampled_from(["-o", "--runs", "--radii", "nan", "--"]), max_size=6))
def test_any_words_are_read_or_refused_in_one_line(words: list[str]) -> None:
    sentence = ""
    try:
        parsed(PaperOptions, words, command="paper")
    except SettingsError as error:
        sentence = str(error)
    assert "\n" not in sentence


WORD_FOR_WORD = {
    "option mistyped": "paper -o <new> --rnus 3",
    "output missing": "paper",
    "value missing": "paper -o <new> --runs",
    "values missing": "paper -o <new> --radii",
    "value of a switch": "paper -o <new> --json=yes",
    "word too many": "paper -o <new> extra",
    "runs a word": "paper -o <new> --runs x",
    "constraints mistyped": "paper -o <new> --constraints penalti",
    "command mistyped": "plna problem.yaml",
    "option of spacearm mistyped": "--verison",
}
"""One sentence for each class of error."""

CONTAINED = {
    "paper -o <new> --rnus=3": ("'--rnus'", "did you mean '--runs'?", "see spacearm paper --help"),
    "plan --sed 3 problem.yaml -o <new>": ("'--sed'", "did you mean '--seed'?", "see spacearm plan --help"),
    "plan -jo <new> problem.yaml": ("'-jo'", "known: --output"),
    "plan --sed=3 -o <new>": ("'--sed'", "did you mean '--seed'?"),
    "paper -o <new> --figrues": ("'--figrues'", "did you mean '--figures'?"),
    "paper -o <new> --no-figures": ("'--no-figures'", "did you mean '--figures'?"),
    "paper -o <new> --json --no-json": ("'--no-json'", "did you mean '--json'?"),
    "paper -o <new> --hepl": ("'--hepl'", "did you mean '--help'?"),
    "plan problem.yaml -o <new> -x": ("'-x'", "known: --output"),
    "plan problem.yaml -o <new> -5": ("'-5'", "known: --output"),
    "paper -o <new> --run 3": ("'--run'", "did you mean '--runs'?"),
    "paper -o <new> --tyro-print-completion zsh": ("'--tyro-print-completion'", "known: --output"),
    "paper --tyro-print-completion x": ("'--tyro-print-completion'", "known: --output"),
    "paper --tyro_write_completion bash <new>": ("'--tyro_write_completion'", "known: --output"),
    "paper -o": ("--output has too few values", "-o FOLDER"),
    "paper -o --runs 3": ("--output has too few values", "-o FOLDER"),
    "paper --output --runs 3": ("--output has too few values", "-o FOLDER"),
    "plan -o <new>": ("PROBLEM.YAML is missing", "see spacearm plan --help"),
    "plan": ("PROBLEM.YAML is missing", "see spacearm plan --help"),
    "plan a.yaml -o <new> --epoch -x": ("--epoch has too few values", "--epoch TIME"),
    "plan a.yaml -o <new> --export": ("--export has too few values", "one or more"),
    "paper -o <new> --radii --runs 3": ("--radii has too few values", "one or more"),
    "paper -o <new> --weights 0.5 0.5": ("--weights has too few values", "--weights FLOAT FLOAT FLOAT"),
    "plan --json=no -o <new> a.yaml": ("--json takes no value", "leave the value out"),
    "plan a.yaml b.yaml -o <new>": ("'b.yaml' is one argument too many", "see spacearm plan --help"),
    "plan -o <new> -- -a.yaml": ("-a.yaml does not exist",),
    "plan -o <new> -- a.yaml -o": ("'-o'",),
    "paper -o <new> --runs 1.5": ("--runs is '1.5'", "a whole number"),
    "paper -o <new> --runs=": ("--runs is ''", "a whole number"),
    "paper -o <new> --runs 3 --runs x": ("--runs is 'x'", "a whole number"),
    "paper -o <new> --runs none": ("--runs is 'none'", "a whole number"),
    "paper -o <new> --runs 0": ("runs is 0", "from 1 to"),
    "paper -o <new> --runs 1000000000": ("runs is 1000000000", "from 1 to"),
    "plan a.yaml -o <new> --seed x": ("--seed is 'x'", "a whole number or none"),
    "plan a.yaml -o <new> --seed -1": ("seed is -1", "from 0 to"),
    "paper -o <new> --seed -1": ("seed is -1", "from 0 to"),
    "paper -o <new> --seed 9223372036854775808": ("seed is 9223372036854775808", "to 9223372036854775807"),
    "paper -o <new> --threads 0": ("threads is 0", "from 1 to"),
    "paper -o <new> --weights 0.5 0.25 a": ("--weights is 'a'", "a number"),
    "paper -o <new> --weights 0.5 0.25 0.5": ("weights sum to 1.25", "expected 1"),
    "paper -o <new> --weights 0.5 0.25 0.2499999": ("weights sum to 0.9999999", "expected 1"),
    "paper -o <new> --weights -0.5 1 0.5": ("weights[0] is -0.5", "from 0 to 1"),
    "paper -o <new> --weights nan 0.5 0.5": ("weights[0] is nan", "finite"),
    "paper -o <new> --radii 0": ("radius is 0", "above 0", "[m]"),
    "paper -o <new> --radii 0.1 -0.1": ("radius is -0.1", "above 0", "[m]"),
    "paper -o <new> --radii nan": ("radius is nan", "above 0", "[m]"),
    "paper -o <new> --radii inf": ("radius is inf", "[m]"),
    "paper -o <new> --radii -inf": ("radius is -inf", "[m]"),
    "paper -o <new> --radii 10cm": ("--radii is '10cm'", "a number"),
    "paper -o <new> --radii 0.1 0.1": ("radii is (0.1, 0.1)", "once"),
    "paper -o <new> --tolerance 0": ("tolerance is 0", "above 0", "[m]"),
    "paper -o <new> --tolerance nan": ("tolerance is nan", "[m]"),
    "paper -o <new> --link-radius -0.01": ("link_radius is -0.01", "from 0", "[m]"),
    "paper -o <new> --methods pso ipso-n": ("method is 'ipso-n'", "did you mean 'ipso-s'?"),
    "paper -o <new> --methods genetic": ("method is 'genetic'", "known: pso"),
    "paper -o <new> --modes gaol": ("mode is 'gaol'", "did you mean 'goal'?"),
    "certify a.json --time-unit None": ("--time-unit is 'None'", "did you mean 'none'?", "s, ms, us, ns, none"),
    "certify a.json --limits velocity speed": ("--limits is 'speed'", "position, velocity, acceleration"),
    "render": ("no command 'render'", "known: bench"),
    "--runs 3 paper": ("no option '--runs'", "a command's options follow its name"),
    "''": ("no command ''", "known: bench"),
}
"""Command lines of the same classes, and what their sentences hold."""


def words_of(line: str, new: Path) -> list[str]:
    words = line.replace("''", "\0").replace("<new>", str(new)).split()
    return ["" if word == "\0" else word for word in words]


@pytest.mark.parametrize("case", WORD_FOR_WORD)
def test_each_class_of_wrong_words_has_its_sentence(case: str, refused: Refused, tmp_path: Path) -> None:
    refused(case, *words_of(WORD_FOR_WORD[case], tmp_path / "new"))


@pytest.mark.parametrize("line", CONTAINED)
def test_wrong_words_are_refused_in_one_sentence(line: str, refused: Refused, tmp_path: Path) -> None:
    refused(CONTAINED[line], *words_of(line, tmp_path / "new"))


def test_words_that_are_spelt_otherwise_are_read_all_the_same() -> None:
    plan = PlanOptions(problem=Path("-a"), output=Path("b"), seed=3, export=("aem", "ros"), no_report=True)
    for line in (
        "-o b --seed 3 --export aem ros --no-report -- -a",
        "-ob --seed=3 --export=aem ros --no-report -- -a",
        "--output=b --seed 1 --seed 3 --no_report --export aem ros -- -a",
    ):
        assert parsed(PlanOptions, line.split(), command="plan") == plan
    assert parsed(PlanOptions, ["-o", "b", "--export", "ros", "a"], command="plan").problem == Path("a")


@pytest.mark.parametrize("line", ["a -o b --sed 3", "a -o b --seed x", "-o b", "a -o", "a b -o c", "a -o b --export x"])
def test_without_tyros_hook_its_own_words_stand_in_one_line(line: str, told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tyro._errors", None)
    code, out, err = told(["plan", *line.split()])
    assert (code, out) == (2, "")
    assert re.fullmatch(r"spacearm: [^─│╭╮╰╯\n]{20,}\n", err)


def test_help_wins_over_what_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "-h", "--whatever"]) == 0
    assert capsys.readouterr().out.startswith("usage: spacearm plan")
