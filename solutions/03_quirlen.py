# %% title [markdown]
# # 3 · Quirlen: calibration about a pivot
#
# **What you will do.** Find the tip of a tool from poses that all touch one point (*Quirlen*, swirling), judge the result, plan better poses, and survive
# bad ones.
#
# **What you will learn.** What a small residual is worth, what singular values say before anything is measured, what the sheet's
# $s_0$ means in millimeters, how many poses it takes, and how to let go of outliers.
#
# **What you need.** Chapter 1, least squares. About 75 minutes.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $T_{WF}$: $R_i$, $p_i$ | pose $i$ of the tool frame $F$ (the flange) in the world $W$ |
# | $P_t$, in code `tip` | the tip, seen from $F$ |
# | $P_\text{pivot}$, in code `point` | the fixed point, seen from $W$ |
# | $A\,x = b + r$ | stacked equations, $x = (P_t, P_\text{pivot})$, residuals $r$ |
# | $s_1 \ge \dots \ge s_6$ | singular values of $A$; $v_6$, the null vector, belongs to $s_6 = 0$ |
# | $\sigma_t$, $\sigma_r$ | noise of a pose: each coordinate (mm), each component of its turn (rad) |

# %% setup
import numpy as np

from labkit.calibration import pivot
from labkit.chapters.ch03_quirlen import stages
from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.exercises import course
from labkit.geometry.lie import exp_so3

ex = course("03-quirlen")
np.set_printoptions(precision=6, suppress=True)

# %% the-question [markdown]
# ## The question
#
# A robot gets a new measuring tip, parallel to the old one: only a shift is unknown. **Where is the tip, seen from the flange?** Nobody measures it. Instead the robot
# touches one fixed point again and again, from different directions. The point's place need not be known. This is section 3 of the lab sheet.
#
# Its file `Kreisel.txt` was never published. But the printed output has line numbers: of the blocks "Ptest", five lines each, the first begins at line 20 and the last at line 75,
# and line 80 prints $s_0$. So we know how many poses there were. `data/quirlen` holds as many synthetic ones, built so that the printed results come out.

