"""The documents are true: each fenced block is run, read or compared, or says above it why not
(`<!-- not run: REASON -->`), and each command that they name is there."""

from __future__ import annotations

import ast
import configparser
import re
from collections import Counter
from pathlib import Path
from typing import Dict, List

import pytest
import yaml  # type: ignore[import-untyped]  # schemathesis brings it

import cogmap
from binary import run
from command import faults_of_block, faults_of_prose, library_names
from conftest import MakeServer
from document import ROOT, Block, blocks_of, documents, text_of
from server import Server
from walk import (
    RUN,
    Walk,
    compiled,
    is_documentation,
    is_output,
    is_walked,
    other_than_shown,
    read_json,
)

#: Languages of blocks that are read.
READ = frozenset(("ini", "json", "json5", "jsonc", "toml", "yaml"))
BLOCKS: List[Block] = [block for document in documents() for block in blocks_of(document)]
WALKED = sorted({block.document for block in BLOCKS if is_walked(block)})
#: Documents that tell of the past, whose commands may be gone.
PAST = re.compile(r"CHANGELOG\.md|docs/decisions/.*")


def those_of(*languages: str) -> List[Block]:
    """The blocks of some languages that are not excused."""
    return [each for each in BLOCKS if each.language in languages and each.reason is None]


def excused(language: str) -> List[Block]:
    """The blocks of a language that are."""
    return [each for each in BLOCKS if each.language == language and each.reason is not None]


def test_each_block_is_run_or_says_why_not() -> None:
    unexplained = [
        str(block)
        for block in BLOCKS
        if block.reason is None and block.language not in RUN | READ and not is_output(block)
    ]
    assert not unexplained, "run these, or write the reason above them: " + ", ".join(unexplained)
    in_documents = Counter(block.document for block in BLOCKS if is_walked(block))
    assert in_documents["README.md"] >= 3 and in_documents["clients/python/README.md"] >= 8


@pytest.mark.parametrize("document", WALKED)
def test_the_blocks_of_a_document_do_what_they_say(
    service: Server, document: str, tmp_path: Path
) -> None:
    Walk(service, tmp_path).through(document)


@pytest.mark.parametrize("block", excused("python"), ids=str)
def test_python_that_is_not_run_names_what_the_client_has(block: Block) -> None:
    for statement in ast.walk(ast.parse(block.text, str(block))):
        if isinstance(statement, ast.ImportFrom) and statement.module == "cogmap":
            assert not [each.name for each in statement.names if not hasattr(cogmap, each.name)]


@pytest.mark.parametrize("block", excused("rust"), ids=str)
def test_rust_that_is_not_run_is_compiled(block: Block, tmp_path: Path) -> None:
    compiled(block, block.text, tmp_path)


@pytest.mark.parametrize("block", [each for each in BLOCKS if is_documentation(each)], ids=str)
def test_programs_of_the_crates_pages_are_in_their_documentation(block: Block) -> None:
    library = (ROOT / block.document).parent / "src" / "lib.rs"
    assert 'doc = include_str!("../README.md")' in library.read_text()


@pytest.mark.parametrize("block", those_of("json", "jsonc"), ids=str)
def test_messages_can_be_read(block: Block) -> None:
    read_json(block.text)


@pytest.mark.parametrize("block", those_of("toml"), ids=str)
def test_settings_are_those_of_the_service(block: Block, tmp_path: Path) -> None:
    (tmp_path / "token").write_text("secret\n")
    settings = tmp_path / "cogmap.toml"
    settings.write_text(block.text.replace("/etc/cogmap", str(tmp_path)))
    run("check-config", "--config", settings)


@pytest.mark.parametrize("block", those_of("json5"), ids=str)
def test_settings_of_zenoh_are_taken(
    block: Block, make_service: MakeServer, tmp_path: Path
) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text(f"{{ {block.text} }}")
    make_service([f"zenoh.config_file={file}"])


@pytest.mark.parametrize("block", those_of("ini", "yaml"), ids=str)
def test_files_of_other_programs_can_be_read(block: Block) -> None:
    if block.language == "yaml":
        yaml.safe_load(block.text)
    else:
        unit = configparser.ConfigParser(strict=False, interpolation=None)
        unit.read_string(block.text)
        started = [unit[part]["ExecStart"] for part in unit if "ExecStart" in unit[part]]
        assert started and not faults_of_block(replaced(block, "\n".join(started)))


def replaced(block: Block, text: str) -> Block:
    """A block with another text."""
    return Block(block.document, block.line, block.language, text, block.reason, False)


@pytest.mark.parametrize("document", [each for each in documents() if not PAST.fullmatch(each)])
def test_commands_and_settings_of_a_document_are_there(document: str) -> None:
    found = faults_of_prose(document)
    for block in blocks_of(document):
        if block.language == "sh":
            found += faults_of_block(block)
    assert found == []


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("cogmap serve --no-such-flag", "no flag --no-such-flag"),
        ("cogmap bake DIR", "no command bake"),
        ("cogmap serve --set http.port=80", "no setting http.port=80"),
        ("cogmap serve --set http.listen=nowhere", "http.listen"),
        ("cogmap-lab bench nothing", "no command nothing"),
        ("make test nothing", "no target nothing"),
        ("make scorecard DATUM=DIR", "no variable DATUM"),
        ("cargo test -p cogmap-nothing", "no package cogmap-nothing"),
        ("cargo run --example nothing", "no example nothing"),
        ("python tests/nothing.py | sort", "no file tests/nothing.py"),
    ],
)
def test_a_command_that_is_not_there_is_found(line: str, fault: str) -> None:
    found = faults_of_block(Block("page.md", 1, "sh", line, None, False))
    assert fault in found[0]


def test_an_answer_that_differs_from_the_one_shown_is_found() -> None:
    shown: Dict[str, object] = {"at": [1.25, None], "name": "ada", "stamp_ns": 5, "list": [1]}
    same: Dict[str, object] = {"at": [1.2549, None], "name": "ada", "stamp_ns": 7, "list": [1, 2]}
    assert not list(other_than_shown(shown, same))
    others: List[Dict[str, object]] = [
        {"at": [1.26, None]},
        {"name": "bob"},
        {"stamp_ns": "7"},
        {"list": []},
    ]
    for other in others:
        assert len(list(other_than_shown(shown, {**same, **other}))) == 1, other
    assert list(other_than_shown(shown, {**same, "further": 1}))


def test_series_of_the_documents_are_those_of_the_service() -> None:
    table = re.findall(r"^\| `(cogmap_\w+)` \|", text_of("docs/metrics.md"), re.MULTILINE)
    known = {*table, *library_names()}
    for document in documents():
        named = re.findall(r"\bcogmap_[a-z_]*[a-z]\b", text_of(document))
        unknown = {re.sub(r"_(bucket|count|sum)$", "", name) for name in named} - known
        assert not unknown, document
