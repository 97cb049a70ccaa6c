# %% title [markdown]
# # 1 · Frames from three points
#
# **What you will do.** Build coordinate frames from measured points, find how two frames lie to each other, and take a robot pose apart.
#
# **What you will learn.** Which measurements a frame trusts, why the inverse of a pose needs no solver, why a flat triangle makes a bad
# frame, what happens at B = 90°, and what a wrong convention costs in millimeters.
#
# **What you need.** Vectors, matrices, a little NumPy. About 90 minutes.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $W$, $F$, $K_0$, $K_1$ | frames: the world, any frame, the two frames of the lab sheet |
# | $T_{WF}$, in code `T_WF` | 4×4 matrix that maps coordinates in $F$ to coordinates in $W$ |
# | $R$, $t$ | its rotation (columns = axes of $F$ seen from $W$) and translation (origin of $F$ seen from $W$) |
# | $T_{AC} = T_{AB}\,T_{BC}$ | neighboring letters cancel |
# | mm, rad | units inside the code; degrees only in names that end in `_deg` |

# %% setup
import numpy as np

from labkit.chapters.ch01_frames import stages
from labkit.documents.lab_sheet.printed import points
from labkit.exercises import course
from labkit.geometry import frames

ex = course("01-frames")
np.set_printoptions(precision=6, suppress=True)

# %% the-question [markdown]
# ## The question
#
# A measuring arm touches three points of a work piece: its origin, a point on the x axis, a point on the side of positive y. Two such triples are given.
# **How do the two frames lie to each other?** This is section 1 of the lab sheet *Kalibrierung* (Hochschule Darmstadt, 2016). Listing 2 and
# listing 3 print the points. The sheet never states their unit; its later sections work in millimeters, so we read millimeters.

# %% the-points
measured = points()
for name, triple in measured.items():
    for label, point in zip(("origin", "x_point", "y_point"), triple):
        print(name, f"{label:8}", point)

# %% directions [markdown]
# ## A direction has length 1
#
# Points say *where*, directions say *which way*. The difference of two points is a direction once it has length 1. This is the first brick.
# Write the body, run the cell, and read what appears beneath it.

# %% normalize
@ex.normalize
def normalize(v):
    """Return v, shape (3,), scaled to length 1."""
    ### BEGIN SOLUTION
    return v / np.linalg.norm(v)
    ### END SOLUTION


# %% first-edge [markdown]
# ## Three points are too many
#
# Three noisy points almost never form a right angle, so no orthonormal frame passes through all of them. The sheet repairs this with Gram-Schmidt
# (*Schmidtsche Orthonormalisierung*). Before you see it move: **all three points carry the same noise; which measured direction does Gram-Schmidt keep exactly?**
#
# Then drag the six points, the y points above all. A hollow cross shows the part of the second edge that is thrown away, the dashed line what is kept, and the matrix beside it
# is $T_{K_0K_1}$. Try *Make it fail* too.

# %% predict-edges
guess = ...  # your code here
### BEGIN SOLUTION
guess = "origin to x_point"
### END SOLUTION
ex.predict("edges", guess, reveal=stages.three_points)

# %% gram-schmidt-derivation [markdown]
# ## Gram-Schmidt
#
# Let $a$ be the first edge and $b$ the second. The axis $x$ is $a$ at length 1. From $b$ we remove its shadow on $x$, what is left is perpendicular
# to $x$, and normalizing it gives $y$:
#
# $$x = \frac{a}{|a|}, \qquad r = b - (b \cdot x)\,x, \qquad y = \frac{r}{|r|}, \qquad z = x \times y .$$
#
# Check it: $r \cdot x = b \cdot x - (b \cdot x)(x \cdot x) = 0$. The cross product makes $z$ perpendicular to both and the system right-handed.

# %% gram_schmidt
@ex.gram_schmidt
def gram_schmidt(a, b):
    """Return R, shape (3, 3), from two edges a, b, shape (3,), in mm: columns x (along
    a), y (in their plane), z."""
    ### BEGIN SOLUTION
    x = normalize(a)
    y = normalize(b - (b @ x) * x)
    return np.column_stack([x, y, np.cross(x, y)])
    ### END SOLUTION


# %% pose [markdown]
# ## From axes to a frame
#
# A frame is its axes and its origin. Packed into one matrix, $T_{WF}$ turns coordinates in $F$ into coordinates in $W$:
# $p_W = R\,p_F + t$. Feed it $p_F = 0$ and you get the origin, feed it $(1, 0, 0)$ and you get the origin plus the x axis.

