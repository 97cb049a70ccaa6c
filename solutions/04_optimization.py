# %% title [markdown]
# # 4 · Optimizers one can see
#
# **What you will do.** Build Newton, Gauss-Newton and the two decisions of a trust region on a surface you can look at, and check a published comparison of them.
#
# **What you will learn.** What a quadratic model is, what Newton makes of a place where $f$ bends down, what a sum of squares buys, how a gain ratio keeps a
# method honest, and why "reaches the minimum from far away" says little.
#
# **What you need.** Gradient, matrix, a little NumPy. About 90 minutes, in two sittings if you like, the second from
# *Gauss-Newton needs a sum of squares* on; what is marked *further* comes on top. Chapter 5 uses all of it on real robot data.

# %% notation [markdown]
# | letter | meaning |
# | --- | --- |
# | $x = (x_1, x_2)$ | the unknowns; $x^k$ is the iterate after $k$ steps. Nothing in this chapter has a unit |
# | $f$, $g = \nabla f$, $H = \nabla^2 f$ | cost, gradient, Hessian |
# | L, G, S | local minimum, global minimum, saddle of this $f$ |
# | $t$ | place on the line through both centers: 0 at $(1, 1)$, 1 at $(-1, -2)$ |
# | $r$, $J$ | residuals and their Jacobian; the cost is then $\tfrac12 |r|^2$ |
# | $h$, $\Delta$ | a step, and the radius within which it is trusted |
# | $m(h) = f + g^\top h + \tfrac12 h^\top B h$ | the quadratic model; $B$ is $H$, or $J^\top J$ |
# | $\rho$ | gain ratio: what a step brought over what the model promised |

# %% setup
import numpy as np

from labkit.chapters.ch04_optimization import stages
from labkit.documents.thesis import printed as thesis
from labkit.documents.thesis import wells
from labkit.documents.thesis.wells import stand_ins
from labkit.estimation import optimization as opt
from labkit.exercises import course

ex = course("04-optimization")
np.set_printoptions(precision=4, suppress=True)

# %% the-question [markdown]
# ## The question
#
# The master thesis *Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen* (HAW Hamburg, 2019) has to choose the method that will calibrate a
# robot's sensor. It tests three on a function it calls a *Potenzfunktion* (section 6.2, equation 6-16):
#
# $$f(x) = -\frac{100}{(x_1-1)^2+(x_2-1)^2+1} - \frac{200}{(x_1+1)^2+(x_2+2)^2+1}$$
#
# Two wells, a pass between them, a plain around them. Table 7-1 tells from how far away each method still finds the minima, and ranks
# Newton "bad", Gauss-Newton "good", trust region "very good". The text adds that **none of them finds the saddle** (*Sattelpunkt*). Is that so?

# %% gradient-text [markdown]
# ## Downhill
#
# Write $q = |x - c|^2 + 1$ for a well of depth $w$ at $c$. Then $f$ is a sum of terms $-w/q$, with $w = 100$ at $c = (1, 1)$ and $w = 200$ at
# $c = (-1, -2)$. Differentiate one of them by the chain rule, and add up both.

# %% gradient
@ex.gradient
def gradient(x):
    """Return the gradient of f at x; both have shape (2,)."""
    ### BEGIN SOLUTION
    d1, d2 = x - np.array([1, 1]), x - np.array([-1, -2])
    q1, q2 = d1 @ d1 + 1, d2 @ d2 + 1
    return 200 / q1**2 * d1 + 400 / q2**2 * d2
    ### END SOLUTION


# %% measured-text [markdown]
# ## Measure it
#
# Nobody needs a second derivation to check a derivative. Step a little to each side along one unknown, and divide the difference by the distance:
#
# $$\frac{\partial f}{\partial x_k} \approx \frac{f(x + h\,e_k) - f(x - h\,e_k)}{2h} \qquad \text{(central difference, } e_k \text{ a unit vector)}$$
#
# Its error shrinks with $h^2$, until $h$ is so small that rounding takes over; chapter 5 looks for the best step. It works for every function, so write it for any number of unknowns.

