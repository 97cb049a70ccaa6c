# %% title [markdown]
# # 6 · A tracker on a robot flange
#
# **What you will do.** Read the packets of a tracker, mount it on a simulated robot,
# find where it sits, and judge how well it follows a motion.
#
# **What you will learn.** What a receiver can know of a stream, which motions determine
# a mounting, what a null vector hides, how much to believe six runs that agree, and why
# accuracy in motion is a matter of time first.
#
# **What you need.** Chapter 1, the singular value decomposition by name. About 90
# minutes; the parts marked *further* come on top: the report's two errors, stations
# that move, other methods, the lag and errors over speed, 65 minutes together, and the
# whole cell at the end, 30 minutes.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $B$, $F$ | base and flange of the robot; $T_{BF}$ comes from the joints |
# | $E$, $W$ | the tracker, and its own pose at reset, in which it reports $T_{WE}$ |
# | $T_{FE}$ | the mounting, called $X$ while it is unknown |
# | $A_i$, $B_i$ | motions since the first pose, $A_i X = X B_i$ (report: $B$, $A$) |
# | mm, s, rad | inside; packets and logs carry meters |

# %% setup
import numpy as np

from labkit.calibration import ax_xb
from labkit.chapters.ch06_tracker import stages
from labkit.documents.report import printed as report
from labkit.documents.report.reconstruction import synthetic_mountings, synthetic_table
from labkit.exercises import course
from labkit.geometry.frames import relative, rotation_angle
from labkit.machines import arm, simulation, tracking, udp
from labkit.machines.log import average_stops, read_csv
from labkit.machines.mounting import calibrate_mounting
from labkit.tables import DATA, read_table

ex = course("06-tracker")
np.set_printoptions(precision=4, suppress=True)

# %% the-question [markdown]
# ## The question
#
# Can a game controller's tracker follow a painter's spray gun? The report *Kalibrace a
# testování systému OTUS tracker* (Západočeská univerzita v Plzni, 2018) bolts one to a
# Stäubli TX40 and compares. Its logs were never published, so here a simulated tracker
# stands in; where the report prints numbers, they are checked.

# %% packets [markdown]
# ## A packet
#
# Table 1 of the report gives 23 fields of 8 bytes: device, time stamp, position,
# velocity, acceleration, quaternion (x, y, z, w), angular velocity and acceleration,
# two buttons. It gives **no types**. Our assumption, in one place of
# `machines/packet.py`: little-endian doubles, meters, seconds.

# %% decode_packet
@ex.decode_packet
def decode_packet(data):
    """Return time (s), position (mm), shape (3,), and quaternion x, y, z, w, shape
    (4,), of a good packet of 184 bytes, from no more than 10 m away."""
    ### BEGIN SOLUTION
    values = np.frombuffer(data, "<f8")
    return values[1], 1000 * values[2:5], values[11:15]
    ### END SOLUTION


# %% stream [markdown]
# ## A stream
#
# The tracker sends 250 packets per second by UDP, and UDP promises nothing. The packet
# has no sequence number and no checksum. **How can a receiver know that one was lost**:
# it cannot, from gaps in the time stamps, or because UDP reports it? Decide first. Then
# press play: these are real packets between two threads on your machine. Raise the
# loss, switch on the nonsense (the report's *nesmyslné hodnoty*), watch the counters.

# %% predict-loss
guess = ...  # your code here
### BEGIN SOLUTION
guess = "from gaps in the time stamps"
### END SOLUTION
ex.predict("loss", guess, reveal=stages.live_tracker)

# %% books [markdown]
# A receiver is honest when its counts agree with the sender's, whatever the order of
# arrival. Two seconds of stream, sent at ten times the speed:

# %% balance-the-books
faults = udp.Faults(0.05, duplicate=0.03, reorder=0.05, malformed=0.02, foreign=0.02)
endless = simulation.endless_packets(np.random.default_rng(0))
packets = (packet for packet, _ in zip(endless, range(500)))
with udp.listen() as listener:
    stream = udp.stream(packets, 250.0, faults, np.random.default_rng(1))
    with udp.Sender(stream, listener.port, speed=10.0) as sender:
        sender.finished.wait(10.0)
        sender.flush(listener)
    seen, sent = listener.statistics(), sender.sent
print("every good packet counted once:", seen.good == sent["good"])
reported = sum(seen.bad.values()) == sent["malformed"] + sent["foreign"]
print("every bad one reported:        ", reported)
print("reasons:", sorted(seen.bad))

# %% arm [markdown]
# ## The reference: a robot
#
# The robot knows where its flange is, if we know the robot. A link in the
# Denavit-Hartenberg convention is four elementary transforms:
# $T = R_z(\theta)\,D_z(d)\,D_x(a)\,R_x(\alpha)$. The data sheet (appendix B) prints
# reaches, and these fix the lengths: forearm $R_b = 225$, upper arm $450 - 225$, wrist
# to flange $515 - 450 = 65$ mm. The elbow bends by up to 138° from straight: **how
# close can the wrist come to axis 2, in mm?** Predict, then drag the flange.

