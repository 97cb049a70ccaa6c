# %% title [markdown]
# # 7 · Lateration and dead reckoning
#
# **What you will do.** Find a robot from its distances to landmarks, drive one by counting wheel turns, and compute how its uncertainty grows.
#
# **What you will learn.** How a start decides what a search finds, why geometry can matter more than the sensor, what the time step does to a motion model, and why
# odometry that errs by two centimeters in its first meter is a meter off after fourteen.
#
# **What you need.** Derivatives, matrices, covariances; chapter 4 helps with Newton. About 90
# minutes; what is marked *further* goes beyond them.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $x = (x, y, \theta)$ | pose of the robot in the plane (m, m, rad); $\theta$ grows to the left |
# | $u = (v, \omega)$ | control: speed (m/s) and turn rate (rad/s), held for the time step $T$ (s) |
# | $\Sigma_x$, $\Sigma_u$ | covariances of pose and control, shapes (3, 3) and (2, 2) |
# | $F_x$, $F_u$ | derivatives of one step by pose and control |
# | ICR | instantaneous center of rotation, where the wheel axes meet |

# %% setup
import numpy as np

from labkit.chapters.ch07_dead_reckoning import stages
from labkit.documents.lecture import printed as lecture
from labkit.estimation import gaussian
from labkit.exercises import course
from labkit.localization import lateration, odometry

ex = course("07-dead-reckoning")
np.set_printoptions(precision=4, suppress=True)

# %% the-question [markdown]
# ## The question
#
# A robot drives through a hall. **Where is it?** The lecture *Lokalisierung* sorts the task (page "Varianten"): tracking from a known start, finding
# oneself anywhere, and surviving being carried off. Some sensors look inward (wheel counters, gyroscopes), some outward (lasers, cameras). Its table
# "Übersicht über Lokalisierungsverfahren" then names four methods. A robot wakes up somewhere in a known hall and has nothing but wheel odometry. **Which method finds out where it is**:
# dead reckoning, the Kalman filter, the particle filter, none of them? Decide first; then change task, sensors and map, and see which methods still work.

# %% predict-method
guess = ...  # your code here
### BEGIN SOLUTION
guess = "none of them"
### END SOLUTION
ex.predict("method", guess, reveal=stages.methods)

# %% lateration [markdown]
# ## Lateration: distances to landmarks
#
# Let landmark $i$ stand at $l_i$, and let the sensor measure the distance $d_i$. The robot lies on a circle about each landmark. The lecture
# ("Algorithmus für 2D-Lateration") writes it as a search for zeros:
#
# $$f_i(x) = |l_i - x|^2 - d_i^2 = 0 .$$

# %% lateration_residual
@ex.lateration_residual
def lateration_residual(landmarks, distances, position):
    """Return f, shape (n,) in m^2, for landmarks (n, 2), distances (n,) and a position
    (2,)."""
    ### BEGIN SOLUTION
    return ((landmarks - position) ** 2).sum(axis=1) - distances**2
    ### END SOLUTION


# %% newton [markdown]
# Newton's method replaces $f$ by its tangent planes, goes to where they vanish, and starts again from there:
# $J\,\Delta = -f$, $x \leftarrow x + \Delta$. Row $i$ of $J$ is $2\,(x - l_i)^\top$. Twenty rounds are plenty, unless the start lies almost on the line through the landmarks.

# %% newton_lateration
@ex.newton_lateration
def newton_lateration(landmarks, distances, start):
    """Return the position, shape (2,), that Newton's method finds from `start` (2,),
    with landmarks (2, 2)."""
    ### BEGIN SOLUTION
    position = np.array(start, dtype=float)
    for _ in range(20):
        J = 2 * (position - landmarks)
        f = lateration_residual(landmarks, distances, position)
        position = position - np.linalg.solve(J, f)
    return position
    ### END SOLUTION


