"""Execute a notebook in a kernel of its own, at full size or reduced."""

import base64
import io
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

HERE = Path(__file__).resolve().parent
NOTEBOOKS = sorted(HERE.glob("*.ipynb"))
LONGEST = 3600  # s, of one cell


def execute(path: Path, reduced: bool = False, first: str = "") -> nbformat.NotebookNode:
    """The notebook at `path` with the outputs of a fresh run, in an empty folder of its own.

    `reduced`: a cell with smaller numbers, kept in the metadata of the cell that it follows,
    is run after it. `first`: code that runs before everything else. Neither is in the result.

    **Raises** `nbclient.exceptions.CellExecutionError` if a cell fails.
    """
    notebook = nbformat.read(path, as_version=4)
    cells = [nbformat.v4.new_code_cell(first)] if first else []
    own = []
    for cell in notebook.cells:
        own.append(len(cells))
        cells.append(cell)
        if reduced and "reduced" in cell.metadata:
            cells.append(nbformat.v4.new_code_cell(cell.metadata["reduced"]))
    run = nbformat.v4.new_notebook(cells=cells, metadata=notebook.metadata)
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            run,
            timeout=LONGEST,
            record_timing=False,
            coalesce_streams=True,
            resources={"metadata": {"path": folder}},
        )
        client.execute()
    notebook.cells = [cells[i] for i in own]
    for number, cell in enumerate((c for c in notebook.cells if c.cell_type == "code"), 1):
        cell.execution_count = number
        for output in cell.outputs:
            if "execution_count" in output:
                output.execution_count = number
            if "image/png" in output.get("data", {}):
                output.data["image/png"] = smaller(output.data["image/png"])
    return notebook


def smaller(png: str) -> str:
    """The same picture in 128 colours, half the size; both in base64."""
    stream = io.BytesIO()
    with Image.open(io.BytesIO(base64.b64decode(png))) as picture:
        few = picture.convert("RGB").quantize(128, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        few.save(stream, "PNG", optimize=True)
    return base64.b64encode(stream.getvalue()).decode()
