"""Operators that do one thing at once, or report in one line why they cannot."""

import bpy

from blender_rl_guiding.errors import InputError


class Acting(bpy.types.Operator):
    """Runs `act` and shows its InputError; itself never registered."""

    def act(self, context: bpy.types.Context) -> None:
        """Do it. InputError where it is impossible."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self.act(context)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}
