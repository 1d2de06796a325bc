"""Opens .blend files: starts a Blender that exports them."""
