# %% title [markdown]
# # 2 · Chaining and closing the loop
#
# **What you will do.** Chain four measured transforms around a loop, find by how much the loop misses itself, explain the last printed digits, and
# share out the error.
#
# **What you will learn.** What the order of a product does, how a small turn becomes millimeters through its lever, how errors grow with the number
# of links, what a long product does to right angles, and what a second loop changes.
#
# **What you need.** Chapter 1. About 75 minutes.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $K_0 \dots K_3$ | four frames on the work piece |
# | $T_{K_0K_1}$ | a link: the pose of $K_1$ seen from $K_0$ |
# | $P_k$ | pose after $k$ links: $P_0 = I$, $P_k = P_{k-1}\,T_{k}$ |
# | $\xi = (\varphi, \rho)$ | twist: turn (rad) and shift (mm) of a small motion $\exp(\xi)$; `exp_se3`, `log_se3` |
# | $\sigma_r, \sigma_t$ | standard deviation of each component of a link's turn and shift |

# %% setup
import numpy as np
import scipy.linalg

from labkit.chapters.ch02_chaining import stages
from labkit.documents.lab_sheet import printed as lab_sheet
from labkit.exercises import course
from labkit.files import systems
from labkit.files.text import number_in
from labkit.geometry import chaining
from labkit.geometry.frames import relative
from labkit.geometry.lie import exp_se3, log_se3

ex = course("02-chaining")
np.set_printoptions(precision=6, suppress=True)

# %% the-question [markdown]
# ## The question
#
# A measuring arm reaches only so far, and the work piece is larger. So the arm is moved: from stand 1 it measures the frames $K_0$ and $K_1$, from stand 2 $K_1$ and
# $K_2$, and so on, until stand 4 measures $K_3$ and again $K_0$. **Where does the chain end, and what does the gap tell?** This is section 2 of the lab sheet
# (*Verkettung von Transformationen*). The eight frames that its program read were never published; listing 7 prints four transforms, each from one pair of frames, and their product. (The sheet's prose counts the stands a little differently; four pairs mean four stands.)
# The cell below says of each link by what angle it turns and how far it goes; `closure_error`, which reads both from a matrix, you will write yourself further down.
# To have something to measure, `data/chaining` holds eight synthetic frames (labeled so) that round to the printed digits.

# %% the-links
printed = lab_sheet.printed_transforms()
measured = chaining.transforms_from_points(lab_sheet.station_points())
for k, (T, S) in enumerate(zip(printed, measured)):
    angle, distance = chaining.closure_error(T)
    link = f"K{k} to K{(k + 1) % 4}: {np.rad2deg(angle):6.2f} deg, {distance:6.2f} mm"
    print(f"{link}; synthetic entries off by {np.abs(S - T).max():.1e}")

# %% order [markdown]
# ## First A, then B
#
# Every move is made *in the frame that has been reached*. Below, A shifts and turns about z by 60°, B shifts only. **Does the order of the two matter?** Decide, then drag the frames A and B,
# and turn them with the sliders, B about x. Then try *No turns*.

# %% predict-order
guess = ...  # your code here
### BEGIN SOLUTION
guess = "yes, one turn is enough"
### END SOLUTION
ex.predict("order", guess, reveal=stages.order_of_product)

# %% sum-or-product [markdown]
# ## A sum sign
#
# Above its listing the sheet writes $K_0 \cdot \sum_{i=1}^{n} {}^{i}T_{i+1} = K_0 \cdot E$. The result it prints begins with these three rows:
#
# | | | | |
# | ---: | ---: | ---: | ---: |
# | 0.999905 | −0.012206 | 0.006358 | −1.205218 |
# | 0.012191 | 0.999923 | 0.002337 | 1.215314 |
# | −0.006386 | −0.002259 | 0.999977 | −0.128655 |
#
# **Which of the two did the program compute, the sum or the product?** Decide from what you know of rotations.

# %% predict-operator
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the product"
### END SOLUTION
ex.predict("operator", guess)

# %% chain
@ex.chain
def chain(transforms):
    """Return T_0N, shape (4, 4), from the links T_01, T_12, ..., shape (N, 4, 4),
    mm."""
    ### BEGIN SOLUTION
    T = np.eye(4)
    for link in transforms:
        T = T @ link
    return T
    ### END SOLUTION


