"""The engine that judges an answer and says what is wrong with it; it knows no chapter.

session      `course("01-frames")`, as a notebook meets it
engine       exercises, predictions, chapters: what a lecturer writes
value        a number to find
outcome      what a check comes to, and the mistakes it can name
trial        one check in progress, up to its verdict
evidence     what is known of an answer in one check
named        which named mistake it is
staying      what stays from one call of it to the next
explanations what is said of a wrong answer that is no named mistake
raised       what is said of one that raises
metrics      how far two results are apart, in degrees and millimeters
relations    what a wrong result has to do with the right one
scope        what a checked function sees besides its arguments
guard        running a student's code without harm
feedback     what appears beneath a cell
progress     what has been solved
source       the py:percent sources of the notebooks
"""

from .session import course, course_map, progress_text

__all__ = ["course", "course_map", "progress_text"]
