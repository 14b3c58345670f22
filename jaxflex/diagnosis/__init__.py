"""Diagnosis: where model and measurement disagree, what is missing, and the gap with it added."""

from .diagnose import diagnose as diagnose
from .result import Diagnosis as Diagnosis
