# %% title [markdown]
# # 5 · Hand-eye calibration on 31 real poses
#
# **What you will do.** Find where a laser line scanner sits on a robot's flange, from a thesis's own measurements; test its result on all of them;
# find the misprints in its tables; and end with a fit nine times better than the printed result, both on the same corrected tables.
#
# **What you will learn.** A sphere center from one scan line, derivatives you can trust, Gauss-Newton on a pose, a start without a guess, robust
# weights, and how to tell what data can know.
#
# **What you need.** Chapters 1 and 4. About 90 minutes, in two sittings if you like, the second from *Let the outliers speak for themselves* on; the parts marked *further*
# take as long again.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $B$, $F$, $S$ | robot base, flange, scanner |
# | $T_{BF}$, in code `T_BF` | the 31 robot poses, shape (31, 4, 4); the thesis writes $T_A^F$ |
# | $T_{FS}$, `T_FS` | **wanted**: the scanner on the flange; the thesis's $T_F^S$, pose `p2` |
# | $x_S$, `x_S` | the sphere's center as the scanner sees it, (31, 3) |
# | $c$, `target` | the same center in the base; the thesis's $T_P^A x_{P'}$ |
# | $\varepsilon_i$, `e` | residual of pose $i$ in the base, three numbers (mm) |
# | $[x]$, `skew(x)` | the matrix with $[x]\,v = x\times v$ |
# | $\varphi$, $\tau$ | small changes of $T_{FS}$: a rotation vector and a translation |
# | mm, rad | degrees only in names that end in `_deg` |

# %% setup
import numpy as np

from labkit.calibration import hand_eye, literature, planning, robust
from labkit.chapters.ch05_hand_eye import stages
from labkit.documents import misprints
from labkit.documents.thesis import comparison
from labkit.documents.thesis import printed as thesis
from labkit.documents.thesis.listings import listing_cost, listing_gauss_newton
from labkit.exercises import course
from labkit.geometry import frames
from labkit.geometry.lie import exp_so3, nearest_rotation, skew
from labkit.machines import robot_accuracy, triangulation

ex = course("05-hand-eye")
np.set_printoptions(precision=3, suppress=True, linewidth=110)

# %% the-question [markdown]
# ## The question
#
# A scanner hangs on the flange of a KUKA KR 60. CAD says where, but only to some centimeters. **Where is it really?** The master thesis *Optimierung bei der
# Kalibrierung von Sensor-Roboter-Systemen* (HAW Hamburg, 2019) scans a sphere in 31 poses. Whatever the pose, robot and scanner speak of
# one fixed point:
#
# $$T_{BF,i}\;T_{FS}\;x_{S,i} = c \qquad\text{(4-1)}$$
#
# Appendix C14 prints the poses, C17 the centers, table 7-4 the result. Section 7.3 promises deviations of 0.1 to 0.6 mm.

# %% the-data
printed = thesis.measurements()
for i in (0, 11, 30):
    print(f"pose {i + 1:2}, line {printed.line[i]:2}  {printed.kuka_deg[i]}  sees the "
          f"sphere at {printed.x_S[i]}")
p2_end = frames.kuka_from_degrees(thesis.kuka_pose_deg("scanner_end"))
target = thesis.printed_target()
print("the thesis's sphere center (tables 6-4 and 6-5):", target)

# %% triangulation [markdown]
# ## Height from two angles (*further*)
#
# How does the scanner see depth? It *triangulates* (section 2.2): a laser at one end of a base $L$ lights a spot, a camera at the other end looks at it. Seen from both ends the spot
# stands at the angles $\alpha$ and $\beta$ against the base, and its height $H$ cuts the base in two: $L = H/\tan\alpha + H/\tan\beta$ (2-11).
#
# Angles err. **The object moves twice as far away: how does the error of $H$ grow?** Decide, then drag it. *Make it fail* shortens the base.

# %% predict-twice_as_far
guess = ...  # your code here
### BEGIN SOLUTION
guess = "nearly four times"
### END SOLUTION
ex.predict("twice_as_far", guess, reveal=stages.triangle)

# %% height_from_angles
@ex.height_from_angles
def height_from_angles(alpha, beta, base):
    """Return the height H (mm) from both angles (rad), in the unit of the base (mm)."""
    ### BEGIN SOLUTION
    return base / (1 / np.tan(alpha) + 1 / np.tan(beta))
    ### END SOLUTION


# %% height_std
@ex.height_std
def height_std(alpha, beta, base, std):
    """Return the standard deviation of H (mm) to first order.

    alpha, beta: rad, both with independent errors of standard deviation std (rad);
    base: mm.
    """
    ### BEGIN SOLUTION
    H = height_from_angles(alpha, beta, base)
    by_alpha, by_beta = (H**2 / (base * np.sin(a) ** 2) for a in (alpha, beta))
    return std * np.hypot(by_alpha, by_beta)
    ### END SOLUTION


# %% over-the-range [markdown]
# The data sheet (B1) promises $\pm 0.16\,\%$ of a range of 100 mm, as three standard deviations, from 190 to 290 mm. It does not print the base. With a base of 100 mm, which
# noise of the angles would that be, and how does the error of $H$ then change from one end of the range to the other? (Height above the laser, so $\alpha = 90°$.)

# %% over-the-range-code
base, promised = 100.0, triangulation.LINEARITY
at = {H: triangulation.angles_to([0.0, H], base) for H in (125, 190, 240, 290, 390)}
std = promised / height_std(*at[240], base, 1.0)
print(f"{np.rad2deg(std):.4f} deg give {promised:.3f} mm in the middle of the range")
for H, angles in at.items():
    print(f"H = {H} mm: {height_std(*angles, base, std):.3f} mm")

# %% over-the-range-verdict [markdown]
# Solved for the height, (2-11) is $H = L\,\tan\alpha\tan\beta/(\tan\alpha+\tan\beta)$ (2-12).
# From the near end of its range to the far one the error doubles, whatever single number a data sheet prints. Go near, where the part allows it.