# %% measured_gradient
@ex.measured_gradient
def measured_gradient(f, x, h):
    """Return the gradient of f at x, shape (n,), by central differences.

    f: takes an array of shape (n,), returns a number; x: shape (n,); h: the step.
    """
    ### BEGIN SOLUTION
    return np.array([(f(x + e) - f(x - e)) / (2 * h) for e in h * np.eye(len(x))])
    ### END SOLUTION


# %% compare-gradient
x = np.array([0.3, -0.4])
off = np.abs(gradient(x) - measured_gradient(wells.value, x, 1e-4)).max()
print(f"your gradient at {x}: {gradient(x)}")
print("within 1e-4 of the measured one:", off < 1e-4)

# %% one-line [markdown]
# ## Everything happens on one line
#
# The gradient is a positive number times $x - c_1$ plus another times $x - c_2$. It can vanish only where both pull in opposite directions: **on the
# straight line between the centers.** Both minima (L and G) and the saddle (S) lie on it.
#
# Newton's idea: lay a parabola on $f$ where you stand, with the right height, slope and curvature, and go to its vertex. **From a fifth of the way to $(-1, -2)$, where $f$ bends downward, where does Newton end?** Decide, then drag the start
# (or focus it and press the arrow keys). The triangle at the bottom marks the vertex. *Make it fail* goes to a place where the parabola is nearly straight.

# %% predict-top
guess = ...  # your code here
### BEGIN SOLUTION
guess = "on the pass between the wells"
### END SOLUTION
ex.predict("top", guess, reveal=stages.line)

# %% hessian-text [markdown]
# ## Curvature
#
# In two dimensions the curvature is a matrix. Differentiate $g = \tfrac{2w}{q^2}(x - c)$ once more; the product rule gives
#
# $$H = \frac{2w}{q^2}\,I - \frac{8w}{q^3}\,(x-c)(x-c)^\top \qquad \text{for each well.}$$
#
# The first part is a round bowl. The second flattens it in the direction away from the center, and beyond $|x - c| = 1/\sqrt3$ bends it downward.

# %% hessian
@ex.hessian
def hessian(x):
    """Return the Hessian of f, shape (2, 2), at x, shape (2,)."""
    ### BEGIN SOLUTION
    H = np.zeros((2, 2))
    for w, c in ((100, np.array([1, 1])), (200, np.array([-1, -2]))):
        d = x - c
        q = d @ d + 1
        H += 2 * w / q**2 * np.eye(2) - 8 * w / q**3 * np.outer(d, d)
    return H
    ### END SOLUTION


# %% listing-c7 [markdown]
# ## Against the document: listing C7
#
# The thesis prints the Hessian twice, as formulas (listing C7) and as MATLAB code (C9). They differ. Who is right? Row $k$ of the Hessian is the gradient of component $k$ of the
# gradient, and a gradient can be *measured*. (If you wrote your own Hessian by differences, the check took it, and rightly so. But now
# it would be compared with itself: write the two formulas above first.)

# %% compare-listing-c7
rows = [measured_gradient(lambda y, k=k: gradient(y)[k], x, 1e-5) for k in (0, 1)]
measured = np.array(rows)
for name, H in (("yours", hessian(x)), ("listing C7", wells.printed_hessian(x))):
    entries = f"H11 {H[0, 0]:8.3f}  H12 {H[0, 1]:8.3f}  H22 {H[1, 1]:8.3f}"
    print(f"{name:10}  {entries}   off by {np.abs(H - measured).max():.3f}")

# %% listing-c7-verdict [markdown]
# Listing C7, in the text we have (made from a PDF), is wrong on the diagonal: $H_{11}$ ends in $-(-1600(x_1-1)^2)$ where $-1600(x_1+1)^2$ belongs, and $H_{22}$ repeats $H_{11}$ instead of using $x_2$.
# The code in C9, which computed the results, is right.
#
# ## What kind of place is it?
#
# A vanishing gradient is necessary for a minimum. Sufficient is: all eigenvalues of $H$ positive as well (section 2.4.3).