# %% predict-fold
guess = ...  # your code here
### BEGIN SOLUTION
guess = 161
### END SOLUTION
ex.predict("fold", guess, reveal=stages.tx40)

# %% dh_matrix
@ex.dh_matrix
def dh_matrix(theta, d, a, alpha):
    """Return the transform of one link, shape (4, 4); rad and mm."""
    ### BEGIN SOLUTION
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    x, y = [c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s]
    return np.array([x, y, [0, sa, ca, d], [0, 0, 0, 1]])
    ### END SOLUTION


# %% forward_kinematics
@ex.forward_kinematics
def forward_kinematics(dh, q):
    """Return T_BF, shape (4, 4); rows of dh, shape (6, 4), are theta offset, d, a,
    alpha; q, shape (6,), are the joint angles (rad)."""
    ### BEGIN SOLUTION
    T = np.eye(4)
    for (offset, d, a, alpha), angle in zip(dh, q):
        T = T @ dh_matrix(offset + angle, d, a, alpha)
    return T
    ### END SOLUTION


# %% equation [markdown]
# ## A X = X B
#
# The reading is relative to a frame nobody knows. Motions get rid of it (equations 2 to
# 4): from the first pose to the $i$-th, the flange moves by
# $A_i = T_{BF_0}^{-1} T_{BF_i}$, the tracker by $B_i = T_{WE_0}^{-1} T_{WE_i}$, and
# both are the same motion seen through the mounting: $A_i X = X B_i$.
#
# If all motions turn about one and the same axis, **what do the residuals look like,
# and what the mounting?** Decide, then drag the two rotation axes; the colored dots are
# axes of many mountings found from noisy readings. Press *small motions* as well: noise
# divided by a small angle is a large error, which is why more poses close together can
# make a calibration worse.

# %% predict-axes
guess = ...  # your code here
### BEGIN SOLUTION
guess = "perfect, and the mounting is arbitrary"
### END SOLUTION
ex.predict("axes", guess, reveal=stages.two_axes)

# %% vec [markdown]
# ## The rotation as a null vector
#
# Stack the **columns** of $X$ into $\operatorname{vec} X$. Then
# $\operatorname{vec}(PXQ) = (Q^\top \otimes P)\operatorname{vec} X$, and
# $R_A X - X R_B = 0$ becomes nine linear equations per motion (equations 7 to 9):
# $\;m_i \operatorname{vec} X = 0$, stacked over all motions
# $M \operatorname{vec} X = 0$. The order of the nine, and whatever rotation mixes them,
# changes neither the solutions nor $m_i^\top m_i$.

# %% kron_row
@ex.kron_row
def kron_row(A, B):
    """Return the block of one motion, shape (9, 9), from the rotations A of the flange
    and B of the tracker, shape (3, 3) each; its sign and its order of rows are free."""
    ### BEGIN SOLUTION
    return np.kron(np.eye(3), A) - np.kron(B.T, np.eye(3))
    ### END SOLUTION


# %% null-vector [markdown]
# With noise nothing is exactly zero, so the singular vector of the smallest singular
# value must do (equations 10 to 12). Three traps wait: its **sign** is arbitrary, its
# **length** is 1, and its matrix is only nearly orthonormal. The report names the first
# and accepts the last; we project to the nearest rotation.

# %% rotation_from_nullvector
@ex.rotation_from_nullvector
def rotation_from_nullvector(M):
    """Return the rotation, shape (3, 3), that the stacked blocks M, shape (9 N, 9),
    determine."""
    ### BEGIN SOLUTION
    X = np.linalg.svd(M)[2][-1].reshape(3, 3, order="F")
    U, _, Vt = np.linalg.svd(X * np.sign(np.linalg.det(X)))
    return U @ Vt
    ### END SOLUTION


# %% second-smallest [markdown]
# How nearly is there a *second* null vector, another mounting that fits as well? That
# is the singular value next to the smallest. Beside the largest it says what the
# motions are worth, before any residual is looked at.

# %% singular_value_ratio
@ex.singular_value_ratio
def singular_value_ratio(M):
    """Return the second smallest singular value of the stacked blocks M, shape
    (9 N, 9), divided by the largest: 0 where a second mounting fits as well."""
    ### BEGIN SOLUTION
    values = np.linalg.svd(M)[1]
    return values[-2] / values[0]
    ### END SOLUTION


# %% translation [markdown]
# ## The translation by least squares
#
# With the rotation $R$ known, the last column of $A_i X = X B_i$ is linear in $t$
# (equations 14 to 16): $(I - R_{A_i})\,t = t_{A_i} - R\,t_{B_i}$, stacked
# $K_1 t = K_2$. One motion leaves the part of $t$ along its axis free, so two
# directions are needed again.

# %% translation_lsq
@ex.translation_lsq
def translation_lsq(A, B, R):
    """Return t, shape (3,), mm, from motions A, B, shape (N, 4, 4), and the rotation R
    of the mounting."""
    ### BEGIN SOLUTION
    K1 = np.eye(3) - A[:, :3, :3]
    K2 = A[:, :3, 3] - B[:, :3, 3] @ R.T
    return np.linalg.lstsq(K1.reshape(-1, 3), K2.ravel(), rcond=None)[0]
    ### END SOLUTION


