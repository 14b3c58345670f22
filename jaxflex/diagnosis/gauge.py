"""Tip deflections that a strain gauge stands for.

Many rigs report as the tip's deflection what a gauge at the root shows, scaled under a weight at the
tip. Of the first mode that is nearly the same; higher modes, which move the tip little, bend the root
a lot, and no parameter or effect makes up for that.
"""

import dataclasses

from ..files.arm_file import ArmFile

MODES = 3  # that a gauge shows
PROMISING = 0.8  # of the misfit over the shortest horizon: a gauge that leaves less is tried in full
BY_GAUGE = (
    "the tip's deflection is followed far better as what a strain gauge at the root shows, scaled under a weight "
    "at the tip (deflection_from = 'gauge'); at high frequencies the two differ"
)


def by_gauge(file: ArmFile) -> ArmFile | None:
    """The arm with the deflections of its flexible links read from gauges; None if that changes nothing."""
    links = tuple(
        dataclasses.replace(link, deflection_from="gauge", modes=max(link.modes, MODES))
        if link.modes > 0 and link.model == "assumed_modes" and link.deflection_from == "tip"
        else link
        for link in file.arm.links
    )
    changed = any(new is not old for new, old in zip(links, file.arm.links, strict=True))
    return dataclasses.replace(file, arm=dataclasses.replace(file.arm, links=links)) if changed else None