# %% classify_extremum
@ex.classify_extremum
def classify_extremum(g, H):
    """Return the kind of a point with gradient g (2,) and Hessian H (2, 2).

    It is one of these words: "minimum", "maximum", "saddle" or, where |g| > 1e-6,
    "not stationary". No eigenvalue of H is 0.
    """
    ### BEGIN SOLUTION
    if np.linalg.norm(g) > 1e-6:
        return "not stationary"
    eigenvalues = np.linalg.eigvalsh(H)
    if (eigenvalues > 0).all():
        return "minimum"
    return "maximum" if (eigenvalues < 0).all() else "saddle"
    ### END SOLUTION


# %% newton-text [markdown]
# ## Newton's step
#
# The model $m(h) = f + g^\top h + \tfrac12 h^\top H h$ is stationary where its gradient $g + H h$ vanishes. The thesis has it right in (2-24),
# and its (2-27) subtracts the $d$ of (2-25); only (2-26), in our text of it, has an inverse too many and a minus sign. Take (2-26) literally from $(-0.9, -1.9)$ and you land 17 700 away.

# %% newton_step
@ex.newton_step
def newton_step(g, H):
    """Return the step h, shape (2,), to where the model is stationary.

    g: shape (2,); H: shape (2, 2).
    """
    ### BEGIN SOLUTION
    return np.linalg.solve(H, -g)
    ### END SOLUTION


# %% saddle-text [markdown]
# ## Find the saddle
#
# The table in section 6.2 gives the saddle as $(0.105, -0.205)$. That point does not even lie on the line between the centers. Find the real one with
# your own three functions.

# %% saddle
saddle = ...  # your code here
### BEGIN SOLUTION
saddle = np.zeros(2)
for _ in range(10):
    saddle = saddle + newton_step(gradient(saddle), hessian(saddle))
### END SOLUTION
saddle = ex.saddle(saddle)

# %% compare-extrema
places = (0.979, 0.968), (-0.995, -1.992), (0.105, -0.205)
for name, printed, e in zip(wells.NAMES, places, wells.extrema()):
    kind = classify_extremum(gradient(e.x), hessian(e.x))
    slope = np.linalg.norm(gradient(np.array(printed)))
    off = np.linalg.norm(e.x - printed)
    there = f"printed {printed}, |g| there {slope:.3f}"
    print(f"{name:15} {there}; the computed one is {off:.4f} away: {kind}")

# %% saddle-statement [markdown]
# ## "A saddle must be hit exactly"
#
# Rounding to three digits explains slopes up to about 0.3 in the wells and 0.05 at the pass, not 2.5. And you have just found the saddle: for Newton's step a start beside it is enough. Section 7.1.1 says that no method finds it and that one would have to hit "exactly" the point (*exakt der Punkt*);
# section 2.5.2 of the same thesis says that Newton cannot tell a saddle from a minimum. How large is the neighborhood from which Newton ends in it?
#
# In the figure the thin lines are the two directions of curvature, solid where $f$ bends up, dashed where it bends down. The two blue bars are the Newton step,
# one part along each direction. Where it bends down, Newton goes *up*. Switch to the trust region for comparison.

# %% predict-neighborhood
guess = ...  # your code here
### BEGIN SOLUTION
guess = "within 0.7 of it"
### END SOLUTION
ex.predict("neighborhood", guess, reveal=stages.saddle)