# %% rounding [markdown]
# ## Against the document
#
# Your product will agree with the printed one, but not to the last digit. Is that an error? The printed links are rounded by up to half a unit of the sixth decimal,
# $h = 0.5 \cdot 10^{-6}$. An error $E$ in link $k$ arrives in the product as $T_1 \cdots T_{k-1}\,E\,T_{k+1} \cdots T_N$. Adding the absolute values over all links gives
# a bound for every entry. In the last column the digits of the *rotations* arrive multiplied by a lever of some hundred millimeters.

# %% compare-listing-7
product = np.array(chain(printed))
listing_7 = lab_sheet.printed_product()
bound = chaining.rounding_bound(printed, lab_sheet.HALF_DIGIT)
off = np.abs(product - listing_7)
corner = printed.sum(axis=0)[3, 3]
print("corner of the sum:", corner, "  of the product:", product[3, 3])
for name, part in (("rotation", np.s_[:3, :3]), ("translation (mm)", np.s_[:3, 3])):
    most, allowed = off[part].max(), bound[part].max()
    print(f"{name}: off by {most:.1e}, rounding allows {allowed:.1e}")
within = off[:3] <= bound[:3] + lab_sheet.HALF_DIGIT
print("every entry within its bound:", bool(within.all()))
unrounded = np.abs(chain(measured) - listing_7).max()
print(f"product of the unrounded synthetic links: off by {unrounded:.1e}")

# %% closure [markdown]
# ## The closure error
#
# The product should be the identity. How far is it from it? Not by a norm of $T - I$: that adds millimeters to numbers without a unit. A rigid motion has an
# **angle**, from the trace of its rotation, and a **distance**, the length of its translation. (Near 0 the cosine is flat: the arccosine of the trace
# keeps two or three digits of the angle from six decimals of a matrix, and loses turns below 1e-8. That is enough here. The library also reads the sine,
# from $R - R^\top$.)

# %% closure_error
@ex.closure_error
def closure_error(T):
    """Return angle (rad) and distance (mm) by which T, shape (4, 4), differs from I."""
    ### BEGIN SOLUTION
    R = T[:3, :3]
    twice_sine, twice_cosine = np.linalg.norm(R - R.T) / np.sqrt(2), np.trace(R) - 1
    return np.arctan2(twice_sine, twice_cosine), np.linalg.norm(T[:3, 3])
    ### END SOLUTION


# %% sheet-closure
angle, distance = closure_error(product)
turn = np.rad2deg(angle)
print(f"the sheet's loop misses itself by {turn:.1f} deg and {distance:.2f} mm")

# %% work-piece [markdown]
# The sheet finds its product "annähernd genau" the identity. Whether it is depends on *where* you ask. A point of the work piece at $p$ is displaced by
# $|T p - p|$, and what the angle adds to this grows with the distance from the axis of the closure motion.

# %% even_lever
# how far from the axis does the turn alone move a point as far as the loop's distance
# (mm)? Nearer the shift counts more, farther away the turn
even_lever = ...  # your code here
### BEGIN SOLUTION
angle, distance = closure_error(product)
even_lever = distance / angle
### END SOLUTION
even_lever = ex.even_lever(even_lever)

# %% at-the-work-piece
for x in (100, 300, 1000):
    points = x * np.vstack([np.eye(3), -np.eye(3)])
    d = chaining.displacement(product, points)
    along = f"{d.min():5.2f} to {d.max():5.2f} mm, along the axes"
    print(f"{x:5} mm from the origin of K0: {along}")

# %% worst_at_one_meter
# and in the worst of all directions, at 1000 mm from the origin of K0 (mm)?
worst_at_one_meter = ...  # your code here
### BEGIN SOLUTION
p = np.random.default_rng(0).normal(size=(20_000, 3))
p *= 1000 / np.linalg.norm(p, axis=1)[:, None]
worst_at_one_meter = chaining.displacement(product, p).max()
### END SOLUTION
worst_at_one_meter = ex.worst_at_one_meter(worst_at_one_meter)

# %% lever [markdown]
# ## One bad link
#
# A turn at the end of link $k$ moves everything that follows. The end of the chain moves by the turn (in rad) times its **lever**: the distance from $K_k$ to the end.
# The figure shows the sheet's loop: thin (black, or white on dark) as it is, purple as the chain sees it, gray the gap at $K_0$ and at a work piece P; the measuring arm stands where that link is measured. **One link is turned wrongly by 3°: which one opens the loop most at $K_0$?** Decide, then drag the frames, choose which link is wrong, and about which axis: then the lever is the distance from that axis.

