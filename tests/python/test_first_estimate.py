"""The way of a newcomer: ten lines, an estimate."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest

import cogmap
from binary import environment
from server import Server
from wait import LONG_S, eventually

ROOT = Path(__file__).parents[2]
#: Where 0.5 m/s and 0.1 rad/s lead in 0.1 s: along an arc of 0.01 rad with a radius of 5 m.
ARC_END_M = (5 * math.sin(0.01), 5 * (1 - math.cos(0.01)), 0.0)


def served(service: Server, space: str, agent: str) -> cogmap.Estimate:
    """The latest estimate of an agent, over HTTP."""
    estimate = service.client().agent(space, agent).estimate
    assert estimate is not None
    return estimate


def assert_at_the_end_of_the_arc(estimate: cogmap.Estimate) -> None:
    turned = (0.0, 0.0, math.sin(0.005), math.cos(0.005))
    assert estimate.translation_m == pytest.approx(ARC_END_M, abs=1e-12)
    assert estimate.rotation_xyzw == pytest.approx(turned, abs=1e-12)
    assert (estimate.frame, estimate.status) == ("map", cogmap.Status.LOCALIZED)


def test_ten_lines_bring_the_first_estimate(service: Server) -> None:
    with cogmap.Robot("default", "ada", connect=service.endpoint, ends_session=False) as robot:
        robot.start_pose([0, 0, 0])
        robot.velocity([0.5, 0, 0], [0, 0, 0.1], duration_s=0.1)
        robot.flush()
        estimate = robot.estimate()
    assert_at_the_end_of_the_arc(estimate)
    assert (estimate.space, estimate.agent, estimate.seq) == ("default", "ada", 1)
    detail = service.client().agent("default", "ada")
    assert detail.estimate == estimate, "HTTP says the same to the last bit"
    assert detail.watermark == cogmap.Watermark(robot.session_id, durable=2, applied=2)


def before_the_end(estimate: cogmap.Estimate) -> cogmap.Estimate:
    """What was told before the session's last sample, which moves nothing."""
    return dataclasses.replace(estimate, seq=estimate.seq - 1)


@pytest.mark.parametrize("document", ["README.md", "clients/python/README.md"])
def test_the_documented_program_runs_as_it_stands(
    service: Server, document: str, capsys: pytest.CaptureFixture[str]
) -> None:
    program = (ROOT / document).read_text().split("```python\n")[1].split("```")[0]
    assert 'Robot("default", "ada", connect="tcp/127.0.0.1:7447")' in program
    exec(program.replace("tcp/127.0.0.1:7447", service.endpoint), {})
    estimate = served(service, "default", "ada")
    assert_at_the_end_of_the_arc(estimate)
    assert capsys.readouterr().out == f"{before_the_end(estimate)}\n"


def test_the_example_program_prints_its_estimate(service: Server) -> None:
    program = ROOT / "clients" / "python" / "examples" / "first_estimate.py"
    command = [sys.executable, str(program), "--connect", service.endpoint]
    command += ["--agent", "eve"]
    printed = subprocess.run(
        command, env=environment(), stdout=subprocess.PIPE, text=True, timeout=LONG_S, check=True
    ).stdout
    estimate = served(service, "default", "eve")
    assert_at_the_end_of_the_arc(estimate)
    assert printed == f"{before_the_end(estimate)}\n"


def test_estimates_come_to_a_subscriber_in_order_and_up_to_the_last_sample(
    service: Server,
) -> None:
    heard: List[cogmap.Estimate] = []
    with service.robot("ada", batch_samples=1) as robot:
        robot.on_estimate(heard.append)
        assert robot.wait_for_service()
        robot.start_pose([0, 0, 0])
        for _ in range(100):
            robot.velocity([1.0, 0, 0], [0, 0, 0], duration_s=0.01)
        robot.flush()
        eventually("the last estimate", lambda: bool(heard) and heard[-1].seq == 100)
    numbers = [estimate.seq for estimate in heard]
    assert numbers == sorted(set(numbers))
    for estimate in heard:
        # Each is of exactly the samples that it says: a centimetre for each after the first.
        assert estimate.translation_m == pytest.approx((estimate.seq / 100, 0, 0), abs=1e-12)
    assert heard[-1] == served(service, "default", "ada")