# %% the-poses
print("poses in Kreisel.txt:", (75 - 20) // 5 + 1)
poses = lab_sheet.kreisel_poses()
for T in poses[:3]:
    tilt_deg = np.rad2deg(np.arccos(T[2, 2]))
    print("flange at", T[:3, 3].round(2), f"mm, tilted by {tilt_deg:.1f} deg")
print("...", len(poses), "synthetic poses in all")

# %% equation [markdown]
# ## One pose, three equations
#
# In every pose the tip is at the pivot: $R_i P_t + p_i = P_\text{pivot}$. Both unknowns to the left, what is known to the right:
#
# $$\begin{pmatrix} R_1 & -I \\ \vdots & \vdots \\ R_n & -I \end{pmatrix} \begin{pmatrix} P_t \\ P_\text{pivot} \end{pmatrix} \cong \begin{pmatrix} -p_1 \\ \vdots \\ -p_n \end{pmatrix} .$$

# %% pivot_matrix
@ex.pivot_matrix
def pivot_matrix(T_WF):
    """Return A, shape (3n, 6), from poses T_WF of shape (n, 4, 4), in mm: three rows
    per pose, pose after pose."""
    ### BEGIN SOLUTION
    return np.vstack([np.hstack([T[:3, :3], -np.eye(3)]) for T in T_WF])
    ### END SOLUTION


# %% pivot_rhs
@ex.pivot_rhs
def pivot_rhs(T_WF):
    """Return b, shape (3n,) in mm, from poses T_WF of shape (n, 4, 4): three numbers
    per pose, pose after pose."""
    ### BEGIN SOLUTION
    return -T_WF[:, :3, 3].ravel()
    ### END SOLUTION


# %% least-squares [markdown]
# ## Least squares
#
# Measured poses contradict each other, so we ask for the $x$ with the smallest $r^\top r$. Setting the derivative to zero gives the normal equations, and the sheet's
# equation (1): $x = (A^\top A)^{-1} A^\top b$. It is right, but $A^\top A$ has the *square* of the condition number of $A$. An orthogonal factorization (QR, SVD)
# works on $A$ itself, and `np.linalg.lstsq` does just that. Use either; further down you will see the difference.

# %% solve_pivot
@ex.solve_pivot
def solve_pivot(A, b):
    """Return x = (tip, point), shape (6,) in mm, with the least sum of squares of A x -
    b; A is (3n, 6), b is (3n,)."""
    ### BEGIN SOLUTION
    return np.linalg.lstsq(A, b, rcond=None)[0]
    ### END SOLUTION


# %% compare-listing-9
A, b = np.array(pivot_matrix(poses)), np.array(pivot_rhs(poses))
x = np.array(solve_pivot(A, b))
listing_9 = np.array([-1.747805, 44.586360, -87.648108, -253.032904, 107.040686,
                      -3.215224])
print("tip  ", x[:3], "mm\npoint", x[3:], "mm")
print(f"off listing 9 by {np.abs(x - listing_9).max():.1e} mm (half a printed digit is "
      "5.0e-07)")

# %% tip_length
# how long is the tool, from the flange to the tip, in mm?
tip_length = ...  # your code here
### BEGIN SOLUTION
tip_length = np.linalg.norm(x[:3])
### END SOLUTION
tip_length = ex.tip_length(tip_length)

# %% residuals [markdown]
# ## What is left over
#
# The agreement with listing 9 is no surprise: the synthetic poses were made for it. It shows that twelve poses can give these numbers, and what they then mean.
#
# The sheet checks its result with equation (2): $P_\text{test} = R_i P_t + p_i - P_\text{pivot}$, ideally zero in every pose. Then it prints
# $s_0 = \sqrt{r^\top r / n}$, $n$ the number of poses.

# %% pivot_residuals
@ex.pivot_residuals
def pivot_residuals(T_WF, tip, point):
    """Return R_i tip + p_i - point (mm) of every pose, shape (n, 3); T_WF is (n, 4, 4),
    tip and point are (3,)."""
    ### BEGIN SOLUTION
    return np.array([T[:3, :3] @ tip + T[:3, 3] - point for T in T_WF])
    ### END SOLUTION


# %% s0
residuals = np.array(pivot_residuals(poses, x[:3], x[3:]))
print("first P_test", residuals[0], "\nlast P_test ", residuals[-1])
listings = np.array([[-0.106450, 0.191828, -0.098577],
                     [0.043934, -0.236217, -0.109208]])
print("as in listings 9 and 10, to half a digit:",
      bool((np.abs(residuals[[0, -1]] - listings) < 5e-7).all()))
s0 = ...  # your code here
### BEGIN SOLUTION
s0 = np.sqrt((residuals**2).sum() / len(poses))
### END SOLUTION
s0 = ex.s0(s0)

# %% what-s0-means [markdown]
# The sheet calls $s_0$ the standard deviation of the result (*Standardabweichung des Ergebnisses*). That it is not: it says how far the poses disagree, and how sure the result is comes further down.
# The sheet divides by the number of *poses*. So $s_0$ is the typical distance in space by which the tip misses. The noise of one *coordinate* is smaller, and its
# unbiased estimate divides by the degrees of freedom: $3n$ equations less six unknowns. All three are honest numbers once their names are said.
# And as $n s_0^2 = r^\top r$, the printed $s_0$ even tells how far the ten poses missed that the sheet does not print.

# %% three-numbers
squares, n = (residuals**2).sum(), len(poses)
std = np.sqrt(squares / (3 * n - 6))
print(f"s0, rms distance in space (divided by {n} poses): as you found it above")
print(f"{np.sqrt(squares / (3 * n)):.3f} mm  rms of a coordinate (divided by {3 * n} "
      "equations)")
print(f"{std:.3f} mm  std of a coordinate, unbiased (divided by {3 * n - 6})")
print(f"{np.rad2deg(std / np.linalg.norm(x[:3])):.2f} deg turn of the flange that "
      "moves the tip as far")

# %% ten-others
# the sheet prints s0 of all twelve poses, and the residuals of two
s0_printed = lab_sheet.S0_LISTING_10
sum_of_all, sum_of_two = n * s0_printed**2, (listings**2).sum()
print(f"{np.sqrt(sum_of_two / 2):.3f} mm  rms distance in the two poses printed")
print(f"{np.sqrt((sum_of_all - sum_of_two) / (n - 2)):.3f} mm  in the ten others")

# %% swirl [markdown]
# ## Small residual, good tip?
#
# The sheet concludes: "Wie erwartet gilt für jede Messpose $P_\text{test} \approx \vec 0$." Does that make the tip right? Imagine the tool held upright on the point, spinning about its own axis like a top, never tilting. Decide, then let the time run and watch three
# bars: the residual $s_0$, the true error of the tip (here we know it), and the error that the covariance predicts. *Make it fail* only spins.

# %% predict-spin
guess = ...  # your code here
### BEGIN SOLUTION
guess = "a small residual, a large error"
### END SOLUTION
ex.predict("spin", guess, reveal=stages.swirl)

# %% two-poses [markdown]
# ## How many poses?
#
# The sheet: "Da es 6 Unbekannt gibt, werden auch mindestens 2 Messposen benötigt". Two poses give six equations. Is that enough?

# %% predict-two-poses
guess = ...  # your code here
### BEGIN SOLUTION
guess = "never"
### END SOLUTION
ex.predict("two_poses", guess)

# %% count-the-rank
for n in (2, 3, 4, 12):
    s = np.linalg.svd(pivot_matrix(poses[:n]), compute_uv=False)
    print(f"{n:2} poses: {3 * n:2} equations, s6/s1 = {s[5] / s[0]:.4f}, rank "
          f"{np.sum(s > 1e-9 * s[0])}")
turn = poses[0, :3, :3].T @ poses[1, :3, :3]
axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0],
                 turn[1, 0] - turn[0, 1]])
