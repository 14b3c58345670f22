"""Flexible-link robot arms driven by DC motors: differentiable models, simulation and analysis.

Pure functions of pytrees, in SI units: everything works under `jit`, `vmap`, `grad` and `jvp`.
"""

# The model: beam, motor, effects, arm
from .arm.arm import Arm as Arm
from .arm.arm import AssembledArm as AssembledArm
from .arm.energy import kinetic_energy as kinetic_energy
from .arm.energy import potential_energy as potential_energy
from .arm.parts import Joint as Joint
from .arm.parts import Link as Link
from .arm.parts import Payload as Payload
from .beam.basis import MODE_SHAPES as MODE_SHAPES

# What a controller has to be
from .control import AbstractController as AbstractController
from .control import AbstractReference as AbstractReference
from .control import Measurement as Measurement
from .control import Setpoint as Setpoint

# Dynamics by autodiff of T - U
from .dynamics.lagrange import coriolis_matrix as coriolis_matrix
from .dynamics.lagrange import gravity_vector as gravity_vector
from .dynamics.lagrange import lagrangian as lagrangian
from .dynamics.lagrange import mass_matrix as mass_matrix
from .effects import EFFECTS as EFFECTS
from .motor import DCMotor as DCMotor
from .motor import MotorAxis as MotorAxis
from .scalars import Scalar as Scalar
from .scalars import ScalarLike as ScalarLike
from .scalars import scalar as scalar
from .sensors import Sensor as Sensor

# Simulation
from .simulation.methods import Adaptive as Adaptive
from .simulation.methods import Fixed as Fixed
from .simulation.simulate import InitialState as InitialState
from .simulation.simulate import simulate as simulate
from .simulation.trajectory import SimulationError as SimulationError
from .simulation.trajectory import Trajectory as Trajectory
