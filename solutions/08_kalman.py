# %% title [markdown]
# # 8 · Kalman filters
#
# **What you will do.** Predict and correct, first a number, then a vehicle, then a robot among landmarks. Rebuild an example of the lecture from four printed digits.
#
# **What you will learn.** What two contradicting sensors do to a filter, what becomes of a velocity that nobody measures, what one forgotten wrap of an
# angle costs, and how to tell whether a filter is honest.
#
# **What you need.** Chapter 7 and covariances. About 90 minutes; sections called *further* come on top.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $x$, $\Sigma$, in code `x`, `cov` | state and its covariance; $x^-$ before the correction |
# | $A$, $B$, $C$ | the state follows itself, the control acts, the sensor sees; $A^\top$, in hints Aᵀ, is the transpose |
# | $\Sigma_u$, $\Sigma_z$ | covariances of control and measurement |
# | $\Sigma_v$, in code `cov_v` | noise of the system in one step, here $B \Sigma_u B^\top$ |
# | $y = z - Cx^-$, $S$ | innovation (what surprises) and its covariance |
# | $K$ | gain: how much of the surprise is believed |
# | $G_x$, $G_u$, $H$ | Jacobians of motion and measurement in the extended filter |
# | NEES, NIS | error and innovation, squared, in units of the covariance the filter claims |

# %% setup
import numpy as np

from labkit.chapters.ch08_kalman import stages
from labkit.documents.lecture.examples import (circle_course, predict_vehicle,
                                               reconstruct_vehicle)
from labkit.estimation import kalman
from labkit.exercises import course
from labkit.localization import ekf, odometry
from labkit.machines import simulation
from labkit.machines.tracking import shift_time

ex = course("08-kalman")
np.set_printoptions(precision=4, suppress=True)

# %% the-question [markdown]
# ## The question
#
# Odometry drifts, distances are noisy. **How do we combine them so that the result is better than either, and know how good it is?** The lecture
# *Lokalisierung* ("Ziel des Kalman-Filters") answers with two alternating steps. A model of the motion *predicts*, and every measurement *corrects*:
#
# $$x^- = A x + B u, \qquad \Sigma^- = A \Sigma A^\top + B \Sigma_u B^\top .$$

# %% predict_state
@ex.predict_state
def predict_state(x, cov, A, B, u, cov_u):
    """Return state (n,) and covariance (n, n) one time step later; u (k,), cov_u (k,
    k), B (n, k)."""
    ### BEGIN SOLUTION
    return A @ x + B @ u, A @ cov @ A.T + B @ cov_u @ B.T
    ### END SOLUTION


# %% correction [markdown]
# The correction asks how surprising the measurement is, and divides the surprise between prediction and sensor (lines 5 to 8 of "Algorithmus für linearen
# Kalman-Filter"). Without a measurement there is no correction.
#
# $$K = \Sigma^- C^\top (C \Sigma^- C^\top + \Sigma_z)^{-1}, \qquad x = x^- + K (z - C x^-), \qquad \Sigma = (I - K C)\,\Sigma^- .$$

# %% update
@ex.update
def update(x, cov, z, C, cov_z):
    """Return state and covariance after the measurement z, shape (m,), with C (m, n)
    and cov_z (m, m); no covariance is singular."""
    ### BEGIN SOLUTION
    K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z)
    return x + K @ (z - C @ x), (np.eye(len(x)) - K @ C) @ cov
    ### END SOLUTION


# %% printed-filter [markdown]
# The header of that slide's algorithm reads `KalmanFilter(x_k, u_k, z_k+1)`, its last line `return x_k+1`.
# **What is missing to call it step after step?**

# %% predict-printed
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the covariance, in and out"
### END SOLUTION
ex.predict("printed", guess)

# %% bells [markdown]
# ## Three bells
#
# **Prediction and measurement are equally sure, but 2 m apart: what becomes of the corrected bell?** Decide, then drag the peak of the measurement: sideways moves it, upward makes it sharper. Watch what the gain follows, and what it does not look at.
# *Make it fail* shows what the bells do not tell.