# %% circle [markdown]
# ## One scan line, one circle
#
# A line scanner measures a whole line of points at once, all in its plane $y = 0$. The plane cuts the sphere in a circle. Multiply $(x-x_c)^2 + (z-z_c)^2 = r^2$ out and it is
# *linear* in $a_1 = -2x_c$, $a_2 = -2z_c$, $a_3 = x_c^2 + z_c^2 - r^2$: that is listing C15. Keep the residuals small by any means you like.

# %% fit_circle
@ex.fit_circle
def fit_circle(x, z):
    """Return x_c, z_c and r (mm) of the circle that fits a scan line best.

    x, z: coordinates of its points in the scan plane, shape (n,) each, mm.
    """
    ### BEGIN SOLUTION
    a = np.linalg.lstsq(np.column_stack([x, z, np.ones(len(x))]), -(x**2 + z**2),
                        rcond=None)[0]
    x_c, z_c = -a[0] / 2, -a[1] / 2
    return x_c, z_c, np.sqrt(x_c**2 + z_c**2 - a[2])
    ### END SOLUTION


# %% equator [markdown]
# ## Where to cut
#
# The circle lies in the plane, the sphere's center beside it, at $d = \sqrt{R^2 - r^2}$ (6-27), on one side or the other. The scan plane may
# cut the sphere anywhere: **where does the profile tell least about how far away the center is**, through the center, halfway out, or near the edge? Decide, then drag the sphere.

# %% predict-equator
guess = ...  # your code here
### BEGIN SOLUTION
guess = "through the center"
### END SOLUTION
ex.predict("equator", guess, reveal=stages.scan_line)

# %% sphere-center [markdown]
# The derivative tells it: $\partial d/\partial r = -r/d$. Five of the 31 scan lines pass the center closer than 8 mm, near the sphere's *equator*: pose 4 at
# $|y| = 1.2$ mm, where 0.01 mm of circle radius is 0.26 mm of center. Listing C16 always takes the minus sign; table C17 shows that the thesis chose by pose. So pass the side in.

# %% sphere_center_from_profile
@ex.sphere_center_from_profile
def sphere_center_from_profile(x, z, radius, side):
    """Return the sphere's center in S, shape (3,), mm.

    x, z: points of the scan line, shape (n,) each, mm; radius: of the sphere, mm; side:
    +1 or -1, the sign of y.
    """
    ### BEGIN SOLUTION
    x_c, z_c, r = fit_circle(x, z)
    return np.array([x_c, side * np.sqrt(radius**2 - r**2), z_c])
    ### END SOLUTION


# %% residual [markdown]
# ## The model, and a first verdict
#
# What is left of (4-1) is the residual $\varepsilon_i = T_{BF,i}\,T_{FS}\,x_{S,i} - c$ (4-3), three numbers per pose. The thesis describes $T_{FS}$ by a KUKA pose `p2`;
# `frames.matrix_from_kuka(p2)` makes a matrix of it. `frames.transform(T, points)` takes one transform or one per point.

# %% kuka_residual
@ex.kuka_residual
def kuka_residual(p2, T_BF, x_S, target):
    """Return the residual vectors in B, shape (N, 3), mm.

    p2: x, y, z (mm), A, B, C (rad), shape (6,); T_BF (N, 4, 4); x_S (N, 3), mm; target
    (3,), mm.
    """
    ### BEGIN SOLUTION
    T_FS = frames.matrix_from_kuka(p2)
    return frames.transform(T_BF, frames.transform(T_FS, x_S)) - target
    ### END SOLUTION


# %% validation [markdown]
# Table 7-5 validates the end pose at *one* unnamed position: $(0.24, -0.67, -0.11)$ mm. Compare pose 1. Pose 2 has a digit too many, which is taken out. Then decide: **what is the rms distance over all
# 31**, about 0.7, 3 or 12 mm?

# %% validation-code
as_printed = kuka_residual(p2_end, printed.T_BF, printed.x_S, target)
print("pose 1:", as_printed[0], "mm   pose 2:", as_printed[1], "mm")
repaired = thesis.measurements((2,))
print("z of pose 2 as printed:", printed.x_S[1, 2], "  and repaired:",
      repaired.x_S[1, 2])

# %% predict-31
guess = ...  # your code here
### BEGIN SOLUTION
guess = "about 12 mm"
### END SOLUTION
ex.predict("thirty_one", guess)

# %% rms-before [markdown]
# So it was most likely pose 1: y and z agree to 0.01 mm, x up to its sign and 0.014 mm. Pose 2 has a sphere 2 m away from a scanner that reaches 390 mm: a digit too many.
# With that one entry repaired, what is the **rms distance** over all 31, the root of the mean squared length of the residual vectors?

# %% rms_before
rms_before = ...  # your code here
### BEGIN SOLUTION
residuals = kuka_residual(p2_end, repaired.T_BF, repaired.x_S, target)
rms_before = np.sqrt((residuals**2).sum(axis=1).mean())
### END SOLUTION
rms_before = ex.rms_before(rms_before)

# %% derivatives [markdown]
# ## Derivatives you can trust
#
# The thesis takes forward differences with $h = 5\cdot10^{-7}$ for millimeters and degrees alike (listing C4). Chapter 4 measured the gradient of one number; write the central difference of a whole vector. Then decide: **which step
# is best by the angle A**, near 0.0000001, near 0.001 or near 1 degree?

# %% numeric_jacobian
@ex.numeric_jacobian
def numeric_jacobian(function, x, step):
    """Return the derivative, shape (m, n), by central differences, a whole step to each
    side.

    function: takes an array (n,), returns an array (m,); x: where, floats, shape (n,);
    step: a number, the same for all n.
    """
    ### BEGIN SOLUTION
    columns = [(function(x + h) - function(x - h)) / (2 * step)
               for h in step * np.eye(len(x))]
    return np.column_stack(columns)
    ### END SOLUTION


