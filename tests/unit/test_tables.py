"""A table in columns of letters."""

from blender_rl_guiding.tables import Cell, Row, Table, aligned


def test_columns_are_as_wide_as_their_widest_text():
    rows = {"c1": [Row("bsdf", [Cell("0.25", ("±0.1",))])], "c2": [Row("a_method", [Cell("12")])]}
    assert aligned(Table(("", "mape"), rows)).split("\n") == ["          mape", "    bsdf  0.25", "a_method    12"]
