"""Commands that documents name: whether the programs, targets and packages take them so."""

from __future__ import annotations

import functools
import json
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, FrozenSet, Iterable, Iterator, List

from binary import binary, environment, lab, run
from document import ROOT, Block, prose_of, text_of

#: A command in a sentence or in a cell of a table.
_SPAN = re.compile(r"(?<!`)`((?:cogmap|cogmap-lab|make|cargo) [^`]+)`(?!`)")
#: A command in an indented block.
_INDENTED = re.compile(r"^ {4,}((?:cogmap|cogmap-lab|make|cargo) .+)$", re.MULTILINE)
_CONTINUED = re.compile(r"\\\n *")
#: What ends one command of a line and begins another.
_BETWEEN = frozenset(("|", "||", "&&", ";", "&", "(", ")", ">", "<", ">>"))
_ASSIGNMENT = re.compile(r"^[A-Za-z_]+=")
_FLAG = re.compile(r"^--[a-z][a-z0-9-]*")


@dataclass(frozen=True)
class Help:
    """What a command says of itself."""

    subcommands: FrozenSet[str]
    flags: FrozenSet[str]


@functools.lru_cache(maxsize=None)
def _help(program: str, *subcommands: str) -> Help:
    print_help: Callable[..., str] = lab if program == "cogmap-lab" else run
    text = print_help(*subcommands, "--help")
    _, _, listed = text.partition("\nCommands:\n")
    names = re.findall(r"^  (\S+)", listed.partition("\n\n")[0], re.MULTILINE)
    return Help(frozenset(names), frozenset(re.findall(r"--[a-z][a-z0-9-]*", text)))


@functools.lru_cache(maxsize=None)
def _settings() -> FrozenSet[str]:
    """The names of all settings, as they are given by a flag and in the environment."""
    names = re.findall(r"^\| `([a-zA-Z_.]+)` \|", text_of("docs/settings.md"), re.MULTILINE)
    variables = re.findall(r"`(COGMAP_[A-Z_]+)`", text_of("docs/settings.md"))
    return frozenset((*names, *variables))


@functools.lru_cache(maxsize=None)
def _targets() -> Dict[str, FrozenSet[str]]:
    """The packages of the workspace, with the names of what each builds."""
    listed = subprocess.run(
        ["cargo", "metadata", "--offline", "--locked", "--no-deps", "--format-version", "1"],
        cwd=ROOT,
        env=environment(),
        stdout=subprocess.PIPE,
        check=True,
    )
    packages = json.loads(listed.stdout)["packages"]
    return {
        package["name"]: frozenset(target["name"] for target in package["targets"])
        for package in packages
    }


def library_names() -> FrozenSet[str]:
    """The names of the packages, as Rust writes them."""
    return frozenset(package.replace("-", "_") for package in _targets())


def commands_in(line: str) -> Iterator[List[str]]:
    """The commands of a line of a shell, each in words, without assignments before it."""
    # What may be left out stands in brackets.
    whole = re.sub(r"\[(-[^]]*)\]", r"\1", line)
    lexer = shlex.shlex(whole, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    words: List[str] = []
    for word in [*lexer, ";"]:
        if word in _BETWEEN:
            if words:
                yield words
            words = []
        elif words or not _ASSIGNMENT.match(word):
            words.append(word)


def faults_of_block(block: Block) -> List[str]:
    """What is not as a block of a shell says."""
    return _faults(str(block), _CONTINUED.sub(" ", block.text).splitlines())


def faults_of_prose(document: str) -> List[str]:
    """What is not as a document's sentences, tables and indented blocks say."""
    prose = _CONTINUED.sub(" ", prose_of(document))
    lines = [*_SPAN.findall(prose), *_INDENTED.findall(prose)]
    found = _faults(document, (" ".join(line.split()) for line in lines))
    variables = set(re.findall(r"\bCOGMAP_[A-Z]+__[A-Z_]*[A-Z]\b", text_of(document)))
    spaces = {name for name in variables if name.startswith("COGMAP_SPACES__")}
    found += [f"{document}: no setting {name}" for name in variables - spaces - _settings()]
    return found


def _faults(where: str, lines: Iterable[str]) -> List[str]:
    found: List[str] = []
    for line in lines:
        for words in commands_in(line):
            found += [f"{where}: {fault} in {line!r}" for fault in _faults_of_command(words)]
    return found


def _faults_of_command(words: List[str]) -> Iterator[str]:
    program = Path(words[0]).name
    if program in ("cogmap", "cogmap-lab"):
        yield from _faults_of_binary(program, words[1:])
    elif program == "make":
        yield from _faults_of_make(words[1:])
    elif program == "cargo":
        yield from _faults_of_cargo(words[1:])
    yield from _missing_files(words)


def _faults_of_binary(program: str, words: List[str]) -> Iterator[str]:
    path: List[str] = []
    takes = _help(program)
    for before, word in zip(["", *words], words):
        flag = _FLAG.match(word)
        if flag is not None and flag[0] not in takes.flags:
            yield f"no flag {flag[0]}"
        elif before == "--set" and word.partition("=")[0] not in _known_to_set(word):
            yield f"no setting {word}"
        elif word in takes.subcommands:
            path.append(word)
            takes = _help(program, *path)
        elif takes.subcommands and flag is None and not before.startswith("--"):
            yield f"no command {word}"
            break
    chosen = [word for flag, word in zip(words, words[1:]) if flag == "--set" and "…" not in word]
    if chosen:
        try:
            run("check-config", *(part for setting in chosen for part in ("--set", setting)))
        except AssertionError as error:
            yield str(error)


def _known_to_set(word: str) -> FrozenSet[str]:
    """Settings of a space are listed without the space's name, and some of them are tables."""
    name = word.partition("=")[0]
    of_a_space = re.match(r"spaces\.[^.]+\.", name)
    if of_a_space is None:
        return _settings()
    return frozenset(of_a_space[0] + setting for setting in _settings())


def _faults_of_make(words: List[str]) -> Iterator[str]:
    makefile = (ROOT / "Makefile").read_text()
    for word in words:
        name, is_variable, _ = word.partition("=")
        if is_variable:
            if not re.search(rf"\b{name}\b", makefile):
                yield f"no variable {name}"
        elif not re.search(rf"^{re.escape(name)}:", makefile, re.MULTILINE):
            yield f"no target {name}"


def _faults_of_cargo(words: List[str]) -> Iterator[str]:
    every = frozenset(name for names in _targets().values() for name in names)
    for flag, word in zip(words, words[1:]):
        if flag == "--":
            return
        if flag in ("-p", "--package") and word not in _targets():
            yield f"no package {word}"
        if flag in ("--bin", "--example", "--test", "--bench") and word not in every:
            yield f"no {flag[2:]} {word}"


def _missing_files(words: List[str]) -> Iterator[str]:
    """Paths that begin with a directory of the project lead to something."""
    for word in words:
        first, slash, _ = word.partition("/")
        is_ours = slash and first not in ("", "target") and (ROOT / first).is_dir()
        if is_ours and "/." not in f"/{word}" and not (ROOT / word).exists():
            yield f"no file {word}"
