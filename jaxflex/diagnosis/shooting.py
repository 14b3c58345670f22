"""Gauss-Newton over pieces joined end to end: multiple shooting with continuity condensed away.

Within a horizon the starts of all pieces but the first follow from it through the
linearised motion; the first is free and is eliminated. What is left is a small least
squares problem in the parameters, the same for a horizon of a tenth of a second and for
a whole run (Bock's direct multiple shooting).
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import dataclasses
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..arm.arm import AssembledArm
from .chains import Linearised, condense
from .cores import respond_on_cores
from .delay import delayed
from .normal import Normal
from .parameters import Parameters
from .plant import Instruments, Pieces, Response, Stepping, substeps_for
from .runs import Run, Shown, Slopes
from .steps import FEW_LANES, LANES, Intervals, Point, Steps, along_pieces

LOST_PIECE = 2.0  # misfit of a piece, and by how much another start must better it
SWEEPS = 2  # from piece to piece, when they are joined
EVERYTHING = slice(None)
MOST_SUBSTEPS = 24  # in a sample, where a contact is stiff
SLIDES = 0.9999  # of its farthest: how far a bristle is bent while a joint slides
DRY_PASSES = 2  # of a substep of one joint: the second knows the friction that the first one found
DRY_SUBSTEPS = 3  # in a sample, at least, where dry friction may change its sign


@dataclass
class Setting:
    """All that stays fixed during a diagnosis."""

    parameters: Parameters
    channels: tuple[str, ...]
    noise: np.ndarray  # standard deviation of each channel
    colour: list[np.ndarray]  # coefficients of the whitening filter of each channel, first one 1
    sample_time: float
    length: int  # samples in a piece
    substeps: int
    start_spread: np.ndarray  # how far a start may be from what was guessed, (states,)
    hidden: list[int]  # places in a start of what goes on from piece to piece, no reading showing it


def _stacked(columns: list[np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
    return np.stack(columns, -1) if columns else np.zeros((*shape, 0))


class Problem:
    """What turns runs and parameters into least squares."""

    def __init__(self, setting: Setting):
        self.setting = setting
        build = setting.parameters.build

        def assembled(vector):
            return build(vector).assemble()

        def along(vector, direction):
            return jax.jvp(lambda v: eqx.filter(assembled(v), eqx.is_inexact_array), (vector,), (direction,))[
                1
            ]

        effects = setting.parameters.effect
        self._moves_model = [True] * len(setting.parameters.nominal) + [e.index is not None for e in effects]
        bent = len(setting.start_spread) - len(setting.channels)
        self._bristles = slice(bent - len(setting.parameters.arm.joints), bent)
        self._stepping: tuple[np.ndarray, Stepping] | None = None  # the last that was asked for
        self._model = eqx.filter_jit(assembled)
        self._tangents = eqx.filter_jit(jax.vmap(along, (None, 0)))
        self._delay = [
            next(
                (
                    len(setting.parameters.nominal) + i
                    for i, part in enumerate(setting.parameters.effect)
                    if part.effect == "input_delay" and part.location == f"joint_{joint + 1}"
                ),
                None,
            )
            for joint in range(len(setting.parameters.arm.joints))
        ]

    def stepping(self, vector: np.ndarray) -> Stepping:
        """How a sample interval is integrated for these parameters."""
        if self._stepping is None or not np.array_equal(self._stepping[0], vector):
            self._stepping = vector.copy(), self._stepping_of(vector)
        return self._stepping[1]

    def _stepping_of(self, vector: np.ndarray) -> Stepping:
        parameters = self.setting.parameters
        dry, joints = parameters.has_dry_friction(vector), len(parameters.lightness)
        substeps = self.setting.substeps
        if parameters.plays:
            # what ties a loose joint is hardly known; where more were needed the motion is lost
            touching = vector.copy()
            touching[list(parameters.plays.values())] = 0.0
            model = self._model(jnp.asarray(touching))
            substeps = min(substeps_for(model, self.setting.sample_time), MOST_SUBSTEPS)
        return Stepping(
            jnp.asarray(max(substeps, DRY_SUBSTEPS) if dry else substeps),
            # joints that stick move one another until they agree
            jnp.asarray(DRY_PASSES + joints - 1 if dry else 1),
            jnp.asarray(parameters.lightness),
        )

    def instruments(self, vector: np.ndarray) -> Instruments:
        """The instruments that a parameter vector stands for."""
        values = {"sensor_gain": [], "sensor_bias": [], "sensor_drift": [], "sensor_lag": []}
        found = {
            (part.effect, part.location): vector[len(self.setting.parameters.nominal) + i]
            for i, part in enumerate(self.setting.parameters.effect)
        }
        for name in self.setting.channels:
            for kind, entries in values.items():
                entries.append(found.get((kind, name), 0.0))
        gain, bias, drift, lag = (np.array(v, dtype=float) for v in values.values())
        return Instruments(1 + gain, bias, drift, lag)

    def pieces(self, run: Run, vector: np.ndarray) -> tuple[Pieces, np.ndarray]:
        """The pieces of a run under the delays of `vector`, and the slope of commands with delay."""
        s = self.setting
        columns, rates = [], []
        for joint in range(run.command.shape[1]):
            at = self._delay[joint]
            delay = 0.0 if at is None else float(vector[at])
            mean, slope = delayed(run.times, run.command[:, joint], delay, s.sample_time)
            columns.append(mean)
            rates.append(slope)
        total = -(-len(run.times) // s.length) * s.length

        def cut(values):
            padded = np.pad(values, (0, total - len(values)), mode="edge")
            return padded.reshape(-1, s.length)[run.places]

        time = run.times[0] + cut(np.arange(total)) * s.sample_time
        command = np.stack([cut(c) for c in columns], -1)
        slope = np.stack([cut(c) for c in rates], -1)
        stepping = self.stepping(vector)
        return Pieces(jnp.asarray(command), jnp.asarray(time), s.sample_time, stepping), slope

    def predict(self, run: Run, vector: np.ndarray) -> Response:
        """What the pieces of a run show from their starts."""
        return self._shown(run, vector).response

    def _shown(self, run: Run, vector: np.ndarray) -> Shown:
        """What the pieces of a run do from their starts, taken from there if that was asked for last."""
        here = (vector, run.starts, run.command)
        if run.shown is None or not run.shown.is_at(*here):
            pieces, slope = self.pieces(run, vector)
            model, instruments = self._model(jnp.asarray(vector)), self.instruments(vector)
            found = respond_on_cores(model, instruments, self.setting.channels, run.starts, pieces)
            starts, command = run.starts.copy(), run.command
            run.shown = Shown(vector.copy(), starts, command, found, pieces, slope)
        return run.shown

    def linearise(
        self,
        run: Run,
        vector: np.ndarray,
        columns: list[int],
        forcing: np.ndarray | None = None,
        fresh: bool = True,
    ) -> Linearised:
        """A run about its starts and `vector`, with slopes by the parameters at `columns`.

        `forcing`: `(more, pieces, samples, joints + coordinates)` of further columns, each a
        sequence of changes of the commands and of forces on the coordinates. Unless `fresh`,
        slopes that the run has from before serve again.
        """
        old = None if fresh else run.slopes
        known = {} if old is None else old.by_column
        missing = [column for column in dict.fromkeys(columns) if column not in known]
        states = run.starts.shape[1]
        shown = self._shown(run, vector)
        reading, end = self._slopes(run, shown, old is None, missing, forcing)
        if old is None:
            by_start, end_by_start = reading[..., :states], end[..., :states]
            reading, end = reading[..., states:], end[..., states:]
        else:
            by_start, end_by_start = old.by_start, old.end_by_start
        found = {column: (reading[..., k], end[..., k]) for k, column in enumerate(missing)}
        run.slopes = Slopes(by_start, end_by_start, known | found)
        residual, gap = self._misfit(run, shown.response)
        by_column = [run.slopes.by_column[column] for column in columns]
        forced = range(len(missing), reading.shape[-1])
        return Linearised(
            residual,
            by_start,
            _stacked([a for a, _ in by_column] + [reading[..., k] for k in forced], residual.shape),
            end_by_start,
            _stacked([b for _, b in by_column] + [end[..., k] for k in forced], gap.shape),
            gap,
        )

    def _slopes(
        self,
        run: Run,
        shown: Shown,
        starts: bool,
        columns: list[int],
        forcing: np.ndarray | None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of readings and ends by the starts, then by columns, then by forcing; last axis."""
        vector, response, pieces = shown.vector, shown.response, shown.pieces
        states = run.starts.shape[1] if starts else 0
        if forcing is None:
            forcing = np.zeros((0, *pieces.time.shape, run.command.shape[1]))
        total = states + len(columns) + len(forcing)
        if total == 0:
            return np.zeros((*run.reading.shape, 0)), np.zeros((*run.starts.shape, 0))
        inside = [column for column in columns if self._moves_model[column]]
        steps, tables = self._intervals(run, shown, inside)
        start = np.eye(run.starts.shape[1], total) if starts else np.zeros((run.starts.shape[1], total))
        unit = np.zeros((total, len(vector)))
        unit[states + np.arange(len(columns)), columns] = 1.0
        delays = [
            (states + columns.index(at), joint) for joint, at in enumerate(self._delay) if at in columns
        ]
        places = [states + columns.index(column) for column in inside]

        def source(k):
            added = np.zeros((run.pieces, steps.by_state.shape[2], total))
            for place, column in zip(places, inside, strict=True):
                added[..., place] = tables[column][:, k]
            for place, joint in delays:
                added[..., place] = steps.by_input[:, k, :, joint] * shown.delay_slope[:, k, None, joint]
            acting = np.moveaxis(forcing[:, :, k], 0, -1)
            added[..., states + len(columns) :] = steps.by_input[:, k, :, : acting.shape[1]] @ acting
            return added

        with np.errstate(all="ignore"):  # a piece may leave all bounds
            reading, end = along_pieces(
                steps,
                response,
                pieces,
                self.instruments(vector),
                start,
                source,
                self._instruments_along(unit),
            )
        reading = reading / self.setting.noise[:, None]
        return np.where(run.valid[..., None, None], reading, 0.0), end

    def _intervals(self, run: Run, shown: Shown, columns: list[int]) -> tuple[Steps, dict[int, np.ndarray]]:
        """The intervals of a run made linear, and their slopes by parameters of the arm."""
        vector, here = shown.vector, (shown.vector, shown.starts, shown.command)
        model = self._model(jnp.asarray(vector))
        rough = self.rough(vector, shown.response)
        intervals = Intervals(model, self.setting.channels, shown.pieces, shown.response, rough)
        if run.point is None or not run.point.is_at(*here):
            run.point = Point(*here, intervals.steps(), {})
        steps, known = run.point.steps, run.point.by_parameter
        missing = [column for column in columns if column not in known]
        direct = [column for column in missing if self.is_direct(column)]
        groups, tangents = self._along(vector, direct, LANES if len(direct) > FEW_LANES else FEW_LANES)
        tables = intervals.by_bristles(tangents)
        more, tangents = self._along(vector, [c for c in missing if c not in direct], LANES)
        tables += intervals.by_balance(tangents, steps)
        for group, table in zip(groups + more, tables, strict=True):
            known.update((column, table[..., k]) for k, column in enumerate(group))
        return steps, known

    def is_direct(self, column: int) -> bool:
        """True of a parameter that no force makes up for: of bristles, and of all where contacts open and shut."""
        parameters = self.setting.parameters
        return bool(parameters.plays) or parameters.bends_bristles(column)

    def rough(self, vector: np.ndarray, response: Response) -> np.ndarray:
        """Where a joint sticks or turns, `(pieces, samples)`; everywhere if contacts open and shut."""
        shape, parameters = response.states.shape[:2], self.setting.parameters
        if parameters.plays or not parameters.has_dry_friction(vector):
            return np.full(shape, bool(parameters.plays))
        bends = np.concatenate([response.states, response.end[:, None]], 1)[..., self._bristles]
        return np.any(bends[:, :-1] * bends[:, 1:] < SLIDES**2, axis=-1, keepdims=False)

    def _along(
        self, vector: np.ndarray, columns: list[int], lanes: int
    ) -> tuple[list[list[int]], list[AssembledArm]]:
        """The columns in groups, and slopes of the model's leaves by `lanes` of them at a time."""
        groups = [columns[k : k + lanes] for k in range(0, len(columns), lanes)]
        unit = np.zeros((len(groups), lanes, len(vector)))
        for k, group in enumerate(groups):
            unit[k, np.arange(len(group)), group] = 1.0
        return groups, [self._tangents(jnp.asarray(vector), jnp.asarray(rows)) for rows in unit]

    def _misfit(self, run: Run, response: Response) -> tuple[np.ndarray, np.ndarray]:
        """Residual of every reading in units of the noise, and the gap after every piece."""
        residual = (run.reading - response.reading) / self.setting.noise
        gap = np.zeros_like(run.starts)
        gap[:-1] = response.end[:-1] - run.starts[1:]
        return np.where(run.valid[..., None], residual, 0.0), gap

    def _instruments_along(self, unit: np.ndarray) -> Instruments:
        zero = self.instruments(np.zeros(unit.shape[1]))
        rows = [self.instruments(row) for row in unit]
        return Instruments(*(np.stack([r[k] - zero[k] for r in rows], -1) for k in range(4)))

    def condense(self, run: Run, linear: Linearised, horizon: int, damping: float = 0.0) -> Normal:
        """Least squares in the columns over horizons of `horizon` pieces; `damping` as for `condense`."""
        s = self.setting
        found = condense(linear, run.valid, horizon, s.colour, s.start_spread, damping)
        return dataclasses.replace(found, back=[(run, joined) for joined in found.back])

    def move_starts(self, normal: Normal, step: np.ndarray) -> None:
        """Move the starts of all pieces as a step of the columns asks."""
        for run, joined in normal.back:
            joined.move(run.starts, step)

    def refresh(self, run: Run, vector: np.ndarray, linear: Linearised) -> Linearised:
        """The same slopes about where the run is now."""
        residual, gap = self._misfit(run, self.predict(run, vector))
        return dataclasses.replace(linear, residual=residual, gap=gap)

    def mend(self, run: Run, vector: np.ndarray) -> bool:
        """Move starts that are lost to where the piece before ends, if that fits better; true if any was.

        A piece that begins near rest under friction may settle on the wrong side of it.
        """
        ends, here, there = self._from_before(run, vector)
        better = (here > LOST_PIECE) & (there < here / LOST_PIECE)
        run.starts = np.where(better[:, None], ends, run.starts)
        return bool(better.any())

    def bend(self, run: Run, vector: np.ndarray) -> None:
        """Begin every piece with the bristles of dry friction, and hidden loads, as the piece before leaves them.

        No reading sees them, and left free they would make up for friction that is missing, or for play.
        """
        if self.setting.parameters.has_dry_friction(vector):
            ends = self.predict(run, vector).end[:-1, self._bristles]
            bent = np.where(np.isfinite(ends), np.clip(ends, -1, 1), 0.0)
            own = run.starts[1:, self._bristles]
            run.starts[1:, self._bristles] = np.where(run.follows[1:, None], bent, own)
        if self.setting.hidden:
            self.join(run, vector, self.setting.hidden)

    def join(self, run: Run, vector: np.ndarray, places: slice | list[int] = EVERYTHING) -> None:
        """Move every start to where the piece before ends, unless that fits clearly worse.

        What no reading sees of a start, such as where in its play a joint is, is then one
        motion, which linear algebra can join over a longer horizon. `places` of a start that move.
        """
        for _ in range(SWEEPS):
            ends, here, there = self._from_before(run, vector, places)
            run.starts = np.where((there < LOST_PIECE * here)[:, None], ends, run.starts)

    def _from_before(
        self, run: Run, vector: np.ndarray, places: slice | list[int] = EVERYTHING
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the pieces before end, and misfits of every piece from its own start and from there."""
        response = self.predict(run, vector)
        starts = run.starts.copy()
        starts[1:, places] = np.where(run.follows[1:, None], response.end[:-1, places], starts[1:, places])
        other = dataclasses.replace(run, starts=starts)
        there = self.misfit(other, self.predict(other, vector))
        return starts, self.misfit(run, response), there

    def misfit(self, run: Run, response: Response) -> np.ndarray:
        """Mean square of what the readings of each piece differ from `response`, in units of the noise."""
        with np.errstate(over="ignore"):  # a motion may be lost
            return np.mean(self._misfit(run, response)[0] ** 2, (1, 2))
