import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from jaxflex import RungeKutta4


def swing(t, y, args):
    """A pendulum pushed in time: neither linear nor autonomous."""
    return y[1], -jnp.sin(y[0]) + 0.3 * jnp.cos(2 * t)


def solve(solver, steps, controller=None, dt0=None, end=2.0):
    return diffrax.diffeqsolve(
        diffrax.ODETerm(swing), solver, 0.0, end, dt0 or end / steps, (jnp.array(1.0), jnp.array(0.5)),
        stepsize_controller=controller or diffrax.ConstantStepSize(),
    )  # fmt: skip


def test_one_step_is_the_textbook_one():
    h, y = 0.3, np.array([1.0, 0.5])

    def f(t, y):
        return np.array(swing(t, y, None))

    k1 = f(0.0, y)
    k2 = f(h / 2, y + h / 2 * k1)
    k3 = f(h / 2, y + h / 2 * k2)
    k4 = f(h, y + h * k3)
    step = solve(RungeKutta4(), 1, end=h)
    np.testing.assert_allclose(np.ravel(step.ys), y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), rtol=1e-14)


def test_error_falls_with_the_fourth_power_of_the_step():
    exact = solve(diffrax.Dopri8(), 400).ys[0][-1]
    errors = [abs(float(solve(RungeKutta4(), n).ys[0][-1] - exact)) for n in (20, 40, 80)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(orders, 4.0, atol=0.2)


def test_estimate_of_the_error_is_of_the_third_order():
    solver, start = RungeKutta4(), (jnp.array(1.0), jnp.array(0.5))
    term = diffrax.ODETerm(swing)
    found = []
    for h in (0.1, 0.05, 0.025):
        state = solver.init(term, 0.0, h, start, None)
        found.append(float(solver.step(term, 0.0, h, start, None, state, False)[1][0]))
    np.testing.assert_allclose(np.log2(np.abs(np.array(found[:-1]) / np.array(found[1:]))), 4.0, atol=0.3)
    controller = diffrax.PIDController(rtol=1e-7, atol=1e-9)
    exact = solve(diffrax.Dopri8(), 400).ys[0][-1]
    adaptive = solve(solver, 1, controller, 0.01)
    np.testing.assert_allclose(adaptive.ys[0][-1], exact, atol=1e-6)


def test_it_is_differentiable():
    def end(scale):
        term = diffrax.ODETerm(lambda t, y, args: scale * y)
        return diffrax.diffeqsolve(term, RungeKutta4(), 0.0, 1.0, 0.01, jnp.array(1.0)).ys[-1]

    np.testing.assert_allclose(jax.grad(end)(0.7), np.exp(0.7), rtol=1e-8)