axis /= np.linalg.norm(axis)
point = x[3:] + 50 * poses[0, :3, :3] @ axis
shifted = pivot_residuals(poses[:2], x[:3] + 50 * axis, point)
change = np.abs(shifted - residuals[:2]).max()
print("tip shifted by 50 mm along the axis of the turn: residuals change by less than "
      f"1e-9 mm: {change < 1e-9}")

# %% why-three [markdown]
# Two poses suffice only with knowledge from elsewhere: if the component along the axis of the turn is known, say because the tool was measured with a ruler. Three poses
# with different axes of turn fix all six unknowns.
#
# ## Plan before you measure
#
# $A$ holds orientations only, and those you choose. Its singular values say how well the poses will fix the tip; the null vector shows the
# direction in which they will not. With noise of known size, even the covariance of the tip follows in advance: the ellipsoid. Which set is better? Decide, then drag the six
# directions over the sphere; drag beside it to turn the view. *Make it fail* leaves nothing but spin, and the null vector appears.

# %% predict-cone
guess = ...  # your code here
### BEGIN SOLUTION
guess = "6 poses within 20 deg"
### END SOLUTION
ex.predict("cone", guess, reveal=stages.pose_designer)

# %% cone-text [markdown]
# The same in numbers. `pivot.cone(n, angle)` gives $n$ orientations of a tool led once around a cone, tilted by that angle; `pivot.touching_poses` moves the flange
# to where the tip then touches the point. The flange, the plate that carries the tool, is 100 mm away from the tip: the *lever*.

# %% cone-angle
tip = np.array([0.0, 0.0, -100.0])
print("poses    cone  condition   squared  tip across    along")
for n, half_angle_deg in ((60, 1), (60, 2), (6, 20), (60, 20), (60, 45)):
    R = pivot.cone(n, np.deg2rad(half_angle_deg))
    s = np.linalg.svd(pivot.pivot_matrix(pivot.touching_poses(R, tip, np.zeros(3))),
                      compute_uv=False)
    cov = pivot.predicted_covariance(R, tip, std_rot=0.0, std_trans=0.2)
    condition = s[0] / s[5]
    across, along = np.sqrt(cov[0, 0]), np.sqrt(cov[2, 2])
    print(f"{n:5}  {half_angle_deg:2} deg  {condition:9.0f}  {condition**2:8.0f}  "
          f"{across:7.2f} mm  {along:.2f} mm")

