"""Runs to and from pandas and xarray."""

import jax.numpy as jnp
import numpy as np
import pytest

import controllers as ctl
import jaxflex as jf
from jaxflex.simulation.frames import extra

TIMES = np.linspace(0.0, 1.0, 11)
ONE = jf.Trajectory.from_channels(TIMES, {"angle_1": np.sin(TIMES), "tip_x": np.cos(TIMES)})
BATCH = jf.Trajectory.from_channels(
    np.broadcast_to(TIMES, (2, 3, 11)), {"angle_1": np.arange(66.0).reshape(2, 3, 11)}
)


@pytest.mark.parametrize("run", [ONE, BATCH], ids=["one run", "batch"])
@pytest.mark.parametrize("form", ["pandas", "xarray"])
def test_there_and_back(run, form):
    away = getattr(run, f"to_{form}")()
    back = getattr(jf.Trajectory, f"from_{form}")(away)
    assert list(back.channels) == list(run.channels) and back.status.shape == run.status.shape
    np.testing.assert_array_equal(back.times, run.times)
    for name in run.channels:
        np.testing.assert_array_equal(back[name], run[name])


def test_units_and_selection_as_those_libraries_have_them():
    frame, dataset = ONE.to_pandas(), BATCH.to_xarray()
    assert frame.index.name == "time" and frame.attrs["units"]["angle_1"] == "rad"
    assert dataset["angle_1"].attrs["units"] == "rad" and dataset["time"].attrs["units"] == "s"
    np.testing.assert_array_equal(dataset.isel(member_1=1, member_2=2).angle_1, BATCH["angle_1"][1, 2])
    np.testing.assert_array_equal(BATCH.to_pandas().loc[(1, 2)].angle_1, BATCH["angle_1"][1, 2])


def test_recordings_come_from_both():
    recording = jf.Recording(TIMES, {"angle_1": np.sin(TIMES)})
    for back in (
        jf.Recording.from_pandas(recording.to_pandas()),
        jf.Recording.from_pandas(recording.to_pandas().reset_index(), "a table"),
        jf.Recording.from_xarray(recording.to_xarray()),
    ):
        np.testing.assert_array_equal(back["angle_1"], recording["angle_1"])
    with pytest.raises(jf.RecordingError, match="a run has one axis"):
        jf.Recording.from_xarray(BATCH.to_xarray())


def test_what_is_refused():
    frame = ONE.to_pandas()
    with pytest.raises(ValueError, match="'speed' is no channel"):
        jf.Trajectory.from_pandas(frame.rename(columns={"angle_1": "speed"}))
    with pytest.raises(ValueError, match="no 'time'"):
        jf.Trajectory.from_pandas(frame.reset_index(drop=True))
    other = jf.Trajectory.from_channels(np.stack([TIMES, 2 * TIMES]), {"angle_1": np.zeros((2, 11))})
    with pytest.raises(ValueError, match="different times"):
        other.to_xarray()


def test_members_with_nan_have_failed():
    run = jf.Trajectory.from_channels(
        np.stack([TIMES] * 2), {"angle_1": np.stack([TIMES, np.full(11, np.nan)])}
    )
    with pytest.raises(jf.SimulationError, match="member 1"):
        jf.Trajectory.from_xarray(run.to_xarray()).check()


def test_a_missing_library_names_its_extra():
    with pytest.raises(ImportError, match=r"pip install 'jaxflex\[frames\]'"):
        extra("not_a_module_at_all", "frames", "a DataFrame")


def test_channels_are_those_of_a_simulation():
    arm = jf.Arm((), (jf.Joint(hub_inertia=1.0),))
    run = jf.simulate(arm, ctl.OpenLoop(), ctl.Step((0.0,), (1.0,)), jnp.linspace(0.0, 1.0, 5))
    assert list(run.to_pandas().columns) == list(run.channels)
