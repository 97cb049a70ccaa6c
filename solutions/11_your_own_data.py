# %% title [markdown]
# # 11 · Your own data
#
# **What you will do.** Take poses of a robot, yours or one of ours in which something is wrong, from the file to a calibration you would sign: look, choose the model, read the report, decide what to measure next, measure again, and see whether the prediction held.
#
# **What you will learn.** What no mounting can change; what a single row is worth; when a covariance is honest; which pose helps most; what must be measured so that an error can be seen at all.
#
# **What you need.** Chapters 5 and 6. About 75 minutes.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $T_{BF}$, `T_BF` | flange in the base: the robot's file, shape (n, 4, 4), mm |
# | $T_{ST}$, `T_ST` | target in the sensor: the sensor's file |
# | $X = T_{FS}$ | **wanted**: the sensor on the flange; $T_{BT}$ is found with it |
# | $A$, $B$ | motion of the flange and of the sensor from one row to the next |
# | $J$, `r` | derivative of the residuals by the parameters, and the residuals |
# | $h_i = j_i\,(J^\top J)^{-1} j_i^\top$ | what share of the parameters number $i$ pays for, $j_i$ its row of $J$ |
# | $C$, $f$ | covariance of the parameters; degrees of freedom, $n - p$ |

# %% setup
import numpy as np
from IPython.display import display

from labkit.calibration import calibrate, motion
from labkit.chapters.ch11_your_own_data import stages
from labkit.documents import redundancy
from labkit.exercises import course
from labkit.files.poses import read_poses, refuse_other_rows
from labkit.files.samples import sample_cell
from labkit.geometry.frames import invert
from labkit.geometry.lie import log_so3
from labkit.machines.sensor_cell import CELL

ex = course("11-your-own-data")
np.set_printoptions(precision=2, suppress=True, linewidth=88)

# %% the-question [markdown]
# ## The question
#
# A robot, a sensor on its flange, some twenty poses of each. Every program turns that into a matrix. **May you trust it?** No document stands behind this chapter: the data are yours.
# If you have none at hand, take ours. Three cells, made by a script in `data/own_data`, each with one fault of the kind that costs an afternoon: *a swapped role*, *a slipped screw*, *a clock that runs behind*.
#
# A file says numbers, not what they mean. The reader recognizes format, order and unit, and prints what it assumed. That line is the first thing to check.

# %% the-data
robot_file, sensor_file = sample_cell("slipped_screw")  # or your own, two paths as text
robot, sensor = (read_poses(f).in_unit("mm") for f in (robot_file, sensor_file))
refuse_other_rows(robot, sensor)
print(robot.assumed)
print(sensor.assumed)
print("first flange pose:", robot.T[0, :3, 3], "mm")
print("sees the target at", sensor.T[0, :3, 3], "mm")

# %% look [markdown]
# ## Look before you compute
#
# Whatever the mounting, the loop closes on the same target in every row, $T_{BF,i}\,X\,T_{ST,i} = T_{BT}$. Take two neighboring rows and the target falls out:
# $A\,X = X\,B$, one motion, seen from the flange and from the sensor: $A$ leads from the flange of one row to that of the next.

# %% motions
@ex.motions
def motions(T_BF, T_ST):
    """Return A and B, shape (n - 1, 4, 4) each, from each row to the next: A X = X B.

    T_BF (n, 4, 4): flange in base; T_ST (n, 4, 4): target in sensor.
    """
    ### BEGIN SOLUTION
    return invert(T_BF[:-1]) @ T_BF[1:], T_ST[:-1] @ invert(T_ST[1:])
    ### END SOLUTION


# %% screws [markdown]
# $B = X^{-1} A\,X$ is the same screw in another place: it turns by the same angle and shifts as far along its axis. Two numbers a row that need no calibration. Wrong units, rows out of step, and most
# outliers show at once.

# %% screws-code
A, B = motions(robot.T, sensor.T)
(angle_A, shift_A), (angle_B, shift_B) = motion.screw(A), motion.screw(B)
angles, shifts = np.rad2deg(angle_A - angle_B), shift_A - shift_B
for i in range(0, len(angles), 3):
    off = f"{angles[i]:6.3f} deg, shifts by {shifts[i]:6.3f} mm"
    print(f"rows {i + 1:2} to {i + 2:2}: angles differ by {off}")

# %% inverted [markdown]
# A common fault is a file that holds the inverse: the camera in the board instead of the board in the camera. **Which of these numbers changes when one file holds the inverse poses?** Decide, then choose the cell *swapped role* and invert its second file; the clock of the third cell has a slider.

