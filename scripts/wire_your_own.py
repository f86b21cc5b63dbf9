"""Builds the Diagram by hand, steps it, and reads a port: a start for something of one's own.

python scripts/wire_your_own.py
"""

from pydrake.systems.analysis import Simulator

from drake_quad.scenario.load import load_scenario
from drake_quad.simulation.diagram import stair_climb_of
from drake_quad.simulation.prepare import prepare


def main() -> None:
    """Walks on level ground for five seconds and prints the margin twice a second."""
    scenario = load_scenario("flat_walk")
    prepared = prepare(scenario)  # reads the robot, lays the course, plans on paper
    climb = stair_climb_of(prepared)
    simulator = Simulator(climb.diagram)
    monitor = climb.diagram.GetSubsystemByName("stability_monitor")
    for k in range(1, 11):
        simulator.AdvanceTo(0.5 * k)
        context = monitor.GetMyContextFromRoot(simulator.get_context())
        margin = monitor.GetOutputPort("stability_margin").Eval(context)[0]
        print(f"t = {0.5 * k:.1f} s  margin {margin:.3f} m")


if __name__ == "__main__":
    main()
