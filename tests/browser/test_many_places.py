"""A page with a hundred thousand places stays fast."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, Tuple

import cogmap

from conftest import Open
from driver import START_NS, Driver, Driving
from server import Server

#: Places along each side of a block of them.
SIDE = 47
#: Farther apart than a place's field reaches, so that each step recruits one.
STEP_M = 0.6
_EXACT = cogmap.MotionNoise((1e-5,) * 3, (1e-7,) * 3)
#: Samples in one batch.
BATCH = 4000
#: How long the page is watched [ms].
WATCHED_MS = 6000


def steps() -> Iterator[Tuple[float, float, float]]:
    """A way through all cells of the block, one step each."""
    x_side, y_side = 1.0, 1.0
    for layer in range(SIDE):
        for row in range(SIDE):
            for _ in range(SIDE - 1):
                yield (x_side * STEP_M, 0.0, 0.0)
            x_side = -x_side
            if row < SIDE - 1:
                yield (0.0, y_side * STEP_M, 0.0)
        y_side = -y_side
        if layer < SIDE - 1:
            yield (0.0, 0.0, STEP_M)


def fill(service: Server) -> int:
    """Lets an agent recruit the places, and says how many there are."""
    client = service.client()
    client.create_space("large", places_max=200_000)
    samples: List[cogmap.Sample] = [cogmap.Sample(START_NS, cogmap.StartPose((0, 0, 0)))]
    for number, step in enumerate(steps(), 1):
        motion = cogmap.Increment(step, noise=_EXACT)
        samples.append(cogmap.Sample(START_NS + number * 10_000_000, motion))
    for first in range(0, len(samples), BATCH):
        batch = cogmap.SampleBatch(1, first, tuple(samples[first : first + BATCH]))
        client.post_samples("large", "surveyor", batch)
    return client.space("large").places


def script_s(metrics: Dict[str, List[Dict[str, Any]]]) -> float:
    """Time that scripts have taken [s]."""
    return float(next(m["value"] for m in metrics["metrics"] if m["name"] == "ScriptDuration"))


def test_a_hundred_thousand_places_cost_little(service: Server, open_page: Open) -> None:
    places = fill(service)
    assert places >= 100_000
    ada = Driver(service, "ada", space="large", x=-3.0)
    page = open_page(service, space="large", width=1280, height=800)
    page.until_places(places)
    # The time of the page's own thread, which does not grow while other programs run.
    session = page.page.context.new_cdp_session(page.page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    with Driving(ada):
        page.page.wait_for_timeout(3000)
        before, frames = script_s(session.send("Performance.getMetrics")), page.stats()["frames"]
        page.page.wait_for_timeout(WATCHED_MS)
        after, stats = script_s(session.send("Performance.getMetrics")), page.stats()
    drawn = stats["frames"] - frames
    assert drawn >= 5, "the page moves"
    ms = 1000 * (after - before) / drawn
    print(f"{places} places: {ms:.1f} ms of script a frame over {drawn} frames, "
          f"{stats['drawCalls']} draw calls")
    assert stats["drawCalls"] <= 12
    assert ms <= 8
    assert page.complaints == []
