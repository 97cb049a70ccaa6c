"""The engine that judges an answer and says what is wrong with it; it knows no chapter.

session     `course("01-frames")`, as a notebook meets it
engine      exercises, values, predictions, and the verdict on an answer
metrics     how far two results are apart, in degrees and millimeters
relations   what a wrong result has to do with the right one
scope       what a checked function sees besides its arguments
guard       running a student's code without harm
feedback    what appears beneath a cell
progress    what has been solved
source      the py:percent sources of the notebooks
"""

from .session import course, course_map, progress_text

__all__ = ["course", "course_map", "progress_text"]