# %% predict-bell
guess = ...  # your code here
### BEGIN SOLUTION
guess = "narrower than both"
### END SOLUTION
ex.predict("bell", guess, reveal=stages.bells)

# %% fusion [markdown]
# ## Two sensors, one wall
#
# A standing robot measures its distance to a wall with two sensors ("Fusionierung von zwei Messwerten"). In one dimension the filter is a weighted mean: each
# opinion, the prior included, weighs one over its variance, and the weights add up to one over the new variance.

# %% fuse_two_sensors
@ex.fuse_two_sensors
def fuse_two_sensors(x0, var0, z, stds):
    """Return position and variance from a prior (x0, var0), two measurements z (2,) and
    their stds (2,)."""
    ### BEGIN SOLUTION
    weights = np.array([1 / var0, *(1 / stds**2)])
    return weights @ [x0, *z] / weights.sum(), 1 / weights.sum()
    ### END SOLUTION


# %% fused-question [markdown]
# The page prints: $\hat x_0 = 0$, $\Sigma_0 = 20$, $z = (9.4,\ 10.6)$, standard deviations 0.5 and 1. What follows for the position? Its variance may come along.

# %% fused
fused = ...  # your code here
### BEGIN SOLUTION
fused = fuse_two_sensors(0.0, 20.0, np.array([9.4, 10.6]), np.array([0.5, 1.0]))[0]
### END SOLUTION
fused = ex.fused(fused)

# %% fused-against [markdown]
# Printed is 9.6, and the true position is 10. Yours rounds to another digit. Which other reading of the page gives 9.6? (It also calls the new
# variance $\Sigma_0$; it is $\Sigma_1$.)

# %% fused-readings
z, stds = np.array([9.4, 10.6]), np.array([0.5, 1.0])
readings = {"20 is a standard deviation": (0, 20**2, z), "no prior": (0, 1e12, z)}
readings |= {"prior mean 10": (10, 20, z),
             "z[0] was 9.407, printed 9.4": (0, 20, z + [0.007, 0])}
for name, (x0, var0, values) in readings.items():
    x, var = fuse_two_sensors(x0, var0, values, stds)
    print(f"{name:28} x = {x:.4f}, rounds to {x:.1f}; variance {var:.3f}")

# %% fused-verdict [markdown]
# All four give 9.6, so the page alone does not tell which it was. The last line decides how severe to be: an input that was rounded in print, 9.407 to 9.4, already explains the difference.
# Nothing more is proved, and the ledger of chapter 10 calls the row *rounding*, not a misprint.

# %% vehicle [markdown]
# ## A velocity nobody measures
#
# Now the vehicle of "Beispiel: bewegtes Fahrzeug": the state is position and velocity, the control an acceleration, and a sensor measures the position alone. With
# time step $T$: $A = \begin{pmatrix}1 & T\\0 & 1\end{pmatrix}$, $B = \begin{pmatrix}0\\T\end{pmatrix}$, $C = (1\ \ 0)$. (Acceleration also moves the
# position by $T^2/2$; the lecture leaves that out.)
#
# In the figure, the dots are the sensor's errors, and the bracket beside them what the filter *believes* of the sensor. Pull it until it fits; the true noises stay 0.5 m and
# 0.4 m/s². On the right the mean NIS judges every such belief. Then switch the sensor off for three seconds.
# First decide: **the velocity is never measured, so what becomes of its uncertainty while the vehicle drives?**

# %% predict-velocity
guess = ...  # your code here
### BEGIN SOLUTION
guess = "it settles at a small value"
### END SOLUTION
ex.predict("velocity", guess, reveal=stages.vehicle)

# %% steady [markdown]
# ## The gain knows before the data do
#
# No measurement appears in the formulas of $K$ and $\Sigma$: both can be computed before the first one is taken. In a time-invariant system whose sensor sees every state, directly or
# through the model, they settle where one step changes nothing more: at the solution of the Riccati equation. (Measure the velocity alone instead: the gain still settles, but the variance
# of the position grows without end, for nothing ever tells where the vehicle is.) A gain that stands still makes filters fast: `labkit.fast.kalman.filter_steps` runs the rest as a digital filter.