# %% errors [markdown]
# ## Two errors, taken at their word (*further*)
#
# With $v$ the null vector (of length 1) and $N$ the number of motions, the report
# measures its fit by $E_{rot} = \frac{1}{N-1}\lVert M^\top M\,v \rVert$ (13) and
# $E_{trans} = \frac{1}{N-1}\lVert K_1 t - K_2 \rVert$ (17). Write them exactly so. One
# contains the squares of small angles and hardly changes with $N$; the other has no
# square at all and shrinks like $1/\sqrt{N}$, however bad the fit.

# %% e_rot
@ex.e_rot
def e_rot(M):
    """Return E_rot of the stacked blocks M, shape (9 N, 9)."""
    ### BEGIN SOLUTION
    v = np.linalg.svd(M)[2][-1]
    return np.linalg.norm(M.T @ (M @ v)) / (len(M) / 9 - 1)
    ### END SOLUTION


# %% e_trans
@ex.e_trans
def e_trans(residuals):
    """Return E_trans of the residuals K1 t - K2, shape (N, 3), mm."""
    ### BEGIN SOLUTION
    return np.linalg.norm(residuals) / (len(residuals) - 1)
    ### END SOLUTION


# %% outliers [markdown]
# ## A rule, before looking
#
# At each of 21 poses the robot rests and 4 s of readings are averaged. "Evidently
# wrong" values were left out by eye. A rule fixed beforehand is fair: keep what lies
# within some standard deviations of the median. Estimate this standard deviation as
# 1.4826 times the median of the distances from the median: for normal noise it is the
# same, and a few outliers hardly move it.

# %% reject_outliers
@ex.reject_outliers
def reject_outliers(values, factor=4.0):
    """Return a bool array, shape (n,): True where values lie within factor robust
    standard deviations of the median. Where one of these is 0, the others may stay
    or go."""
    ### BEGIN SOLUTION
    distance = np.abs(values - np.median(values))
    return distance <= factor * 1.4826 * np.median(distance)
    ### END SOLUTION


# %% mean-of-a-stop [markdown]
# ### The mean of a stop (*further*)
#
# Positions are averaged as they are. Rotations come as quaternions, and $q$ and $-q$
# are one rotation: a tracker may send either. Their mean is nothing at all.

# %% mean_quaternion
@ex.mean_quaternion
def mean_quaternion(q):
    """Return the mean, shape (4,), of length 1, of quaternions q, shape (n, 4), of
    length 1 and of either sign, that lie within a few degrees; its sign is free."""
    ### BEGIN SOLUTION
    return np.linalg.eigh(q.T @ q)[1][:, -1]
    ### END SOLUTION


# %% the-log [markdown]
# ## Calibrate
#
# `run_1.csv` is a synthetic log of such a run, its true mounting the report's result.
# The stops are averaged for you, `A` and `B` are the motions since pose 0, and `kept`
# is False for a pose that has to go (pose 0 itself is no motion: its equations are all 0). Put your functions in a row;
# the result is a matrix, in mm.

# %% read-the-log
poses = read_table("tracker/poses.csv")
joints = np.deg2rad(np.column_stack([poses[f"q{i} [deg]"] for i in range(1, 7)]))
T_BF = np.array([forward_kinematics(arm.TX40.dh, q) for q in joints])
T_WE, used = average_stops(read_csv(DATA / "tracker/run_1.csv"))
kept = calibrate_mounting(T_BF, T_WE).kept
A, B = relative(T_BF[0], T_BF), relative(T_WE[0], T_WE)
print("share of readings used at a stop:", used.min(), "to", used.max())
print("poses that go:", np.count_nonzero(~kept), "of", len(kept))

# %% mounting
mounting = ...  # your code here
### BEGIN SOLUTION
A_kept, B_kept = A[kept][1:], B[kept][1:]
M = np.concatenate([kron_row(a[:3, :3], b[:3, :3]) for a, b in zip(A_kept, B_kept)])
mounting = np.eye(4)
mounting[:3, :3] = rotation_from_nullvector(M)
mounting[:3, 3] = translation_lsq(A_kept, B_kept, mounting[:3, :3])
### END SOLUTION
mounting = ex.mounting(mounting)

# %% which-motions [markdown]
# **Four motions must do: four whose axes are nearly alike, or four whose axes differ.
# Which four agree better among themselves, and which find the truer rotation?** Decide.
# The cell prints the ratio, the mean residual angle, and how far the rotation found is
# from the true one.

# %% ratio-of-motions
from labkit.geometry.lie import log_so3

A_k, B_k = A[kept][1:, :3, :3], B[kept][1:, :3, :3]
axes = log_so3(A_k) / np.linalg.norm(log_so3(A_k), axis=1, keepdims=True)
alike = np.argsort(np.abs(axes @ np.linalg.svd(axes)[2][0]))
for name, four in (("alike", alike[-4:]), ("different", alike[:4]), ("all 19", alike)):
    A_4, B_4 = A_k[four], B_k[four]
    M_4 = np.concatenate([kron_row(a, b) for a, b in zip(A_4, B_4)])
    R_4 = rotation_from_nullvector(M_4)
    residual = rotation_angle((R_4 @ B_4).swapaxes(1, 2) @ A_4 @ R_4).mean()
    off = rotation_angle(R_4.T @ simulation.T_FE[:3, :3])
    residual, off = np.rad2deg([residual, off])
    print(f"{name:9} ratio {singular_value_ratio(M_4):.2f},", end=" ")
    print(f"residual {residual:.2f} deg, off by {off:.2f} deg")

