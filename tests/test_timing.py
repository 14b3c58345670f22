import jax.numpy as jnp
import numpy as np

import jaxflex as jf
from controllers import PD, Step


def test_stages_are_timed_and_the_result_is_that_of_the_function():
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.02),))
    given = (arm, PD((2.0,), (0.1,)), Step((0.0,), (0.3,)), jnp.linspace(0.0, 0.2, 5))
    run, seconds = jf.timed(jf.simulate)(*given, method=jf.Fixed(1e-3))
    np.testing.assert_allclose(run["angle_1"], jf.simulate(*given, method=jf.Fixed(1e-3))["angle_1"])
    assert run.check() is run
    assert all(s > 0 for s in seconds) and seconds.run < seconds.compile
    assert "compiled in" in repr(seconds)