# %% predict-lever
guess = ...  # your code here
### BEGIN SOLUTION
guess = "the second, to K2"
### END SOLUTION
ex.predict("lever", guess, reveal=stages.open_loop)

# %% growth [markdown]
# ## How errors grow
#
# Let every link carry independent noise, and take the mean over many chains. Turns of different links add like random steps, a turn moves the end by its lever $l_k$:
#
# $$\text{angle}^2 = 3N\sigma_r^2, \qquad \text{distance}^2 = 3N\sigma_t^2 + 2\sigma_r^2 \sum_k |l_k|^2 .$$
#
# (A turn about the lever itself moves nothing: two of three components count.) For $N$ links of length $L$ in a row the levers are $0, L, \dots, (N-1)L$.
# On a loop of fixed size they stay below its diameter. In the figure, left: a hundred chains, seen from the side (dashed: the law); right: the laws, gray those of other errors of a link. The numbers of the sentence beneath can be dragged.
# **Twice as many links in a row: how much larger is the error at the end?**

# %% predict-growth
guess = ...  # your code here
### BEGIN SOLUTION
guess = "2.8 times"
### END SOLUTION
ex.predict("growth", guess, reveal=stages.growth)

# %% what-the-arm-did [markdown]
# (In a row the squares of the levers add up to about $L^2N^3/3$, the better the longer the row.) The law also reads backwards. If the sheet's closure angle is typical, it tells the noise of a single link; with the sheet's levers, this noise predicts the distance.
# One loop is one sample, so expect agreement within a factor of two or three, not more.

# %% noise-of-the-sheet
angle, distance = chaining.closure_error(product)
std_rot = angle / np.sqrt(3 * len(printed))
expected = chaining.expected_closure(printed, std_rot, 0.0)[1]
on_triangle = f"{100 * std_rot:.2f} mm on a triangle of 100 mm"
print(f"noise of a link: {np.rad2deg(std_rot):.2f} deg a component, {on_triangle}")
print(f"closure distance it predicts: {expected:.1f} mm")
print(f"found: {distance / expected:.1f} times that")

# %% drift [markdown]
# ## Right angles wear off
#
# Six decimals leave $R^\top R - I$ at about $10^{-6}$. Go around the loop again and again and the defect grows, without any noise. The repair is the nearest rotation:
# among all rotations, the one with the smallest $|X - R|$ (root of the sum of squares). With the SVD $R = U S V^\top$ it is $X = U V^\top$, as long as $\det R > 0$.

# %% orthonormalize
@ex.orthonormalize
def orthonormalize(T):
    """Return a copy of T, shape (4, 4), its block (det R > 0) replaced by the nearest
    rotation."""
    ### BEGIN SOLUTION
    U, _, Vt = np.linalg.svd(T[:3, :3])
    X = T.copy()
    X[:3, :3] = U @ Vt
    return X
    ### END SOLUTION


# %% many-rounds
once = chaining.chain(printed)  # nothing repaired on the way
worn, repaired = np.eye(4), np.eye(4)
for rounds in range(1, 1001):
    worn = worn @ once
    repaired = orthonormalize(repaired @ once)
    if rounds in (1, 10, 100, 1000):
        defect = chaining.orthonormality_error(worn)
        kept = chaining.orthonormality_error(repaired) < 1e-12
        off = f"RᵀR differs from I by {defect:.1e}"
        print(f"{rounds:5} rounds: {off}; repaired, below 1e-12: {kept}")

# %% sharing [markdown]
# ## Sharing out the error
#
# Every rigid motion is a screw: a turn about some axis, with a slide along it. Its twist $\xi = (\varphi, \rho)$ tells what to do per unit of time so that the
# motion is complete at time 1: $\exp(\xi)$ is the exponential of the 4×4 matrix with $[\varphi]_\times$ as its block, $\rho$ as its column and zeros below. `exp_se3` computes it, `log_se3` goes
# the way back, and half a twist is half the motion:

# %% half-a-motion
half = exp_se3(0.5 * log_se3(measured[0]))
print("half a link, twice, is the link:", np.allclose(half @ half, measured[0]))
twist = np.zeros((4, 4))
(a, b, c), twist[:3, 3] = log_se3(measured[0])[:3], log_se3(measured[0])[3:]
twist[:3, :3] = [[0, -c, b], [c, 0, -a], [-b, a, 0]]
print("a matrix exponential:", np.allclose(scipy.linalg.expm(twist), measured[0]))
halved = (0.5 * measured[0][:3, 3]).round(1)
way = half[:3, 3].round(1)
print("half the shift is not half the way:", way, "against", halved, "mm")

