"""Sizes of effects as a rig of this kind has them, whatever they show in the data."""

TYPICAL = {
    "coulomb_friction": 0.01,  # N m
    "stribeck_friction": 0.008,  # N m, the level
    "asymmetric_friction": 0.008,  # N m, the level
    "quadratic_drag": 2e-3,  # N m s^2/rad^2
    "cable_stiffness": 0.05,  # N m/rad
    "cogging_torque": 5e-3,  # N m
    "load_torque_bias": 5e-3,  # N m
    "joint_flexibility": 0.1,  # rad/(N m)
    "backlash": 0.02,  # rad
    "voltage_saturation": 0.4,  # of the largest voltage
    "voltage_dead_zone": 0.3,  # V
    "input_delay": 8e-3,  # s
    "torque_constant": 0.15,
    "winding_heating": 0.03,
    "payload_mass": 0.025,  # kg
    "hub_inertia": 1e-4,  # kg m^2
    "root_compliance": 0.05,  # rad/(N m)
    "gravity": 1.0,  # m/s^2
    "structural_damping": 0.03,
    "centrifugal_stiffening": 5.0,
    "viscous_friction": 2e-3,  # N m s/rad
    "sensor_bias": 50.0,  # times the noise
    "sensor_gain": 0.15,
    "sensor_lag": 0.015,  # s
    "sensor_drift": 20.0,  # times the noise, a second
    "periodic_disturbance": 5e-3,  # N m
    "outside:cubic_link_stiffness": 1e6,
    "outside:friction_patch": 0.03,  # N m
    "outside:growing_friction": 2e-3,  # N m a second
    "outside:load_dependent_friction": 0.3,
    "outside:magnetic_saturation": 0.1,
    "outside:base_resonance": 0.02,  # rad/(N m)
    "outside:soft_stop": 50.0,  # N/m
    "outside:random_torque": 0.01,  # N m
    "outside:current_crosstalk": 30.0,  # times the noise, an ampere
    "outside:sensor_nonlinearity": 0.2,
    "outside:clock_drift": 3e-3,
    "outside:gust": 0.1,  # N m
}
