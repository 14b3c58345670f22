"""The notebooks run, in a reduced form; what is stored is whole, small and says nothing of the machine."""

import inspect
import re

import nbformat
import pytest

from experiments.notebooks.execute import NOTEBOOKS, execute

TITLES = ("first arm", "energies", "tune", "hundreds", "lack", "your own", "learn", "papers")
LARGEST = 300_000  # bytes
STRANGE = re.compile(r"/tmp/|/home/|/root/|/Users/|site-packages|Traceback|Warning")


def strict():
    """Make figures refuse to be drawn while an axis with numbers on it has a label without a unit."""
    import re

    from matplotlib.figure import Figure

    def label(axes, way):
        """What stands at an axis, or at another that shares it."""
        sharing = getattr(axes, f"get_shared_{way}_axes")()
        beside = [other for other in axes.figure.axes if other is axes or sharing.joined(axes, other)]
        return " ".join(getattr(other, f"get_{way}label")() for other in beside)

    def draw(self, renderer, plain=Figure.draw):
        for axes in self.axes:
            for way in "xy":
                words = label(axes, way)
                bare = hasattr(axes, "_colorbar") and not words
                if axes.axison and not bare and not re.search(r"\[.+\]", words):
                    raise ValueError(f"axis {way} has the label {words!r}, which names no unit")
        return plain(self, renderer)

    Figure.draw = draw


def test_there_are_eight():
    assert len(NOTEBOOKS) == len(TITLES)
    for path, title in zip(NOTEBOOKS, TITLES, strict=True):
        first = nbformat.read(path, as_version=4).cells[0].source
        assert title in first.splitlines()[0].lower() and "**What you will be able to do:**" in first


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_is_stored_is_whole(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert path.stat().st_size < LARGEST
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert any("image/png" in output.get("data", {}) for cell in code for output in cell.outputs)
    for cell in code:
        for output in cell.outputs:
            assert output.output_type != "error" and output.get("name") != "stderr", cell.source
            text = output.get("text", "") + output.get("data", {}).get("text/plain", "")
            assert not STRANGE.search(text), text


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs_reduced(path, monkeypatch, tmp_path_factory):
    monkeypatch.setenv("JAXFLEX_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))
    execute(path, reduced=True, first=inspect.getsource(strict) + "\nstrict()")
