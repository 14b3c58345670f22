"""A hypothesis: the nominal arm with some effects, fitted; and what it leaves unexplained."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import dataclasses
from dataclasses import dataclass

import numpy as np

from ..effects import EFFECTS, AbstractBodyEffect, SensorGain, TorqueConstant
from .adopt import held_by, rise, risen, with_candidate
from .calibrate import MOST, Fit, Freedom, fit, settle
from .catalogue import EITHER_SIGN, FORM, Candidate, Motion, candidates, plausible
from .further import fit_further
from .locate import LatentForce, latent_forces, strongest_frequencies
from .parameters import Parameters
from .runs import Run, Starts, restart, starts_of
from .screen import scores, with_candidates
from .shooting import Problem

HORIZONS = (1, 3, 10)  # pieces: a tenth of a second, a third, one second
# A model is never the plant. What it gets wrong shows more the longer it runs, and is no
# missing effect: gains below this share of the readings, times the horizon, count as that.
MODEL_ERROR = 0.002
TRUSTED = 2.5  # standard deviations up to which a nominal parameter may leave its value freely
STRONG = 3.0  # times the allowance: a candidate worth a full fit, and a gain worth an effect
FAIR = 1.5  # misfit a reading over a second, in units of the noise, that leaves nothing to explain
LITTLE = 0.01  # of the gap there was: what may be left over a second where a tenth of one is followed
CLOSE = 2.0  # misfit a reading up to which a fit is close enough to trust, and to climb from
CHANCE = 10.0  # gain that noise alone may bring
SECOND_ORDER = 0.1  # uncertainty of the terms quadratic in deflection, as a share of centrifugal stiffening
RIVAL = 0.85  # of the gain of an effect: a candidate that reaches it is tried in its place
INVISIBLE = 1e-3  # share of a response that is its own: below it, starts and parameters imitate all
OTHER_FORM = 0.01  # of what an effect explains: what another form of it would explain better
KNOWN_FORM = 0.001  # the same, where physics leaves little choice of the form
FORM_IS_KNOWN = {
    "gravity", "load_torque_bias", "payload_mass", "hub_inertia", "torque_constant", "input_delay",
    "sensor_bias", "sensor_gain", "sensor_drift", "sensor_lag",
}  # fmt: skip
BARRED = 1e20  # precision that keeps a parameter where it is
PARTS = (AbstractBodyEffect, TorqueConstant, SensorGain)  # what nominal parameters could be bent to imitate
LEAST = 0.1  # of the value that a shape is begun with
ANY_FORM = 2.0  # of the value that the form of friction is begun with: its standard deviation
SHARPEST = 1e-3  # the same, of the form of friction
FARTHEST_REST = 5.0  # times how far its joint turns: a cable's rest, from the middle of that
ASTRAY = 2.0  # times what is left without an effect: a fit with it that leaves more has failed
RUNAWAY = 1e3  # misfit over a longer horizon, against a shorter, at which a motion is lost
SOME = 3  # one in so many pieces tells wrong signs, and parts of the arm, apart
FEWEST = 20  # pieces that speak for all where much is left
HUBS = (2.0, 8.0)  # of the inertia that a joint feels: sizes from which a hub's is begun
SPRING = 0.3  # of the turn by which its link gives way: from there what ties it is begun, beside from none
FREQUENCIES = 3  # of a periodic disturbance that are tried


@dataclass
class Hypothesis:
    """Effects in the order added, and where their fit came to; `costs` at each horizon on the way."""

    effects: tuple[Candidate, ...]
    fit: Fit
    horizon: int
    costs: dict[int, float]

    @property
    def is_fitted(self) -> bool:
        """False where the starts alone were."""
        return bool(self.fit.freedom.columns)

    @property
    def closest(self) -> float:
        """Misfit a reading over the shortest horizon, in units of the noise.

        Pieces that are joined are pieces that happen to meet: what longer horizons leave bounds it.
        """
        return min(self.costs.values()) / self.fit.count

    def strength(self, other: "Hypothesis", explained: dict[int, float] | None = None) -> float:
        """By how much it beats another, in units of what noise and the model's own error may bring.

        `explained`: what effects already there, those of `other`, have gained at each horizon; a
        share of it may be due to the form that they were given.
        """
        shared = self.costs.keys() & other.costs.keys()
        form = form_error(other.effects, explained or {})
        return max(
            (
                (other.costs[h] - self.costs[h]) / (allowance(self.fit.count, h) + form.get(h, 0.0))
                for h in shared
            ),
            default=-np.inf,
        )

    def gain(self, other: "Hypothesis") -> float:
        """Fall of the cost against another at the longest horizon that both were fitted over."""
        horizon = max(self.costs.keys() & other.costs.keys())
        return other.costs[horizon] - self.costs[horizon]


@dataclass(frozen=True)
class Ranked:
    """A candidate with its gain at the horizon where it stands out most."""

    candidate: Candidate
    step: tuple[float, ...]
    gain: float
    strength: float
    horizon: int = HORIZONS[0]


def form_error(effects: tuple[Candidate, ...], explained: dict[int, float]) -> dict[int, float]:
    """Gain at each horizon that another form of these effects may bring, of the cost that they have `explained`."""
    share = KNOWN_FORM if {effect.effect for effect in effects} <= FORM_IS_KNOWN else OTHER_FORM
    return {horizon: share * cost for horizon, cost in explained.items()}


def allowance(count: int, horizon: int) -> float:
    """Gain that noise and the model's own error may bring."""
    return CHANCE + MODEL_ERROR * horizon * count