# %% squared [markdown]
# The column "squared" is what the normal equations work with, and every power of ten in it costs one of the 16 digits a computer has. Try it with exact poses on very narrow cones.

# %% normal-equations
for half_angle_deg in (0.1, 0.001):
    T = pivot.touching_poses(pivot.cone(60, np.deg2rad(half_angle_deg)), tip,
                             [300.0, 200.0, 100.0])
    A_cone, b_cone = pivot.pivot_matrix(T), pivot.pivot_rhs(T)
    by_normal = np.linalg.inv(A_cone.T @ A_cone) @ A_cone.T @ b_cone
    by_svd = np.linalg.lstsq(A_cone, b_cone, rcond=None)[0]
    worse = np.linalg.norm(by_normal[:3] - tip) / np.linalg.norm(by_svd[:3] - tip)
    left = 16 - np.log10(np.linalg.cond(A_cone)) * np.array([1, 2])
    words = f"cone {half_angle_deg:5} deg: {left[0]:2.0f} digits left by SVD,"
    words += f" {left[1]:2.0f} by normal equations,"
    print(words, f"at least 100 times worse: {worse > 100}")

# %% covariance [markdown]
# ## How sure are we?
#
# Noise in $b$ with covariance $\sigma^2 I$ reaches $x = (A^\top A)^{-1}A^\top b$ as $\operatorname{cov}(x) = \sigma^2 (A^\top A)^{-1}$, and $\sigma$ is estimated from the residuals. Here residual and
# geometry meet: $\sigma$ says how well the poses agree, $(A^\top A)^{-1}$ how much that agreement is worth.

# %% pivot_covariance
@ex.pivot_covariance
def pivot_covariance(A, residuals):
    """Return the covariance of x (mm^2), shape (6, 6), from A of shape (3n, 6) and
    residuals (mm) of shape (n, 3)."""
    ### BEGIN SOLUTION
    r = residuals.ravel()
    return r @ r / (len(r) - 6) * np.linalg.inv(A.T @ A)
    ### END SOLUTION


# %% tip-with-its-uncertainty
cov = pivot_covariance(A, residuals)
print("tip", x[:3].round(2), "+-", np.sqrt(np.diag(cov))[:3].round(2),
      "mm; the sheet prints six decimals")
for half_angle_deg in (5, 10, 20, 45):
    R = pivot.cone(12, np.deg2rad(half_angle_deg))
    predicted = pivot.predicted_covariance(R, x[:3], 0.0, std)[:3, :3]
    worst = np.sqrt(np.linalg.eigvalsh(predicted).max())
    poses_needed = np.ceil(12 * (worst / 0.1) ** 2)
    print(f"0.1 mm in the worst direction, cone {half_angle_deg:2} deg: about "
          f"{poses_needed:4.0f} poses")

# %% break-it [markdown]
# ## Break it
#
# Spin only. The workbook's `calibrate_pivot` refuses, and names the direction. $A$ holds no lengths, and $s_6$ is judged *relative* to $s_1$: meters in place of millimeters change nothing.
# Then add orientation noise: now every pose seems a little tilted, and the matrix looks healthy. Only who knows the size of that noise can tell.

# %% break-it-code
spin = pivot.cone(40, 0.0, turns=1)
meters = pivot.touching_poses(spin, tip / 1000, np.zeros(3))
exact = pivot.touching_poses(spin, tip, np.zeros(3))
noisy = pivot.touching_poses(spin, tip, np.zeros(3), np.deg2rad(0.2), 0.1,
                             np.random.default_rng(1))