# %% spread-text [markdown]
# Six runs over the same poses give six mountings: `mountings`, shape (6, 4, 4), in mm.
# Appendix D prints a variance over its runs (*Rozptyl*): the sum of the squared
# deviations from the mean, divided by 6, not by 5. Do the same: what is the standard
# deviation of the height z over our six, in mm?

# %% spread
mountings = np.array([run.T_FE for run in synthetic_mountings()])
spread = ...  # your code here
### BEGIN SOLUTION
spread = mountings[:, 2, 3].std()
### END SOLUTION
spread = ex.spread(spread)

# %% compare [markdown]
# ## Against the document
#
# Appendix D checks itself: six times an average less five entries is the sixth. And
# since the mean $\bar e$ of $N$ distances never exceeds their root mean square, the
# error of *Two errors, taken at their word* obeys $E_{trans} \ge \bar e \sqrt{N} / (N - 1)$ with $\bar e = 2.67$ mm and $N = 20$: a row
# of $K_1 t - K_2$ and the translation error of a motion differ by a rotation only, so
# they are equally long. (The report left out some poses, and does not say how many;
# with $N = 19$ the bound is 3 % higher.)

# %% compare-appendix-d
table = report.table_d()
runs = dict(zip(report.COLUMNS, table.runs.T))
mean = dict(zip(report.COLUMNS, table.mean))
others = np.delete(runs["max_mm"], 2)  # the largest errors of all runs but the third
print("run 3, largest error, printed", runs["max_mm"][2], "mm,", end=" ")
print(f"from the average: {6 * mean['max_mm'] - others.sum():.3f} mm")
print("run 4, angles: mean", runs["mean_deg"][3], "deg, largest", runs["max_deg"][3])
by_6, by_5 = runs["x"].var(), runs["x"].var(ddof=1)
print(f"Rozptyl of x: {table.variance[0]}, divided by 6: {by_6:.2e}, by 5: {by_5:.2e}")
N = report.POSES
least = mean["mean_mm"] * np.sqrt(N) / (N - 1)
printed = mean["E_trans"]
print(f"E_trans, printed {printed:.6f} 'mm', but at least {least:.2f} mm:", end=" ")
print(f"it is meters, {1000 * printed:.2f} mm")

# %% compare-simulated-table
ours = synthetic_table()
both = ("report", table.mean, table.variance), ("ours", ours.mean(0), ours.var(0))
for name, averages, variances in both:
    mean = dict(zip(report.COLUMNS, averages))
    rozptyl = dict(zip(report.COLUMNS, variances))["z"]
    print(f"{name:6} z {1000 * mean['z']:.2f} mm, Rozptyl {rozptyl:.1e} m^2,", end=" ")
    print(f"mean error {mean['mean_mm']:.2f} mm, {mean['mean_deg']:.3f} deg")
    print(f"{'':6} E_trans {1000 * mean['E_trans']:.2f} mm, E_rot {mean['E_rot']:.1e}")

# %% contradictions [markdown]
# Two things exclude each other. Section 3.1 and the table put the origin 49.17 mm
# below, the conclusion 65.3 mm. (The half turn about z that the text speaks of would
# change the signs of x and y as the conclusion has them, but not z.) And a mean error
# of ±5 rad/s would exceed the fastest motion, 3.7 rad/s, and the conclusion's largest
# error, 3 deg/s: 0.05 rad/s, which is 2.9 deg/s, would not; what was meant, the page
# does not tell. A digit may also have been lost when the document was converted to
# text. Chapter 10 lists them all.
#
# ## Break it: six runs that agree
#
# The runs agree within 0.2 mm while a single pose is off by 2.5 mm. **How far from the
# truth is the mean of the six**: 0.1 mm (the spread over $\sqrt 6$), 0.2 mm (the
# spread), or can the runs alone not tell?

# %% predict-runs
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the runs alone cannot tell"
### END SOLUTION
ex.predict("runs", guess, reveal=stages.six_runs)

# %% runs-then [markdown]
# Random errors of this size at 20 poses would scatter the mounting by more than half a
# millimeter. The six agree far better: what errs is mostly the same in all of them.

# %% sweeps [markdown]
# ## Break it again: a station that moves (*further*)
#
# How does the tracker know where it is? Two *base stations* stand in the room (section
# 1 of the report). A station flashes, and with the flash a plane of light begins to
# turn about its axis $y$; later another one turns about its axis $x$. A photodiode on
# the tracker sees the flash, then the plane: **the time between them is an angle**. A
# plane starts at $-90°$ and needs $1/\mathrm{rate}$ for a whole turn. For a diode at
# $(x, y, z)$ in the station's frame, $z$ pointing into the room,
#
# $$\alpha = \operatorname{atan2}(x, z), \qquad \beta = \operatorname{atan2}(y, z).$$
#
# The report prints no rate; 60 turns per second are our assumption. **How far does the
# plane move in a microsecond, 3 m from the station, in mm?**