# %% steady_state_gain
@ex.steady_state_gain
def steady_state_gain(A, C, cov_v, cov_z):
    """Return the gain K, shape (n, m), after very many steps, right to 0.001.

    A (n, n), C (m, n), cov_v (n, n) of the system per step, cov_z (m, m). The sensor
    sees every state, directly or through A.
    """
    ### BEGIN SOLUTION
    cov = np.eye(len(A))
    for _ in range(3000):
        cov = A @ cov @ A.T + cov_v
        K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + cov_z)
        cov = (np.eye(len(A)) - K @ C) @ cov
    return K
    ### END SOLUTION


# %% k50 [markdown]
# ## Against the document: the correction at k = 50
#
# "Simulation des Kalmanfilters (2)" prints the prediction $x^- = (12.5,\ 5.0)$ with
# $\Sigma^- = \begin{pmatrix}1.9469 & 0.2550\\0.2550 & 0.0916\end{pmatrix}$, the measurement 11.79 with variance 0.25, and the result:
# $(11.90,\ 4.98)$ with $\begin{pmatrix}0.2216 & 0.0290\\0.0290 & 0.0620\end{pmatrix}$. Compute the corrected state, with its covariance if you like.

# %% corrected
prior_cov = np.array([[1.9469, 0.2550], [0.2550, 0.0916]])
corrected = ...  # your code here
### BEGIN SOLUTION
C, cov_z = np.array([[1.0, 0.0]]), np.array([[0.25]])
corrected = update(np.array([12.5, 5.0]), prior_cov, np.array([11.79]), C, cov_z)
### END SOLUTION
corrected = ex.corrected(corrected)

# %% detective [markdown]
# The covariance agrees to the last digit, the state does not: printed is (11.90, 4.98). Four digits of a covariance are a good witness. After $n$
# predictions without a correction, $\Sigma^-$ depends linearly on the two starting variances and the variance of the acceleration, so three numbers fix three,
# for every $n$ and $T$ you try. Only one line below is round.

# %% detective-code
for n in (49, 50, 51, 52):
    var_x0, var_v0, var_a = reconstruct_vehicle(prior_cov, n, 0.1)
    print(f"{n} steps of 0.1 s: starting variances {var_x0:.4f} and {var_v0:.4f}, "
          f"acceleration {var_a:.4f}")
x_51, cov_51 = predict_vehicle(51, 0.1, 1.0, 0.01, 0.16)
result = kalman.update(x_51, cov_51, [11.79], [[1.0, 0.0]], [[0.25]])
print("prediction after 51 steps at 1 m/s^2:", x_51, " corrected:", result.x)
for T in (0.05, 0.09, 0.11, 0.12):
    print(f"51 steps of {T} s would need", reconstruct_vehicle(prior_cov, 51, T))

# %% verdict [markdown]
# So the simulation ran 51 steps (0 to 50), from variances 1 and 0.01, with $\sigma_a = 0.4$. It predicted (12.75, 5.10), not the printed (12.5, 5.0), which are the ideal
# $\tfrac12 a t^2$ and $a t$ at 5 s. Corrected, 12.75 gives the printed 11.90, and the velocity 4.989, printed cut off as 4.98. What stays free: any $T$ from about 0.055 to 0.11 s allows
# non-negative variances; only roundness, and the ratio of the printed position to the velocity, single out 0.1.

# %% ekf [markdown]
# ## A robot among landmarks
#
# Now motion and measurement bend: the *extended* filter pushes the state through the true functions and the covariance through their Jacobians. The sensor measures
# distance and bearing to landmark $l$ ("Messmodell"); with $(d_x, d_y) = l - (x, y)$ they are $\sqrt{d_x^2 + d_y^2}$ and
# $\mathrm{atan2}(d_y, d_x) - \theta$. First, angles need a home between $-\pi$ and $\pi$.

# %% wrap_angle
@ex.wrap_angle
def wrap_angle(angle):
    """Return the same direction as an angle from -pi to pi."""
    ### BEGIN SOLUTION
    return (angle + np.pi) % (2 * np.pi) - np.pi
    ### END SOLUTION