known = {"std_rot": np.deg2rad(0.2), "std_trans": 0.1}
for words, T, noise in (("exact", exact, {}), ("meters", meters, {}),
                        ("noisy", noisy, {}), ("noise known", noisy, known)):
    try:
        result = pivot.calibrate_pivot(T, **noise)
        error = np.linalg.norm(result.tip - tip)
        print(f"{words}: accepted, s0 = {result.s0:.2f} mm, and the tip is off by "
              f"{error:.0f} mm")
    except ValueError as refusal:
        print(f"{words}: {refusal}")

# %% beyond [markdown]
# ## Beyond the document: bad poses
#
# One slip of the tip, one pose read while the robot still moved: a few bad poses come among the good ones. A robust estimate asks which poses *agree*, and weighs each by its distance $d$ from them.
# Tukey's weights are $w = (1 - q^2)^2$ with $q = d / (7\,\sigma)$, and exactly 0 for $q > 1$. Least squares with these weights is repeated until it settles. It needs a start that no bad pose
# can spoil: the best of a hundred solutions from three poses each.

# %% robust_weights
@ex.robust_weights
def robust_weights(distances, scale):
    """Return Tukey's weights, shape (n,), from distances (mm) and the scale (the noise,
    mm), with the cutoff at 7 scales."""
    ### BEGIN SOLUTION
    q = distances / (7 * scale)
    return np.where(q < 1, (1 - q**2) ** 2, 0.0)
    ### END SOLUTION


# %% outliers-text [markdown]
# **Three of twelve touches are a few millimeters beside the point, the noise is 0.2 mm: how far off is the tip of plain least squares?**

# %% predict-outliers
guess = ...  # your code here
### BEGIN SOLUTION
guess = "about a millimeter"
### END SOLUTION
ex.predict("outliers", guess, reveal=stages.outliers)

# %% weights-for-orientation [markdown]
# Equation (1) takes all numbers to be equally good. Bad poses are not, and orientation noise is another reason: a turn of the flange shakes the tip *across* the lever, not along it. So the components of a residual are not equally good.
# `calibrate_pivot(T, std_rot, std_trans)` weighs them. The yardstick is the Cramér-Rao bound: no unbiased method does better (two hundred runs leave a few percent of each number to chance).

# %% against-the-bound
rng, tip, squares = np.random.default_rng(3), np.array([12.0, -8.0, 150.0]), {}
R = exp_so3(rng.uniform(-0.6, 0.6, (50, 3)))
noise = {"std_rot": np.deg2rad(0.3), "std_trans": 0.1}
for _ in range(200):
    good = pivot.touching_poses(R, tip, np.zeros(3), **noise, rng=rng)
    bad = good.copy()
    bad[:5, :3, 3] += 30 * rng.normal(size=(5, 3))
    cases = {"plain": (good, {}), "weighted": (good, noise), "10 % bad": (bad, {}),
             "10 % bad, robust and weighted": (bad, {**noise, "robust": True})}
    for words, (T, options) in cases.items():
        error = pivot.calibrate_pivot(T, **options).tip - tip
        squares[words] = squares.get(words, 0) + error @ error / 200
bound = np.sqrt(np.trace(pivot.predicted_covariance(R, tip, **noise)[:3, :3]))
for words, square in squares.items():
    print(f"{words:30} {square**0.5:5.2f} mm = {square**0.5 / bound:5.2f} x bound")

# %% in-practice [markdown]
# ## In practice
#
# - Tilt as far as the cell allows, in all directions. Twelve poses on a wide cone beat sixty on a narrow one.
# - Leading the tilted tool around by turning the robot's base alone is one axis again, the vertical one: it looks like a cone and is a spin.
# - Look at the singular values before you move, at the covariance afterwards, and at the residual last.
# - Keep a few poses out of the calibration and test the tip on them. On its own poses every result looks good.
# - Say which number you quote: distance or coordinate, divided by what.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. A colleague proudly shows $s_0 = 0.02$ mm from eighty poses. Which single question do you ask?
# 2. The tool points along $z$ of the flange and you only need the direction of the shaft, not its length. Is spinning enough?
# 3. One pose in twelve is grossly wrong. The covariance grows, but does not say which pose it was. Why not, and what in the residuals would?

# %% progress
ex.progress()
