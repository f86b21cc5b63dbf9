"""Builds the Diagram by hand, steps it, and reads a port: a start for something of one's own.

python scripts/wire_your_own.py
"""

from pydrake.systems.analysis import Simulator

from drake_quad.diagram import MakeStairClimb
from drake_quad.scenario import control_settings, load_scenario
from drake_quad.simulation import prepare


def main() -> None:
    """Walks on level ground for five seconds and prints the margin twice a second."""
    scenario = load_scenario("flat_walk")
    prepared = prepare(scenario)  # reads the robot, lays the course, plans on paper
    climb = MakeStairClimb(
        robot=prepared.robot,
        course=prepared.course,
        settings=prepared.settings,
        mission=prepared.tasks,
        control=control_settings(scenario),
        stance=prepared.stance,
        plant_config=scenario.simulation.plant,
        friction=scenario.simulation.friction,
        log_period=scenario.simulation.log_period,
    )
    simulator = Simulator(climb.diagram)
    monitor = climb.diagram.GetSubsystemByName("stability_monitor")
    for k in range(1, 11):
        simulator.AdvanceTo(0.5 * k)
        context = monitor.GetMyContextFromRoot(simulator.get_context())
        margin = monitor.GetOutputPort("stability_margin").Eval(context)[0]
        print(f"t = {0.5 * k:.1f} s  margin {margin:.3f} m")


if __name__ == "__main__":
    main()