# %% predict-inverted
guess = ...  # your code here
### BEGIN SOLUTION
guess = "neither of them"
### END SOLUTION
ex.predict("inverted", guess, reveal=stages.motions_beside_each_other)

# %% between-text [markdown]
# So one looks at the axes. Motions that share a row keep the angle between them even then; two apart they do not.

# %% between_axes
@ex.between_axes
def between_axes(T, apart):
    """Return the angles between the axes of motions i and i + apart, (n - apart,).

    In rad, 0 to pi. T: motions, shape (n, 4, 4), none without a turn; apart: 1 or more.
    """
    ### BEGIN SOLUTION
    phi = log_so3(T[:, :3, :3])
    axes = phi / np.linalg.norm(phi, axis=1, keepdims=True)
    return np.arccos(np.clip((axes[apart:] * axes[:-apart]).sum(axis=1), -1, 1))
    ### END SOLUTION


# %% swapped-code
swapped = [read_poses(f).in_unit("mm") for f in sample_cell("swapped_role")]
for words, T_ST in (("as it stands", swapped[1].T), ("inverted", invert(swapped[1].T))):
    A, B = motions(swapped[0].T, T_ST)
    for apart in (1, 2):
        off = np.rad2deg(between_axes(A, apart) - between_axes(B, apart))
        rms = np.sqrt(np.mean(off**2))
        print(f"{words:12} axes {apart} apart differ by {rms:4.1f} deg (rms)")
try:
    calibrate.hand_eye(swapped[0].T, swapped[1].T)
except ValueError as refusal:
    print(refusal)

# %% model [markdown]
# ## Choose the model
#
# | what you have | what it is | command |
# | --- | --- | --- |
# | flange poses, and poses of a target | sensor on the flange | `hand-eye` |
# | the same, the sensor beside the robot, the target on the flange | its loop is the first with the robot inverted | `hand-eye --eye-to-hand` |
# | flange poses, and the center of one sphere | chapter 5 | `sphere` |
# | poses of a tool that touches one point | chapter 3 | `pivot` |
# | points, and where they should be | chapter 1 | `frame` |
# | two streams with times | chapter 6, two clocks | `compare` |
#
# Both files exchanged, or both inverted, close the loop as well: then the result is the target's pose (exchanged: its inverse), and no data can tell. Only you know what hangs on the flange.
#
# ## Read the report

# %% report tags=["nbval-ignore-output"]
slipped = calibrate.hand_eye(robot.T, sensor.T, length_unit="mm")
display(slipped)

# %% report-text [markdown]
# In a terminal, `python lab.py calibrate hand-eye --robot R --sensor S --out report` writes the same as a page with charts, and a view you can turn. Read it from the top: how many rows agree, what disagrees, and how. A few rejected rows here and there are bad readings.
# A block of them that agrees with itself is a second mounting. Suppose nobody had looked, and all 24 rows had been fitted: the result keeps that fit as `slipped.plain`, and `.T` is the matrix of either. **How far apart, in mm, do this fit and the one to the rows that agree put the sensor on the flange?**

# %% slip_cost
slip_cost = ...  # your code here
### BEGIN SOLUTION
slip_cost = np.linalg.norm(slipped.plain.T[:3, 3] - slipped.T[:3, 3])
### END SOLUTION
slip_cost = ex.slip_cost(slip_cost)

# %% slip-std
if ex.after("slip_cost"):
    alone, both = slipped.rms_translation, slipped.plain.rms_translation
    print(f"rms of the residuals: {alone:.2f} mm in the rows that agree, {both:.2f} "
          "mm in all")
    print("standard deviations told of the place:", slipped.std[3:], "mm")

# %% clock-text [markdown]
# The third cell has two clocks. The angular speed of a body is the same for every sensor on it, so two curves of it tell how far the clocks are apart before anything is calibrated. (Planted: 84 ms behind.)

# %% clock-code
a, b = (read_poses(f).in_unit("mm") for f in sample_cell("late_clock"))
late = calibrate.compare(a.time, a.T, b.time, b.T)
offset = late.time_offset
print(f"the tracker's clock: {1e3 * offset.offset:.0f} ms +- {1e3 * offset.std:.1f} ms")
print(f"then the two agree to {late.rms_translation:.2f} mm (rms)")

# %% left-out-text [markdown]
# ## What a row is worth
#
# A residual is no judge of its own row: each number has pulled the fit toward itself. Of its error $d$ only $(1 - h)\,d$ is left, with $h = j\,(J^\top J)^{-1} j^\top$ its share of the parameters. Undo that and you have what the *other* rows say of it; no second fit is needed.