# %% measurement
@ex.measurement
def measurement(x, landmark):
    """Return (distance, bearing), shape (2,), from the pose x (3,) to a landmark (2,);
    the bearing wrapped."""
    ### BEGIN SOLUTION
    dx, dy = landmark - x[:2]
    return np.array([np.hypot(dx, dy), wrap_angle(np.arctan2(dy, dx) - x[2])])
    ### END SOLUTION


# %% measurement_jacobian
@ex.measurement_jacobian
def measurement_jacobian(x, landmark):
    """Return H, shape (2, 3): distance and bearing by x, y, theta."""
    ### BEGIN SOLUTION
    dx, dy = landmark - x[:2]
    q = dx**2 + dy**2
    r = np.sqrt(q)
    return np.array([[-dx / r, -dy / r, 0], [dy / q, -dx / q, -1]])
    ### END SOLUTION


# %% motion-model [markdown]
# The robot moves by the simplified model of chapter 7, straight along its *old* heading, with speed $v$, turn rate $\omega$ and time step $T$:
#
# $$x' = x + v T \cos\theta, \qquad y' = y + v T \sin\theta, \qquad \theta' = \theta + \omega T .$$
#
# In code that is `odometry.step(x, u, dt, "euler")` with `u = (v, omega)`. (Without `"euler"` it takes the midpoint step.) Its derivatives by the pose and by the control:

# %% motion_jacobians
@ex.motion_jacobians
def motion_jacobians(x, u, dt):
    """Return G_x (3, 3) and G_u (3, 2), the derivatives of the motion above by pose and
    control; u = (v, omega)."""
    ### BEGIN SOLUTION
    c, s = np.cos(x[2]), np.sin(x[2])
    G_x = np.array([[1, 0, -u[0] * dt * s], [0, 1, u[0] * dt * c], [0, 0, 1]])
    return G_x, dt * np.array([[c, 0], [s, 0], [0, 1]])
    ### END SOLUTION


# %% numeric-check [markdown]
# A Jacobian by hand is checked by differences before it is used, always. And then one step of the whole filter, in eight lines: states go through the
# bent functions themselves, covariances through the Jacobians.

# %% numeric-check-code
def slopes(function, x, h=1e-6):
    """Central differences of function(x) by x, one column per coordinate."""
    return np.column_stack([(function(x + h * e) - function(x - h * e)) / (2 * h)
                            for e in np.eye(len(x))])


x, u, landmark = np.array([0.5, -1.0, 2.0]), np.array([1.0, 0.4]), np.array([3.0, 2.0])
H, (G_x, G_u) = measurement_jacobian(x, landmark), motion_jacobians(x, u, 0.1)
pairs = {"H": (H, slopes(lambda x: measurement(x, landmark), x)),
         "G_x": (G_x, slopes(lambda x: odometry.step(x, u, 0.1, "euler"), x)),
         "G_u": (G_u, slopes(lambda u: odometry.step(x, u, 0.1, "euler"), u))}
for name, (by_hand, numeric) in pairs.items():
    print(f"{name:3} agrees with central differences to eight digits:",
          bool(np.abs(by_hand - numeric).max() < 1e-8))

# %% ekf_step
@ex.ekf_step
def ekf_step(x, cov, u, dt, cov_u, z, landmark, cov_z):
    """Return pose and covariance after a step of the simplified model with u = (v,
    omega), and z = (distance, bearing).

    x (3,), cov (3, 3), cov_u (2, 2) of the control, landmark (2,), cov_z (2, 2) of z.
    """
    ### BEGIN SOLUTION
    G_x, G_u = motion_jacobians(x, u, dt)
    x = odometry.step(x, u, dt, "euler")
    cov = G_x @ cov @ G_x.T + G_u @ cov_u @ G_u.T
    H = measurement_jacobian(x, landmark)
    y = z - measurement(x, landmark)
    y[1] = wrap_angle(y[1])
    K = cov @ H.T @ np.linalg.inv(H @ cov @ H.T + cov_z)
    return x + K @ y, (np.eye(3) - K @ H) @ cov
    ### END SOLUTION