# %% frame_from_points
@ex.frame_from_points
def frame_from_points(origin, x_point, y_point):
    """Return T_WF, shape (4, 4), of the frame through three measured points, each of
    shape (3,), in mm."""
    ### BEGIN SOLUTION
    T_WF = np.eye(4)
    T_WF[:3, :3] = gram_schmidt(x_point - origin, y_point - origin)
    T_WF[:3, 3] = origin
    return T_WF
    ### END SOLUTION


# %% inverse [markdown]
# ## The way back, without `inv`
#
# To ask where $W$ lies seen from $F$, solve $p_W = R\,p_F + t$ for $p_F$. The columns of $R$ are orthonormal, so $R^\top R = I$, and nothing needs to be
# solved by elimination. The sheet calls a pseudo-inverse here (listing 1, line 78).

# %% invert
@ex.invert
def invert(T):
    """Return the inverse of a rigid transform, shape (4, 4); nothing needs to be
    solved."""
    ### BEGIN SOLUTION
    X = np.eye(4)
    X[:3, :3] = T[:3, :3].T
    X[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return X
    ### END SOLUTION


# %% pseudo-inverse [markdown]
# What does the pseudo-inverse cost? An iterative SVD instead of nine copied and nine multiplied numbers: about nine times the time, measured by
# `tests/bench/inverse.py`. Worse is what it *hides*: it
# accepts anything. Below, one digit of a matrix is mistyped, and then an axis is missing altogether. `np.linalg.pinv` returns numbers for both; the
# workbook's `frames.invert` says what is wrong. Mind the first line: 0.00 means a perfect inverse, of a matrix that is no pose.

# %% pseudo-inverse-hides
typo = np.array(frame_from_points(*measured["K1"]))
typo[0, 1] = -0.909950
flat = np.array(frame_from_points(*measured["K1"]))
flat[:3, 2] = 0
for name, T in (("mistyped", typo), ("axis missing", flat)):
    back = np.linalg.pinv(T) @ T
    print(f"{name}: pinv says nothing; pinv(T) T differs from I by "
          f"{np.abs(back - np.eye(4)).max():.2f}")
    try:
        frames.invert(T)
    except ValueError as refusal:
        print("   frames.invert:", refusal)

# %% relative-pose [markdown]
# ## How does $K_1$ lie, seen from $K_0$?
#
# Both frames are known in $W$. Put the matrices in an order in which the letters cancel: $T_{K_0K_1} = T_{K_0W}\,T_{WK_1}$.

# %% relative
@ex.relative
def relative(T_WA, T_WB):
    """Return T_AB, shape (4, 4): the pose of B seen from A, given T_WA and T_WB, shape
    (4, 4)."""
    ### BEGIN SOLUTION
    return invert(T_WA) @ T_WB
    ### END SOLUTION


# %% compare [markdown]
# ## Against the document
#
# Listing 4 prints $T_{K_0K_1}$ with six digits after the point. Compare yours with it, entry by entry.

# %% compare-listing-4
T_WK0, T_WK1 = np.array([frame_from_points(*measured[k]) for k in ("K0", "K1")])
T_K0K1 = np.array(relative(T_WK0, T_WK1))
listing_4 = np.array([[0.010000, -0.999950, 0, 0.99], [0.999950, 0.010000, 0, -1],
                      [0, 0, 1, 0], [0, 0, 0, 1]])
print(T_K0K1 + 0.0)
print(f"largest difference from listing 4: {np.abs(T_K0K1 - listing_4).max():.1e} "
      "(half a printed digit is 5.0e-07)")

# %% angle [markdown]
# By what angle is $K_1$ turned against $K_0$? The drawing says 90°, but the points were moved by 0.01 on purpose.

# %% angle_deg
angle_deg = ...  # your code here
### BEGIN SOLUTION
angle_deg = np.rad2deg(np.arccos((np.trace(T_K0K1[:3, :3]) - 1) / 2))
### END SOLUTION
angle_deg = ex.angle_deg(angle_deg)

# %% half-a-degree [markdown]
# Is that much? A hole is to be drilled at $(200, 0, 0)$ mm in $K_1$. In the drawing $K_1$ stands at the same place as here and is turned by exactly 90° against $K_0$: that is `drawn` below.
# **How far from its place in the drawing does the hole land?** Guess first, from the angle.

# %% distance
drawn = T_K0K1.copy()
drawn[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
distance = ...  # your code here
### BEGIN SOLUTION
hole = np.array([200.0, 0.0, 0.0])
apart = frames.transform(T_K0K1, hole) - frames.transform(drawn, hole)
distance = np.linalg.norm(apart)
### END SOLUTION
distance = ex.distance(distance)

# %% noise [markdown]
# ## How good is a frame?
#
# Repeat the measurement a thousand times and you get a cloud of frames. Put the origin at 0, x_point at $(\ell, 0, 0)$ and y_point at $(u, h, 0)$:
# the triangle is $\ell$ long and $h$ high, and y_point stands above the place $u$ of its base. Which of these lengths is worth how much?

# %% predict-flat
guess = ...  # your code here
### BEGIN SOLUTION
guess = "a height twice as large"
### END SOLUTION
ex.predict("flat", guess, reveal=stages.triangle_noise)

# %% noise-law [markdown]
# To first order, with $e_{o}$, $e_{x}$, $e_{y}$ the noise of origin, x_point and y_point, and its coordinate as the second index:
#
# | turn about | error |
# | --- | --- |
# | x | $\left(e_{y,z} - e_{o,z} - \tfrac{u}{\ell}(e_{x,z} - e_{o,z})\right)/h$ |
# | y | $-(e_{x,z} - e_{o,z})/\ell$ |
# | z | $(e_{x,y} - e_{o,y})/\ell$ |
#
# Only the ratio $u/\ell$ enters the turn about x. With y_point above the middle it is ½ for every base. With y_point left at $u = 50$ mm a base of 200 mm in place of 100 mm makes
# the turn about x a little worse (0.365° in place of 0.351° at noise of 0.05 mm and $h = 10$ mm), with $u = 100$ mm it makes it better (0.351° in place of 0.405°).

# %% kuka [markdown]
# ## Poses as a robot displays them
#
# A KUKA controller shows six numbers: x, y, z in mm and the angles A, B, C in degrees. The rotation is $R = R_z(A)\,R_y(B)\,R_x(C)$:
# turn about z, then about the *new* y, then about the *newest* x. Inside the workbook the three angles are radians. With $c = \cos\varphi$, $s = \sin\varphi$:
#
# $$R_z(\varphi) = \begin{pmatrix} c & -s & 0 \\ s & c & 0 \\ 0 & 0 & 1 \end{pmatrix}, \quad
# R_y(\varphi) = \begin{pmatrix} c & 0 & s \\ 0 & 1 & 0 \\ -s & 0 & c \end{pmatrix}, \quad
# R_x(\varphi) = \begin{pmatrix} 1 & 0 & 0 \\ 0 & c & -s \\ 0 & s & c \end{pmatrix}.$$

# %% matrix_from_kuka
@ex.matrix_from_kuka
def matrix_from_kuka(xyzabc):
    """Return T, shape (4, 4), of a KUKA pose xyzabc, shape (6,): x, y, z (mm), A, B, C
    (rad)."""
    ### BEGIN SOLUTION
    x, y, z, A, B, C = xyzabc
    rot_z = np.array([[np.cos(A), -np.sin(A), 0], [np.sin(A), np.cos(A), 0], [0, 0, 1]])
    rot_y = np.array([[np.cos(B), 0, np.sin(B)], [0, 1, 0], [-np.sin(B), 0, np.cos(B)]])
    rot_x = np.array([[1, 0, 0], [0, np.cos(C), -np.sin(C)], [0, np.sin(C), np.cos(C)]])
    T = np.eye(4)
    T[:3, :3] = rot_z @ rot_y @ rot_x
    T[:3, 3] = x, y, z
    return T
    ### END SOLUTION


# %% gimbal [markdown]
# ## The pole
#
# Three rings carry the flange, the plate on which a robot holds its tool. At B = ±90° the outer and the inner ring lie in one plane and turn about the same line: one degree of freedom is lost
# (*gimbal lock*). The figure also shows singular values: how strongly the pose answers to the best and the worst combination of changes of A, B, C. A zero among them means that one
# combination, the "weakest change", moves nothing. **At B = 90° you raise A by 30° and C by 30°: how does the flange move?** Decide, then move the sliders, or press *Make it fail* to go to the pole.

# %% predict-pole
guess = ...  # your code here
### BEGIN SOLUTION
guess = "it does not move"
### END SOLUTION
ex.predict("pole", guess, reveal=stages.kuka_gimbal)

# %% back-to-angles [markdown]
# The way back reads the angles from the entries that hold few terms: $r_{20} = -\sin B$, $r_{10}/r_{00} = \tan A$, $r_{21}/r_{22} = \tan C$. At the pole the last
# four of these entries are only rounding noise. Any A is allowed there, but C must fit it: A − C is fixed at B = +90°, A + C at −90°. So take A first, undo it
# ($R_z(A)^\top R$), and read C from what is left. The check compares poses, not angles.

# %% kuka_from_matrix
@ex.kuka_from_matrix
def kuka_from_matrix(T):
    """Return x, y, z (mm), A, B, C (rad) of a pose, shape (6,), with B between -pi/2
    and pi/2."""
    ### BEGIN SOLUTION
    R = T[:3, :3]
    A = np.arctan2(R[1, 0], R[0, 0])
    B = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    s, c = np.sin(A), np.cos(A)
    C = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([*T[:3, 3], A, B, C])
    ### END SOLUTION


# %% conventions [markdown]
# ## What a wrong convention costs
#
# A tool tip sits 200 mm in front of the flange. Read one and the same displayed pose with four wrong conventions and look where the tip ends up. None of
# them raises an error: only the millimeters tell.

# %% wrong-conventions
pose_deg = np.array([800.0, 200.0, 500.0, 30.0, -40.0, 65.0])
x, A_deg, B_deg, C_deg = pose_deg[:3], *pose_deg[3:]
tip_F = np.array([0.0, 0.0, 200.0])
right = frames.transform(matrix_from_kuka(frames.kuka_from_degrees(pose_deg)), tip_F)
readings = {
    "A, B, C about x, y, z": frames.kuka_from_degrees([*x, C_deg, B_deg, A_deg]),
    "signs reversed": frames.kuka_from_degrees([*x, -A_deg, -B_deg, -C_deg]),
    "A and B swapped": frames.kuka_from_degrees([*x, B_deg, A_deg, C_deg]),
    "degrees taken for radians": pose_deg,
}
for name, pose in readings.items():
    error = np.linalg.norm(frames.transform(matrix_from_kuka(pose), tip_F) - right)
    print(f"{name:27} the tip is off by {error:5.0f} mm")

# %% break-it [markdown]
# ## Break it
#
# Three points on a line have no plane, two equal points no direction, and NaN has nothing at all. A good function says so instead of returning a
# frame. Try your own wrong inputs as well.

# %% break-it-code
o, px = np.zeros(3), np.array([100.0, 0, 0])
for y_point in (np.array([50.0, 1e-4, 0]), o, np.array([50.0, np.nan, 0]),
                np.array([50.0, 10.0])):
    try:
        frames.frame_from_points(o, px, y_point)
    except ValueError as refusal:
        print(refusal)

# %% beyond [markdown]
# ## Beyond the document: trust all points alike (*further*)
#
# If the drawing of the part says where the three points *should* be, the best frame minimizes the sum of squared distances. The SVD solves it in one step (Kabsch,
# `frames.fit_frame`). Noise limits every method: how far an unbiased one can get with it depends only on how widely the points lie around each axis, that is, on the sum of their squared distances from it.
# The black bars in the figure show this bound. Gram-Schmidt does not use the drawing. How much does it lose?

# %% predict-svd
guess = ...  # your code here
### BEGIN SOLUTION
guess = "only about z"
### END SOLUTION
ex.predict("svd", guess, reveal=stages.svd_against_gram_schmidt)

# %% kabsch [markdown]
# Five lines do it. With the points $p_i$ in F and $q_i$ in W, both measured from their means,
# the rotation that turns the $p_i$ best onto the $q_i$ follows from the SVD $\sum p_i q_i^\top = U S V^\top$ as
# $R = V U^\top$; where that is a mirror image, the last column of $V$ changes its sign. The translation takes one mean to the other.

# %% fit_frame
@ex.fit_frame
def fit_frame(points_F, points_W):
    """Return T_WF, shape (4, 4), that fits best: both shapes (n, 3), n at least 3."""
    ### BEGIN SOLUTION
    p, q = points_F - points_F.mean(0), points_W - points_W.mean(0)
    U, _, Vt = np.linalg.svd(p.T @ q)
    R = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, points_W.mean(0) - R @ points_F.mean(0)
    return T
    ### END SOLUTION


# %% in-practice [markdown]
# ## In practice
#
# - Put the first two points as far apart as the part allows, and the third as far *off their line* as it allows.
# - Measure more than three points if you can, and fit.
# - Write frames into names (`T_WF`); a bare `T` is for functions that take any pose. Most calibration bugs are a matrix used in the wrong direction.
# - Store poses as matrices or quaternions. Compare poses, never angles.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. Two students measure the same part. One exchanges the roles of x_point and y_point and renames the axes afterwards. Why do their frames still differ?
# 2. Why does a longer base not improve the turn about x while y_point stands above its middle? Where would y_point have to stand for it to help?
# 3. A program logs A, B, C once a second while the flange turns evenly through the pole. What does the plot of A look like, and what really happens?

# %% progress
ex.progress()