# %% predict-step tags=["nbval-ignore-output"]
guess = ...  # your code here
### BEGIN SOLUTION
guess = "near 0.001 deg"
### END SOLUTION
ex.predict("step", guess, reveal=stages.difference_steps)

# %% analytic [markdown]
# Better: no step at all. Move the pose by a rotation vector $\varphi$ *on its right* and a translation, $R_{FS}\to R_{FS}\exp(\varphi)$, $t\to t+\tau$. With
# $\exp(\varphi)x \approx x + \varphi\times x = x - [x]\varphi$:
#
# $$\frac{\partial\varepsilon}{\partial\varphi} = -R_{BF}\,R_{FS}\,[x_S], \qquad \frac{\partial\varepsilon}{\partial\tau} = R_{BF}.$$

# %% skew-code
phi, x = np.array([0.02, -0.01, 0.03]), np.array([10.0, -20.0, 240.0])
print("exp(phi) x      ", exp_so3(phi) @ x)
print("x - [x] phi     ", x - skew(x) @ phi)
print("nearest rotation", nearest_rotation(np.eye(3) + skew(phi)) @ x)

# %% analytic_jacobian
@ex.analytic_jacobian
def analytic_jacobian(T_FS, T_BF, x_S):
    """Return the derivative of the stacked residuals by phi and tau, shape (3 N, 6): x,
    y, z of pose 1, then pose 2.

    T_FS (4, 4); T_BF (N, 4, 4); x_S (N, 3), mm. Columns: phi (mm per rad), then tau (mm
    per mm).
    """
    ### BEGIN SOLUTION
    R_BF = T_BF[:, :3, :3]
    return np.concatenate([-R_BF @ T_FS[:3, :3] @ skew(x_S), R_BF],
                          axis=2).reshape(-1, 6)
    ### END SOLUTION


# %% gauss_newton_on_pose
@ex.gauss_newton_on_pose
def gauss_newton_on_pose(T_FS, T_BF, x_S, target):
    """Return T_FS, shape (4, 4), after one Gauss-Newton step: R_FS exp(phi) and t_FS +
    tau.

    T_FS: where the step starts, (4, 4); T_BF (N, 4, 4); x_S (N, 3), mm; target (3,),
    mm, held fixed.
    """
    ### BEGIN SOLUTION
    e = frames.transform(T_BF, frames.transform(T_FS, x_S)) - target
    step = np.linalg.lstsq(analytic_jacobian(T_FS, T_BF, x_S), -e.ravel(),
                           rcond=None)[0]
    return frames.pose(T_FS[:3, :3] @ exp_so3(step[:3]), T_FS[:3, 3] + step[3:])
    ### END SOLUTION


# %% pole [markdown]
# ## The pole
#
# CAD puts the scanner at B = −90°, where A and C turn about one line (chapter 1). Only A + C is left of the two there. The rate matrix, which makes a
# rotation vector of $\dot A, \dot B, \dot C$, has determinant $-\cos B$. **What do Gauss-Newton steps in A, B, C do there that steps on the pose do not**: never
# arrive, take detours, or nothing special? Decide; then turn the start by its rings, toward the pole
# and away from it, and follow the scanner step by step.

# %% predict-pole
guess = ...  # your code here
### BEGIN SOLUTION
guess = "they take detours"
### END SOLUTION
ex.predict("pole", guess, reveal=stages.convergence)

# %% simulation [markdown]
# The thesis met this in its simulation (tables 6-2, 7-2, 7-3), where some starts "find no minimum". Its printed inputs contradict each other: z is 20 in one table and 10 in
# the other, B is −90° and +90°, and the plate's y does not fit. One set makes all 39 printed coordinates come out: z = 20, B = −90°, plate at y = 0. With it,
# listing C5 takes exactly the printed numbers of iterations: 1 from the original pose, 4 from all others. (Two of the three starts where the trust region "finds no minimum" begin with
# a cost of 3e-7 mm², less than its tolerance 1e-6: perhaps the solver stopped there at once. Its log was not published.)

# %% table-7-3
T_sim, x_sim, c_sim, true_deg = thesis.simulation()
for start, name in zip(*thesis.start_poses_deg()):
    runs, _ = listing_gauss_newton(start, T_sim, x_sim, c_sim)
    print(f"{name:18} {len(runs) - 1} iterations, A + C = "
          f"{abs(runs[-1, 3] + runs[-1, 5]):.1f} deg")
J = hand_eye.kuka_jacobian(frames.kuka_from_degrees(true_deg), T_sim, x_sim)
print("rank of the Jacobian at B = -90 deg:", np.linalg.matrix_rank(J, tol=1e-9),
      "of 6")
at_the_end = kuka_residual(p2_end, repaired.T_BF, repaired.x_S, target)
costs = listing_cost(at_the_end).sum(), 0.5 * (at_the_end**2).sum()
print(f"listing C3's cost: {costs[0]:.0f} mm2; formula (6-11): {costs[1]:.0f} mm2")

# %% cost [markdown]
# The last line is a find of its own: the code squares the *sum* of the residuals where (6-11) sums the squares. Errors of opposite sign cancel in it. It only decides when to stop,
# so the steps are right.
#
# ## Gauss-Newton against trust region (*further*)
#
# This is the thesis's central experiment (sections 6.1.6 and 7.1.2): which method shall calibrate the scanner? Table 7-3 counts: Gauss-Newton arrives from all ten starts, in 1 or 4 steps.
# MATLAB's *trust region* arrives from seven, in 1 to 12 steps; three rows hold a dash. (One of the seven started elsewhere: a footnote to row 8 turns it by 0.001° instead of 0.005°.)
# So Gauss-Newton is rated "very good" (*sehr gut*), the trust region "good", and the text calls Gauss-Newton "more stable and faster". Is it the method?
#
# A trust region is the loop of chapter 4: a step inside a radius, then the gain ratio. **From how many of the ten starts does ours arrive?** Decide, then drag the start; the crosses are
# the printed ones. *Make it fail* goes to where Gauss-Newton's model is bad.

