"""Flexible-link robot arms driven by DC motors: differentiable models, simulation and analysis.

Pure functions of pytrees, in SI units: everything works under `jit`, `vmap`, `grad` and `jvp`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

# Analysis
from .analysis.export import to_control as to_control
from .analysis.frequencies import clamped_frequencies as clamped_frequencies
from .analysis.frequencies import driven_frequencies as driven_frequencies
from .analysis.frequencies import locked_frequencies as locked_frequencies
from .analysis.laplace import step_response as step_response
from .analysis.linear import LinearModel as LinearModel
from .analysis.linear import Modes as Modes
from .analysis.linear import closed_loop_modes as closed_loop_modes
from .analysis.linear import linearise as linearise
from .analysis.margins import CutLoop as CutLoop
from .analysis.margins import Margins as Margins
from .analysis.margins import cut_loop as cut_loop
from .analysis.margins import held as held
from .analysis.margins import margins as margins
from .analysis.measures import electrical_energy as electrical_energy
from .analysis.measures import overshoot as overshoot
from .analysis.measures import peak as peak
from .analysis.measures import residual_vibration as residual_vibration
from .analysis.measures import rise_time as rise_time
from .analysis.measures import settling_time as settling_time
from .analysis.measures import spectrum as spectrum

# The model: beam, motor, effects, arm
from .arm.arm import Arm as Arm
from .arm.arm import AssembledArm as AssembledArm
from .arm.energy import kinetic_energy as kinetic_energy
from .arm.energy import potential_energy as potential_energy
from .arm.kinematics import tip_position as tip_position
from .arm.library import ahmad_arm as ahmad_arm
from .arm.library import foldager_link as foldager_link
from .arm.parts import AbstractLink as AbstractLink
from .arm.parts import Joint as Joint
from .arm.parts import Link as Link
from .arm.parts import Payload as Payload
from .beam.basis import MODE_SHAPES as MODE_SHAPES
from .beam.basis import Distal as Distal
from .beam.link_model import LinkModel as LinkModel

# Text of models
from .brief import brief as brief

# What a controller has to be
from .control import AbstractController as AbstractController
from .control import AbstractReference as AbstractReference
from .control import Measurement as Measurement
from .control import Setpoint as Setpoint

# Dynamics by autodiff of T - U
from .dynamics.lagrange import coriolis_matrix as coriolis_matrix
from .dynamics.lagrange import gravity_vector as gravity_vector
from .dynamics.lagrange import inverse_dynamics as inverse_dynamics
from .dynamics.lagrange import lagrangian as lagrangian
from .dynamics.lagrange import mass_matrix as mass_matrix
from .dynamics.one_way import OneWayLink as OneWayLink
from .effects import EFFECTS as EFFECTS
from .effects import AbstractBodyEffect as AbstractBodyEffect
from .effects import AbstractDriveEffect as AbstractDriveEffect
from .effects import AbstractEffect as AbstractEffect
from .effects import AbstractJointEffect as AbstractJointEffect
from .effects import AbstractSensorEffect as AbstractSensorEffect

# Files
from .files.arm_file import ArmFile as ArmFile
from .files.arm_file import load_arm as load_arm
from .files.arm_file import read_arm_file as read_arm_file
from .files.arm_file import save_arm as save_arm
from .files.fields import ArmFileError as ArmFileError
from .files.model_file import ModelFileError as ModelFileError
from .files.model_file import load_model as load_model
from .files.model_file import save_model as save_model
from .files.prepare import prepare as prepare
from .files.prepare import require_channels as require_channels
from .files.read_recording import read_recording as read_recording
from .files.recording import Recording as Recording
from .files.recording import RecordingError as RecordingError

# Programs kept between processes
from .kept import kept as kept

# Motors
from .motor import DCMotor as DCMotor
from .motor import MotorAxis as MotorAxis

# Programs that run once
from .one_off import one_off as one_off

# Scalars and sensors
from .scalars import Scalar as Scalar
from .scalars import ScalarLike as ScalarLike
from .scalars import optional_scalar as optional_scalar
from .scalars import scalar as scalar
from .sensors import Sensor as Sensor
from .sensors import quantised as quantised

# What to call first in a notebook
from .session import set_up as set_up

# Simulation
from .simulation.derivatives import adjoint_for as adjoint_for
from .simulation.derivatives import value_and_gradient as value_and_gradient
from .simulation.derivatives import value_and_slopes as value_and_slopes
from .simulation.exact import Exact as Exact
from .simulation.methods import AbstractMethod as AbstractMethod
from .simulation.methods import Adaptive as Adaptive
from .simulation.methods import Fixed as Fixed
from .simulation.rosenbrock import LinearlyImplicit as LinearlyImplicit
from .simulation.runge_kutta import RungeKutta4 as RungeKutta4
from .simulation.simulate import InitialState as InitialState
from .simulation.simulate import simulate as simulate
from .simulation.trajectory import SimulationError as SimulationError
from .simulation.trajectory import Trajectory as Trajectory
from .sweep import sweep as sweep
from .timing import Timing as Timing
from .timing import timed as timed

# Diagnosis, pictures, modes from recordings: imported when first asked for, since what they need
# of SciPy and matplotlib takes longer to import than all the rest
if TYPE_CHECKING:
    from .diagnosis import Diagnosis as Diagnosis
    from .diagnosis import diagnose as diagnose
    from .plotting_animation import animate as animate
    from .plotting_run import plot as plot
    from .ringing import MeasuredMode as MeasuredMode
    from .ringing import MeasuredModes as MeasuredModes
    from .ringing import measure_modes as measure_modes

_LATER = {
    "Diagnosis": "diagnosis",
    "diagnose": "diagnosis",
    "animate": "plotting_animation",
    "plot": "plotting_run",
    "MeasuredMode": "ringing",
    "MeasuredModes": "ringing",
    "measure_modes": "ringing",
}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(f".{_LATER[name]}", __name__), name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})
