"""Writes octant.csv: the seed's Algorithm 1 in plain Python, apart from the Rust code.

Run from this folder: python3 octant.py
Columns: position x, y, z; lattice W, H, D; sigma; cut-off R; indices I, J, K; activation.
"""

import csv
import itertools
import math
import random


def nearest(x):
    """ROUND with halves away from zero."""
    return int(math.copysign(math.floor(abs(x) + 0.5), x))


def algorithm_1(position, size, sigma, radius):
    """Lines 1 to 27 of Algorithm 1."""
    activation_values = []
    i = nearest(position[0] / size[0])
    j = math.ceil(position[1] / size[1]) - 1
    k = math.floor(position[2] / size[2])
    for octant_x in (-1, 1):
        for octant_y in (-1, 1):
            for octant_z in (-1, 1):
                centre = (
                    i * size[0] + octant_x * size[0] / 2,
                    j * size[1] + octant_y * size[1] / 2,
                    k * size[2] + octant_z * size[2] / 2,
                )
                distance = math.dist(position, centre)
                if distance < radius:
                    activation = math.exp(-(distance**2) / (2 * sigma**2))
                else:
                    activation = 0.0
                activation_values.append(activation)
    return (i, j, k), max(activation_values)


def cases():
    """Positions on planes, halves and both sides of zero, then anywhere."""
    for position in itertools.product((-1.0, -0.5, 0.0, 0.25, 0.5, 1.5), repeat=3):
        yield position, (1.0, 1.0, 1.0), 0.5, 2.0
    source = random.Random(1)
    for _ in range(200):
        position = tuple(source.uniform(-20.0, 20.0) for _ in range(3))
        size = tuple(source.uniform(0.2, 3.0) for _ in range(3))
        yield position, size, source.uniform(0.1, 2.0), source.uniform(0.1, 3.0)


with open("octant.csv", "w", newline="", encoding="ascii") as file:
    writer = csv.writer(file, lineterminator="\n")
    for position, size, sigma, radius in cases():
        index, activation = algorithm_1(position, size, sigma, radius)
        writer.writerow([*position, *size, sigma, radius, *index, repr(activation)])