# %% predict-sweep
guess = ...  # your code here
### BEGIN SOLUTION
guess = 1.1
### END SOLUTION
ex.predict("sweep", guess, reveal=stages.sweeps)

# %% ray_direction
@ex.ray_direction
def ray_direction(delays, rate):
    """Return the direction, shape (3,), of length 1, in the station's frame, of a diode
    that the planes about y and x hit delays, shape (2,), s, after their flashes;
    rate is in turns per second."""
    ### BEGIN SOLUTION
    alpha, beta = 2 * np.pi * rate * np.asarray(delays) - np.pi / 2
    d = np.array([np.tan(alpha), np.tan(beta), 1.0])
    return d / np.linalg.norm(d)
    ### END SOLUTION


# %% place [markdown]
# One station knows a direction and no distance. Two rays should meet in the diode; with
# noise they pass each other, and the place is where the sum of the squared distances to
# the rays is least. Push the stations together in the figure above to see what it is
# worth.

# %% nearest_to_rays
@ex.nearest_to_rays
def nearest_to_rays(origins, directions):
    """Return the point, shape (3,), mm, with the least sum of squared distances to the
    lines of rays from origins (n, 3) along directions (n, 3) of any length; n > 1."""
    ### BEGIN SOLUTION
    d = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    across = np.eye(3) - d[:, :, None] * d[:, None, :]
    b = (across @ origins[:, :, None]).sum(axis=0)[:, 0]
    return np.linalg.solve(across.sum(axis=0), b)
    ### END SOLUTION


# %% six-degrees [markdown]
# Several diodes on a rigid body fix its whole pose: least squares on all angles. With
# nine diodes even a single station suffices, in principle. How well is the tracker's
# place known then, along the three axes, and how well with both?

# %% one-or-two-stations
from labkit.machines import stations

held = arm.tool_pose(arm.TX40, joints[3], simulation.T_FE)
for n in (1, 2):
    L = stations.STATIONS[:n]
    angles = stations.body_angles(L, stations.DIODES, held)
    noise = 5e-5 * np.random.default_rng(1).normal(size=angles.shape)
    seen = stations.sight(L, stations.DIODES, angles + noise, held, std=5e-5)
    off = seen.std_of("T_WE.translation")
    turn = np.rad2deg(seen.std_of("T_WE.rotation"))
    print(f"{n} station{'s' * (n > 1)}: std", off.round(2), "mm,", turn.round(2), "deg")

# %% moved [markdown]
# All this holds while the stations stand where the software believes. The conclusion of
# the report asks for firm clamps: vibration, from the very motors that turn the planes,
# made the readings worse by an order of magnitude. Suppose a station is knocked by 0.1°
# and nobody notices. **When does that spoil the calibration of the mounting more:
# before the run, or after its tenth stop?**

# %% predict-moved
guess = ...  # your code here
### BEGIN SOLUTION
guess = "after its tenth stop"
### END SOLUTION
ex.predict("moved", guess, reveal=stages.moved_station)

# %% moved-then [markdown]
# A station that stood askew from the beginning turns the whole world a little, and the
# reset into $W$ takes that up: $E_{trans}$ stays near the noise. One that moves during
# the run makes two worlds, one that drifts makes a new one at every stop, and no
# mounting fits them all. **By how many milliradians must it turn after stop 10, to make
# all of the $E_{trans}$ that the report prints, 0.802 mm?** Use the knob, or
# `stages.compute_moved_station({"tilt": 1.0, "when": "after stop 10"})`, `tilt` in mrad.

# %% knock
knock = ...  # your code here
### BEGIN SOLUTION
state = {"tilt": 2.0, "when": "after stop 10"}
knock = 2.0 * 0.802 / stages.compute_moved_station(state)["E_trans"]
### END SOLUTION
knock = ex.knock(knock)

# %% knock-then [markdown]
# No eye sees so small a turn. A rocking station makes it anew at every stop.
# $E_{trans}$ sees what changes *within* a run, and nothing else.

# %% beyond [markdown]
# ## Beyond the document: can it be done better? (*further*)
#
# The report solves the rotation first, then the translation; so do most methods of
# OpenCV. The figure shows seven methods beside the Cramér-Rao bound, which no unbiased
# method can beat (stored results of 400 trials a case, so the ratios themselves scatter
# by about 2 %). With noisy rotations (0.5°) and good translations (0.1 mm), **which way
# finds the rotation best**: from the rotations alone, from rotations and translations
# at once, or both alike? Decide, then choose the noise.

# %% predict-methods
guess = ...  # your code here
### BEGIN SOLUTION
guess = "from rotations and translations at once"
### END SOLUTION
ex.predict("methods", guess, reveal=stages.methods)