# %% convex-text [markdown]
# ## Where is f convex? (*further*)
#
# Were $f$ **convex**, every place where the gradient vanishes would be a global minimum (section 2.4.2): no saddle to end in, no second well. The thesis gives two tests. By the *chord*:
#
# $$f\big((1-\lambda)x + \lambda y\big) \le (1-\lambda)\,f(x) + \lambda\,f(y) \qquad \text{for all } x, y \text{ in the set and } 0 \le \lambda \le 1,$$
#
# and by the *Hessian*, which must have no negative eigenvalue anywhere in it. The first asks about pairs of places, the second about one place at a time, but at all of them. (Strict convexity
# the thesis equates with a *positive definite* Hessian everywhere. That is sufficient, not necessary: $x^4$ is strictly convex, and its second derivative at 0 is 0.)
#
# Decide how much of the square from $-6$ to 6 passes the second, then drag P and Q. Where is $H$ positive definite? Does it help that it is, at P and at Q? And what does the other matrix say, $2J^\top J$? (The next section tells where it comes from: Gauss-Newton takes it in place of $H$.)

# %% predict-convex_share
guess = ...  # your code here
### BEGIN SOLUTION
guess = "about 1 %"
### END SOLUTION
ex.predict("convex_share", guess, reveal=stages.convexity)

# %% chord-text [markdown]
# $2J^\top J$ is positive definite everywhere: every step made with it sets out downhill. That does not make $f$ convex; it only makes each *model* so, and the wells stay two.
#
# The chord needs no derivative at all. Write the test. The cell after it draws 300 chords in each of four disks around L, G and S. In which of them does $f$ rise above some?

# %% rise_above_chord
@ex.rise_above_chord
def rise_above_chord(f, x, y, n):
    """Return by how much f rises above its chord from x to y at most, a number.

    f: takes shape (d,), returns a number; x, y: shape (d,); n: how many evenly spaced
    places are looked at, both ends included, so that the result is never below 0.
    """
    ### BEGIN SOLUTION
    shares = np.linspace(0, 1, n)
    values = np.array([f((1 - t) * x + t * y) for t in shares])
    return (values - ((1 - shares) * f(x) + shares * f(y))).max()
    ### END SOLUTION


# %% chords
L, G, S = (e.x for e in wells.extrema())
rng = np.random.default_rng(1)
disks = ("L", L, 0.4), ("L", L, 1.0), ("G", G, 0.4), ("S", S, 0.4)
for name, center, radius in disks:
    ends = center + radius * rng.uniform(-1, 1, (300, 2, 2)) / np.sqrt(2)
    rises = np.array([rise_above_chord(wells.value, x, y, 21) for x, y in ends])
    above = (rises > 1e-9).sum()
    print(f"disk of {radius} around {name}: f rises above {above:3} of 300 chords")

# %% squares-text [markdown]
# ## Gauss-Newton needs a sum of squares
#
# Gauss-Newton (section 2.5.3) has no Hessian. It minimizes $\tfrac12|r(x)|^2$ by linearizing the *residuals*: $r(x + h) \approx r + J h$, a linear least-squares problem.
# The thesis never says which residuals it made from the scalar $f$. Here are ours: since $w - w/q = w\,|x-c|^2/q$,
#
# $$f + 300 = |r|^2 \quad\text{with}\quad r = \left(\sqrt{\tfrac{100}{q_1}}\,(x - c_1),\ \sqrt{\tfrac{200}{q_2}}\,(x - c_2)\right),$$
#
# four residuals with the same minima and the same saddle. Their Jacobian $J$ is what Gauss-Newton lives on: one row a residual, one column an unknown. For
# one well, product rule and $\nabla q = 2(x - c)$ give $\sqrt{w/q}\,\left(I - (x-c)(x-c)^\top/q\right)$, two rows.

# %% jacobian
@ex.jacobian
def jacobian(x):
    """Return J, shape (4, 2), of the residuals at x, shape (2,).

    The rows of the well at (1, 1) come first.
    """
    ### BEGIN SOLUTION
    blocks = []
    for w, c in ((100, np.array([1, 1])), (200, np.array([-1, -2]))):
        d = x - c
        q = d @ d + 1
        blocks.append(np.sqrt(w / q) * (np.eye(2) - np.outer(d, d) / q))
    return np.vstack(blocks)
    ### END SOLUTION


