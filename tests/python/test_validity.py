"""The service refuses and accepts the samples that the clients do: those of
`proto/validity.json`."""

from __future__ import annotations

import urllib.request
from typing import Any, List

import cbor2

import cogmap
from cogmap.wire import CBOR, JSON, decode
from server import Server
from validity import accepted, refused
from wait import LONG_S


def post(service: Server, agent: str, bodies: List[Any]) -> cogmap.Watermark:
    """Sends bodies that the client itself would not make, and returns what became of them."""
    samples = [{"stamp_ns": 0, "body": body} for body in bodies]
    request = urllib.request.Request(
        f"{service.url}/v1/spaces/default/agents/{agent}/samples",
        cbor2.dumps({"session": 1, "first_seq": 0, "samples": samples}),
        {"Content-Type": CBOR},
    )
    with urllib.request.urlopen(request, timeout=LONG_S) as response:
        return decode(cogmap.IngestAnswer, response.read(), JSON).watermark


def test_each_refused_sample_is_refused_for_its_reason(service: Server) -> None:
    for number, case in enumerate(refused()):
        watermark = post(service, f"ada-{number}", [case.body])
        told = [(one.range, one.reason.value) for one in watermark.rejected]
        assert told == [(cogmap.SeqRange(0, 1), case.reason)], case


def test_each_sample_at_the_limit_is_accepted(service: Server) -> None:
    bodies = list(accepted())
    watermark = post(service, "ada", bodies)
    assert watermark.rejected == ()
    assert watermark.applied == len(bodies)
