"""Arms of the papers, ready to use."""

from ..motor import DCMotor
from ..scalars import ScalarLike
from .arm import Arm
from .parts import Joint, Link, Payload


def torque_motor() -> DCMotor:
    """The motor chosen for each joint of `ahmad_arm`: a frameless direct-drive torque motor.

    Ahmad et al. give a gear ratio of one and no electrical data, so the motor must turn
    a 0.5 kg m^2 arm directly: 0.2 N m/A over 2 ohm on 24 V gives 2.4 N m at stall, four
    times what the built-in move asks for, at an electrical time constant of 2 ms. Its
    rotor is part of the paper's motor and hub inertia.
    """
    return DCMotor(
        resistance=2.0,
        inductance=4e-3,
        torque_constant=0.2,
        back_emf_constant=0.2,
        voltage_limit=24.0,
    )


def ahmad_arm(
    payload: ScalarLike = 0.05,
    modes: int = 2,
    mode_shapes: str = "distal_mass_and_moment",
    drive: str = "voltage",
    damping: "ScalarLike | str" = 0.01,
) -> Arm:
    """The two-link arm of Ahmad et al. (2008), Table I, with a motor at each joint.

    `payload` [kg]; `modes` a link; `damping` ratio of the links, or `"ahmad"` for the
    paper's `D = 0.1 sqrt(K)` (ratios of 0.16, which no bare metal link has; hence the
    default). With `drive="torque"` the motors are ideal, as in the paper.

    Believe it while each tip stays within a tenth of its link's length (its position is
    then right to 0.6 % of the length) and the first joint turns slower than an eighth of
    the first angular frequency with joints locked, 0.4 rad/s with 50 g (the frequency is
    then right to 1 %), or with links that have `shortening=1`, nine times as exact at
    that deflection and right to 0.3 % up to twice that angular frequency
    (`experiments/exudyn_check`).
    """

    def link() -> Link:
        return Link(
            length=0.5,
            mass_per_length=0.2,
            flexural_rigidity=1.0,
            damping_ratio=damping,
            modes=modes,
            mode_shapes=mode_shapes,
        )

    def joint(hub_mass: float) -> Joint:
        return Joint(hub_inertia=0.02, hub_mass=hub_mass, motor=torque_motor())

    return Arm(
        links=(link(), link()),
        joints=(joint(0.0), joint(1.0)),
        payload=Payload(mass=payload),
        drive=drive,
        name="two-link arm of Ahmad et al. (2008)",
    )


def foldager_link(
    payload: ScalarLike = 0.0,
    modes: int = 3,
    model: str = "assumed_modes",
    segments: int = 20,
    hub_inertia: ScalarLike = 1.1e-4,
) -> Arm:
    """The single link of Foldager et al. (2014), section 6, with a motor.

    Aluminium, 0.395 m x 39.5 mm x 1.4 mm. The paper's theoretical frequencies need an
    E/rho 11 % above the handbook, hence E = 78 GPa at 2700 kg/m^3. It gives no motor
    data; those here are of a small servo motor, and the hub inertia is an assumption.
    """
    link = Link.from_rectangle(
        length=0.395,
        width=0.0395,
        thickness=1.4e-3,
        youngs_modulus=78e9,
        density=2700.0,
        damping_ratio=0.006,
        modes=modes,
        model=model,
        segments=segments,
    )
    motor = DCMotor(
        resistance=1.2,
        inductance=1.5e-3,
        torque_constant=0.062,
        back_emf_constant=0.062,
        voltage_limit=24.0,
    )
    joint = Joint(hub_inertia=hub_inertia, viscous_friction=2e-4, motor=motor)
    return Arm(
        links=(link,),
        joints=(joint,),
        payload=Payload(mass=payload),
        drive="voltage",
        name="single link of Foldager et al. (2014)",
    )