# %% step-text [markdown]
# With $r$ and $J$ a step is a linear least-squares problem, like that of chapter 3. The thesis's (2-32) prints its solution with $J F$; with four residuals and two unknowns
# that product does not exist. A transpose is missing.
#
# Where the residuals bend, that step goes too far. **Levenberg and Marquardt** charge for its length: they minimize $|r + J h|^2 + \lambda |h|^2$. With $\lambda = 0$ that is
# Gauss-Newton. Where does its gradient vanish, and which way does the step turn as $\lambda$ grows?

# %% damped_step
@ex.damped_step
def damped_step(r, J, damping):
    """Return the step h, shape (n,), that minimizes |r + J h|^2 + damping |h|^2.

    r: shape (m,); J: shape (m, n), m >= n; damping: a number, 0 or positive.
    """
    ### BEGIN SOLUTION
    return -np.linalg.solve(J.T @ J + damping * np.eye(J.shape[1]), J.T @ r)
    ### END SOLUTION


# %% gain-text [markdown]
# ## Trust, but measure
#
# $J^\top J$ has no negative eigenvalues, so Gauss-Newton points downhill; but nothing limits how far it goes. A **trust region** asks after every step: how much did $f$
# really fall, and how much had the model promised? That is $\rho$ in (2-36). Up to 0.1 the step is taken back; below ¼ the radius shrinks; above ¾, at the rim, it doubles.
# **Levenberg-Marquardt** turns the same knob under another name, $\lambda$: larger after a poor step, smaller after a good one.

# %% gain_ratio
@ex.gain_ratio
def gain_ratio(cost, new_cost, g, B, step):
    """Return actual over predicted decrease, a number.

    cost and new_cost: numbers, before and after the step; g, step: shape (2,);
    B: shape (2, 2).
    """
    ### BEGIN SOLUTION
    predicted = -(g @ step) - 0.5 * step @ B @ step
    return (cost - new_cost) / predicted
    ### END SOLUTION


# %% dogleg-text [markdown]
# ## Inside the radius: the dogleg
#
# Minimizing $m$ on a disk exactly takes an inner iteration. Powell's dogleg is a bent path that is nearly as good: from 0 down the gradient to the lowest
# point in that direction, the *corner* $p = -\tfrac{g^\top g}{g^\top B g}\,g$, and from there along the leg $l = -B^{-1}g - p$ to the Newton point. Follow it until the path ends or the rim cuts it:
# on the first leg at $-\Delta\,g/|g|$, on the second at $p + s\,l$ with $s = (-b + \sqrt{b^2 - ac})/a$, where $a = l^\top l$, $b = p^\top l$, $c = p^\top p - \Delta^2$. Never leaving the first leg gives the Cauchy point (2-39).

# %% dogleg_step
@ex.dogleg_step
def dogleg_step(g, B, radius):
    """Return the dogleg step, shape (2,), no longer than radius (a positive number).

    g: gradient, shape (2,); B: curvature of the model, shape (2, 2), positive definite.
    """
    ### BEGIN SOLUTION
    newton = np.linalg.solve(B, -g)
    corner = -(g @ g) / (g @ B @ g) * g
    if np.linalg.norm(newton) <= radius:
        return newton
    if np.linalg.norm(corner) >= radius:
        return -radius * g / np.linalg.norm(g)
    leg = newton - corner
    a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2
    return corner + (-b + np.sqrt(b * b - a * c)) / a * leg
    ### END SOLUTION


# %% assemble-text [markdown]
# ## Your parts, assembled (*further*)
#
# A trust region is a loop around the two. In each round: $g = J^\top r$ and $B = J^\top J$ where you stand, a dogleg step, and $\rho$ of the cost $\tfrac12 r^\top r$. Then two decisions:
#
# - The step is *taken* where $\rho > 0.1$; otherwise $x$ stays.
# - The *radius* becomes a quarter of the step's length where $\rho < \tfrac14$. It doubles where $\rho > \tfrac34$ and the step is longer than 0.999 of it. Otherwise it stays.
#
# The check has up to four unknowns, so whatever you call from the loop, your `dogleg_step` for instance, must take more than two.