# %% predict-trust_arrives
guess = ...  # your code here
### BEGIN SOLUTION
guess = "all ten"
### END SOLUTION
ex.predict("trust_arrives", guess, reveal=stages.two_methods)

# %% table-7-3-again
counts, runs = thesis.iterations_7_3(), comparison.table_7_3(radius=10.0)
starts, names = thesis.start_poses_deg()
for i in range(1, 10) if ex.after("trust_arrives") else ():
    columns = [f"{m} {counts[m][i]:.0f} (ours {runs[m][i].steps})" for m in runs]
    cost = comparison.start_cost(starts[i])
    line = "  ".join([f"{i} {names[i]:17}", *columns, f"cost {cost:.0e} mm2"])
    print(line.replace("nan", "-"))
for m in runs if ex.after("trust_arrives") else ():
    printed_rating = comparison.rating(~np.isnan(counts[m]))
    ours = comparison.rating([run.arrived for run in runs[m]])
    print(f"{m}: {printed_rating} by the printed counts, {ours} by our runs")

# %% methods-verdict [markdown]
# (Our counts end where the rms distance falls below $10^{-6}$ mm; the rating "good" stands for more than half of the starts, "very good" for all. The thesis gives no limits, but by these its columns lead to its words.)
# *Faster* holds: Gauss-Newton goes the whole way at once, since the residuals are linear in the translation, and the trust region walks it by radii of 10, 20, 40 mm. *More stable* does
# not: ours arrives from everywhere. What the three dashes are nobody can tell from the print. Starts 4 and 6 fit to $3\cdot10^{-7}$ mm² before the first step, below the toolbox's
# function tolerance of $10^{-6}$ (listing C6); start 9 has no such excuse.
#
# And look where the crosses lie: all on the bottom edge. No start is turned by more than 0.1°, so the experiment never asked about stability. Turn the start by 175° and stand the
# scanner at −88°: there Gauss-Newton goes uphill on its way, and the trust region, which takes no such step, needs a third of the steps.
#
# ## Free the sphere (*further*)
#
# The thesis holds $c$ fixed, touched with the robot to some millimeters. Its "second step" would free the plate's whole pose: 12 unknowns, "four-fold underdetermined". But the plate
# enters through one point, so no number of poses fixes more than 9: six for the scanner, three for $c$. Free those.

# %% joint_residual
@ex.joint_residual
def joint_residual(u, T0, T_BF, x_S):
    """Return the stacked residuals, shape (3 N,), mm: x, y, z of pose 1, then of pose
    2.

    u: phi (rad), tau (mm), sphere center in B (mm), shape (9,); T0: the scanner pose
    that phi and tau move, (4, 4).
    """
    ### BEGIN SOLUTION
    T_FS = frames.pose(T0[:3, :3] @ exp_so3(u[:3]), T0[:3, 3] + u[3:6])
    return (frames.transform(T_BF, frames.transform(T_FS, x_S)) - u[6:]).ravel()
    ### END SOLUTION


# %% start [markdown]
# And the start? Forget that $R_{FS}$ is a rotation, and all 15 unknowns enter linearly; brought into the flange frame, each pose gives
#
# $$R_{FS}\,x_S + t_{FS} - R_{BF}^\top c = -R_{BF}^\top t_{BF}.$$
#
# Solve, then take the nearest rotation (`nearest_rotation`); translation and center may stay as solved. No CAD needed.

# %% linear_start
@ex.linear_start
def linear_start(T_BF, x_S):
    """Return T_FS, shape (4, 4), and the sphere center in B, shape (3,), mm, from
    linear equations alone.

    T_BF (N, 4, 4); x_S (N, 3), mm.
    """
    ### BEGIN SOLUTION
    rows, right = [], []
    for T, x in zip(T_BF, x_S):
        R_t = T[:3, :3].T
        rows.append(np.hstack([np.kron(np.eye(3), x), np.eye(3), -R_t]))
        right.append(-R_t @ T[:3, 3])
    u = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0]
    return frames.pose(nearest_rotation(u[:9].reshape(3, 3)), u[9:12]), u[12:]
    ### END SOLUTION


# %% robust [markdown]
# ## Let the outliers speak for themselves
#
# Even with pose 2 repaired and the center free, least squares leaves 11 mm: a few poses spoil all. Tukey's weights give them no say. The scale must not be spoiled either: the *median* length of
# a 3-vector of unit noise is 1.538 (`robust.MEDIAN_CHI3`), so $s = \mathrm{median}/1.538$, $u = |\varepsilon_i|/(5s)$, and $w = (1-u^2)^2$ below $u = 1$, else 0.

# %% robust_weights
@ex.robust_weights
def robust_weights(residuals):
    """Return one weight (0 to 1) per pose, shape (N,), for residual vectors of shape
    (N, 3) in mm."""
    ### BEGIN SOLUTION
    lengths = np.linalg.norm(residuals, axis=1)
    u = lengths / (5 * np.median(lengths) / robust.MEDIAN_CHI3)
    return np.where(u < 1, (1 - u**2) ** 2, 0.0)
    ### END SOLUTION


# %% robust-code
fit = hand_eye.calibrate_sphere_target(printed.T_BF, printed.x_S, robust=True)
print("poses with weight 0:", np.flatnonzero(fit.weights == 0) + 1,
      f"  noise of the others: {fit.std:.2f} mm")
for i in np.flatnonzero(fit.weights == 0):
    print(f"pose {i + 1:2}: residual in the base {fit.residuals[i]} mm")

# %% suspects [markdown]
# Seven poses stand out, and look at four of them: 18.3 mm along x, 9.1 along y, 8.8 along x, 45 along x, hardly anything across. Pose 3 is printed with
# x = 1379.64. Decide **what happened** (did the robot sag, is a digit missing, or have two changed places?), then click the bars: the slider undoes one slip after another in the chosen pose. Which single change removes the residual
# in *all three* axes at once?

