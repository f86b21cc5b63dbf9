"""What no flight of stairs can be."""

from numbers import Integral

from drake_quad.terrain_check_field import Checker

STEPS_MAX = 1000  # of a flight
RISE_MAX, RUN_MAX = 2.0, 5.0  # [m] of a step: more is a slip of the pen, such as of millimetres


class StairsChecker(Checker):
    """Checks a flight, but for the fields that other elements have too."""

    def check(self, run_min: float) -> None:
        """A flight: each rise, each run, their number, and how it is built."""
        for field, rise in self.step_values("rise", "rises"):
            if rise <= 0.0:
                sign = "negative rise" if rise < 0.0 else "no rise"
                remedy = f"{sign}: must be more than 0 m; stairs that descend say going: down"
                raise self.error(field, remedy, rise)
            if rise > RISE_MAX:
                raise self.error(field, f"must be at most {RISE_MAX:g} m; in metres?", rise)
        for field, run in self.step_values("run", "runs"):
            if run < run_min:
                remedy = f"shorter than a foot: a tread must be at least {run_min:.3g} m deep"
                raise self.error(field, remedy, run)
            if run > RUN_MAX:
                remedy = f"must be at most {RUN_MAX:g} m; in metres? Beyond that it is a landing"
                raise self.error(field, remedy, run)
        self.check_count()
        self.check_style()

    def check_style(self) -> None:
        """How the treads are built: their overhang and thickness, and whether risers are open."""
        element = self.element
        if element.open is not None and not isinstance(element.open, bool):
            raise self.error("open", "must be true or false")
        if element.overhang is not None:
            least = min(run for _, run in self.step_values("run", "runs"))
            if not 0.0 <= self.number("overhang") <= 0.5 * least:
                raise self.error("overhang", "must be from 0 to half of the shortest run")
        if element.thickness is not None:
            if not (element.open or element.overhang):
                raise self.error("thickness", "only of treads with an overhang or open risers")
            if self.number("thickness") <= 0.0:
                raise self.error("thickness", "must be more than 0 m")
        thickness = element.style[1]
        if thickness >= min(rise for _, rise in self.step_values("rise", "rises")):
            remedy = f"treads {thickness:g} m thick fill the lowest riser: they must be thinner"
            raise self.error("thickness", remedy)

    def step_values(self, one: str, many: str) -> list[tuple[str, float]]:
        """Field and value of every rise (or run), whether written once or step by step."""
        values = getattr(self.element, many)
        if values is None:
            return [(one, self.number(one))]
        if getattr(self.element, one) is not None:
            raise self.error(many, f"say {one} or {many}, not both")
        if len(values) == 0:
            raise self.error(many, "needs a step at least")
        return [(f"{many}[{k}]", self.finite(f"{many}[{k}]", v)) for k, v in enumerate(values)]

    def check_count(self) -> None:
        """The number of steps: a whole number, in bounds, and the same in whatever says it."""
        element = self.element
        count, rises, runs = element.count, element.rises, element.runs
        if rises is not None and runs is not None and len(rises) != len(runs):
            remedy = f"has {len(runs)} steps but rises has {len(rises)}: one value for each step"
            raise self.error("runs", remedy)
        if rises is None and runs is None:
            if isinstance(count, bool) or not isinstance(count, Integral) or count < 1:
                raise self.error("count", "must be a whole number of steps, at least 1")
        elif count is not None and count != element.step_count:
            raise self.error("count", f"the lists have {element.step_count} steps: leave it out")
        if element.step_count > STEPS_MAX:
            raise self.error("count", f"a flight has at most {STEPS_MAX} steps: add a landing")
