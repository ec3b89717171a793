"""The grid cells of a space in numpy: read from a running service, and held against its answers.

Nothing about the modules stands here. How many there are, their spacings and orientations are what
the service's grid answers say at four positions; the formulas are those of
`service/core/grid/src/` (`lattice.rs`, `population.rs`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Tuple

import cogmap
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: Tuning width of a cell as a share of its module's spacing (`TUNING_WIDTH`).
_TUNING_WIDTH = 1 / 6
#: How far apart the positions are from which the orientations are read [m]: far, so that the
#: rounding of phases does not matter.
_LEVER_M = 16.0
#: Largest difference between an answer of the service and ours, phases in turns.
_TOLERANCE = 1e-9
#: Positions whose codes are computed at once: their distances from all cells stay in the cache.
_CHUNK = 2048


class Explorer:
    """An agent that can be put anywhere, and asked there for its grid cells.

    Args:
        client: The service.
        space: A space, which exists.
        name: The agent's name.
    """

    def __init__(self, client: cogmap.Client, space: str, name: str) -> None:
        self._client = client
        self._space = space
        self._name = name
        self._seq = 0

    def stand(self, position: Floats) -> cogmap.GridState:
        """Is put down at a position [m] and asked."""
        x, y, z = position.tolist()
        return self._ask(cogmap.StartPose((x, y, z)))

    def step(self, displacement: Floats) -> cogmap.GridState:
        """Moves by a displacement [m], its axes still those of the map, and is asked."""
        x, y, z = displacement.tolist()
        return self._ask(cogmap.Increment((x, y, z), (0.0, 0.0, 0.0, 1.0)))

    def _ask(self, body: cogmap.SampleBody) -> cogmap.GridState:
        sample = cogmap.Sample(self._seq, body)
        batch = cogmap.SampleBatch(1, self._seq, (sample,))
        self._client.post_samples(self._space, self._name, batch)
        self._seq += 1
        return self._client.grid(self._space, self._name)


@dataclass(frozen=True)
class Module:
    """A grid module."""

    spacing_m: float
    #: The lattice axes as columns [m per turn].
    basis: Floats
    #: Preferred phases of the cells [turns], one row for each.
    preferred: Floats

    def phase(self, positions: Floats) -> Floats:
        """Phases [turns], in [0, 1), of positions [m]; rows of three."""
        turns = positions @ np.linalg.inv(self.basis).T
        return turns - np.floor(turns)

    def activation(self, positions: Floats) -> Floats:
        """Activations of the cells (columns) at positions [m] (rows): exp(-d²/2σ²), d the torus
        distance between phase and preferred phase (seed Eq. 1)."""
        phase = self.phase(positions)
        # In spacings, so that the spacing itself falls out of d/σ.
        squared = _torus_distance_squared(phase[:, None, :] - self.preferred[None, :, :])
        activation: Floats = np.exp(squared / (-2 * _TUNING_WIDTH**2))
        return activation


@dataclass(frozen=True)
class Grid:
    """The grid modules of a space, finest first."""

    modules: Tuple[Module, ...]

    @classmethod
    def read(cls, client: cogmap.Client, space: str) -> Grid:
        """Reads it from the answers about an agent in a space.

        The turns of a module (reference grid point plus phase) are linear in the position, so four
        positions give its inverse basis.
        """
        explorer = Explorer(client, space, "surveyor")
        origin = explorer.stand(np.zeros(3))
        away = [explorer.stand(axis) for axis in np.eye(3) * _LEVER_M]
        modules: List[Module] = []
        for index, state in enumerate(origin.modules):
            columns = [_turns(grid.modules[index]) - _turns(state) for grid in away]
            inverse = np.stack(columns, axis=1) / _LEVER_M
            cells = round(len(state.activation) ** (1 / 3))
            # The last lattice axis runs fastest (`preferred_phase`).
            thirds = np.indices((cells, cells, cells)).reshape(3, -1).T / cells
            basis = np.linalg.inv(inverse).astype(np.float64)
            modules.append(Module(state.spacing_m, basis, thirds))
        return cls(tuple(modules))

    @property
    def cells(self) -> int:
        """Number of cells of all modules."""
        return sum(len(module.preferred) for module in self.modules)

    def codes(self, positions: Floats) -> npt.NDArray[np.float32]:
        """Activations of all cells at positions [m], as unit vectors.

        Every module's part has the same length, so that the inner product of two codes is the mean
        over the modules of their cosines: the score of the model (`similarity.rs`), for its number
        of cells instead of infinitely many.
        """
        codes = np.empty((len(positions), self.cells), np.float32)
        for first in range(0, len(positions), _CHUNK):
            rows = slice(first, first + _CHUNK)
            column = 0
            for module in self.modules:
                part = module.activation(positions[rows])
                part /= np.linalg.norm(part, axis=1, keepdims=True) * len(self.modules) ** 0.5
                codes[rows, column : column + part.shape[1]] = part
                column += part.shape[1]
        return codes

    def check(self, client: cogmap.Client, space: str, extent_m: float, count: int) -> float:
        """Compares phases and activations with what the service answers at random positions in a cube,
        half of them reached by a step, and the lattices with face-centred cubic ones.

        Returns:
            The largest difference, phases in turns.

        Raises:
            RuntimeError: It is larger than rounding explains.
        """
        random = np.random.default_rng(1)
        explorer = Explorer(client, space, "examiner")
        settings = client.space(space).settings
        worst = abs(len(self.modules) - settings.grid_modules) * 1.0
        for index, module in enumerate(self.modules):
            spacing_m = settings.grid_spacing_m * settings.grid_ratio**index
            gram = module.basis.T @ module.basis / spacing_m**2
            fcc = np.full((3, 3), 0.5) + 0.5 * np.eye(3)
            worst = max(worst, abs(module.spacing_m / spacing_m - 1), np.abs(gram - fcc).max())
        for number in range(count):
            position = random.uniform(-extent_m / 2, extent_m / 2, 3)
            if number % 2 == 0:
                state = explorer.stand(position)
            else:
                before = random.uniform(-1, 1, 3)
                explorer.stand(position - before)
                state = explorer.step(before)
            for module, answer in zip(self.modules, state.modules):
                phase = module.phase(position[None, :])[0] - answer.phase
                phase -= np.round(phase)
                cells = module.activation(position[None, :])[0] - answer.activation
                worst = max(worst, np.abs(phase).max(), np.abs(cells).max())
        # Written so that a difference that is not a number is too large, too.
        if not worst <= _TOLERANCE:
            raise RuntimeError(
                f"grid codes differ by {worst} from what the service answers: has the formula changed?"
            )
        return float(worst)


def _turns(state: cogmap.GridModuleState) -> Floats:
    turns: Floats = np.add(state.reference, state.phase, dtype=np.float64)
    return turns


def _torus_distance_squared(turns: Floats) -> Floats:
    """Squared length [spacings²] of the shortest displacement that differs from `turns` (the last axis)
    by whole turns.

    With u₄ = -(u₁ + u₂ + u₃) the squared length is ½ Σ uᵢ². The nearest lattice point is found by
    rounding every uᵢ, and where these do not add up to zero by undoing the roundings that went
    farthest (Conway & Sloane 1982, on Aₙ); here, to take the squares of two of the rests anew.
    """
    a, b, c = turns[..., 0], turns[..., 1], turns[..., 2]
    four = np.stack([a, b, c, -(a + b + c)])
    rests = four - np.rint(four)
    excess = np.rint(rests.sum(axis=0))
    # Of either sign: the rests that point the way of the excess, the two farthest of them.
    one, two, three, last = rests * np.sign(excess)
    high, low = np.maximum(one, two), np.minimum(one, two)
    other_high, other_low = np.maximum(three, last), np.minimum(three, last)
    first = np.maximum(high, other_high)
    second = np.maximum(np.minimum(high, other_high), np.maximum(low, other_low))
    excess = np.abs(excess)
    squared: Floats = (rests * rests).sum(axis=0)
    squared += np.where(excess >= 1, 1 - 2 * first, 0)
    squared += np.where(excess >= 2, 1 - 2 * second, 0)
    squared *= 0.5
    return squared
