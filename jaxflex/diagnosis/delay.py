"""A command that arrives late, without asking the integration to step to where it jumps."""

import numpy as np


def delayed(times: np.ndarray, command: np.ndarray, delay: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """A command held between samples, as its mean over each interval when late by `delay` [s]; and its slope."""
    knots = np.append(times, times[-1] + dt)
    area = np.concatenate([[0.0], np.cumsum(command) * dt])
    first = command[0]

    def upto(t):
        return np.where(t < knots[0], first * (t - knots[0]), np.interp(t, knots, area))

    def at(t):
        index = np.clip(np.floor((t - knots[0]) / dt + 1e-9).astype(int), 0, len(command) - 1)
        return command[index]

    mean = (upto(knots[1:] - delay) - upto(knots[:-1] - delay)) / dt
    # the slope just above the delay: at no delay the interval begins to see the command before
    slope = -(at(knots[1:] - delay - 1e-9 * dt) - at(knots[:-1] - delay - 1e-9 * dt)) / dt
    return mean, slope
