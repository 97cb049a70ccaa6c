# %% title [markdown]
# # Robot calibration and localization: start here
#
# Four real documents, a lab sheet, a master thesis, a research report and a lecture, are recomputed in this workbook number by number. Then you beat them on their
# own data. You write the mathematics yourself, in small functions; every one is checked the moment you run its cell.
#
# **What you will do here.** See the map, learn the signs we use, and make one deliberate mistake. About 15 minutes.

# %% setup
import numpy as np

from labkit.chapters.ch00_start_here import stages
from labkit.exercises import course, course_map

ex = course("00-start-here")

# %% map [markdown]
# ## The map, and where you are
#
# Each chapter has a core path that is meant for 45 to 90 minutes; sections marked *further* come on top, and are counted apart. The chapters build on each other, but an
# unsolved step never blocks you: its name then stands for the reference solution, and the cell says so. After a restart, run the cells above the place where you go on (*Run > Run All Above Selected Cell*).

# %% course-map tags=["nbval-ignore-output"]
course_map()

# %% how [markdown]
# ## How an exercise works
#
# A cell with `@ex.name` above a function, or `ex.name(value)` below a number, is an exercise. Replace the `...` and **run the cell: running it is the check.** One of
# four outcomes appears beneath it:
#
# | sign | outcome | meaning |
# | --- | --- | --- |
# | ○ | to do | nothing written yet |
# | ✗ | not yet | it runs, and something about it is named |
# | ✓ | correct | right on several random draws; there is no stored answer to copy |
# | ! | your code raised … | the error, your line, and the call that led there |
#
# Stuck? Press *Hint*, three times if you like. *Solution* shows one way, *Start over* the empty cell. In code: `ex.name.hint()`,
# `.solution()`, `.starter()`. What you have solved is remembered in a file of your home folder, and nowhere else.

# %% mistake [markdown]
# ## A deliberate mistake
#
# Turn the point $(x, y)$ by a quarter turn **counterclockwise** about the origin. The version below is wrong on purpose. Run it, read what it says, then repair it.

# %% quarter-turn-wrong tags=["student"]
@ex.quarter_turn
def quarter_turn(p):
    """Return p, shape (2,), turned by +90 deg about the origin."""
    x, y = p
    return np.array([y, -x])


# %% quarter-turn tags=["solution"]
@ex.quarter_turn
def quarter_turn(p):
    """Return p, shape (2,), turned by +90 deg about the origin."""
    ### BEGIN SOLUTION
    x, y = p
    return np.array([-y, x])
    ### END SOLUTION


# %% predict [markdown]
# ## Predict, then touch
#
# Where a figure can surprise, a question stands before it. The first one: **you turn a point by a quarter turn, twice. Where does it end up?** Run the cell and click an answer (`guess` may stay as it is): the first one is locked in, and the figure appears. Drag its round handles with mouse or finger; or select one with the Tab key and move it
# with the arrow keys (Shift makes ten steps at once). *Reset* brings the start back, *Make it fail* shows what goes wrong.

# %% predict-twice
guess = ...  # your code here
### BEGIN SOLUTION
guess = "opposite, across the origin"
### END SOLUTION
ex.predict("twice", guess, reveal=stages.quarter_turns)

# %% notation [markdown]
# ## Notation
#
# `T_AB` maps coordinates in frame B to coordinates in frame A. Neighboring letters cancel: `T_AC = T_AB @ T_BC`. The same letters stand in text, code and figures.
#
# | here | lab sheet | thesis | report | read as |
# | --- | --- | --- | --- | --- |
# | $T_{AF}$, `T_AF` | ${}^{A}T_{F}$ | $T_A^F$ | $T^A_F$ | pose of F, seen from A |
# | $R_i$, $t_i$ | $R_i$, $P_i$ | rotation and last column of $T_A^F$ | $R$, $p$ | rotation, translation |
#
# **Units.** Lengths are mm in chapters 1 to 6 and 11, and m in chapters 7 to 9, as in the documents; chapter 8 filters the tracker of chapter 6, in mm, at its end. Angles are radians inside; degrees appear only in names ending in `_deg`.

# %% colors [markdown]
# ## Colors
#
# A color has the same role in every figure, and never works alone: line style, marker or letter say the same. In the dark theme, truth turns light.

# %% colors-shown
stages.colors()

# %% glossary [markdown]
# ## Words of the four documents
#
# | German | Czech | English |
# | --- | --- | --- |
# | Schmidtsche Orthonormalisierung | Gramova–Schmidtova ortogonalizace | Gram-Schmidt orthonormalization |
# | Verkettung von Transformationen | skládání transformací | chaining of transforms |
# | Quirlen (Kreiseln) | kalibrace otáčením kolem bodu | pivot calibration ("swirling") |
# | Drehpunkt | bod otáčení | pivot point |
# | Messspitze, Werkzeug | hrot, nástroj | tip, tool |
# | Flansch | příruba | flange |
# | Hand-Auge-Kalibrierung | kalibrace ruka-oko | hand-eye calibration |
# | Lichtschnittsensor | profilový skener | laser line scanner |
# | Vertrauensbereich | oblast důvěry | trust region |
# | Sattelpunkt | sedlový bod | saddle point |
# | Lagesensor | tracker | tracker |
# | Streuung, Varianz | rozptyl | spread, variance |
# | Koppelnavigation | navigace výpočtem | dead reckoning |
# | Lateration | laterace | lateration |
# | Kovarianzmatrix | kovarianční matice | covariance matrix |
# | Landmarke | orientační bod | landmark |
# | Belegtheitsgitter | mřížka obsazenosti | occupancy grid |
# | Partikel, Gewicht | částice, váha | particle, weight |
# | Roulette-Rad, Speichenrad | ruleta, systematické převzorkování | roulette, systematic resampling |
# | entführter Roboter | unesený robot | kidnapped robot |

# %% after-work [markdown]
# ## Good to know
#
# - Save the notebook as usual. In a terminal, `python lab.py progress` shows all chapters, and `python lab.py reset 01` brings back an empty chapter 1 and
#   keeps your copy. Where the course was installed with pip, as on a course server, the commands are `labkit progress` and `labkit reset 01`.
# - A function that runs forever is stopped in a check: after two seconds of computing, or a few more where much has to be computed. Elsewhere press the stop button of JupyterLab.
#   If the cell still shows `[*]`, the code sits inside one single call that Python cannot interrupt, such as `sum(itertools.repeat(1))`: choose
#   *Kernel > Restart Kernel*. What you have solved stays remembered; then run the cells above the place where you go on.
# - What the documents print as results and claims stands in the ledger of chapter 10, with what we compute today. Some of it does not fit, and you will find where.
#
# Now open `01_frames.ipynb`.
