from experiments.diagnosis_matrix.run import met, right, summary, wilson


def test_what_counts_as_right():
    assert right([], "nothing_missing", [], [])
    assert not right([], "missing_effect", ["gravity"], [])
    assert right(["gravity"], "missing_effect", ["gravity"], [])
    assert not right(["gravity"], "missing_effect", ["cable_stiffness", "gravity"], [])
    assert right(["gravity"], "ambiguous", ["cable_stiffness"], ["gravity"])
    assert not right(["gravity"], "ambiguous", ["a", "b"], ["c", "gravity"])
    assert not right(["gravity"], "unexplained", ["gravity"], [])
    assert right(["outside:gust"], "unexplained", [], [])
    assert not right(["outside:gust"], "missing_effect", ["gravity"], [])
    assert right(["a", "b"], "missing_effect", ["b", "a"], [])
    assert right(["stribeck_friction"], "missing_effect", ["coulomb_friction", "stribeck_friction"], [])
    assert not right(["gravity"], "missing_effect", ["coulomb_friction", "gravity"], [])


def test_rates_come_with_their_interval():
    low, high = wilson(19, 20)
    assert 0.76 < low < 0.77 and 0.99 < high < 1.0
    line = {
        "case": "x", "hidden": ["gravity"], "gap": 3.0, "verdict": "missing_effect", "named": ["gravity"],
        "alternatives": [], "after_over_floor": 1.0, "seconds": 20.0, "right": True,
        "parameters": {"gravity": {"along_y": [1.04, 0.01]}},
        "truth": [{"name": "gravity", "location": "base", "values": {"along_y": 1.0}}],
    }  # fmt: skip
    nothing = {"hidden": [], "gap": None, "right": False, "named": [], "parameters": {}, "truth": []}
    text = summary([line, line | nothing])
    assert met(line) and not met(line | {"parameters": {"gravity": {"along_y": [1.06, 0.01]}}})
    assert met(line | {"parameters": {"gravity": {"along_y": [1.06, 0.04]}}}) and met(line | nothing) is None
    assert "| one effect, gap 3 | 1 | 1 | 100% |" in text and "| nothing hidden | 1 | 0 | 0% |" in text