# %% arena [markdown]
# ## Drive among landmarks
#
# As in the lecture's "Beispielfahrt mit einer Landmarke": stars show where each measurement puts the landmark. Arrow keys or play; drag the landmarks while it drives. The panel shows
# the NEES, which averages 3 for an honest filter of three states. **A filter forgets to wrap the bearing's innovation: what happens when a bearing crosses from +180° to −180°?** Decide, then make it fail, twice.

# %% predict-wrapping
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the estimate is thrown off at once"
### END SOLUTION
ex.predict("wrapping", guess, reveal=stages.arena)

# %% honest [markdown]
# ## Is the filter honest?
#
# A filter that errs by a meter and says so is useful; one that errs by 5 cm and claims 1 cm is dangerous. The test: $e^\top \Sigma^{-1} e$, the NEES, where $e$ is truth minus estimate.
# For an honest filter, its model right and its errors Gaussian, it follows a chi-square distribution with as many degrees of freedom as states. Then the mean of 200 runs lies in a narrow band
# around 3, with a probability of 99 %.

# %% nees
@ex.nees
def nees(truth, x, cov):
    """Return the normalized estimation error squared of a pose x (3,) with cov (3, 3);
    wrap the heading error."""
    ### BEGIN SOLUTION
    e = truth - x
    e[2] = wrap_angle(e[2])
    return e @ np.linalg.solve(cov, e)
    ### END SOLUTION


# %% two-hundred-runs
four = circle_course(marks=4)
drives = four.simulate(np.random.default_rng(1), runs=200)
beliefs = {"as it is": {}, "bearing not wrapped": {"wrap": False}}
beliefs["drive believed 3 times too good"] = {"cov_u": four.cov_u / 9}
beliefs["sensor believed 3 times too good"] = {"std_range": four.std_range / 3,
                                               "std_bearing": four.std_bearing / 3}
low, high = kalman.mean_band(3, 200)
print(f"mean NEES of 200 runs after 30 s; honest between {low:.2f} and {high:.2f}")
for name, belief in beliefs.items():
    found = four.localize(drives, **belief)
    mean = kalman.nees(drives.truth[-1], found.x[-1], found.cov[-1], angle=2).mean()
    del found  # 7 MB, before the next run takes as much
    shown = f"{mean:.1f}" if mean < 1000 else "over 1000"
    print(f"{name:33} {shown:>9}  {'honest' if low < mean < high else 'not honest'}")

# %% curvature [markdown]
# ## Further, beyond the document: a sensor ten times more precise
#
# The extended filter replaces a curve by its tangent at the prediction. Here 200 robots know their start poorly, and are corrected once.
# **With a sensor ten times more precise, is the filter's covariance more trustworthy, or less?**

# %% predict-precise
guess = ...  # your code here
### BEGIN SOLUTION
guess = "less trustworthy"
### END SOLUTION
ex.predict("precise", guess, reveal=stages.honesty)

# %% unscented [markdown]
# The tangent is good enough while the prediction is good compared with the sensor. The cure is to linearize again at the corrected pose, and again: the *iterated* filter, which is Gauss-Newton
# from chapter 4 on prior and measurement together. The *unscented* filter needs no Jacobian: it sends seven points through the measurement itself. Which of the three will be honest here? Same
# priors, same measurements:

# %% unscented-code
marks, std_range, std_bearing = stages.TWO_MARKS, 0.01, np.radians(0.2)
cov, rng = np.diag([1.0, 1.0, np.radians(10) ** 2]), np.random.default_rng(4)
prior = rng.standard_normal((200, 3)) * np.sqrt(np.diag(cov))
noise = rng.standard_normal((200, 2, 2)) * [std_range, std_bearing]
z = ekf.measurement(np.zeros(3), marks) + noise
given = (prior, np.broadcast_to(cov, (200, 3, 3)), z, marks, std_range, std_bearing)
filters = {"extended": ekf.ekf_update(*given),
           "unscented": ekf.unscented_update(*given)}
