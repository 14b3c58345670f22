"""Effects: physics beyond the nominal arm, each a small module with zero meaning absent."""

from .base import AbstractBodyEffect as AbstractBodyEffect
from .base import AbstractDriveEffect as AbstractDriveEffect
from .base import AbstractEffect as AbstractEffect
from .base import AbstractJointEffect as AbstractJointEffect
from .base import AbstractSensorEffect as AbstractSensorEffect
from .body import Backlash as Backlash
from .body import CentrifugalStiffening as CentrifugalStiffening
from .body import Gravity as Gravity
from .body import HubInertia as HubInertia
from .body import JointFlexibility as JointFlexibility
from .body import PayloadMass as PayloadMass
from .body import RootCompliance as RootCompliance
from .body import StructuralDamping as StructuralDamping
from .body import ViscousFriction as ViscousFriction
from .drive import InputDelay as InputDelay
from .drive import TorqueConstant as TorqueConstant
from .drive import VoltageDeadZone as VoltageDeadZone
from .drive import VoltageSaturation as VoltageSaturation
from .drive import WindingHeating as WindingHeating
from .friction import AbstractDryFriction as AbstractDryFriction
from .friction import AsymmetricFriction as AsymmetricFriction
from .friction import CoulombFriction as CoulombFriction
from .friction import QuadraticDrag as QuadraticDrag
from .friction import StribeckFriction as StribeckFriction
from .position import CableStiffness as CableStiffness
from .position import CoggingTorque as CoggingTorque
from .position import LoadTorqueBias as LoadTorqueBias
from .position import PeriodicDisturbance as PeriodicDisturbance
from .sensor import SensorBias as SensorBias
from .sensor import SensorDrift as SensorDrift
from .sensor import SensorGain as SensorGain
from .sensor import SensorLag as SensorLag

EFFECTS: dict[str, type[AbstractEffect]] = {
    effect.name: effect
    for effect in (
        CoulombFriction,
        StribeckFriction,
        AsymmetricFriction,
        QuadraticDrag,
        CableStiffness,
        CoggingTorque,
        LoadTorqueBias,
        JointFlexibility,
        Backlash,
        VoltageSaturation,
        VoltageDeadZone,
        InputDelay,
        TorqueConstant,
        WindingHeating,
        PayloadMass,
        HubInertia,
        RootCompliance,
        Gravity,
        StructuralDamping,
        CentrifugalStiffening,
        ViscousFriction,
        SensorBias,
        SensorGain,
        SensorLag,
        SensorDrift,
        PeriodicDisturbance,
    )
}
