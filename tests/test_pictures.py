"""Pictures of runs: every channel is drawn, and the animated arm is where the simulation says."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

import jaxflex as jf
from jaxflex.arm.kinematics import poses
from jaxflex.plotting_animation import _shapes
from jaxflex.scalars import scalar
from jaxflex.simulation.plant import State

TIMES = np.linspace(0.0, 0.4, 9)


def run_of(arm):
    """A made-up motion: the joint turns, the first coordinate swings."""
    model = arm.assemble()
    q = (2 * TIMES, 0.01 * np.sin(20 * TIMES), *[1e-3 * TIMES] * (model.size - 2))
    q = tuple(jnp.asarray(c) for c in q)
    tip = [poses(model, tuple(c[k] for c in q))[1][-1] for k in range(len(TIMES))]
    channels = {"tip_x": [p.x for p in tip], "tip_y": [p.y for p in tip], "angle_1": q[0]}
    channels |= {"reference_1": 2 * TIMES, "tip_acceleration_1": np.cos(20 * TIMES)}
    run = jf.Trajectory.from_channels(TIMES, {name: np.array(values) for name, values in channels.items()})
    return dataclasses.replace(run, state=State(q, q, None, None, None))


@pytest.fixture(scope="module", params=["assumed_modes", "lumped"])
def bent(request):
    arm = jf.foldager_link(0.05, modes=2, model=request.param, segments=4)
    return arm, run_of(arm)


def test_the_drawn_tip_is_the_simulated_one(bent):
    arm, run = bent
    points = _shapes(arm, jnp.stack(run.state.q, axis=-1), scalar(1.0))
    np.testing.assert_allclose(points[:, -1, -1], run.tip, atol=1e-12)
    np.testing.assert_allclose(points[:, 0, 0], 0.0, atol=1e-12)
    # deflections grow in proportion, and the root stays tangent to the hub
    twice = _shapes(arm, jnp.stack(run.state.q, axis=-1), scalar(3.0))
    straight = _shapes(arm, jnp.stack(run.state.q, axis=-1), scalar(0.0))
    np.testing.assert_allclose(twice - straight, 3 * (points - straight), atol=1e-12)
    step = (points - straight)[:, 0, 1]
    assert jnp.abs(step).max() < 0.01 * jnp.abs((points - straight)[:, 0, -1]).max()


def test_gif_of_an_arm(bent, tmp_path):
    arm, run = bent
    moving = jf.animate(arm, run, tmp_path / "arm.gif", exaggeration=2.0, frames_per_second=10)
    with Image.open(tmp_path / "arm.gif") as image:
        assert image.n_frames == 5 and image.info["duration"] == 100
    assert "anim" in moving._repr_html_()


def test_what_cannot_be_animated(bent, tmp_path):
    arm, run = bent
    with pytest.raises(ValueError, match="index one member"):
        jf.animate(arm, jax.tree.map(lambda x: x[None], run))
    with pytest.raises(ValueError, match=r"ends in \.gif"):
        jf.animate(arm, run, tmp_path / "arm.avi")
    with pytest.raises(ValueError, match="exaggeration"):
        jf.animate(arm, run, exaggeration=-1.0)


def test_plot_has_every_channel_with_its_unit(bent):
    _, run = bent
    figure = jf.plot(run, "a run")
    labels = [axis.get_ylabel() for axis in figure.axes]
    assert "joint angle [rad]" in labels and "tip acceleration [m/s^2]" in labels
    assert figure._repr_png_().startswith(b"\x89PNG")
    batch = jf.plot(jax.tree.map(lambda x: jnp.stack([x] * 3), run))
    assert len(batch.axes[0].lines) == 6  # three members, and their references
    recording = jf.Recording(TIMES, {"strain_1": TIMES})
    assert [a.get_ylabel() for a in jf.plot(recording).axes] == ["strain [1]"]
    with pytest.raises(ValueError, match="nothing to plot"):
        jf.plot(jf.Recording(TIMES, {"reference_1": TIMES}))