filters["iterated"] = ekf.ekf_update(*given, iterations=10)
for name, step in filters.items():
    rms = 1000 * np.sqrt((step.x[:, :2] ** 2).sum(1).mean())
    print(f"{name:10} RMS {rms:4.0f} mm, mean NEES "
          f"{kalman.nees(np.zeros(3), step.x, step.cov, angle=2).mean():7.3g}")

# %% unscented-verdict [markdown]
# Only the iterated filter is: accurate, and its NEES near 3. The unscented one is even farther off than the extended, but claims less: its points lie 1.7 standard deviations of a wide prior from the middle, too
# coarse for a curve that the sensor resolves to a centimeter. Neither number alone tells that; the RMS sees the error, the NEES whether it was admitted.

# %% gates [markdown]
# ## Which landmark was that?
#
# Real landmarks wear no numbers, and some measurements belong to none. The innovation in units of its covariance, $y^\top S^{-1} y$ (the NIS), decides: nearest in this distance (Mahalanobis's), and only if it
# lies below the chi-square limit (5.99 for two numbers and 95 %). Only what was measured counts: with one landmark in sight and three on the map the limit is that of two numbers, not of six
# (`kalman.gate` takes the number from `step.dof`). In the example the filter's heading is off by 8°: what it measures of landmark 0 then lies nearer to
# landmark 1 *in meters*, and the gate can only throw the measurement away.

# %% gate
@ex.gate
def gate(innovation, cov_innovation, limit):
    """Return True where the innovation (m,) is plausible: its NIS, with the covariance
    (m, m), is below the limit."""
    ### BEGIN SOLUTION
    return bool(innovation @ np.linalg.solve(cov_innovation, innovation) < limit)
    ### END SOLUTION


# %% association
marks = np.array([[10.0, 0.0], [8.7, 1.6]])
truth = np.array([0.0, 0.0, np.radians(-8)])
cov = np.diag([1e-4, 1e-4, np.radians(8) ** 2])
z = ekf.measurement(truth, marks)
believed = np.zeros(3)  # the filter thinks the robot looks straight ahead
for by in ("nearest", "mahalanobis"):
    print(f"{by:12} landmarks 0 and 1 are taken for",
          ekf.associate(believed, cov, z, marks, 0.05, 0.01, by=by))
stray = np.array([[4.0, 1.0]])
taken = ekf.associate(believed, cov, stray, marks, 0.05, 0.01)
print("a chair at 4 m is taken for", taken, "(-1: for nothing)")

# %% tracker [markdown]
# ## Further: the tracker of chapter 6, filtered
#
# Chapter 6 simulated the report's motions and ended with a filter it did not explain. You have all its parts now: constant velocity as the model, accelerations as its noise, your gate (16.27 is
# the 99.9 % limit for three numbers), your correction. The tracker jumps by up to half a meter now and then. The second line believes that the robot accelerates ten times less; watch the gate.

# %% tracker-code
motion = simulation.simulate_motion("middle", np.random.default_rng(5))
read, dt = motion.T_read[:, :3, 3], motion.time[1] - motion.time[0]
truth = shift_time(motion.time, motion.T_true, -simulation.MOVING.latency)[:, :3, 3]
A, B, C = (np.kron(M, np.eye(3)) for M in ([[1, dt], [0, 1]], [[dt**2 / 2], [dt]],
                                           [[1, 0]]))
cov_z = 9.0 * np.eye(3)
for std_a in (4000.0, 400.0):
    x, cov, off = np.array([*read[0], 0, 0, 0]), np.diag([9.0] * 3 + [1e6] * 3), []
    for z, position in zip(read, truth):
        x, cov = predict_state(x, cov, A, B, np.zeros(3), std_a**2 * np.eye(3))
        if gate(z - C @ x, C @ cov @ C.T + cov_z, 16.27):
            x, cov = update(x, cov, z, C, cov_z)
        off.append(np.linalg.norm(x[:3] - position))
    print(f"believed {std_a:4.0f} mm/s^2: median error {np.median(off):5.1f} mm, "
          f"largest {max(off):5.0f} mm")