# %% everything-at-once [markdown]
# Rotation first means: translations may not help the rotation. Maximum likelihood
# weighs both by their noise; `ax_xb.calibrate_hand_eye` does, and returns a covariance.
# It treats the first pose like any other, and so needs one more unknown, here $T_{BW}$.
# For it the eye stands still, at W, and looks *to the hand*; the tracker is what it
# sees. On our log it gains little, since the systematic error is nobody's noise model,
# though `robust` sets aside the worst stop left, pose 4. But its standard deviation
# says how far off it may be; six equal runs do not.

# %% maximum-likelihood
best = ax_xb.calibrate_hand_eye(T_BF, T_WE, robust=True, eye="to hand")
found = {"truth": simulation.T_FE, "report's method": mounting}
found["maximum likelihood"] = best.T_FT  # the tracker is the target
for name, T in found.items():
    print(f"{name:19}", T[:3, 3], "mm")
print("standard deviation ", *best.std_of("T_FT.translation").round(2), "mm")
print("ignored poses:", np.flatnonzero(best.weights < 0.01))

# %% motion [markdown]
# ## In motion
#
# Section 3.2 moves the robot through the same points slowly, faster, fast, and finds
# mean errors of ±15 mm and ±1° that hardly depend on speed. In the fast motion the
# tracker moves at up to 1.4 m/s and turns at up to 3.7 rad/s. **If it lags 8 ms behind,
# by how many degrees is the rotation off at most, by how many mm the position?** Work
# both out, then try speed, latency and nonsense. Which of the four summaries would you
# print?

# %% predict-turning
guess = ...  # your code here
### BEGIN SOLUTION
guess = 1.7
### END SOLUTION
ex.predict("turning", guess)

# %% predict-motion
guess = ...  # your code here
### BEGIN SOLUTION
guess = 11
### END SOLUTION
ex.predict("motion", guess, reveal=stages.dynamic_errors)

# %% nonsense [markdown]
# A few percent of nonsense are enough to make the mean 15 mm at every speed and to hide
# a lag of 8 ms.

# %% offset [markdown]
# ### Find the lag (*further*)
#
# The lag itself is easy to find: the **norm** of the angular velocity is
# the same in every frame and at every point of the body, so it needs no calibration at
# all. Shift one curve against the other until they match: where the mean of the squared
# differences over the shared part is least. Then look between the samples; near its
# least the cost is a parabola, and three values fix its vertex. (Sums of products,
# `np.correlate`, mislead here: they also count how many samples overlap, which pulls
# the peak toward 0.)

# %% time_offset
@ex.time_offset
def time_offset(time, reference, delayed, max_offset=0.2):
    """Return by how many seconds, at most +-max_offset, `delayed` lags behind
    `reference`; finer than a sample.

    Both are angular speeds (rad/s), shape (n,), at the same equally spaced times."""
    ### BEGIN SOLUTION
    step = time[1] - time[0]
    n = round(max_offset / step)
    core = reference[n:-n]
    parts = [delayed[n + s : len(time) - n + s] for s in range(-n, n + 1)]
    cost = ((np.array(parts) - core) ** 2).mean(axis=1)
    best = np.clip(np.argmin(cost), 1, 2 * n - 1)
    left, middle, right = cost[best - 1 : best + 2]
    return (best - n + 0.5 * (left - right) / (left - 2 * middle + right)) * step
    ### END SOLUTION


# %% four-motions
for name in ("slow", "middle", "fast", "rotation"):
    m = simulation.simulate_motion(name, np.random.default_rng(5))
    lag = time_offset(m.time, tracking.speeds(m.time, m.T_true)[1], m.w_read)
    errors = tracking.tracking_errors(m.time, m.T_true, m.T_read)
    raw = tracking.summarize(errors.translation)
    then = tracking.shift_time(m.time, m.T_true, -lag)
    smooth, gate = tracking.filter_positions(m.time, m.T_read[:, :3, 3])
    left = tracking.summarize(np.linalg.norm(smooth - then[:, :3, 3], axis=1))
    words = ", ".join(f"{k} {v:.0f}" for k, v in raw.items())
    print(f"{name:9} lag {1000 * lag:4.0f} ms   raw: {words} mm")
    print(f"{'':21} gated: mean {left['mean']:.1f}, max {left['max']:.1f} mm,", end=" ")
    print(f"{100 * (1 - gate.mean()):.0f} % refused")

# %% over-speed [markdown]
# ## Errors over speed (*further*)
#
# Figures 10 to 17 of the report show four errors of each motion: of position, rotation,
# speed and angular speed. Its summary says that all hardly depend on the speed, with
# means of ±15 mm, ±1° and ±10 mm/s; the conclusion adds that they stay below about 25
# mm, 3°, 40 mm/s and 3 deg/s. The figures themselves are lost, so the simulated tracker
# goes through the same points in 10, 5 and 2.5 s. **Suppose it lags by a constant time.
# The same path in half the time: by which factors do the errors of position and of
# speed grow?** Decide, then try the lag, and all four errors.

# %% predict-tempo
guess = ...  # your code here
### BEGIN SOLUTION
guess = "2 and 4"
### END SOLUTION
ex.predict("tempo", guess, reveal=stages.over_speed)

