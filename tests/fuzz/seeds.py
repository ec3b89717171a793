#!/usr/bin/env python3
"""Writes the corpora that the fuzz targets start from: the golden messages of every codec."""

from __future__ import annotations

import sys
from pathlib import Path

#: The codecs in the order of the target `decode`.
CODECS = ("postcard", "cbor", "json")
GOLDEN = Path(__file__).parents[2] / "proto" / "golden"


def main(corpus: Path) -> None:
    for target in ("decode", "fold", "block", "checkpoint"):
        (corpus / target).mkdir(parents=True, exist_ok=True)
    for number, codec in enumerate(CODECS):
        for file in sorted(GOLDEN.glob(f"*.{codec}")):
            (corpus / "decode" / file.name).write_bytes(bytes([number]) + file.read_bytes())
    for file in sorted(GOLDEN.glob("*.postcard")):
        message = file.read_bytes()
        if len(message) < 1 << 16:
            # The message from each of four robots: its number, the length, the bytes.
            framed = (bytes([robot]) + len(message).to_bytes(2, "little") for robot in range(4))
            (corpus / "fold" / file.name).write_bytes(b"".join(head + message for head in framed))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