# %% tracker-compare [markdown]
# Unfiltered, the same readings are off by a median of 4 mm and by up to 500 mm. The honest filter keeps the median, which is systematic and which no filter sees, and removes the jumps. The
# sure one refused a good reading, drove on by its model, and then refused nearly all of them: it is lost, several times farther off than its covariance admits.

# %% batch [markdown]
# ## All at once, or one by one? (*further*)
#
# Nobody moves, and a sensor measures several times. A filter takes the readings one by one
# and keeps only state and covariance. Chapter 4 would take all at once, by weighted least
# squares: what is known before ($x_0$, $\Sigma_0$) counts like one more reading. Write that.

# %% batch_estimate
@ex.batch_estimate
def batch_estimate(x0, cov0, z, C, cov_z):
    """Return state and covariance from all measurements z, shape (k, m), at once; no
    covariance is singular."""
    ### BEGIN SOLUTION
    N, b = np.linalg.inv(cov0), np.linalg.solve(cov0, x0)
    for one in z:
        N = N + C.T @ np.linalg.solve(cov_z, C)
        b = b + C.T @ np.linalg.solve(cov_z, one)
    return np.linalg.solve(N, b), np.linalg.inv(N)
    ### END SOLUTION


# %% batch-code
rng, C, cov_z = np.random.default_rng(4), np.array([[1.0, 0.5]]), np.array([[0.2]])
x0, cov0, z = np.zeros(2), np.diag([4.0, 9.0]), rng.normal(2.0, 0.5, (30, 1))
x, cov = x0, cov0
for one in z:
    x, cov = update(x, cov, one, C, cov_z)
at_once, cov_at_once = batch_estimate(x0, cov0, z, C, cov_z)
print("one by one ", np.round(x, 4), "std", np.round(np.sqrt(np.diag(cov)), 4))
print("all at once", np.round(at_once, 4), "std",
      np.round(np.sqrt(np.diag(cov_at_once)), 4))

# %% batch-said [markdown]
# The same, to every printed digit: a Kalman filter *is* least squares, done step by step. Where a
# model is linear nothing is lost by forgetting the readings. Where it is not, the extended
# filter linearizes each reading where it stood *then*; all at once can linearize anew.

# %% break-it [markdown]
# ## Further, break it: the short form in single precision
#
# $(I - KC)\,\Sigma^-$ subtracts two nearly equal numbers. Joseph's form $(I - KC)\,\Sigma^-(I - KC)^\top + K\Sigma_zK^\top$ adds what is positive, for any gain. In double precision
# you will rarely see the difference; on a small controller with 32-bit numbers you will: prior variance 10⁶, sensor variance 10⁻³, two measurements.

# %% break-it-code
for dtype in (np.float64, np.float32):
    for form in ("short", "joseph"):
        P = np.array([[1e6]])
        for _ in range(2):
            P = kalman.update([0.0], P, [0.0], [[1.0]], [[1e-3]], form=form,
                              dtype=dtype).cov
        right = abs(P[0, 0] - 0.0005) < 1e-6  # two readings: half the sensor's variance
        print(f"{dtype.__name__} {form:7}", "variance 0.0005" if right
              else "what rounding left")

# %% in-practice [markdown]
# ## In practice
#
# - Log the NIS from the first day. It needs no truth, and it tells which noise you believed wrongly.
# - Wrap every difference of angles. Test it with a robot that faces backward.
# - A covariance that is too small is worse than one that is too large: inflate when in doubt.
# - Gate, but count what you reject: a filter that rejects everything is lost, and sure of itself.
# - Batch over runs, not over time: `labkit.fast.ekf.ekf_localize` filters 200 robots in the time of a few; `localization.ekf.ekf_localize`, which your runs above used, shows what it computes.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. The gain never looks at the data. What, then, makes the filter react to an unexpected measurement, and what does not react at all?
# 2. One landmark, distance and bearing, robot at rest. Which poses explain the measurement equally well, and what does the ellipse look like?
# 3. Mean NIS is in its band, mean NEES is far above. What kind of mistake could that be?

# %% progress
ex.progress()
