"""A program that uses a robot ends by itself, soon, with its own exit code, and what it sent is on
disk."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Optional

import pytest

from binary import environment
from port import Port
from server import Server
from wait import LONG_S

#: Longest time from a program's last line to its end [s]. It is two seconds at most where nothing
#: else runs.
END_S = 5.0
SAMPLES = 500
README = Path(__file__).parents[2] / "clients" / "python" / "README.md"


@dataclass(frozen=True)
class Ending:
    """How a program ends."""

    #: Its last lines.
    lines: str
    #: Its exit code.
    code: int
    #: What it says on standard error.
    says: str = ""
    #: The signal that it gets in its last line.
    signal: Optional[signal.Signals] = None


def remedy() -> str:
    """The lines of the Python client's README by which SIGTERM ends a program in good order."""
    (found,) = re.findall(r"^signal\.signal\(.*$", README.read_text(), re.MULTILINE)
    return f"import signal\n{found}"


ENDINGS: Dict[str, Ending] = {
    "falls off the end": Ending("ended()", 0),
    "raises": Ending("ended()\nraise RuntimeError('mine')", 1, "RuntimeError: mine"),
    "exits with a code": Ending("ended()\nsys.exit(3)", 3),
    "raises in a with block": Ending("with robot:\n    ended()\n    1 / 0", 1, "ZeroDivisionError"),
    "drops the robot": Ending("del robot\nended()", 0),
    "is in a cycle with its callback": Ending("robot.on_estimate(lambda _: robot)\nended()", 0),
    "is interrupted": Ending(
        "ended()\ntime.sleep(60)", -signal.SIGINT, "KeyboardInterrupt", signal.SIGINT
    ),
    "is interrupted in a flush": Ending(
        "robot.increment([0, 0, 0])\nended()\nwhile True:\n    robot.flush(60)",
        -signal.SIGINT,
        "KeyboardInterrupt",
        signal.SIGINT,
    ),
    "is terminated, as the README advises": Ending(
        f"{remedy()}\nended()\ntime.sleep(60)", 143, "", signal.SIGTERM
    ),
    "is terminated in a with block": Ending(
        f"{remedy()}\nwith robot:\n    ended()\n    time.sleep(60)", 143, "", signal.SIGTERM
    ),
}

PROGRAM = f"""
import os, sys, time
import cogmap

def ended():
    print(time.monotonic(), flush=True)

robot = cogmap.Robot("default", sys.argv[3], connect=sys.argv[1])
for _ in range({SAMPLES}):
    robot.increment([0.001, 0, 0])
if sys.argv[2] == "wait":
    robot.flush(60)
    print("flushed", flush=True)
    sys.stdin.readline()
    for _ in range({SAMPLES}):
        robot.increment([0.001, 0, 0])
"""