# %% squares-add [markdown]
# What a tracker errs at rest knows nothing of the direction in which it is carried, and
# independent errors add as squares, on average: $e^2 = e_0^2 + (\tau v)^2$ with the lag
# $\tau$. So errors and speeds alone tell both apart, in whatever order they are given.

# %% static_error_and_lag
@ex.static_error_and_lag
def static_error_and_lag(speed, error):
    """Return e0 (mm) and the lag (s) of the law error^2 = e0^2 + (lag speed)^2, fitted
    by least squares of the squares; speed (mm/s) and error (mm), shape (n,)."""
    ### BEGIN SOLUTION
    slope, intercept = np.polyfit(speed**2, error**2, 1)
    return np.sqrt(intercept), np.sqrt(slope)
    ### END SOLUTION


# %% law-of-three
speed, error = [], []
for k, name in enumerate(simulation.MOTIONS):
    m = simulation.simulate_motion(name, np.random.default_rng([3, k]))
    e = tracking.tracking_errors(m.time, m.T_true, m.T_read)
    speed.append(tracking.speeds(m.time, m.T_true)[0])
    error.append(e.translation)
speed, error = np.concatenate(speed), np.concatenate(error)
sound = error < 100  # far below the nonsense, far above all else
for name, chosen in (("all readings", sound | ~sound), ("without nonsense", sound)):
    e0, lag = static_error_and_lag(speed[chosen], error[chosen])
    print(f"{name:17} at rest {e0:5.1f} mm, lag {1000 * lag:4.1f} ms")

# %% against-the-maker [markdown]
# The maker prints a latency below 4 ms (appendix A). That is up to 5.6 mm at 1.4 m/s,
# and 1.4 mm at 0.35 m/s: beside a mean error of 15 mm a lag may well pass unnoticed, if
# something larger that does not grow with the speed makes the mean. The nonsense would
# do: a few percent of it suffice. The claims are rows of the ledger. Computable of them
# is that 25 mm and 3° exceed the guaranteed repeatability of 1 mm and 1°. Whether the
# readings *drift* ("not significantly") is seen in no printed number but the six runs
# of appendix D, taken within half an hour: no column has a trend that chance would not
# make.

# %% in-practice [markdown]
# The report asks for "advanced filtering" in its conclusion. The lines "gated" of the
# four motions above did it in two steps: a gate refuses what cannot follow from the
# motion so far, a Kalman filter with constant velocity smooths the rest. What remains
# is the systematic error, which no filter sees. Chapter 8 builds this filter.
#
# ## In practice
#
# - Bind a receiver to the address you mean, count what you throw away, and never let it
#   block.
# - Turn far, about axes far apart. Look at the second smallest singular value before
#   you look at the residual.
# - Calibrate over the space you will work in. Repeat at *other* poses: same poses
#   repeat their error.
# - Synchronize first. Then print median and 95 % beside the mean, and say what happened
#   to the outliers.

# %% whole [markdown]
# ## From beginning to end: one cell (*further*, 30 minutes)
#
# A part on a trolley is to be found and touched. Its frame $P$ comes from three marks
# (chapter 1), which the scanner $S$ on the flange has seen (chapter 5). A tracker $E$
# rides on the trolley, and its world $W$ has been calibrated in the base (this
# chapter). The trolley is pushed elsewhere, a chain around the tracker says where
# (chapter 2), and the tip (chapter 3) goes to a hole of the part. All of it is
# simulated, each calibration from its own noisy readings.

# %% calibrate-all
from labkit.machines import cell as cells

rng = np.random.default_rng(6)
tip, scanner = cells.calibrate_tip(rng), cells.calibrate_scanner(rng)
tracker = cells.calibrate_tracker(rng)
cell, job = cells.cell_from(tip, scanner, tracker), cells.simulated_job(cells.FAR)
T_BP0 = cells.learned_pose(cell, job)
print("std of the tip    ", tip.std_of("tip").round(2), "mm")
for name, found, frame in (("scanner", scanner, "T_FS"), ("tracker", tracker, "T_BS")):
    turn = np.rad2deg(found.std_of(f"{frame}.rotation")).round(2)
    shift = found.std_of(f"{frame}.translation").round(2)
    print(f"std of the {name}", shift, "mm", turn, "deg")

# %% moved-text [markdown]
# Between tracker and part nothing has moved, so what was true when the part was learned
# is true now. The readings are $T_{WE_0}$ and $T_{WE_1}$.

# %% moved_part
@ex.moved_part
def moved_part(T_BW, T_WE0, T_WE1, T_BP0):
    """Return T_BP, shape (4, 4), of a part now, from the tracker's world, its readings
    when the part was learned and now, and the part as it was learned; mm."""
    ### BEGIN SOLUTION
    T_EP = np.linalg.inv(T_BW @ T_WE0) @ T_BP0
    return T_BW @ T_WE1 @ T_EP
    ### END SOLUTION


# %% common-errors [markdown]
# Two questions before any number. **The marks are touched with the very tip that later
# goes to the hole, the flange turned alike, and the tip's calibration is 1 mm off. By
# how much does it miss the hole, if the trolley has not moved?** And: **the trolley
# comes back exactly to where the part was learned. What does the error of $T_{BW}$ do
# to the part's place now?**