# %% left_out
@ex.left_out
def left_out(r, J):
    """Return the residual of each number under the fit to all others, shape (n,).

    r: residuals of a linear fit, shape (n,); J: their derivative, shape (n, p).
    """
    ### BEGIN SOLUTION
    h = np.einsum("ni,ij,nj->n", J, np.linalg.inv(J.T @ J), J)
    return r / (1 - h)
    ### END SOLUTION


# %% drop [markdown]
# The rings in the report's charts are these. **Ten poses: nine turn the flange about one axis, one is tilted across. Which can you least afford to lose?** Decide, then leave them out one by one; "Make it fail" leaves out the one that matters and draws what is then free.

# %% predict-drop
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the one tilted across"
### END SOLUTION
ex.predict("drop", guess, reveal=stages.pose_left_out)

# %% honest-text [markdown]
# ## An honest covariance
#
# With noise of standard deviation $s$ the parameters have the covariance $s^2 (J^\top J)^{-1}$. But $s$ comes from the same few residuals: $s^2 = r^\top r / f$, $f = n - p$. An error divided by an *estimated* standard deviation follows Student's law, whose variance is $f/(f-2)$. Angles and lengths have noises of their own: four poses
# leave 24 numbers less 12 parameters, of which six belong to each.
# **Four poses, noise estimated, that factor forgotten: how often does the truth lie farther away than two of the standard deviations told?**

# %% predict-coverage
guess = ...  # your code here
### BEGIN SOLUTION
guess = "1 time in 10"
### END SOLUTION
ex.predict("coverage", guess, reveal=stages.done_again)

# %% honest_covariance
@ex.honest_covariance
def honest_covariance(r, J):
    """Return the covariance (p, p) for noise estimated from r, with Student's factor.

    r: residuals of a linear fit, shape (n,); J: their derivative, (n, p), n - p > 2.
    """
    ### BEGIN SOLUTION
    f = len(r) - J.shape[1]
    return (r @ r) / f * f / (f - 2) * np.linalg.inv(J.T @ J)
    ### END SOLUTION


# %% next-text [markdown]
# ## What to measure next
#
# Whitened, so that every number has noise 1, a reading with derivative $J$ (k, p) brings the information $J^\top J$. Information adds up; covariances do not.

# %% with_one_more
@ex.with_one_more
def with_one_more(C, J):
    """Return the covariance (p, p) after one more reading.

    C (p, p): covariance so far; J (k, p): whitened derivative of its k numbers.
    """
    ### BEGIN SOLUTION
    return np.linalg.inv(np.linalg.inv(C) + J.T @ J)
    ### END SOLUTION


# %% more [markdown]
# Note what is absent: the reading itself. You know what a pose is worth before you drive there. **Nine poses turn the flange about one axis and hardly about the others. What helps the worst known direction more: ninety of the kind, or one tilted across by 20°?**

# %% predict-more
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the single one across"
### END SOLUTION
ex.predict("more", guess, reveal=stages.next_pose)

# %% next-pose-text [markdown]
# To choose among candidates one number is needed. The trace of $C$ would add square radians to square millimeters; the determinant needs no common unit.

# %% next_pose
@ex.next_pose
def next_pose(C, candidates):
    """Return the number, from 0, of the candidate that leaves the smallest determinant.

    C (p, p): covariance so far, p at most 12; candidates (m, k, p): whitened
    derivatives of m.
    """
    ### BEGIN SOLUTION
    return int(np.argmin([np.linalg.det(with_one_more(C, J)) for J in candidates]))
    ### END SOLUTION


# %% again-text [markdown]
# ## Measure again
#
# The report proposes three poses and says what they will bring. Hold it to its word. `CELL` is the cell the files came from, screw tightened again: it can be measured as often as you like. Sixteen poses, tilted mostly about one axis, then the three proposed.

# %% again
rng = np.random.default_rng(2)
tilt = np.deg2rad(rng.uniform(-1, 1, (16, 3)) * [4, 30, 4])
T_BF = CELL.looking(tilt, rng.uniform([-60, -60, 420], [60, 60, 580], (16, 3)))
noise = {"std_rot": CELL.std_rot, "std_trans": CELL.std_trans}
before = calibrate.hand_eye(T_BF, CELL.read(T_BF, rng), **noise)
print(*before.advice, sep="\n")
print("std of the position now (mm):   ", before.std[3:])
print("predicted with the three poses: ", before.next_std[3, 3:])