class Program:
    """A program of a user, as a process."""

    def __init__(self, service: Server, agent: str, ending: Ending, mode: str = "go") -> None:
        source = PROGRAM + textwrap.dedent(ending.lines)
        self._ending = ending
        self._process = subprocess.Popen(
            [sys.executable, "-c", source, service.endpoint, mode, agent],
            env=environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def line(self) -> str:
        """Its next line."""
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def go_on(self) -> None:
        """Lets it send its second half."""
        assert self._process.stdin is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()

    def assert_ends(self) -> None:
        """Waits for its last line and for its end."""
        ending, last = self._ending, self.line()
        if ending.signal is not None:
            # In its last line it waits.
            time.sleep(0.2)
            last = str(time.monotonic())
            self._process.send_signal(ending.signal)
        try:
            _, errors = self._process.communicate(timeout=LONG_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        took_s = time.monotonic() - float(last)
        assert self._process.returncode == ending.code, errors
        assert ending.says in errors
        assert "panicked" not in errors and ".rs:" not in errors, errors
        assert took_s < END_S, f"it took {took_s:.1f} s to end"
        if "COGMAP_SHOW_ENDS" in os.environ:
            print(f"{took_s:.2f} s: {ending.lines!r}")


def agent_of(name: str) -> str:
    return name.replace(" ", "-").replace(",", "")


def assert_all_end(programs: List[Program]) -> None:
    """Waits for the ends of programs that run side by side."""
    with ThreadPoolExecutor(len(programs)) as threads:
        list(threads.map(Program.assert_ends, programs))


def test_programs_end_and_what_they_sent_is_on_disk(service: Server) -> None:
    assert_all_end([Program(service, agent_of(name), one) for name, one in ENDINGS.items()])
    for name in ENDINGS:
        sent = SAMPLES + (name == "is interrupted in a flush")
        # Closing may add something of its own.
        assert service.client().agent("default", agent_of(name)).watermark.durable >= sent, name


@pytest.mark.parametrize("how", ["killed", "stopped"])
def test_programs_end_although_the_service_is_gone(service: Server, how: str) -> None:
    programs = [Program(service, agent_of(name), one, "wait") for name, one in ENDINGS.items()]
    for program in programs:
        assert program.line() == "flushed"
    if how == "killed":
        service.kill()
    else:
        service.pause()
    for program in programs:
        program.go_on()
    assert_all_end(programs)
    if how == "stopped":
        service.resume()


def test_an_attempt_to_connect_can_be_interrupted() -> None:
    port = Port()
    source = f"""
    import cogmap
    print("connecting", flush=True)
    cogmap.Robot("default", "ada", connect="tcp/127.0.0.1:{port.number}", connect_timeout_s=60)
    """
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(source)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None and process.stdout.readline() == "connecting\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, errors = process.communicate(timeout=LONG_S)
    assert process.returncode == -signal.SIGINT and "KeyboardInterrupt" in errors
    assert time.monotonic() - began < END_S


def test_a_dropped_robot_ends_its_thread_after_it_has_flushed(service: Server) -> None:
    source = f"""
    import gc, threading, time
    import cogmap
    robot = cogmap.Robot("default", "ada", connect={service.endpoint!r})
    robot.on_estimate(lambda _, robot=robot: None)
    robot.on_rejection(lambda _, robot=robot: None)
    for _ in range({SAMPLES}):
        robot.increment([0.001, 0, 0])
    del robot
    gc.collect()
    end = time.monotonic() + 60
    while threading.active_count() > 1 and time.monotonic() < end:
        time.sleep(0.01)
    print(threading.active_count())
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(source)],
        env=environment(),
        stdout=subprocess.PIPE,
        timeout=LONG_S,
        check=True,
    )
    assert done.stdout == b"1\n"
    # The last one is the session's end.
    assert service.client().agent("default", "ada").watermark.durable == SAMPLES + 1


def test_a_closed_robot_leaves_no_thread(service: Server) -> None:
    source = f"""
    import threading
    import cogmap
    for _ in range(3):
        with cogmap.Robot("default", "ada", connect={service.endpoint!r}) as robot:
            robot.increment([0, 0, 0])
            robot.estimate()
    print([thread.name for thread in threading.enumerate()])
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(source)],
        env=environment(),
        stdout=subprocess.PIPE,
        timeout=LONG_S,
        check=True,
    )
    assert done.stdout == b"['MainThread']\n"


def test_robots_of_one_program_are_flushed_at_its_end_together(service: Server) -> None:
    source = f"""
    import cogmap
    link = cogmap.open_session({service.endpoint!r})
    robots = [cogmap.Robot("default", f"ada-{{n}}", session=link) for n in range(10)]
    for robot in robots:
        for _ in range({SAMPLES}):
            robot.increment([0.001, 0, 0])
    """
    subprocess.run(
        [sys.executable, "-c", textwrap.dedent(source)],
        env=environment(),
        timeout=LONG_S,
        check=True,
    )
    marks: List[int] = [
        service.client().agent("default", f"ada-{n}").watermark.durable for n in range(10)
    ]
    assert marks == [SAMPLES + 1] * 10  # with the sessions' ends


def test_a_lost_sample_is_told_at_the_end(service: Server) -> None:
    ending = Ending("ended()", 0, f"ada: {SAMPLES + 1} samples are lost, not acknowledged")
    program = Program(service, "ada", ending, "wait")
    assert program.line() == "flushed"
    service.kill()
    program.go_on()
    program.assert_ends()


FORKING = """
import multiprocessing, os, sys
import cogmap

def say(text):
    print(text, flush=True)

def in_child():
    for use in (
        lambda: robot.increment([0, 0, 0]),
        robot.flush,
        robot.estimate,
        lambda: cogmap.Robot("default", "tim", connect=sys.argv[1]),
        lambda: cogmap.Robot("default", "tim", session=link),
    ):
        try:
            use()
        except cogmap.CogmapError as error:
            say(type(error).__name__ + (" forked" if "forked" in str(error) else f": {error}"))
    robot.close()

def own_robot():
    with cogmap.Robot("default", "eve", connect=sys.argv[1]) as eve:
        eve.increment([0, 0, 0])
    say("eve closed")

fork = multiprocessing.get_context("fork")
early = fork.Process(target=own_robot)
early.start()
early.join(60)
link = cogmap.open_session(sys.argv[1])
with cogmap.Robot("default", "ada", session=link) as robot:
    robot.increment([0, 0, 0])
    for target in (in_child, lambda: sys.exit(3)):
        process = fork.Process(target=target)
        process.start()
        process.join(60)
        say(process.exitcode)
    child = os.fork()
    if child == 0:
        sys.exit(4)
    say(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    robot.flush()
    say(robot.watermark.durable)
"""


def test_a_robot_stays_in_its_process(service: Server) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "ignore::DeprecationWarning", "-c", FORKING, service.endpoint],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        timeout=LONG_S,
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    told = ["Closed forked"] * 3 + ["CogmapError forked"] * 2
    assert done.stdout.splitlines() == ["eve closed", *told, "0", "3", "4", "1"]