# %% predict-touch
guess = ...  # your code here
### BEGIN SOLUTION
guess = "not at all"
### END SOLUTION
ex.predict("touch", guess)

# %% predict-returns
guess = ...  # your code here
### BEGIN SOLUTION
guess = "nothing"
### END SOLUTION
ex.predict("returns", guess, reveal=stages.whole_cell)

# %% lever [markdown]
# ### How an error travels
#
# Every result of the workbook gives the error of a transform $T_{AB} = (R, t)$ as a
# rotation vector $\varphi$ about the axes of $B$ and a shift $d$ in $A$. The true point
# is then $R\exp(\varphi)\,p + t + d$. To first order that is
# $R\,p + t - R\,[p]\,\varphi + d$, with $[p]$ the matrix of the cross product: a
# rotation acts by its lever. For $e_A = J e$ the covariance is $J\,\Sigma\,J^\top$.
#
# The scanner's pose is known to 1 mm per axis at worst, and to 0.2°. **How well is then
# a mark known that it sees 215 mm away?** Decide before the second cell below prints
# it, with all of the covariance and with its variances alone.

# %% point_covariance
@ex.point_covariance
def point_covariance(T, cov_T, p, cov_p):
    """Return the covariance, shape (3, 3), mm^2, of the point p of B seen from A.

    T = T_AB, cov_T, shape (6, 6), of (phi, d) as above (rad, mm), and cov_p, shape
    (3, 3), of p along the axes of B; both errors are independent."""
    ### BEGIN SOLUTION
    R, (x, y, z) = T[:3, :3], p
    lever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    J = np.hstack([-R @ lever, np.eye(3)])
    return J @ cov_T @ J.T + R @ cov_p @ R.T
    ### END SOLUTION


# %% correlated
x_S = job.marks[0]  # the first mark, as the scanner sees it
joint = point_covariance(cell.T_FS, cell.cov_FS, x_S, np.zeros((3, 3)))
alone = np.diag(np.diag(cell.cov_FS))
apart = point_covariance(cell.T_FS, alone, x_S, np.zeros((3, 3)))
for name, cov in (("with its correlations", joint), ("its variances alone", apart)):
    print(f"a mark, scanner {name}: {np.sqrt(np.trace(cov)):.2f} mm")

# %% budget-text [markdown]
# The scanner sits where it sits to 1 mm only, and yet it sees a mark to a fraction of
# that: turn and shift come from one fit, and at the distance of the calibrating sphere
# they make up for each other. What one calibration estimates together stays together.
#
# ### The budget
#
# Six sources know nothing of each other: three calibrations, the marks, two readings.
# `jacobians` says how the tip's miss moves with each of them, all ways by which a
# source enters added up; $T_{BW}$ enters twice. Which of the six contributes most?
# Write down what each does.

# %% shares
@ex.shares
def shares(jacobians, covariances):
    """Return for each source the standard deviation in space, mm, that it contributes:
    the root of the trace of its share; jacobians, each (3, n), covariances (n, n)."""
    ### BEGIN SOLUTION
    pairs = zip(jacobians, covariances)
    return np.array([np.sqrt(np.trace(J @ C @ J.T)) for J, C in pairs])
    ### END SOLUTION


# %% budget
jacobians = cells.miss_jacobians(cell, job)
covariances = cells.source_covariances(cell, job)
in_order = ([by[n] for n in cells.SOURCES] for by in (jacobians, covariances))
found = shares(*in_order)
sizes, total = dict(zip(cells.SOURCES, found)), np.linalg.norm(found)
for name, size in sizes.items():
    print(f"{name:15} {size:.3f} mm, {(size / total) ** 2:4.0%} of the variance")
misses = cells.simulate_misses(cell, job, np.random.default_rng(1), 20_000)
simulated = np.sqrt((misses**2).sum(axis=1).mean())
print(f"first order {total:.2f} mm, 20,000 simulated cells {simulated:.2f} mm")
off = np.linalg.norm(cells.miss(cells.TRUTH, cell, job))
print(f"the calibrations of this very cell make it miss by {off:.2f} mm")

# %% halved-text [markdown]
# **The largest contributor is calibrated again, four times as long, and its standard
# deviation is halved. What is the total then, in mm?** Decide first whether it is worth
# it.

# %% halved
halved = ...  # your code here
### BEGIN SOLUTION
largest = max(sizes.values())
halved = np.sqrt(total**2 - 0.75 * largest**2)
### END SOLUTION
halved = ex.halved(halved)

# %% what-a-budget-knows [markdown]
# Now make the figure above fail, and push the part about; or click a frame and spoil it.
# One calibration is wrong by more than it admits, the tip misses by millimeters, and
# the budget has not changed: it repeats what the calibrations say of themselves. It
# says where to work next, and whether a miss is too large to be chance. It never says that nothing is wrong; a part
# measured twice, by different ways, does.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. The mounting adapter is printed anew. Which figures of appendix D change, which do
#    not?
# 2. Why does the angular speed need no calibration, while the linear speed does?
# 3. A colleague halves the error by averaging 40 s instead of 4 s at each pose. What
#    has improved, and what has not?

# %% progress
ex.progress()
