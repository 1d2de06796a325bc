"""Operators that act immediately, or report in one line why they cannot."""

import bpy

from blender_rl_guiding.errors import InputError


class Acting(bpy.types.Operator):
    """Runs `act` and shows its InputError. Only subclasses are registered."""

    def act(self, context: bpy.types.Context) -> None:
        """Run the operator's action. InputError if it is impossible."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self.act(context)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}