# %% predict-slip
guess = ...  # your code here
### BEGIN SOLUTION
guess = "two digits changed places"
### END SOLUTION
ex.predict("slip", guess, reveal=stages.thirty_one_poses)

# %% neighbors [markdown]
# A second witness needs no calibration at all: the poses turn along four lines by equal steps, so each flange should be turned halfway between its neighbors, and hardly leave
# the plane of its line (along x, y, and the two diagonals x* and y*). Pose 12 is where it counts: its residual of 3 mm could be a digit in x, but its orientation is one degree off (only A − C counts at B = 90°).

# %% neighbors-code
turns = np.rad2deg(misprints.neighbor_turns(printed))
offsets = misprints.neighbor_offsets(printed)
for pose in (2, 3, 4, 7, 12, 21, 30):
    print(f"pose {pose:2}: turned {turns[pose - 1]:5.2f} deg off the middle, "
          f"{offsets[pose - 1]:6.2f} mm off its plane")
rest = np.setdiff1d(np.arange(31), np.array([2, 3, 4, 7, 12, 21, 30]) - 1)
print(f"the others, medians: {np.nanmedian(turns[rest]):.2f} deg, "
      f"{np.median(np.abs(offsets[rest])):.1f} mm")
for slip in misprints.explanations(thesis.printed_entries(), 12, fit.T_FS, fit.target,
                                   fit.std):
    rest = f"leaves {slip.after:.2f} mm, {np.rad2deg(slip.turn):.2f} deg off the middle"
    print(f"  {slip.column:5} {slip.printed} -> {slip.corrected}: {rest} ({slip.slip})")

# %% find [markdown]
# ## Name them
#
# Now write the search. `entries` maps (table, pose, column) to the printed text, such as `'1397.69'`; `thesis.measurements_from(entries)` makes arrays of it. Return the set of
# wrong entries. Any procedure is fine, within 15 seconds a call (who recomputes only the row that is changed needs a fraction of one),
# but no innocent entry may be accused. The check also plants slips of its own.
#
# One slip is a lost or added sign, two digits swapped, a digit too many, a digit missing, or one digit wrong. `misprints.single_slips(text)` lists all numbers one slip away, and
# `misprints.explanations(entries, pose, T_FS, target, std)` tries them on every entry of a row, as above: the most credible comes first, its `table`, `pose` and `column` say where.
# (For the check the smallest residual alone would do. The neighbors are there for you: they make a guess a finding.)

# %% find_misprints
@ex.find_misprints
def find_misprints(entries):
    """Return the misprinted entries, {("C17", 2, "z"), ...}; poses count from 1.

    entries: {(table, pose, column): text}; columns x, y, z, of C14 A_deg to C_deg, too.
    """
    ### BEGIN SOLUTION
    measured = thesis.measurements_from(entries)
    fit = hand_eye.calibrate_sphere_target(measured.T_BF, measured.x_S, robust=True)
    named = set()
    for i in np.flatnonzero(np.linalg.norm(fit.residuals, axis=1) > 6 * fit.std):
        slips = misprints.explanations(entries, int(i) + 1, fit.T_FS, fit.target,
                                       fit.std)
        if slips:
            named.add((slips[0].table, slips[0].pose, slips[0].column))
    return named
    ### END SOLUTION


# %% corrections [markdown]
# The corrections stand in `data/hand_eye/corrections.csv`, with reasons, beside the untouched tables. (Table 6-6 prints pose 3 with the same slip. Where the others were made,
# by a person or when the PDF became the text we have, nobody knows, and nobody is blamed.) Fit scanner *and* center to the corrected data and give the rms over all 31, none dropped.

# %% rms_after
corrected = thesis.measurements(True)
rms_after = ...  # your code here
### BEGIN SOLUTION
rms_after = hand_eye.calibrate_sphere_target(corrected.T_BF, corrected.x_S).rms
### END SOLUTION
rms_after = ex.rms_after(rms_after)

# %% rms-after [markdown]
# Here is what each correction buys; the last line compares like with like, the printed pose and your fit on the same corrected tables. Two things were needed: right numbers *and* a free center. With the printed center even perfect tables leave 4.8 mm, because the
# touched plate is 6.6 mm off.

# %% steps-of-corrections
poses, steps = [], thesis.corrections() if ex.after("rms_before", "find_misprints",
                                                    "rms_after") else []
for row in steps:
    poses.append(row["pose"])
    m = thesis.measurements(poses)
    end = hand_eye.rms_distance(kuka_residual(p2_end, m.T_BF, m.x_S, target))
    fixed = hand_eye.calibrate_sphere_target(m.T_BF, m.x_S, target=target).rms
    joint = hand_eye.calibrate_sphere_target(m.T_BF, m.x_S).rms
    print(f"{row['table']} {row['pose']:2} {row['column']:5} {row['printed']:>8} -> "
          f"{row['corrected']:8}", end=" ")
    print(f"rms {end:6.2f} end pose, {fixed:6.2f} center fixed, {joint:6.2f} all free")

# %% radius-text [markdown]
# ## Which sphere was it?
#
# The certificate (C11) says R = 29.9725 mm, listing C16 takes 30, the coordinate machine (C13) 30.277. Every $y$ in C17 contains R = 30, so another R moves all centers along y:
# $y' = \pm\sqrt{y^2 + R^2 - 30^2}$. With which R does the fit of scanner and center to all 31 corrected poses leave the least rms?

# %% radius
radius = ...  # your code here
### BEGIN SOLUTION
radius = hand_eye.fit_radius(corrected.T_BF, corrected.x_S).radius
### END SOLUTION
radius = ex.radius(radius)

# %% radius-verdict
choices = (("all poses", np.arange(31) >= 0),
           ("without pose 4", np.arange(31) != 3)) if ex.after("radius") else ()