# %% held
more, errors = np.concatenate([T_BF, before.next_poses]), []
for _ in range(100):
    found = calibrate.hand_eye(more, CELL.read(more, rng), **noise)
    errors.append(found.T[:3, 3] - CELL.T_FS[:3, 3])
rms = np.sqrt(np.mean(np.square(errors), axis=0))
print("rms error of 100 calibrations:  ", rms)
print("over what was predicted:        ", rms / before.next_std[3, 3:])

# %% held-text [markdown]
# A hundred errors know their own rms to 7 % (one standard deviation): ratios from 0.86 to 1.14 are what chance leaves. Within that, the prediction held. Where yours does not, in your own cell, the model is wrong and not the arithmetic: a target that bends, a robot that is not exact, readings that share an error.
#
# ## What the four documents would have needed
#
# When can data show an error at all? Number $i$ of a fit betrays $(1-h)$ of its error $d$, in a residual with standard deviation $s\sqrt{1-h}$. It counts as seen from a few of those on: 4.13 are noticed with 80 %, while a good number is suspected once in a thousand (Baarda, 1968).

# %% visible
@ex.visible
def visible(J, std, times):
    """Return the smallest error of each number that is seen, shape (n,), unit of std.

    J (n, p): derivative of the numbers by the parameters, no share h of which is 1;
    std: their noise, all alike; times: how many standard deviations of its residual an
    error must reach, as 4.13.
    """
    ### BEGIN SOLUTION
    h = np.einsum("ni,ij,nj->n", J, np.linalg.inv(J.T @ J), J)
    return times * std / np.sqrt(1 - h)
    ### END SOLUTION


# %% documents [markdown]
# For each document, a measurement as it was made, and the same with one thing added. Three points make a frame, whatever is wrong with them; one position validates anything. Where $h = 1$ nothing is left to contradict.

# %% documents-code
for measured, added in redundancy.checks():
    print(f"{measured}\n  {added}")

# %% documents-seen [markdown]
# And were the errors that are in them large enough? All that was missing was to look:

# %% documents-seen-code
sizes, limit = redundancy.misprints_seen()
seen = sum(size > limit for size in sizes.values())
print(f"thesis: {seen} of {len(sizes)} wrong rows lie beyond {limit:.1f} std from "
      "the others,")
print(f"  the least of them at {min(sizes.values()):.0f}")
by_runs, by_average = redundancy.averages_seen()
print(f"report: the wrong entry of run 3 lies {by_runs:.0f} std from the other runs;")
print(f"  from the printed average {by_average:.0f} times what rounding explains")

# %% break-it [markdown]
# ## Break it
#
# What does the calibration say to a robot that only turns about one axis, to rows of the two files out of step, to three poses?

# %% break-it-code
flat = CELL.looking(tilt * [0, 1, 0], np.tile([0.0, 0.0, 500.0], (16, 1)))
attempts = {
    "one axis": (flat, CELL.read(flat, rng)),
    "out of step": (T_BF, np.roll(CELL.read(T_BF, rng), 1, axis=0)),
    "three poses": (T_BF[:3], CELL.read(T_BF[:3], rng)),
}
for name, files in attempts.items():
    try:
        warnings = calibrate.hand_eye(*files).warnings
        print(f"{name}: {'; '.join(warnings) or 'nothing'}")
    except ValueError as refusal:
        print(f"{name}: {refusal}")

# %% yours [markdown]
# ## Yours
#
# Put two files of your own, the same rows in both, beside this notebook, their names into the line `robot_file, sensor_file = ...` at the top, and run on from there; or let the command write the report. (`ex.slip_cost` knows our cell only.) Formats and options stand in `docs/calibrate.md`.
# Before you sign: the line of what was assumed; the angles of the motions; the rejected rows, with a reason for each; the weak direction; one calibration from half of the rows beside one from the other half.
#
# ## In practice
#
# - Write down which way each file points, in a sentence, before the first pose is taken.
# - Tilt about two axes at least, as far as the sensor sees the target.
# - Measure the first pose again at the end: a screw that slipped shows there.
# - One clock, or a motion that turns quickly, so that two can be aligned.
# - Keep three poses out of the fit. They have pulled nothing toward themselves.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. A row has a residual of nearly zero. Name a case in which that is bad news.
# 2. Why can no data tell a result from the one you get with both files exchanged?
# 3. Your report tells 0.3 mm from twelve rows with estimated noise. What would you say to a colleague who asks for "the accuracy"?

# %% progress
ex.progress()
