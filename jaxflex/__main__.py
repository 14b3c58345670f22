"""The `jaxflex` command."""

from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Optional

import typer

from .cli.runtime import command

app = typer.Typer(
    help="Flexible-link robot arms driven by DC motors: model, simulate, tune, diagnose.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)

ArmFile = Annotated[
    Optional[Path], typer.Argument(metavar="[ARM]", help="arm.toml; without one, the built-in two-link arm.")
]
Json = Annotated[Optional[Path], typer.Option("--json", help="Write the result to this JSON file.")]
Output = Annotated[Optional[Path], typer.Option("-o", "--output", help="Folder for figures and tables.")]


@app.command()
def tune(
    arm: ArmFile = None,
    payloads: Annotated[str, typer.Option(help="kg, FIRST:LAST:COUNT or A,B,…")] = "0:0.1:6",
    move: Annotated[Optional[str], typer.Option(help="Target of every joint, rad, A,B,…")] = None,
    duration: Annotated[Optional[float], typer.Option(help="Duration of the unshaped move, s.")] = None,
    steps: Annotated[int, typer.Option(help="Steps of the search.")] = 48,
    seed: Annotated[int, typer.Option(help="Seed of the scattered starts.")] = 0,
    json: Json = None,
    output: Output = None,
) -> None:
    """Tune PD gains and an input shaper by gradient so that the tip stops ringing for every payload."""
    _run("tune", arm, payloads, move, duration, steps, seed, json, output)


@app.command()
def simulate(
    arm: ArmFile = None,
    payload: Annotated[Optional[float], typer.Option(help="Mass at the tip, kg.")] = None,
    signal: Annotated[
        Optional[str],
        typer.Option("--input", help="move, step, bang-bang, or a recording (.csv, .mat, .tdms, .parquet)."),
    ] = None,
    duration: Annotated[Optional[float], typer.Option(help="Length of the run, s.")] = None,
    dt: Annotated[float, typer.Option(help="Time between the rows of the CSV, s.")] = 0.002,
    json: Json = None,
    output: Output = None,
) -> None:
    """Simulate one run of an arm, or of the design that tune wrote; writes CSV and figure."""
    _run("simulate", arm, payload, signal, duration, dt, json, output)


@app.command()
def modes(
    arm: ArmFile = None,
    payloads: Annotated[Optional[str], typer.Option(help="kg, FIRST:LAST:COUNT or A,B,…")] = None,
    pose: Annotated[Optional[str], typer.Option(help="Angle of every joint, rad, A,B,…")] = None,
    json: Json = None,
    output: Output = None,
) -> None:
    """Natural frequencies with joints free, locked and controlled, against payload."""
    _run("modes", arm, payloads, pose, json, output)


@app.command()
def diagnose(
    arm: Annotated[Path, typer.Argument(metavar="ARM", help="arm.toml of the nominal arm.")],
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Recordings of it (.csv, .mat, .tdms, .parquet).")
    ],
    json: Json = None,
    output: Output = None,
) -> None:
    """Find where the model and measured runs disagree, name the missing effect, and add it."""
    _run("diagnose", arm, runs, json, output, fuse=True)


@app.command()
def shaper(
    files: Annotated[
        Optional[list[Path]],
        typer.Argument(
            metavar="[ARM | RUN...]",
            help="arm.toml, or recordings of its vibration; without either, the built-in two-link arm.",
        ),
    ] = None,
    payloads: Annotated[Optional[str], typer.Option(help="kg, FIRST:LAST:COUNT or A,B,…; of an arm.")] = None,
    driven_by: Annotated[
        Optional[str],
        typer.Option(
            "--input",
            help="What drives the arm in the recordings: reference, voltage, torque, current or angle.",
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Share of the vibration that may be left.")] = 0.05,
    json: Json = None,
    output: Output = None,
) -> None:
    """Measure or compute what rings, and recommend an input shaper, with the reason."""
    _run("shaper", files or [], payloads, driven_by, tolerance, json, output)


def _run(name: str, *given: Any, fuse: bool = False) -> None:
    """The command `name`, imported by itself: the others need what takes long to import."""
    module = import_module(f"jaxflex.cli.{name}")
    command(getattr(module, name), fuse=fuse)(*given)


def main() -> None:
    """Entry point of the command line."""
    app()


if __name__ == "__main__":
    main()
