from experiments.study import command

from .run import run

command(run, __file__)