# %% geometry [markdown]
# ## What the circles tell
#
# A robot stands on the line between two landmarks, and both measured distances come out 1 % short. **In how many points do the circles meet?** Decide. Then drag landmarks, robot and the start of the search. The dashed ellipse holds 95 % of what any unbiased method can promise; the dotted line is the
# direction the distances see worst. Then press *Make it fail* and look at the singular values: they know of the trouble before the estimate does.

# %% predict-roots
guess = ...  # your code here
### BEGIN SOLUTION
guess = "none"
### END SOLUTION
ex.predict("roots", guess, reveal=stages.circles)

# %% two-costs [markdown]
# ## Which squares?
#
# With more landmarks the circles no longer meet in one point. The lecture ("Least-Square-Verfahren") then minimizes $\sum (|l_i - x|^2 - d_i^2)^2$.
# But the sensor errs in the *distance* by $e$, and $d^2$ errs by about $2\,d\,e$: far landmarks are heard louder. Maximum likelihood for equal noise minimizes
# $\sum (|l_i - x| - d_i)^2$ instead. Four landmarks, one of them near, 20,000 measurements with a poor sensor.
# A bias of a few millimeters is what 20,000 draws leave to chance; mind the spread.

# %% two-costs-compared
landmarks = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
robot, std = np.array([8.0, 8.0]), 0.5
true = np.linalg.norm(landmarks - robot, axis=1)
measured = true + std * np.random.default_rng(1).standard_normal((20_000, 4))
bound = np.sqrt(np.trace(std**2 * lateration.dilution(landmarks, robot)))
for name, cost in (("squares, as in the lecture", "squares"),
                   ("distances", "distance")):
    off = lateration.laterate(landmarks, measured, cost=cost).position - robot
    bias = 1000 * np.linalg.norm(off.mean(0))
    spread = 1000 * np.sqrt((off**2).sum(1).mean())
    print(f"{name:27} bias {bias:3.0f} mm, RMS {spread:3.0f} mm, "
          f"{spread / 1000 / bound:.2f} times the bound")

# %% wheels [markdown]
# ## Dead reckoning (*Koppelnavigation*)
#
# No landmark in sight: add up what the wheels report. For a differential drive with track width $l$, $v = (v_R + v_L)/2$ and
# $\omega = (v_R - v_L)/l$ ("Wiederholung Differentialantrieb").

# %% wheel_to_twist
@ex.wheel_to_twist
def wheel_to_twist(v_left, v_right, track):
    """Return u = (v, omega), shape (2,), from the wheel speeds (m/s) and the track
    width (m)."""
    ### BEGIN SOLUTION
    return np.array([(v_right + v_left) / 2, (v_right - v_left) / track])
    ### END SOLUTION


# %% three-models [markdown]
# ## Three ways to take a step
#
# During $T$ the robot drives an arc. The *simplified* model goes straight along the old heading; the *midpoint* model along $\theta + \omega T/2$. The
# *arc* is exact: the robot turns about the ICR by $\omega T = 2h$. The chord of that arc points along $\theta + h$, and its length is
# $v T \sin(h)/h$. Write it so that driving straight on needs no division by zero.
# Whole turns in $\theta$ do not matter: leave it as it adds up, or wrap it.
#
# The lecture drives with the midpoint model. It propagates *errors* with the simplified one, whose Jacobians are shorter; so do the exercises below.

# %% step_euler
@ex.step_euler
def step_euler(x, u, dt):
    """Return the pose (x, y, theta) after one step of the simplified model; x (3,), u =
    (v, omega), dt in s."""
    ### BEGIN SOLUTION
    return np.array([x[0] + u[0] * dt * np.cos(x[2]), x[1] + u[0] * dt * np.sin(x[2]),
                     x[2] + u[1] * dt])
    ### END SOLUTION