def freedom(parameters: Parameters, effects: tuple[Candidate, ...]) -> Freedom:
    """Nominal parameters under their prior, the effects' amplitudes free, their shapes held loosely."""
    count = len(parameters.nominal)
    columns = list(range(count))
    precision, centre, lowest = [1.0] * count, [0.0] * count, [-np.inf] * count
    far = [TRUSTED] * count
    taken = {effect.key for effect in effects}
    for part in parameters.effect:
        if part.effect == "centrifugal_stiffening" and (part.effect, part.location) not in taken:
            # the model's own terms of second order are not exact: a nuisance, not an effect
            columns.append(parameters.position(part.effect, part.location, part.field))
            precision.append(1 / SECOND_ORDER**2)
            centre.append(0.0)
            lowest.append(-np.inf)
    for effect in effects:
        for name in effect.amplitudes:
            columns.append(parameters.position(*effect.key, name))
            precision.append(0.0)
            centre.append(0.0)
            lowest.append(-np.inf if effect.effect in EITHER_SIGN else 0.0)
        for name in effect.free:
            value = dict(effect.shape)[name]
            columns.append(parameters.position(*effect.key, name))
            share = ANY_FORM if name in FORM else 0.5
            precision.append(1 / (share * value if value else 1.0) ** 2)
            centre.append(value)
            least = SHARPEST if name in FORM else LEAST
            lowest.append(least * value if value else -np.inf)
    far += [np.inf] * (len(columns) - count)
    return Freedom(tuple(columns), *(np.array(part) for part in (precision, centre, lowest, far)))