for name, used in choices:
    found = hand_eye.fit_radius(corrected.T_BF[used], corrected.x_S[used])
    print(f"{name}: {found.radius:.3f} mm")
    for source in ("certificate", "listing", "coordinate machine"):
        R = thesis.radius(source)
        x_S = thesis.centers_with_radius(corrected.x_S[used], R)
        rms = hand_eye.calibrate_sphere_target(corrected.T_BF[used], x_S).rms
        away = np.sqrt(used.sum() * (rms**2 - found.rms**2)) / found.std
        print(f"  {source:19} {R:.4f} mm: rms {rms:.3f} mm, {away:4.1f} standard "
              "deviations away")

# %% known [markdown]
# The distance is $\sqrt{\Delta S}/s$: how much the sum of squares grows when $R$ is held there. (The usual standard deviation would mislead: pose 4 puts a kink into the rms at 29.977 mm, below
# which its circle is larger than the sphere; a search that starts too low is caught in a second minimum there.) The listing's 30 mm fits. The certificate fits once pose 4, next to the
# equator, is left out, and poorly with it. The coordinate machine's 30.28 does not fit either way.
#
# ## What can these data know? (*further*)
#
# A small rms on the data is not a small error elsewhere. Leave each pose out in turn, and ask the covariance which direction is weak. All 31 poses keep the sphere near one place of the scanner's field:
# **what is known worst**, the sphere's center, the scanner's orientation, or the distance to the sphere?

# %% predict-weak
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the scanner's orientation"
### END SOLUTION
ex.predict("weak", guess, reveal=stages.pattern_designer)

# %% known-code
fit = hand_eye.calibrate_sphere_target(corrected.T_BF, corrected.x_S)
left_out = hand_eye.leave_one_out(corrected.T_BF, corrected.x_S)
if ex.after("rms_after"):
    print(f"left out: rms {hand_eye.rms_distance(left_out):.3f} mm; in the fit: "
          f"{fit.rms:.3f} mm")
    lines = hand_eye.leave_one_out(corrected.T_BF, corrected.x_S, groups=corrected.line)
    print(f"a whole line of motion left out: {hand_eye.rms_distance(lines):.3f} mm")
    print(fit)

# %% known-spread
anywhere = np.random.default_rng(0).uniform(*np.transpose(planning.FIELD),
                                            size=(100_000, 3))
anywhere[:, 1] *= np.where(np.arange(len(anywhere)) % 2, 1, -1)  # both sides
print("standard deviation of x_S:", corrected.x_S.std(axis=0).round(1), "mm")
print("all over the field:       ", anywhere.std(axis=0).round(1), "mm")

# %% known-rank
p2 = frames.kuka_from_matrix(fit.T_FS)
p3 = frames.kuka_from_matrix(thesis.frame("plate"))
J = hand_eye.plate_jacobian(corrected.T_BF, corrected.x_S, p2, p3,
                            thesis.point("sphere_in_plate"))
print("rank of the thesis's second step:", np.linalg.matrix_rank(J, tol=1e-6),
      "of 12 unknowns")

# %% design [markdown]
# The pattern always aimed at the middle of the field. Use all of it: x within ±25 mm, |y| from 3 to 25, z from 190 to 290 (`planning.FIELD`), line of sight (the scanner's z axis) at most 90° from straight
# down. `planning.poses_that_see(T_FS, target, R_BF, x_S)` gives the poses for chosen orientations and places. With 31 poses, reach 0.7 of the thesis's
# orientation error (0.44°, so 0.31°), and no more than its translation error (1.2 mm). `planning.predicted_sphere_covariance(poses, T_FS, target, std)`, with `fit.std`, tells your own: the root of the
# trace of its first 3 × 3 block is the orientation (rad), of the second the translation.

# %% design_poses
@ex.design_poses
def design_poses(T_FS, target, rng):
    """Return 31 robot poses T_BF, shape (31, 4, 4), that would calibrate the scanner
    better.

    T_FS (4, 4) and target (3,), mm: where scanner and sphere are; rng: a NumPy random
    generator.
    """
    ### BEGIN SOLUTION
    x = rng.uniform(-25, 25, 31)
    y = rng.uniform(3, 25, 31) * rng.choice([-1, 1], 31)
    z = rng.choice([190, 290], 31)
    down = np.diag([1.0, -1.0, -1.0]) @ T_FS[:3, :3].T  # it looks straight down
    turn = np.column_stack([rng.uniform(-0.8, 0.8, (31, 2)), rng.uniform(-3, 3, 31)])
    return planning.poses_that_see(T_FS, target, exp_so3(turn) @ down,
                                   np.column_stack([x, y, z]))
    ### END SOLUTION


# %% break-it [markdown]
# ## Break it
#
# Some motions teach nothing. A good function names the missing one. The two methods of the thesis's section 2.6, by Kim, Cho and Kim and by Li et al. (the next
# section tells how they work), refuse the 31 poses for the same kind of reason.

# %% break-it-code
shifted = np.tile(corrected.T_BF[0], (6, 1, 1))
shifted[:, :3, 3] += 50 * np.random.default_rng(0).normal(size=(6, 3))
fit_sphere, few = hand_eye.calibrate_sphere_target, corrected.x_S[:6]
attempts = {
    "translated only": lambda: fit_sphere(shifted, few),
    "one line of motion": lambda: fit_sphere(corrected.T_BF[:4], few[:4]),
    "Kim, Cho, Kim": lambda: literature.kim_linear(
        corrected.T_BF, corrected.x_S[:, None], fit.target[None]),
    "Li et al.": lambda: literature.li_two_step(corrected.T_BF, corrected.x_S),
}
for name, attempt in attempts.items():
    try:
        print(f"{name}: rms {attempt().rms:.2f} mm")
    except ValueError as refusal:
        print(f"{name}: {refusal}")

# %% beyond [markdown]
# ## Two methods of the literature (*further*)
#
# The thesis reads two papers (sections 2.6 and appendix A) and follows neither. Both need data that suit them. `literature.suitable_scene` makes such: twelve poses turned about all axes, and
# four that only translate the first, with a sphere, and a cube in its place for Kim.
#
# **Li et al.** take the rotation first. Two poses of the *same* orientation see the sphere shifted; subtract their equations (2-40), and target and $t_{FS}$ drop out. The thesis prints what is
# left as $R_0 R_s (X_{l2} - X_{l1}) = T_{02} - T_{01}$ (2-41). Derive it before you use it.