# %% step_midpoint
@ex.step_midpoint
def step_midpoint(x, u, dt):
    """Return the pose (x, y, theta) after one step along the heading of half the
    turn."""
    ### BEGIN SOLUTION
    direction = x[2] + u[1] * dt / 2
    return np.array([x[0] + u[0] * dt * np.cos(direction),
                     x[1] + u[0] * dt * np.sin(direction), x[2] + u[1] * dt])
    ### END SOLUTION


# %% step_arc
@ex.step_arc
def step_arc(x, u, dt):
    """Return the pose (x, y, theta) after driving the exact arc; omega may be 0."""
    ### BEGIN SOLUTION
    half_turn = u[1] * dt / 2
    chord = u[0] * dt * np.sinc(half_turn / np.pi)
    direction = x[2] + half_turn
    return np.array([x[0] + chord * np.cos(direction), x[1] + chord * np.sin(direction),
                     x[2] + u[1] * dt])
    ### END SOLUTION


# %% half-the-step [markdown]
# You halve the time step. **What becomes of the midpoint model's error at the end of a drive**: it halves, it becomes a quarter, it stays? Decide, then compare the three.

# %% predict-order
guess = ...  # your code here
### BEGIN SOLUTION
guess = "it becomes a quarter"
### END SOLUTION
ex.predict("order", guess, reveal=stages.models)

# %% propagation [markdown]
# ## How uncertainty travels
#
# A small error of the pose before the step and a small error of the control both end in the new pose. To first order
# ("Fehlerfortpflanzung bei Koppelnavigation (2)"):
#
# $$\Sigma_{x'} = F_x \Sigma_x F_x^\top + F_u \Sigma_u F_u^\top .$$
#
# The lecture derives both Jacobians for the simplified model.

# %% jacobian_state
@ex.jacobian_state
def jacobian_state(x, u, dt):
    """Return F_x, shape (3, 3), of the simplified model."""
    ### BEGIN SOLUTION
    F_x = np.eye(3)
    F_x[:2, 2] = -u[0] * dt * np.sin(x[2]), u[0] * dt * np.cos(x[2])
    return F_x
    ### END SOLUTION


# %% jacobian_control
@ex.jacobian_control
def jacobian_control(x, u, dt):
    """Return F_u, shape (3, 2), of the simplified model."""
    ### BEGIN SOLUTION
    return dt * np.array([[np.cos(x[2]), 0], [np.sin(x[2]), 0], [0, 1]])
    ### END SOLUTION


# %% control-noise [markdown]
# ## How wrong are wheels?
#
# The lecture ("Fehlermodell für Steuerbefehl") counts variance per way: $k_d$ for the distance per meter, $k_\theta$ for the heading per turn, $k_\mathrm{drift}$ for the
# heading per meter. A way $d = vT$ has the variance $k_d\,d$, so the speed $d/T$ has $k_d\,d/T^2$:
#
# $$\sigma_v^2 = \frac{k_d}{T}|v|, \qquad \sigma_\omega^2 = \frac{k_\theta}{T}|\omega| + \frac{k_\mathrm{drift}}{T}|v| .$$
#
# The absolute values are for reversing and for right turns.

# %% control_covariance
@ex.control_covariance
def control_covariance(u, dt, k_d, k_theta, k_drift):
    """Return the covariance of the control u = (v, omega), shape (2, 2)."""
    ### BEGIN SOLUTION
    v, omega = np.abs(u)
    return np.diag([k_d * v / dt, (k_theta * omega + k_drift * v) / dt])
    ### END SOLUTION


# %% propagate
@ex.propagate
def propagate(x, cov, u, dt, cov_u):
    """Return pose (3,) and covariance (3, 3) after one step of the simplified model;
    cov (3, 3), cov_u (2, 2)."""
    ### BEGIN SOLUTION
    F_x, F_u = jacobian_state(x, u, dt), jacobian_control(x, u, dt)
    return step_euler(x, u, dt), F_x @ cov @ F_x.T + F_u @ cov_u @ F_u.T
    ### END SOLUTION