# %% trust_region
@ex.trust_region
def trust_region(residual, jacobian, x, radius, steps):
    """Return x, shape (n,), and the radius, a number, after so many rounds (steps).

    residual(x): (m,); jacobian(x): (m, n); x, radius: those of the start."""
    ### BEGIN SOLUTION
    for _ in range(steps):
        r, J = residual(x), jacobian(x)
        g, B = J.T @ r, J.T @ J
        step = dogleg_step(g, B, radius)
        new, length = residual(x + step), np.linalg.norm(step)
        rho = gain_ratio(r @ r / 2, new @ new / 2, g, B, step)
        x = x + step if rho > 0.1 else x
        wider = 2 * radius if rho > 0.75 and length > 0.999 * radius else radius
        radius = length / 4 if rho < 0.25 else wider
    return x, radius
    ### END SOLUTION


# %% assemble
start = np.array([10.0, 10.0])
for steps in range(9):
    x, radius = trust_region(wells.residual, jacobian, start, 1.0, steps)
    print(f"{steps} rounds: x = {x}, radius {radius:.3f}, f = {wells.value(x):.2f}")

# %% assembled [markdown]
# Which round took no step, and what did the next one do better? `opt.trust_region` is the same loop with more care: unknowns of unlike units, stopping rules, poses as well as vectors.

# %% four-text [markdown]
# ## Four paths on one map
#
# Now all four from the same start. Newton and the trust region (*Trust-Region-Verfahren*) use the true Hessian, Gauss-Newton and Levenberg-Marquardt the sum of squares. Blue lines are
# the chosen method's model at the chosen iteration, the dashed circle its radius, the thick bar its step. **How many of the four reach the global minimum from $(3, 3)$?** Nobody works this out in the head, so guess; then drag the start and the iteration.

# %% predict-four
guess = ...  # your code here
### BEGIN SOLUTION
guess = "one"
### END SOLUTION
ex.predict("four", guess, reveal=stages.four_paths)

# %% table-text [markdown]
# ## Against the document: table 7-1 (*further*)
#
# Listing C8 stops once $|g_1| + |g_2| \le 10^{-10}$, with the gradient from *before* the last step. With that rule and the printed starts Newton should need 9 and
# 7 iterations. For the other two methods nothing is published but listing C6, a screenshot of MATLAB's toolbox as set for the robot: *trust region*, derivatives *approximated by solver*. MATLAB's
# documentation says that `fminunc` then runs a quasi-Newton method instead, because its trust region needs the gradient supplied. SciPy's BFGS is such a method.
# Nobody knows which programs made the two columns. Five methods that may have been meant stand in for them below. Where does each of these *stand-ins* end, from the
# thesis's farthest starts?

# %% table-7-1
for start in ((1.25, 1.25), (-1.25, -2.25)):
    run = wells.run("newton", start, stop=opt.small_gradient_before(1e-10))
    print(f"Newton from {start}: {run.iterations} iterations to {run.solution}")
print("printed: 9 to (0.9789, 0.9684), 7 to (-0.9948, -1.9922)\n")
claims = (4.3, "GN: local"), (35, "GN: global"), (4.5, "TR: local"), (45, "TR: global")
names = {"GN": "Gauss-Newton", "LM": "Levenberg-M.", "dogleg": "TR, dogleg"}
names |= {"exact": "TR, exact", "BFGS": "BFGS"}
print(f"{'start':12}{'thesis':22}", *(f"{name:13}" for name in names.values()))
for s, claim in claims:
    ends = stand_ins((s, s))
    words = [f"{wells.NAMES[ends[key][0]].split()[0]:13}" for key in names]
    print(f"{f'({s:g}, {s:g})':12}{claim:22}", *words)

