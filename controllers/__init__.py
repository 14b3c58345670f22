"""Controllers for flexible arms: references, input shapers, PD control and gradient tuning."""

# What the joints should do
# How a design fares, and how it is tuned
from .assess import Assessment as Assessment
from .assess import assess as assess
from .assess import measure as measure
from .assess import run as run
from .assess import with_payloads as with_payloads
from .bijections import AbstractBijection as AbstractBijection
from .bijections import Delays as Delays
from .bijections import Interval as Interval
from .bijections import Positive as Positive
from .bijections import Simplex as Simplex

# Designs to compare
from .designs import Design as Design
from .designs import classical_designs as classical_designs
from .designs import default_move as default_move
from .designs import ringing_mode as ringing_mode
from .designs import stack as stack
from .designs import textbook_pd as textbook_pd
from .designs import unshaped_design as unshaped_design
from .designs import with_duration as with_duration
from .free_shaper import FreeMotion as FreeMotion
from .free_shaper import TunedShaper as TunedShaper
from .free_shaper import free_motion as free_motion
from .free_shaper import shaped_residual as shaped_residual
from .free_shaper import stack_motions as stack_motions
from .free_shaper import step_motion as step_motion
from .free_shaper import tip_after as tip_after
from .free_shaper import tune_shaper as tune_shaper
from .minimise import Minimum as Minimum
from .minimise import minimise as minimise

# Feedback
from .pd import GAINS as GAINS
from .pd import PD as PD
from .pd import OpenLoop as OpenLoop
from .recommend import ALTERNATING as ALTERNATING
from .recommend import Rated as Rated
from .recommend import rate_shapers as rate_shapers
from .recommend import recommend as recommend
from .references import AbstractProfile as AbstractProfile
from .references import BangBang as BangBang
from .references import MinimumJerk as MinimumJerk
from .references import Move as Move
from .references import Quintic as Quintic
from .references import Sampled as Sampled
from .references import SCurve as SCurve
from .references import Step as Step
from .references import Trapezoid as Trapezoid

# Input shapers
from .shapers import CLASSICAL as CLASSICAL
from .shapers import SHAPERS as SHAPERS
from .shapers import Shaped as Shaped
from .shapers import Shaper as Shaper
from .shapers import convolve as convolve
from .shapers import cosine as cosine
from .shapers import ei as ei
from .shapers import half_sine as half_sine
from .shapers import insensitivity as insensitivity
from .shapers import load_shaper as load_shaper
from .shapers import matched_s_curve as matched_s_curve
from .shapers import on_samples as on_samples
from .shapers import polynomial as polynomial
from .shapers import residual_curve as residual_curve
from .shapers import residual_ratio as residual_ratio
from .shapers import si as si
from .shapers import simultaneous as simultaneous
from .shapers import um_zv as um_zv
from .shapers import um_zvd as um_zvd
from .shapers import unshaped as unshaped
from .shapers import zero_placement as zero_placement
from .shapers import zv as zv
from .shapers import zvd as zvd
from .shapers import zvdd as zvdd
from .tuning import Problem as Problem
from .tuning import Tuned as Tuned
from .tuning import Weights as Weights
from .tuning import cost as cost
from .tuning import standard_start as standard_start
from .tuning import tune as tune