# %% drive [markdown]
# ## Drive it
#
# Click the picture and use the arrow keys, or press play: that is the lecture's circle (page "Simulation"), 1 m/s and 24°/s in 140 steps of 0.1 s. The *true path* is where
# the robot really goes, *dead reckoning* what it believes. After 14 m straight on by odometry alone,
# **where does its true position most likely differ**: ahead or behind, to the left or right, or all around alike? Decide; then watch which way the ellipses grow.

# %% predict-spread
guess = ...  # your code here
### BEGIN SOLUTION
guess = "to the left or right"
### END SOLUTION
ex.predict("spread", guess, reveal=stages.drive)

# %% circle [markdown]
# ## The circle in numbers
#
# The lecture prints the constants, $k_d = (0.02\,\mathrm{m})^2/1\,\mathrm{m}$, $k_\theta = (5°)^2/360°$ and $k_\mathrm{drift} = (2°)^2/1\,\mathrm{m}$, but not where the drive
# ends. `lecture.circle_drive()` holds them in radians and meters: `drive.controls` (140, 2), `drive.dt`, and `drive.noise` with the three constants by name, to be passed on as `**drive.noise`.
# Start at the origin and take all steps with `step_euler`, the model of the lecture's Jacobians. (They turn by 336°: the circle does not quite close.)

# %% end_pose
drive = lecture.circle_drive()
end_pose = ...  # your code here
### BEGIN SOLUTION
end_pose = np.zeros(3)
for u in drive.controls:
    end_pose = step_euler(end_pose, u, drive.dt)
### END SOLUTION
end_pose = ex.end_pose(end_pose)

# %% end_cov [markdown]
# How sure may the robot be of it? Start once more, this time with a covariance of zeros, and let `propagate` take the steps.

# %% end_cov-code
end_cov = ...  # your code here
### BEGIN SOLUTION
x, end_cov = np.zeros(3), np.zeros((3, 3))
for u in drive.controls:
    cov_u = control_covariance(u, drive.dt, **drive.noise)
    x, end_cov = propagate(x, end_cov, u, drive.dt, cov_u)
### END SOLUTION
end_cov = ex.end_cov(end_cov)

# %% what-k-means [markdown]
# ## What $k_d$ is, and what it is not
#
# $k_d$ has the unit m²/m. That is why it survives a change of the time step: cut the same 14 s into other steps and the end stays as uncertain. A speed noise that
# is *constant per step*, a frequent shortcut, promises more the finer you cut. Compare the heading, and mind the last column. (`drive_with_covariance` takes midpoint steps, so
# the drive ends elsewhere than yours above; what is printed of the uncertainty is the same.)

# %% what-k-means-code
for dt in (0.5, 0.1, 0.02):
    cut = lecture.circle_drive(dt)
    poses, covs = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)),
                                                 cut.controls, dt, **cut.noise)
    fixed = control_covariance(cut.controls[0], 0.1, **cut.noise)
    wrong = np.sqrt(len(cut.controls) * dt**2 * fixed[1, 1])
    position = np.sqrt(np.trace(covs[-1][:2, :2]))
    heading = np.degrees(np.sqrt(covs[-1][2, 2]))
    print(f"T = {dt:4} s: position {position:.3f} m, heading {heading:.2f} deg; "
          f"shortcut {np.degrees(wrong):5.2f} deg")

# %% banana [markdown]
# ## A promise, tested
#
# The ellipse of 95 % is a first-order promise. Let 1500 robots with the same commands and their own noise drive 14 m straight on, and look where they end. **What share of the ends does the ellipse
# hold**, about 60, 85 or 95 %?

# %% predict-banana
guess = ...  # your code here
### BEGIN SOLUTION
guess = "about 85 %"
### END SOLUTION
ex.predict("banana", guess, reveal=stages.banana)