class Search:
    """Fits hypotheses to runs and ranks what each one misses."""

    def __init__(self, problem: Problem, runs: list[Run], say):
        self.problem = problem
        self.runs = runs
        self.parameters = problem.setting.parameters
        self.say = say

    @property
    def has_to_spare(self) -> bool:
        """True if one in SOME of the pieces tells what leaves much from what leaves little."""
        return sum(run.pieces for run in self.runs) >= SOME * FEWEST and not self.problem.setting.hidden

    def thinned(self, together: int = 1) -> "Search":
        """The same search with one in SOME of the pieces, for fits over `together` of them."""
        return Search(self.problem, [run.thinned(SOME, together) for run in self.runs], self.say)

    def by_some(self, found: Hypothesis, starts: Starts) -> tuple["Search", Hypothesis]:
        """The same search with one in SOME of the pieces, which start there, and what `found` leaves of them."""
        self.restart(starts)
        few = self.thinned()
        begun = few.starts()
        own = few.climb(found.effects, found.fit.vector, to=HORIZONS[0], most=1)
        few.restart(begun)
        return few, own

    def starts(self) -> Starts:
        """The starts of all pieces, with the slopes there, to come back to."""
        return starts_of(self.runs)

    def restart(self, starts: Starts) -> None:
        """Back to these starts."""
        restart(self.runs, starts)

    def settle(self, vector: np.ndarray, horizon: int = 1) -> Fit:
        """The starts alone, parameters held."""
        return settle(self.problem, self.runs, vector, horizon)

    def climb(
        self, effects: tuple[Candidate, ...], vector: np.ndarray, ceiling: float = np.inf, to: int = HORIZONS[-1],
        iterations: int = 4, most: int = MOST, without: Hypothesis | None = None,
        begun: Hypothesis | None = None,
    ) -> Hypothesis:  # fmt: skip
        """Fit over longer and longer horizons, beyond those of `begun` if given; the rest as for `fit`.

        Stops where the misfit is above `ceiling`, or far above that of the hypothesis `without` one of
        the effects, which leaves no less unless the fit has gone astray.
        """
        known = {} if without is None else without.costs
        free = freedom(self.parameters, effects)
        found, costs = (begun.fit, dict(begun.costs)) if begun else (None, {})
        for horizon in HORIZONS:
            if horizon > to or (found is not None and found.level > ceiling):
                break
            if horizon in costs:
                continue
            if found is None:
                longer = fit(self.problem, self.runs, vector, free, horizon, iterations, most=most)
            else:
                limit = RUNAWAY * (1 + found.level)
                longer = fit_further(self.problem, self.runs, vector, free, horizon, limit, iterations, most)
            if longer is None:
                break
            found, vector = longer, longer.vector
            costs[horizon] = found.cost
            if found.cost > ASTRAY * known.get(horizon, np.inf):
                break
        assert found is not None
        return Hypothesis(effects, found, max(costs), costs)

    def over_a_second(self, hypothesis: Hypothesis) -> float:
        """Misfit a reading over the longest horizon, whether or not it was fitted there."""
        if hypothesis.horizon == HORIZONS[-1]:
            return hypothesis.fit.level
        starts = self.starts()
        level = self.settle(hypothesis.fit.vector, HORIZONS[-1]).level
        self.restart(starts)
        return level

    def latent(self, vector: np.ndarray, horizon: int = HORIZONS[-1]) -> list[LatentForce]:
        """The forces that would make the model fit the first run."""
        return latent_forces(self.problem, self.runs[0], vector, horizon)

    def rank(
        self,
        vector: np.ndarray,
        effects: tuple[Candidate, ...],
        horizons: tuple[int, ...] = HORIZONS,
        instead: Candidate | None = None,
    ) -> list[Ranked]:
        """Every candidate not yet in `effects`, the one that stands out most first.

        Nominal parameters and the effects already there are refitted, to first order,
        along with each candidate. With `instead`, one of the effects, the candidates are
        judged as if that one were taken out; it is then among them itself.
        """
        frequencies = strongest_frequencies(self.latent(vector)[0], FREQUENCIES)
        if instead is not None and instead.effect == "periodic_disturbance":
            frequencies = [dict(instead.shape)["frequency"], *frequencies]
        motions = [Motion(self.problem, run, vector) for run in self.runs]
        tried = list(candidates(self.parameters, motions, frequencies))
        return self.scored(vector, effects, tried, horizons, instead)

    def scored(
        self,
        vector: np.ndarray,
        effects: tuple[Candidate, ...],
        tried: list[Candidate],
        horizons: tuple[int, ...],
        instead: Candidate | None = None,
    ) -> list[Ranked]:
        """Those of the candidates `tried` that are not yet in `effects`; the rest as for `rank`."""
        parameters = self.parameters
        free = freedom(parameters, effects)
        taken = {effect.key for effect in effects if effect is not instead}
        tried = [c for c in tried if c.key not in taken and parameters.has_what_it_changes(c.key, taken)]
        tried = [rise(c) if taken & held_by(c) else c for c in tried]
        motions = [Motion(self.problem, run, vector) for run in self.runs]
        columns = list(free.columns)
        own = [] if instead is None else self._own_places(columns, instead)
        linears = [
            with_candidates(self.problem, run, motion, vector, columns, tried)
            for run, motion in zip(self.runs, motions, strict=True)
        ]
        _, pull, prior = free.prior(vector)
        best: dict[tuple[str, str], Ranked] = {}
        for horizon in horizons:
            parts = [
                self.problem.condense(run, linear, horizon)
                for run, (linear, _) in zip(self.runs, linears, strict=True)
            ]
            normal = sum(parts[1:], parts[0])
            precision = prior.copy()
            if own:
                # as if the effect were out: its own columns are given back to the residual, then barred
                amplitudes = np.array([vector[columns[k]] for k in own[: len(instead.amplitudes)]])
                lost = normal.matrix[:, own[: len(instead.amplitudes)]] @ amplitudes
                normal = dataclasses.replace(normal, vector=normal.vector + lost)
                precision[own] = BARRED
                pull = np.where(np.isin(np.arange(len(columns)), own), 0.0, pull)
            for score in scores(normal, precision, pull, len(columns), tried, linears[0][1]):
                candidate, step = score.candidate, score.step
                if taken & held_by(candidate):
                    candidate, step = risen(parameters, vector, candidate, step)
                is_there = instead is not None and candidate.key == instead.key
                if not is_there and (score.survival < INVISIBLE or not plausible(candidate, step)):
                    continue
                strength = score.gain / allowance(normal.count, horizon)
                kept = best.get(candidate.key)
                if kept is None or strength > kept.strength:
                    best[candidate.key] = Ranked(candidate, step, score.gain, strength, horizon)
        return sorted(best.values(), key=lambda ranked: -ranked.strength)

    def parts(self, effects: tuple[Candidate, ...]) -> list[Ranked]:
        """Every change of a part of the arm that is not yet in `effects`, at nothing.

        A hub's inertia may be many times the nominal one, so it is begun from some sizes. A spring where a
        link is tied is begun from one as well: beside it, parameters go on bending where there is none.
        """
        motion = Motion(self.problem, self.runs[0], self.parameters.start)
        taken = {effect.key for effect in effects}
        return [
            Ranked(candidate, start, 0.0, 0.0)
            for candidate in candidates(self.parameters, [motion], [])
            if candidate.key not in taken and issubclass(EFFECTS[candidate.effect], PARTS)
            for start in self._sizes(candidate)
        ]

    def _sizes(self, part: Candidate) -> list[tuple[float, ...]]:
        nothing = (0.0,) * len(part.amplitudes)
        if part.effect == "hub_inertia":
            felt = 1 / self.parameters.lightness[part.index]  # kg m^2
            return [nothing, *((share * felt,) for share in HUBS)]
        if part.effect in ("joint_flexibility", "root_compliance") and not self.parameters.plays:
            return [nothing, (SPRING * self.parameters.gives_way(part.index),)]
        return [nothing]

    def _own_places(self, columns: list[int], effect: Candidate) -> list[int]:
        names = (*effect.amplitudes, *effect.free)
        return [columns.index(self.parameters.position(*effect.key, name)) for name in names]

    def rivals(self, final: Hypothesis, effect: Candidate) -> list[tuple[Ranked, float]]:
        """Candidates that would explain nearly as much in place of `effect`, and what they would gain."""
        if not effect.amplitudes:
            return []
        rest = self.rank(final.fit.vector, final.effects, (final.horizon,), instead=effect)
        if not rest:
            return []
        own = next((r.gain for r in rest if r.candidate.key == effect.key), max(r.gain for r in rest))
        return [
            (item, item.gain)
            for item in rest
            if item.candidate.key != effect.key
            and item.gain > (RIVAL if item.candidate.count <= effect.count else 1.0) * own
        ]

    def sensible(self, found: Hypothesis) -> bool:
        """False if the effect added last came to a size that makes no sense."""
        last = found.effects[-1]
        if last.effect == "cable_stiffness":
            rest = found.fit.vector[self.parameters.position(*last.key, "rest_angle")]
            angle = np.concatenate([run.measured[:, last.index] for run in self.runs])
            if abs(rest - (angle.max() + angle.min()) / 2) > FARTHEST_REST * np.ptp(angle):
                return False  # from so far it pulls as a constant torque does
        size = (found.fit.vector[self.parameters.position(*last.key, name)] for name in last.amplitudes)
        return not last.amplitudes or plausible(last, tuple(size))

    def confirm(
        self,
        base: Hypothesis,
        starts: Starts,
        ranked: Ranked,
        to: int,
        ceiling: float = np.inf,
        most: int = MOST,
        without: Hypothesis | None = None,
    ) -> Hypothesis:
        """The candidate added to `base` in full, fitted from `starts`; the rest as for `climb`."""
        self.restart(starts)
        effects, vector = with_candidate(
            self.parameters, base.effects, base.fit.vector, ranked.candidate, ranked.step
        )
        return self.climb(effects, vector, ceiling, to, most=most, without=without)