# %% li_rotation
@ex.li_rotation
def li_rotation(T_BF, x_S):
    """Return R_FS, shape (3, 3), from poses that all have one orientation.

    T_BF: (N, 4, 4), moved in two directions at least; x_S: the sphere in each, (N, 3),
    mm.
    """
    ### BEGIN SOLUTION
    seen = x_S - x_S.mean(axis=0)
    moved = -(T_BF[:, :3, 3] - T_BF[:, :3, 3].mean(axis=0)) @ T_BF[0, :3, :3]
    return nearest_rotation(moved.T @ seen)
    ### END SOLUTION


# %% li-text [markdown]
# In the second step $R_{FS}$ is known, and all poses that turn give $R_{BF}\,t_{FS} - c = -(t_{BF} + R_{BF} R_{FS}\,x_S)$: linear in six unknowns.

# %% li_translation
@ex.li_translation
def li_translation(T_BF, x_S, R_FS):
    """Return t_FS and the target, shape (3,) each, mm, once R_FS is known.

    T_BF: (N, 4, 4), turned about two axes at least; x_S: (N, 3), mm; R_FS: (3, 3).
    """
    ### BEGIN SOLUTION
    R, t = T_BF[:, :3, :3], T_BF[:, :3, 3]
    rows = np.concatenate([R, np.tile(-np.eye(3), (len(R), 1, 1))], axis=2)
    right = -(t + np.einsum("nij,jk,nk->ni", R, R_FS, x_S))
    u = np.linalg.lstsq(rows.reshape(-1, 6), right.ravel(), rcond=None)[0]
    return u[:3], u[3:]
    ### END SOLUTION


# %% kim-text [markdown]
# **Kim, Cho and Kim** watch a body with several points $X_W$, known in its own frame $W$ (homogeneous, in columns). Here $A$ and $B$ are motions: between poses $p$ and $q$ the flange moves by $A = T_{BF,p}^{-1}\,T_{BF,q}$ and the scanner by
# $B = (X_S^p X_W^\top)(X_S^q X_W^\top)^{-1}$, and both are the same motion: $A X = X B$ with $X = T_{FS}$ (2-44). (Formula (2-43) prints $AX = BX$. Its own section, chapter 4.1 and appendix A contradict it.)
#
# Appendix A writes the rows of $X$ one after another, $u = (x_{11}, x_{12}, \dots, x_{34})$, and $AX = XB$ as twelve linear equations $D\,u = F$, first those of the entries (1, 1) to (1, 4).

# %% kim_system
@ex.kim_system
def kim_system(A, B):
    """Return D, shape (12, 12), and F, shape (12,), with D u = F equivalent to A X = X
    B.

    A, B: rigid motions, (4, 4). u: the rows of X one after another, its last row is
    known; the equations in the order of the entries (1, 1), (1, 2), ... (3, 4).
    """
    ### BEGIN SOLUTION
    F = np.zeros(12)
    F[3::4] = -A[:3, 3]
    return np.kron(A[:3, :3], np.eye(4)) - np.kron(np.eye(3), B.T), F
    ### END SOLUTION


# %% assembled-methods
def by_li(scene):
    """T_FS from your two steps."""
    same, turned = scene.translated, np.arange(12)
    R_FS = li_rotation(scene.T_BF[same], scene.x_S[same])
    t_FS, _ = li_translation(scene.T_BF[turned], scene.x_S[turned], R_FS)
    return frames.pose(R_FS, t_FS)


# %% assembled-kim
def by_kim(scene):
    """T_FS from your equations, stacked over all neighboring poses."""
    X_W, X_S = (np.insert(x, 3, 1.0, axis=-1) for x in (scene.cube_W, scene.cube_S))
    M = np.swapaxes(X_S, 1, 2) @ X_W
    A = frames.invert(scene.T_BF[:-1]) @ scene.T_BF[1:]
    B = M[:-1] @ np.linalg.inv(M[1:])
    D, F = zip(*(kim_system(a, b) for a, b in zip(A, B)))
    u = np.linalg.lstsq(np.vstack(D), np.concatenate(F), rcond=None)[0].reshape(3, 4)
    return frames.pose(nearest_rotation(u[:, :3]), u[:, 3])


# %% price-text [markdown]
# How do both compare on the same poses with the joint fit, of scanner and sphere center at once? Below, 150 scenes with 0.1 mm of noise, the errors of the translation, and the Cramér-Rao bound of a sphere: no unbiased method
# can have less. Decide first.

# %% predict-price
guess = ...  # your code here
### BEGIN SOLUTION
guess = "about three times"
### END SOLUTION
ex.predict("price_of_two_steps", guess)

# %% literature
both = literature.METHODS | {"your Li": by_li, "your Kim": by_kim}
methods = both if ex.after("price_of_two_steps", "li_rotation", "kim_system") else {}
errors, bound = literature.compare_methods(150, 0.1, np.random.default_rng(0), methods)
for name, error in errors.items():
    print(f"{name:24} {error:.2f} mm, {error / bound:.1f} times the bound for "
          "one sphere")

# %% literature-verdict [markdown]
# Splitting a problem in two is convenient, and costs accuracy: what step 1 errs nobody corrects in step 2. Kim's cube has eight points in place of one, so that the bound for one sphere is not
# its own; it forgets instead that $X$ is a rigid motion and divides noisy matrices by each other. (Fewer points make it worse, and a sphere alone gives a matrix of rank 1: *Break it* showed the refusal.)

