"""Options: every one is described, takes what its record takes, and whatever else is refused in one line."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cli.conftest import Refused, Told
from spacearm.cli import COMMANDS, main
from spacearm.cli.arguments import _options, parsed
from spacearm.cli.bench import MbmOptions, SpaceOptions
from spacearm.cli.certify import Options as CertifyOptions
from spacearm.cli.doctor import Options as DoctorOptions
from spacearm.cli.paper import Options as PaperOptions
from spacearm.cli.plan import Options as PlanOptions
from spacearm.errors import SettingsError
from spacearm.study.paper_problem import PaperSettings
from spacearm.swarm import NAMED_SETTINGS

RECORDS: dict[str, Any] = {
    "bench mbm": MbmOptions,
    "bench space": SpaceOptions,
    "certify": CertifyOptions,
    "doctor": DoctorOptions,
    "paper": PaperOptions,
    "plan": PlanOptions,
}
UNITS = {"--radii": "[m]", "--tolerance": "[m]", "--link-radius": "[m]", "--search": "[ms]", "--budget": "[ms]"}


def test_every_command_is_tested_here() -> None:
    assert {command.split()[0] for command in RECORDS} == set(COMMANDS)


@pytest.mark.parametrize("command", RECORDS)
def test_help_describes_every_option_with_default_and_unit(command: str, told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = told([*command.split(), "--help"])
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    text = " ".join(out.split())
    for option in _options(RECORDS[command]):
        assert option.help, f"{option.key} has no line under Attributes:"
        assert option.usage.split()[0] in text
        assert " ".join(option.help_with_default.split()) in text
        assert UNITS.get((option.flags or ("",))[-1], "") in option.help
        if option.values != 0:
            assert re.search(r"\((default: .+|required)\)$", option.help_with_default)


def test_the_help_knows_every_named_method() -> None:
    line = next(option for option in _options(PaperOptions) if option.key == "methods")
    assert set(NAMED_SETTINGS) <= set(re.findall(r"[\w-]+", line.help))


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
    words += [] if figures else ["--no-figures"]
    words += ["--json"] if json else []
    read = parsed(PaperOptions, words, command="paper", description="")
    assert read == PaperOptions(output=Path("out"), settings=settings, figures=figures, json=json)


def test_options_left_out_keep_their_defaults() -> None:
    read = parsed(PaperOptions, ["--output=out"], command="paper", description="")
    assert read == PaperOptions(output=Path("out"))
    plan = parsed(PlanOptions, ["-oout", "a.yaml", "--seed", "none"], command="plan", description="")
    assert plan == PlanOptions(problem=Path("a.yaml"), output=Path("out"))


@given(st.lists(st.text("-=orun3. \n\t", max_size=8) | st.sampled_from(["-o", "--runs", "--radii", "nan", "--"]), max_size=6))
def test_any_words_are_read_or_refused_in_one_line(words: list[str]) -> None:
    sentence = ""
    try:
        parsed(PaperOptions, words, command="paper", description="")
    except SettingsError as error:
        sentence = str(error)
    assert "\n" not in sentence


WRONG_WORDS = {
    "option mistyped": "paper -o <new> --rnus 3",
    "option mistyped with a value": "paper -o <new> --rnus=3",
    "option mistyped before a file": "plan --sed 3 problem.yaml -o <new>",
    "switch mistyped": "paper -o <new> --no-figres",
    "option unlike any": "plan problem.yaml -o <new> -x",
    "option abbreviated": "paper -o <new> --run 3",
    "output missing": "paper",
    "output without a value": "paper -o",
    "output without a value, long": "paper --output --runs 3",
    "problem missing": "plan -o <new>",
    "value missing": "paper -o <new> --runs",
    "values missing": "paper -o <new> --radii",
    "values too few": "paper -o <new> --weights 0.5 0.5",
    "value of a switch": "paper -o <new> --json=yes",
    "word too many": "paper -o <new> extra",
    "file too many": "plan a.yaml b.yaml -o <new>",
    "runs a word": "paper -o <new> --runs x",
    "runs a fraction": "paper -o <new> --runs 1.5",
    "runs empty": "paper -o <new> --runs=",
    "runs zero": "paper -o <new> --runs 0",
    "runs too many": "paper -o <new> --runs 1000000000",
    "seed a word": "plan a.yaml -o <new> --seed x",
    "seed negative": "plan a.yaml -o <new> --seed -1",
    "paper's seed negative": "paper -o <new> --seed -1",
    "seed too large": "paper -o <new> --seed 9223372036854775808",
    "threads zero": "paper -o <new> --threads 0",
    "weight a word": "paper -o <new> --weights 0.5 0.25 a",
    "weights that sum to more than 1": "paper -o <new> --weights 0.5 0.25 0.5",
    "weights that sum to nearly 1": "paper -o <new> --weights 0.5 0.25 0.2499999",
    "weight negative": "paper -o <new> --weights -0.5 1 0.5",
    "weight NaN": "paper -o <new> --weights nan 0.5 0.5",
    "radius zero": "paper -o <new> --radii 0",
    "radius negative": "paper -o <new> --radii 0.1 -0.1",
    "radius NaN": "paper -o <new> --radii nan",
    "radius infinite": "paper -o <new> --radii inf",
    "radius a word": "paper -o <new> --radii 10cm",
    "radius twice": "paper -o <new> --radii 0.1 0.1",
    "tolerance zero": "paper -o <new> --tolerance 0",
    "tolerance NaN": "paper -o <new> --tolerance nan",
    "link radius negative": "paper -o <new> --link-radius -0.01",
    "method mistyped": "paper -o <new> --methods pso ipso-n",
    "method unlike any": "paper -o <new> --methods genetic",
    "mode mistyped": "paper -o <new> --modes gaol",
    "constraints mistyped": "paper -o <new> --constraints penalti",
    "command mistyped": "plna problem.yaml",
    "command unlike any": "render",
    "command's option first": "--runs 3 paper",
    "option of spacearm mistyped": "--verison",
    "command empty": "''",
}


@pytest.mark.parametrize("case", WRONG_WORDS)
def test_wrong_words_are_refused_in_one_sentence(case: str, refused: Refused, tmp_path: Path) -> None:
    words = WRONG_WORDS[case].replace("''", "\0").replace("<new>", str(tmp_path / "new")).split()
    refused(case, *("" if word == "\0" else word for word in words))


def test_help_wins_over_what_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "-h", "--whatever"]) == 0
    assert capsys.readouterr().out.startswith("usage: spacearm plan")
