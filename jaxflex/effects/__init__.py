"""Effects: physics beyond the nominal arm, each a small module with zero meaning absent."""

from .base import AbstractJointEffect as AbstractJointEffect
from .friction import AsymmetricFriction as AsymmetricFriction
from .friction import CoulombFriction as CoulombFriction
from .friction import QuadraticDrag as QuadraticDrag
from .friction import StribeckFriction as StribeckFriction
from .position import CableStiffness as CableStiffness
from .position import CoggingTorque as CoggingTorque
from .position import LoadTorqueBias as LoadTorqueBias

EFFECTS: dict[str, type[AbstractJointEffect]] = {
    effect.name: effect
    for effect in (
        CoulombFriction,
        StribeckFriction,
        AsymmetricFriction,
        QuadraticDrag,
        CableStiffness,
        CoggingTorque,
        LoadTorqueBias,
    )
}
