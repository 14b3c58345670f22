"""The same arm in Exudyn: geometrically exact beams, which know no small deflection."""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

import jaxflex as jf

# An aluminium strip of Ahmad's rho and EI: 48.8 mm x 1.52 mm. What the Euler-Bernoulli link
# takes as rigid or as nothing follows from the material and not from a choice.
YOUNGS_MODULUS, SHEAR_MODULUS, DENSITY, SHEAR_CORRECTION = 70e9, 26e9, 2700.0, 5 / 6


class Motion(NamedTuple):
    """What Exudyn's sensors saw: arrays `(times, links)`, the tip `(times, 2)` [m]."""

    times: np.ndarray
    angle: np.ndarray
    deflection: np.ndarray
    tip: np.ndarray


class BeamArm:
    """An arm of `jaxflex`, each link cut into `elements` beams, at rest and straight at `pose` [rad]."""

    def __init__(self, arm: jf.Arm, pose, elements: int, locked: bool = False):
        self.system = add = exu.SystemContainer().AddSystem()
        self.ground = add.AddObject(item.ObjectGround())
        self.links, heading, place = len(arm.links), 0.0, np.zeros(2)
        self.roots, self.tips = [], []
        for i, link in enumerate(arm.links):
            heading += float(pose[i])
            along = np.array([np.cos(heading), np.sin(heading)])
            length, rho, rigidity = (
                float(link.length),
                float(link.mass_per_length),
                float(link.flexural_rigidity),
            )
            area = rho / DENSITY
            nodes = [
                add.AddNode(item.NodeRigidBody2D(referenceCoordinates=[*(place + x * along), heading]))
                for x in np.linspace(0.0, length, elements + 1)
            ]
            for pair in pairwise(nodes):
                add.AddObject(
                    item.ObjectBeamGeometricallyExact2D(
                        nodeNumbers=list(pair),
                        length=length / elements,
                        massPerLength=rho,
                        crossSectionInertia=DENSITY * rigidity / YOUNGS_MODULUS,
                        bendingStiffness=rigidity,
                        axialStiffness=YOUNGS_MODULUS * area,
                        shearStiffness=SHEAR_CORRECTION * SHEAR_MODULUS * area,
                        includeReferenceRotations=True,
                    )
                )
            joint = arm.joints[i]
            self._body(nodes[0], 0.0, joint.hub_inertia)
            self._join(nodes[0], joint.hub_mass, locked)
            self.roots.append(nodes[0])
            self.tips.append(nodes[-1])
            place = place + length * along
        self._body(self.tips[-1], arm.payload.mass, arm.payload.inertia)

    def _body(self, node, mass, inertia):
        self.system.AddObject(
            item.ObjectRigidBody2D(mass=float(mass), inertia=float(inertia), nodeNumber=node)
        )

    def _join(self, node, hub_mass, locked):
        """Pin the root of a link to the tip of the one before it, or to the ground; weld it if `locked`."""
        add = self.system
        here = add.AddMarker(item.MarkerNodeRigid(nodeNumber=node))
        if self.tips:
            self._body(self.tips[-1], hub_mass, 0.0)
            there = add.AddMarker(item.MarkerNodeRigid(nodeNumber=self.tips[-1]))
        else:
            there = add.AddMarker(item.MarkerBodyRigid(bodyNumber=self.ground))
        add.AddObject(item.ObjectJointRevolute2D(markerNumbers=[there, here]))
        if locked:
            turn = [add.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))]
            if self.tips:
                turn.insert(
                    0, add.AddMarker(item.MarkerNodeCoordinate(nodeNumber=self.tips[-1], coordinate=2))
                )
            else:
                fixed = add.AddNode(item.NodePointGround())
                turn.insert(0, add.AddMarker(item.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0)))
            add.AddObject(item.ObjectConnectorCoordinate(markerNumbers=turn))

    def frequencies(self, count: int) -> np.ndarray:
        """The `count` lowest natural frequencies [Hz], ascending, rigid-body zeros included."""
        self.system.Assemble()
        return np.sort(self.system.ComputeODE2Eigenvalues(convert2Frequencies=True)[0])[:count]

    def simulate(self, torque: Callable[[float], np.ndarray], end: float, samples: int, each: int) -> Motion:
        """Motion under `torque(t)` [N m] of every joint until `end` [s], seen `samples` times.

        Generalised-alpha with Newton's method, `each` steps a sample.
        """
        add = self.system
        for i in range(self.links):
            self._torque(self.roots[i], lambda t, i=i: torque(t)[i])
            if i > 0:
                self._torque(self.tips[i - 1], lambda t, i=i: -torque(t)[i])
        sensors = [
            add.AddSensor(
                item.SensorNode(
                    nodeNumber=node, storeInternal=True, outputVariableType=exu.OutputVariableType.Coordinates
                )
            )
            for node in (*self.roots, *self.tips)
        ]
        add.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = samples * each
        settings.timeIntegration.endTime = end
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.adaptiveStep = False
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.newton.relativeTolerance = 1e-6
        settings.timeIntegration.newton.absoluteTolerance = 1e-6
        settings.solution.sensors.writePeriod = end / samples
        settings.solution.file.write = False
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        add.SolveDynamic(settings)
        seen = [add.GetSensorStoredData(sensor) for sensor in sensors]
        start = [np.array(add.GetNode(node)["referenceCoordinates"]) for node in (*self.roots, *self.tips)]
        at = np.stack([data[:, 1:4] + zero for data, zero in zip(seen, start, strict=True)], axis=1)
        roots, tips = at[:, : self.links], at[:, self.links :]
        heading = np.concatenate([np.zeros((len(at), 1)), tips[:, :-1, 2]], axis=1)
        reach = tips[:, :, :2] - roots[:, :, :2]
        across = -np.sin(roots[:, :, 2]) * reach[:, :, 0] + np.cos(roots[:, :, 2]) * reach[:, :, 1]
        return Motion(seen[0][:, 0], roots[:, :, 2] - heading, across, tips[:, -1, :2])

    def _torque(self, node, of_time):
        self.system.AddLoad(
            item.LoadTorqueVector(
                markerNumber=self.system.AddMarker(item.MarkerNodeRigid(nodeNumber=node)),
                loadVectorUserFunction=lambda mbs, t, load: [0.0, 0.0, float(of_time(t))],
            )
        )