# %% table-verdict [markdown]
# The Newton column comes out to the iteration. Of the five stand-ins only BFGS ends where the table says from all four other starts. How much is that worth?
# Suppose that every landing were the toss of a coin, L or G. How likely is it that **at least one of five** stand-ins has all four landings right?

# %% luck
luck = ...  # your code here
### BEGIN SOLUTION
luck = 1 - (1 - 0.5**4) ** 5
### END SOLUTION
luck = ex.luck(luck)

# %% luck-verdict [markdown]
# So four landings are weak evidence, and two of the four starts are Gauss-Newton's. Together with the documented fallback of `fminunc` they *suggest* that the praised trust
# region was a quasi-Newton method. The deviations that table 7-1 prints beside its results, as $\mu$, measure no accuracy either: each is an iterate with four digits minus an "ideal" one with two.
#
# And "the farthest start"? Decide how much of the square from $-6$ to 6 leads Newton to a minimum, then rub it free for all four methods.

# %% predict-share
guess = ...  # your code here
### BEGIN SOLUTION
guess = "less than 1 %"
### END SOLUTION
ex.predict("share", guess, reveal=stages.basins)

# %% farthest-text [markdown]
# The ranking of table 7-1 stands. But look along its diagonal: below is one letter for each start $(1, 1), (2, 2), \dots, (60, 60)$, a dash for one that runs away.
# For the methods that always arrive there *is* no farthest start: L and G take turns to the end. Where a start at 45 lands is chance, not stability.

# %% farthest
diagonal = np.repeat(np.arange(1, 60.1)[:, None], 2, axis=1)
square = np.stack(np.meshgrid(*2 * [np.linspace(-6, 6, 121)]), axis=-1)
letters = np.array(["L", "G", "S", "-"])
for method in wells.METHODS:
    ends, _ = wells.destinations(method, diagonal)
    ends_in_square, _ = wells.destinations(method, square)
    share = (ends_in_square < 2).mean()
    print(f"{method:20}", "".join(letters[ends]), f"{100 * share:5.1f} % of the square")

# %% classes [markdown]
# ## Which problem, which solver? (*further*)
#
# Before the method comes the problem. The thesis writes it as: minimize $f(x)$, subject to $g_i(x) = 0$ and $h_i(x) \le 0$ (2-13 to 2-15), and sorts by what these are (table 2-2).
#
# | problem | what is special | solver, for instance in SciPy |
# | --- | --- | --- |
# | linear | $f$, $g$, $h$ linear: convex, the minimum in a corner | `linprog` |
# | quadratic | $f$ quadratic, $g$, $h$ linear; convex where $B$ has no negative eigenvalue | `lstsq`, `lsq_linear` |
# | nonlinear, a sum of squares | residuals at hand: $J$ is enough | `least_squares`: Gauss-Newton's relatives |
# | nonlinear, smooth | local minima, saddles | `minimize`: trust region, BFGS |
# | integer | some unknowns whole numbers | `milp`, where all else is linear |
#
# Calibrating a scanner is the third kind: residuals, six unknowns, no condition. It could also be written with the nine entries of a rotation matrix and the condition $R^\top R = I$. Drop
# that condition and the rest is the second kind, convex and solved at once: this is how chapter 5 finds a start without a guess.
#
# Section 4.1 chooses *what to look at* by adding up points, section 5.2 the method by words in four levels. Recompute both.

# %% tables-4-1-and-5-2
for name, row in thesis.table_4_1().items():
    points = row["points"].astype(int)
    printed, most = f"{row['sum']:.0f}/{row['of']:.0f}", 10 * len(points)
    print(f"{name:14} {points} printed {printed}, computed {points.sum()}/{most}")
for name, levels in thesis.table_5_2().items():
    print(f"{name:35} {levels}  {levels.sum()} of 16")

