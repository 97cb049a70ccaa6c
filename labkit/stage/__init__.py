"""The figure one can touch; it knows no chapter and no mathematics.

stage       the Stage: state, presets, what goes to the page and comes from it
controls    what one may declare: handles, sliders, choices, toggles, time, targets
stage.js    the front end, the same in notebooks and on any other page
front       a Stage in a notebook
canvas      pictures drawn, compared and sent
room        how a figure fits a place that is smaller than designed
renderer    how it is drawn: words kept, colors for the dark theme
scene3d     bodies, frames, points and paths in space; scene3d_solids what bodies are made of, scene3d_handles how
            handles move there; space.js draws them in the page and is made of web/space
style       colors and letters by role
marks       small things that several chapters draw
tape        moments gone by, so that time can be scrubbed
garbage     let go while nothing moves
film        a Stage recorded for the reading edition
"""

from .controls import Choice, Handle, Play, Slider, Target, Toggle
from .scene3d import View
from .stage import Stage, living

__all__ = ["Choice", "Handle", "Play", "Slider", "Stage", "Target", "Toggle", "View", "living"]