# %% bend [markdown]
# ## Beyond the document: bend the Gaussian
#
# Switch the region to *bent*. The same ends, written as the constant control that would lead from the computed pose to each of them
# (their exponential coordinates), are close to normal; carried back to the floor, their ellipse bends. Nothing about the robot changed, only the coordinates in which we call
# it Gaussian. The check with 10,000 runs of the lecture's noise, 14 m straight on:

# %% bend-code
controls = drive.controls * [1.0, 0.0]
poses, covs = odometry.drive_with_covariance(np.zeros(3), np.zeros((3, 3)), controls,
                                             drive.dt, **drive.noise)
rng = np.random.default_rng(5)
ends = odometry.sample_drives(np.zeros(3), controls, drive.dt, **drive.noise, rng=rng,
                              runs=10_000)[-1].copy()  # not the whole paths
bent = gaussian.bent_region(poses[-1], ends)
straight = gaussian.share_inside(ends, poses[-1], covs[-1])
curved = gaussian.share_inside(bent.twists, bent.mean, bent.cov)
print(f"inside the 95 % ellipse:      {100 * straight:.0f} %")
print(f"inside the 95 % bent region:  {100 * curved:.0f} %")
print(f"mean of the ends lags behind: {100 * (poses[-1] - ends.mean(0))[0]:.0f} cm")

# %% unlike-wheels [markdown]
# ## Wheels that are not alike (*further*)
#
# The right wheel is a little larger than the software believes, by `excess` (0.01 is 1 %).
# Both wheels count the same way, by the believed radius, as on a straight line; really the robot
# drives a circle.
# **How far to the left does it end?** Write the exact answer, then compare: a drift of the
# lecture's kind and a wheel 1 % too large, after 2, 14 and 50 m.

# %% wheel_offset
@ex.wheel_offset
def wheel_offset(way, excess, track):
    """Return how far to the left (m) the robot ends that counted `way` (m) straight
    on; excess is not 0, and negative for a smaller right wheel."""
    ### BEGIN SOLUTION
    turn = way * excess / track
    middle = way * (1 + excess / 2)
    return middle / turn * (1 - np.cos(turn))
    ### END SOLUTION


# %% unlike-wheels-code
k_drift = drive.noise["k_drift"]
for way in (2.0, 14.0, 50.0):
    std = np.sqrt(k_drift * way**3 / 3)  # of the place, to first order
    aside = wheel_offset(way, 0.01, 0.5)
    print(f"{way:4.0f} m: drift {std:5.2f} m (one sigma), wheel {aside:6.2f} m")

# %% unlike-wheels-said [markdown]
# Noise that changes from meter to meter partly cancels: its mark grows with the power 1.5 of
# the way. A wrong radius never cancels: its mark grows with the square, as long as the robot
# has turned little.
# Nothing in $\Sigma_x$ tells of it. The remedy is to measure it: drive a long line, look
# where you are, correct the radius (question 2 below asks what you would see).

# %% other-wheels [markdown]
# ## Other wheels (*further*)
#
# "Ackermann- und Mecanumantrieb werden analog behandelt", says the lecture, and leaves it to
# you. The integration stays; only the way from the wheels to the body's velocity is new.
#
# A **car** (*Ackermann*) steers in front. All wheels roll about one point, on the line of the
# rear axle; for that the inner front wheel turns more than the outer one. The angle $\delta$
# is that of a wheel in the middle between both. The robot's origin is the middle of the rear axle,
# $v$ its speed, $L$ the distance between the axles.

# %% ackermann_twist
@ex.ackermann_twist
def ackermann_twist(speed, steering, wheelbase):
    """Return (v, omega) of the rear axle's middle; steering in rad, to the left
    positive."""
    ### BEGIN SOLUTION
    return np.array([speed, speed * np.tan(steering) / wheelbase])
    ### END SOLUTION