# %% tipping-text [markdown]
# The sums are right; the "/50" is not: four criteria of at most 10 points make 40. (A fifth criterion may have been dropped, or lost on its way to our text.) In table 5-2, Gauss-Newton and
# Levenberg-Marquardt have full marks, and the trust region, which is chosen, four or five less: the text weighs three things above the rest and does not say how much.
#
# Such sums hide weights of 1. Suppose that *solving*, the last criterion of table 4-1, counts $w$ times and the other three once (this $w$ is a weight, no depth of a well). **From which $w$ on does the cube win over the sphere?**

# %% tipping_weight
tipping_weight = ...  # your code here
### BEGIN SOLUTION
sphere, cube = (thesis.table_4_1()[name]["points"] for name in ("sphere", "cube"))
tipping_weight = (sphere[:3].sum() - cube[:3].sum()) / (cube[3] - sphere[3])
### END SOLUTION
tipping_weight = ex.tipping_weight(tipping_weight)

# %% break-it-text [markdown]
# ## Break it
#
# A stopping rule can lie. Out on the plain the gradient fades, and "the gradient is small" is true and worthless. Ask for the place and the kind as well. Even
# the kind can be fooled, when "vanishes" means an absolute $10^{-6}$: `opt.classify_extremum` compares $|g|$ with the curvature instead. And where an eigenvalue is 0, its
# word is "degenerate": $x^4$ and $-x^4$ have the same $g$ and $H$ at 0, and only higher derivatives tell a minimum from a maximum.

# %% break-it
run = wells.run("newton", (3.0, 3.0))
print(f"{run.reason} after {run.iterations} steps: converged = {run.converged}")
g, H = gradient(run.solution), hessian(run.solution)
far, slope = np.linalg.norm(run.solution), np.linalg.norm(g)
print(f"|x| = {far:.0f}, f = {run.cost[-1]:.1e}, |g| = {slope:.0e}")
print(f"largest curvature {np.abs(np.linalg.eigvalsh(H)).max():.0e}")
print(f"your classify_extremum: {classify_extremum(g, H)}")
print(f"opt.classify_extremum:  {opt.classify_extremum(g, H)}")

# %% beyond [markdown]
# ## Beyond the document: widen the wells (*further*)
#
# Each term of $f$ is a *robust loss*: a pull toward a center that fades with distance, as one wants it for outliers. Its width is 1. Make it 8 and the two wells
# merge into one; follow its minimum while the width shrinks. This is *graduated non-convexity*, and chapter 5 uses robust losses on real data.

# %% widen
ends = []
for start in np.random.default_rng(4).uniform(-40, 40, (40, 2)):
    lowest = start
    for width in (8.0, 4.0, 2.0, 1.0):
        lowest = wells.run("trust_region", lowest, width=width).solution
    ends.append(wells.NAMES[wells.which(lowest)])
print({name: ends.count(name) for name in wells.NAMES})

# %% in-practice [markdown]
# ## In practice
#
# - Write your problem as residuals whenever you can: no second derivatives, and a curvature that never points uphill.
# - Never run undamped far from the solution. Levenberg-Marquardt or a trust region costs one gain ratio per step.
# - Check derivatives by central differences before you trust any result.
# - Report start, end, kind, reason for stopping and the number of *rejected* steps. Try several starts.
# - A good start beats a good optimizer. Chapter 5 computes one without iteration.
#
# ## Three questions, to answer in words
#
# 1. Newton ends in the saddle more often than in both minima together. Why is a root of the gradient with mixed curvature no worse for it than a minimum?
# 2. Gauss-Newton and Newton use different matrices for the same cost $\tfrac12|r|^2 = \tfrac12 f + 150$: $J^\top J$ and $\tfrac12 H$. Where do the two come close, and what does that say about residuals that are small at the solution?
# 3. A colleague reports: "converged, gradient below 1e-10". Which two further numbers do you ask for, and why?

# %% progress
ex.progress()
