"""Controllers for flexible arms: references, input shapers, feedback laws and gradient tuning."""

# What the joints should do
# How a design fares, and how it is tuned
from .aggregate import AbstractAggregate as AbstractAggregate
from .aggregate import Blend as Blend
from .aggregate import ConditionalValueAtRisk as ConditionalValueAtRisk
from .aggregate import Mean as Mean
from .aggregate import Worst as Worst
from .aggregate import likely as likely
from .aggregate import varied as varied
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

# Feedback
from .biquad import Biquad as Biquad
from .biquad import notch as notch
from .compose import Filtered as Filtered
from .compose import Sum as Sum
from .compose import ZeroOrderHold as ZeroOrderHold

# Designs to compare
from .designs import Design as Design
from .designs import NoRinging as NoRinging
from .designs import classical_designs as classical_designs
from .designs import default_move as default_move
from .designs import ringing_mode as ringing_mode
from .designs import stack as stack
from .designs import textbook_pd as textbook_pd
from .designs import unshaped_design as unshaped_design
from .designs import with_duration as with_duration
from .instruments import Instrumented as Instrumented
from .inverse_dynamics import ComputedTorque as ComputedTorque
from .inverse_dynamics import InverseDynamics as InverseDynamics
from .learning import Learned as Learned
from .learning import Replayed as Replayed
from .learning import impulse_response as impulse_response
from .learning import learn as learn
from .learning import learning_gain as learning_gain
from .lqg import LQG as LQG
from .lqg import lqg as lqg
from .minimise import Minimum as Minimum
from .minimise import Stepper as Stepper
from .minimise import minimise as minimise
from .move_problem import Problem as Problem
from .move_problem import standard_start as standard_start
from .pareto import ParetoFront as ParetoFront
from .pareto import pareto_front as pareto_front
from .pd import GAINS as GAINS
from .pd import PD as PD
from .pd import OpenLoop as OpenLoop
from .pid import PID as PID
from .pid import StrainRateFeedback as StrainRateFeedback
from .references import AbstractProfile as AbstractProfile
from .references import BangBang as BangBang
from .references import MinimumJerk as MinimumJerk
from .references import Move as Move
from .references import Quintic as Quintic
from .references import Sampled as Sampled
from .references import SCurve as SCurve
from .references import Step as Step
from .references import Trapezoid as Trapezoid
from .riccati import kalman_gain as kalman_gain
from .riccati import lqr_gain as lqr_gain
from .riccati import solve_care as solve_care
from .riccati import solve_dare as solve_dare

# Input shapers
from .shapers import CLASSICAL as CLASSICAL
from .shapers import Shaped as Shaped
from .shapers import Shaper as Shaper
from .shapers import convolve as convolve
from .shapers import ei as ei
from .shapers import residual_ratio as residual_ratio
from .shapers import unshaped as unshaped
from .shapers import zv as zv
from .shapers import zvd as zvd
from .shapers import zvdd as zvdd
from .task import Limits as Limits
from .task import Outcome as Outcome
from .task import Task as Task
from .task import Weights as Weights
from .tuning import AbstractProblem as AbstractProblem
from .tuning import Freely as Freely
from .tuning import Tuned as Tuned
from .tuning import tune as tune