# %% accuracy [markdown]
# ## Accurate, or only repeatable? (*further*)
#
# What is a calibrated scanner worth on a robot that errs itself? The thesis (section 2.1.1) tells two kinds of error apart. *Absolute accuracy* (*Absolutgenauigkeit*) is the difference between
# where the robot was sent and the mean of where it arrives; *repeatability* (*Wiederholgenauigkeit*) is how its arrivals differ among themselves. ISO 9283 makes numbers of them: the distance of
# the mean from the command, and, with $l$ the distances of the arrivals from their mean, $\bar l + 3\,s_l$. For a path the same is asked instant by instant, and the worst counts.
#
# Decide, then drag what is always wrong (the ring). Then let the robot arrive from all around, and faster around the corner.

# %% predict-repeats
guess = ...  # your code here
### BEGIN SOLUTION
guess = "it stays"
### END SOLUTION
ex.predict("repeats", guess, reveal=stages.accuracy_kinds)

# %% position_accuracy
@ex.position_accuracy
def position_accuracy(command, reached):
    """Return the accuracy (mm): how far the mean of the arrivals is from the command.

    command: shape (d,); reached: shape (n, d), mm.
    """
    ### BEGIN SOLUTION
    return np.linalg.norm(reached.mean(axis=0) - command)
    ### END SOLUTION


# %% repeatability
@ex.repeatability
def repeatability(reached):
    """Return ISO 9283's repeatability (mm) of arrivals (n, d), n - 1 below the root."""
    ### BEGIN SOLUTION
    distances = np.linalg.norm(reached - reached.mean(axis=0), axis=1)
    return distances.mean() + 3 * distances.std(ddof=1)
    ### END SOLUTION


# %% kinds
rng, sent = np.random.default_rng(0), np.zeros(3)
robot = robot_accuracy.RobotErrors(np.array([1.5, -0.8, 0.4]), backlash=0.3, std=0.05)
around = rng.normal(size=(30, 3))
around /= np.linalg.norm(around, axis=1)[:, None]
for name, ways in (("one side", np.tile([1.0, 0, 0], (30, 1))), ("all around", around)):
    reached = robot_accuracy.arrive(sent, ways, robot, rng)
    numbers = position_accuracy(sent, reached), repeatability(reached)
    print("from {}: accuracy {:.2f} mm, repeatability {:.2f} mm".format(name, *numbers))
robot = robot_accuracy.RobotErrors(np.zeros(2), std=0.05, lag=0.03)
for speed in (50, 200, 800):
    command, dt = robot_accuracy.corner(speed)
    paths = robot_accuracy.drive(command, dt, robot, rng, n=10)
    off = robot_accuracy.path_accuracy(command, paths)
    print(f"{speed} mm/s: path accuracy {off:.1f} mm")

# %% use [markdown]
# What data sheets of robots print is mostly repeatability; it is what counts for poses that were taught by hand. As soon as poses are computed, from CAD or from a scanner, accuracy counts.
#
# ## What the pose is for (*further*)
#
# The thesis ends with what a calibrated scanner allows (chapter 8): keep the height of a nozzle over a growing part, find deviations of form, locate a part in the robot's base and
# move the path with it. All of them are $T_{BF}\,T_{FS}\,x_S$. So mount the scanner (simulated, where the corrected data say it is), and measure a gauge: two marks 100 mm apart, once with the CAD pose, 32 mm
# off, and once with the calibrated one. First both marks from one orientation of the flange. **By how much is the CAD length wrong?**

# %% predict-same_orientation
guess = ...  # your code here
### BEGIN SOLUTION
guess = "not at all"
### END SOLUTION
ex.predict("same_orientation", guess)

# %% gauge
cad, marks = thesis.frame("scanner_start"), np.array([[1500.0, -650, 1100],
                                                      [1500, -550, 1100]])
alike, seen = robot_accuracy.looking_down_at(marks, fit.T_FS,
                                             turns=np.array([0.0, 0.0]))
turned, seen = robot_accuracy.looking_down_at(marks, fit.T_FS,
                                              turns=np.array([0.0, np.pi]))
for name, T_FS in (("CAD", cad), ("calibrated",
                                  fit.T_FS)) if ex.after("same_orientation") else ():
    p, q = frames.transform(alike, frames.transform(T_FS, seen))
    off = (p - marks[0]).round(2) + 0.0
    print(f"{name:10} length {np.linalg.norm(q - p):6.2f} mm, first mark off by "
          f"{off} mm")

# %% cad-length-text [markdown]
# The length is right and the place is wrong: by the CAD pose the first mark lies 31 mm too high, and a nozzle sent there stops in the air. Now the flange makes half a turn between the marks (poses
# `turned`; the scanner sees the marks as before, `seen`). What length does the CAD pose give?

# %% cad_length
cad_length = ...  # your code here
### BEGIN SOLUTION
p, q = frames.transform(turned, frames.transform(cad, seen))
cad_length = np.linalg.norm(q - p)
### END SOLUTION
cad_length = ex.cad_length(cad_length)

# %% all-lengths
poses = {"CAD": cad, "thesis's end pose": thesis.frame("scanner_end"),
         "calibrated": fit.T_FS}
for name, T_FS in poses.items() if ex.after("cad_length") else ():
    p, q = frames.transform(turned, frames.transform(T_FS, seen))
    print(f"{name:17} length {np.linalg.norm(q - p):6.2f} mm")

# %% in-practice [markdown]
# ## In practice
#
# - Never validate on the pose that fits best. Show all residuals, per pose.
# - Record poses by machine, and publish the file. Seven entries of these tables are off by one slip each, four by two swapped digits.
# - Free what you cannot touch to the accuracy you want.
# - Use the whole field of the sensor; a small residual at one place says nothing about orientation.
# - Cut spheres off their equator, and note the side.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. Name two misprints of C14 and the evidence for each. Why would a large residual alone not be enough?
# 2. With the center fixed the corrected tables leave 4.8 mm, with the center free a small part of it. What does that say about the touched plate, and why does the thesis's second step not help?
# 3. Why does a sphere seen always at the same place of the field leave the scanner's orientation unknown, however the robot turns?

# %% progress
ex.progress()
