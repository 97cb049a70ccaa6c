"""The figure one can touch; it knows no chapter and no mathematics.

stage       the Stage: handles, controls, presets, play
canvas      pictures drawn, compared and sent
scene3d     points, lines and triads in space
style       colors and letters by role
marks       small things that several chapters draw
connection  pictures leave the server at once
"""

from .scene3d import View
from .stage import Choice, Handle, Play, Slider, Stage, Toggle

__all__ = ["Choice", "Handle", "Play", "Slider", "Stage", "Toggle", "View"]