# %% mecanum [markdown]
# A **Mecanum** wheel carries rollers at 45°. Four of them let a robot drive sideways: $v_x$
# ahead, $v_y$ to the left. The wheels, front left (FL) to rear right (RR), stand $a$ before or
# behind the middle (half length) and $b$ beside it (half width). Their rims run at
#
# $$\begin{aligned}
# w_\mathrm{FL} &= v_x - v_y - (a + b)\,\omega, &
# w_\mathrm{FR} &= v_x + v_y + (a + b)\,\omega, \\
# w_\mathrm{RL} &= v_x + v_y - (a + b)\,\omega, &
# w_\mathrm{RR} &= v_x - v_y + (a + b)\,\omega .
# \end{aligned}$$
#
# Turn it around. The wheels slip, so four measured numbers hardly fit exactly: take what fits best, by least squares.

# %% mecanum_twist
@ex.mecanum_twist
def mecanum_twist(speeds, half_length, half_width):
    """Return (v_x, v_y, omega) from the rim speeds FL, FR, RL, RR (m/s), shape (4,)."""
    ### BEGIN SOLUTION
    lever = half_length + half_width
    M = np.array([[1, -1, -lever], [1, 1, lever], [1, 1, -lever], [1, -1, lever]])
    return np.linalg.lstsq(M, speeds, rcond=None)[0]
    ### END SOLUTION


# %% reach [markdown]
# One command, held for two seconds, from where the gray robot stands. A differential drive
# turns up to 100°/s, the car steers up to 35° (1 m between its axles), all reach 1 m/s;
# Mecanum wheels do so ahead and to the side at once.
# **A spot one meter to the left, the same heading: which drive gets there?**

# %% predict-reach
guess = ...  # your code here
### BEGIN SOLUTION
guess = "only Mecanum"
### END SOLUTION
ex.predict("reach", guess, reveal=stages.reach)

# %% reach-said [markdown]
# Press *Make it fail*. The differential drive and the car have two controls for three
# coordinates: one command reaches a surface of poses, no more. Then *U-turn*: who turns on
# the spot, and who needs the street? The step of all three is `wheels.step_twist`, with its
# Jacobians; for $v_y = 0$ it is your `step_arc`.

# %% break-it [markdown]
# ## Break it
#
# Start Newton on the line through both landmarks: both rows of $J$ point the same way, and no step leads off the line. A millimeter aside is enough. And what if
# the circles do not meet at all?

# %% break-it-code
pair, robot = np.array([[0.0, 0.0], [6.0, 0.0]]), np.array([3.0, 2.0])
distances = np.linalg.norm(pair - robot, axis=1)
for start in ([4.0, 0.0], [4.0, 0.001], [4.0, -0.001]):
    search = lateration.newton_lateration(pair, distances, start)
    print(f"from {start}: {search.position} after {len(search.path) - 1} steps. "
          f"{search.reason}")
print(lateration.newton_lateration(pair, [1.0, 1.0], [3.0, 1.0]).reason)
try:
    lateration.laterate(pair, distances)
except ValueError as refusal:
    print(refusal)

# %% in-practice [markdown]
# ## In practice
#
# - Place landmarks so that lines of sight cross at right angles. Check singular values before you buy a better sensor.
# - Give the search the last known position as its start: the mirror image is never far.
# - Use the midpoint model or the arc. They cost next to nothing more.
# - Measure $k_d$, $k_\theta$ and $k_\mathrm{drift}$ by driving a long straight line and many turns on the spot, not from the data sheet.
# - Never trust odometry without an outside measurement. How to add one is chapter 8.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. Two robots have the same sensor. One stands in the middle of four landmarks, one far outside. Whose position is better, and in which direction is the other's bad?
# 2. Wheel A is 1 % larger than wheel B. Is the error model of the lecture the right one for this? What would you see in the ellipses, and what in reality?
# 3. The covariance says "ellipse", the samples say "banana". Which of the two would you hand to a filter that comes next, and what would you watch?

# %% progress
ex.progress()