# %% sharing-derivation [markdown]
# The pose after $N$ links should be $I$ but is $P_N = \exp(\xi)$. Nobody knows which link is to blame, so each takes its $N$-th part. Move the pose after $k$ links back by $k$ parts,
# $P_k' = \exp(-\tfrac{k}{N}\xi)\,P_k$, and read off the corrected links between neighbors. Then $P_N' = \exp(-\xi)\exp(\xi) = I$: the loop closes exactly. And
# every link changes by the same screw $\exp(-\xi/N)$, seen from $K_0$: by exactly its share of the angle.

# %% distribute_closure
@ex.distribute_closure
def distribute_closure(transforms):
    """Return the corrected links, shape (N, 4, 4), of a loop.

    transforms: its links T_01, ... T_(N-1)0, shape (N, 4, 4), mm.
    """
    ### BEGIN SOLUTION
    N = len(transforms)
    poses = [np.eye(4)]
    for link in transforms:
        poses.append(poses[-1] @ link)
    xi = log_se3(poses[-1])
    moved = [exp_se3(-k / N * xi) @ P for k, P in enumerate(poses)]
    return np.array([relative(A, B) for A, B in zip(moved, moved[1:])])
    ### END SOLUTION


# %% closed
links = np.array([orthonormalize(T) for T in printed])
corrected = np.array(distribute_closure(links))
gaps = [chaining.closure_error(chain(loop))[1] for loop in (links, corrected)]
much = gaps[0] > 1e6 * gaps[1]
print(f"closed: {gaps[1] < 1e-9}, by a factor of more than a million: {much}")
for k, (before, after) in enumerate(zip(links, corrected)):
    turned, moved = chaining.closure_error(relative(before, after))
    by = f"{np.rad2deg(turned):.4f} deg"
    print(f"link {k + 1}: turned by {by}, its end moved by {moved:.3f} mm")

# %% break-it [markdown]
# ## Break it
#
# Sharing out assumes small errors. Give one link a blunder of 20 mm, a point touched beside its mark, and see who pays for it: the loop closes, the culprit keeps most of its error,
# and three good links are spoiled. Then ask for the impossible: a loop that misses by half a turn.

# %% break-it-code
blunder = links.copy()
blunder[1, 0, 3] += 20.0
shared = chaining.distribute_closure(blunder)
print("it closes without complaint:", bool(np.allclose(chain(shared), np.eye(4))))
for k in range(4):
    off = np.linalg.norm((shared[k] - links[k])[:3, 3])
    print(f"link {k + 1}: wrong by {off:5.2f} mm")
try:
    chaining.distribute_closure([np.diag([-1.0, -1.0, 1.0, 1.0])])
except ValueError as refusal:
    print(refusal)

# %% beyond [markdown]
# ## Beyond the document: a pose graph (*further*)
#
# Better than equal shares: let the frames be unknowns, and let every measured link pull at its two frames with the strength of its precision. The sum of the weighted squares of
# $\log(Z_{ij}^{-1} X_i^{-1} X_j)$ over all links is least at the most likely poses (`scipy.optimize.least_squares` finds them). On one loop it closes as exactly as you just did, but
# it shares differently: it knows that a small turn with a long lever explains more than a shift.

# %% one-loop-two-ways
pairs = [(0, 1), (1, 2), (2, 3), (3, 0)]
graph = chaining.solve_pose_graph(pairs, links, std_rot=std_rot, std_trans=0.3)
simple = chaining.stations(corrected)[:4]
angles, distances = chaining.closure_error(relative(graph.poses, simple))
for k in range(1, 4):
    differ = f"{np.rad2deg(angles[k]):.3f} deg and {distances[k]:.2f} mm"
    print(f"K{k}: graph and equal shares differ by {differ}")
print(f"weighted sum of squares {graph.chi2:.1f}, expected about {graph.dof}")
print("(std_rot comes from this very loop: no test)")

# %% second-loop [markdown]
# Now a second loop. Six frames, seven links, two loops A and B with one link in common. **You share out the error of loop A, then that of loop B: what about loop A?** Decide, then pull either loop open at its ring.
# Left: the loops with their errors magnified, as measured (thin) and after sharing out; right: by how much each is still open, for each way of sharing out.

