"""The paper's course, as the tests of the terrain build it."""

from drake_quad.terrain.elements import Element

CASE_STUDY = (
    Element("floor", length=4.0),
    Element("stairs", going="up", rise=0.13, run=0.5, count=6),
    Element("landing", length=3.0, turn_deg=90.0),
    Element("stairs", going="down", rise=0.13, run=0.5, count=6),
    Element("floor", length=3.5),
)
