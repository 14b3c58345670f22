"""How an arm rings: its modes of vibration and their damping, measured from recordings."""

from .measure import MeasuredMode as MeasuredMode
from .measure import MeasuredModes as MeasuredModes
from .measure import measure_modes as measure_modes