# %% predict-two-loops
guess = ...  # your code here
### BEGIN SOLUTION
guess = "it opens again"
### END SOLUTION
ex.predict("two_loops", guess, reveal=stages.two_loops)

# %% files [markdown]
# ## The sheet's files (*further*)
#
# The sheet's programs begin and end with files: `LoadSys` reads the three points of a system, `LoadSysN` eight systems (`4_2_System1.txt` to `4_2_System8.txt`), `LoadCalFrames` the poses of chapter 3 from
# `Kreisel.txt`, `SaveCal` writes the tool to `Kalibrierung.txt`. None of them is printed. So here is a form of our own: a line a point, three finite numbers $x$ $y$ $z$ in mm, origin first; what follows a `#` is a comment;
# empty lines count for nothing; some write 1,5 for 1.5.
#
# A reader has two duties. It returns what is there. And where something is wrong, it says **in one sentence what it expected, what came, and in which line**: `if (!LoadSys(...)) return EXIT_FAILURE;` tells the
# person at the machine nothing. `number_in("1.5")` is 1.5, and NaN where there is no number, as in "x" and in "1,5".

# %% read_system
@ex.read_system
def read_system(text):
    """Return origin, x_point and y_point, shape (3, 3), from the text of a file.

    Raises ValueError, naming the line, where it holds anything else than points."""
    ### BEGIN SOLUTION
    points = []
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.split("#")[0].replace(",", ".")
        entries = [number_in(entry) for entry in content.split()]
        if entries and not (len(entries) == 3 and np.isfinite(entries).all()):
            raise ValueError(f"line {number}: expected x y z, got {line!r}")
        points += [entries] if entries else []
    if len(points) != 3:
        raise ValueError(f"expected three points, got {len(points)}")
    return np.array(points)
    ### END SOLUTION


# %% write-text [markdown]
# And back. A file that is read must give the numbers that were written, all of them, to the last bit.

# %% write_system
@ex.write_system
def write_system(points):
    """Return a text from which read_system gets the same points, shape (3, 3), back."""
    ### BEGIN SOLUTION
    return "\n".join(" ".join(repr(float(v)) for v in point) for point in points)
    ### END SOLUTION


# %% round-trip
points = lab_sheet.station_points().reshape(-1, 3, 3)
texts = [write_system(three) for three in points]
back = np.array([read_system(text) for text in texts])
again = chaining.transforms_from_points(back.reshape(4, 2, 3, 3))
print("eight systems, written and read:", bool((back == points).all()))
print("the chain is the same to the last bit:", bool((again == measured).all()))
six = np.array([[f"{v:.6f}" for v in three.ravel()] for three in points]).astype(float)
lost = np.abs(six.reshape(points.shape) - points).max()
print(f"six decimals would lose up to {lost:.0e} mm")

# %% faults
good = texts[0].splitlines()
faults = [good[0], "186.6 -132,2 x"], [*good[:2], "1 2"], good[:2], [*good, good[0]]
for lines in faults:
    try:
        read_system("\n".join(lines))
    except ValueError as refusal:
        print(refusal)

# %% save-cal
import tempfile
from pathlib import Path

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "Kalibrierung.txt"
    tip = [-1.747805, 44.586360, -87.648108]
    pivot = [-253.032904, 107.040686, -3.215224]
    systems.save_calibration(path, tip, pivot)
    print(path.read_text())
    print("tip and pivot, read back:", *systems.load_calibration(path))

# %% in-practice [markdown]
# ## In practice
#
# - Close the loop whenever you can: it is the only honest check the chain offers. Give the gap as an angle *and* a distance, and in millimeters where the part will be.
# - Few long links beat many short ones. Large triangles, as in chapter 1, make small turns.
# - A closed loop proves little: an error common to all links (a wrong scale) closes perfectly.
# - Orthonormalize after long products, and check before you share out: a closure far above the expected one is a blunder, not noise.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. All four links are too long by one percent, and the loop still closes. How is that possible, and what measurement would show it?
# 2. Why does a turning error of the last link turn the loop's end, but not move it? And what does an error of that link's translation do?
# 3. The closure angle is the same whether you start the loop at $K_0$ or at $K_2$; the closure distance is not. Why?

# %% progress
ex.progress()
