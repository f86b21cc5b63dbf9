"""`disturbances.mass_factor`: the real robot is heavier or lighter than its controller's model."""

import numpy as np
import pytest
from rig import model_plant, paper_robot

from drake_quad.errors import InputError
from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.plant import MakeTrueModel
from drake_quad.simulation.prepare import prepare
from drake_quad.systems.disturbances import Disturbances


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_it_is_as_if_every_link_were_of_another_density(factor: float) -> None:
    """Mass matrix, bias and gravity are the model's times the factor, at any posture."""
    heavier, plain = MakeTrueModel(paper_robot(), Disturbances(mass_factor=factor)), model_plant()
    contexts = heavier.CreateDefaultContext(), plain.CreateDefaultContext()
    rng = np.random.default_rng(4)
    for _ in range(5):
        q = rng.uniform(-1.0, 1.0, size=plain.num_positions())
        q[:4] /= np.linalg.norm(q[:4])
        for plant, context in zip((heavier, plain), contexts, strict=True):
            plant.SetPositions(context, q)
            plant.SetVelocities(context, 0.1 * np.arange(18.0))
        # What the rotors add through the gears is the drives', and no link's.
        rotors = np.zeros((plain.num_velocities(), plain.num_velocities()))
        for index in plain.GetJointActuatorIndices():
            actuator = plain.get_joint_actuator(index)
            place = actuator.joint().velocity_start()
            rotors[place, place] = actuator.calc_reflected_inertia(contexts[1])
        np.testing.assert_allclose(
            heavier.CalcMassMatrix(contexts[0]) - rotors,
            factor * (plain.CalcMassMatrix(contexts[1]) - rotors),
            atol=1e-9,
        )
        for terms in ("CalcBiasTerm", "CalcGravityGeneralizedForces"):
            np.testing.assert_allclose(
                getattr(heavier, terms)(contexts[0]),
                factor * getattr(plain, terms)(contexts[1]),
                atol=1e-9,
            )


def test_a_shift_of_the_trunks_mass_moves_what_it_really_has() -> None:
    """The robot's centre of mass moves by the offset times the trunk's part, whatever that is."""
    robot, offset = paper_robot(), (0.03, -0.01, 0.02)
    moved = []
    for factor in (1.0, 1.2):
        both = [
            MakeTrueModel(robot, Disturbances(mass_factor=factor, com_offset=shift))
            for shift in ((0.0, 0.0, 0.0), offset)
        ]
        one, other = (p.CalcCenterOfMassPositionInWorld(p.CreateDefaultContext()) for p in both)
        moved.append(other - one)
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-12)


@pytest.mark.parametrize(("factor", "load"), [(1.0, 0.0), (0.9, 0.0), (1.1, 7.0)])
def test_the_mass_that_moves_is_the_simulated_robots(factor: float, load: float) -> None:
    """What figures weigh the robot by is what Drake simulates: heavier links and the payload."""
    disturbances = Disturbances(mass_factor=factor, payload_mass=load)
    plant = MakeTrueModel(paper_robot(), disturbances)
    simulated = plant.CalcTotalMass(plant.CreateDefaultContext())
    assert disturbances.mass_of(paper_robot().mass) == pytest.approx(simulated)


def test_the_controller_is_not_told() -> None:
    """The model that plans and controls has the file's mass; nonsense is refused."""
    prepared = prepare(load_scenario("flat_walk", ["disturbances.mass_factor=1.1"]))
    assert prepared.robot.mass == paper_robot().mass and prepared.disturbances.mass_factor == 1.1
    with pytest.raises(InputError, match="mass_factor"):
        load_scenario("flat_walk", ["disturbances.mass_factor=0"])
