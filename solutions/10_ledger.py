# %% title [markdown]
# # 10 · The ledger
#
# **What you will do.** Look up what the four documents print as a result or claim, and judge a few rows yourself.
#
# **What you will learn.** What a printed digit hides, what it takes to call a number a misprint, and what a document must publish so that
# others can check it.
#
# **What you need.** Any of the chapters before. About 60 minutes, and as long as the table keeps you.

# %% notation [markdown]
# | status | meaning |
# | --- | --- |
# | reproduced | equal to the printed digits |
# | rounding | off by no more than half a unit of the last digit plus what the digits of the printed inputs leave open: the *bound*, propagated from them |
# | cut off | the digits were truncated instead of rounded |
# | misprint | what is printed around it proves another value, and no single slip elsewhere explains it as well |
# | contradiction | two printed things exclude each other, and the data cannot tell which is wrong |
# | refuted | a claim, computable from printed inputs alone, does not hold |
# | consistent | inputs unpublished: a reconstruction agrees. It proves possibility, not truth |
# | not computable | inputs unpublished, and no reconstruction decides it |
#
# Only *results* and *claims* are counted. A *check* is an input printed twice, a *structure* holds whatever was measured (a row 0 0 0 1), a *consequence* follows from another row.

# %% setup
from functools import partial

import numpy as np
from IPython.display import HTML, Markdown

from labkit.chapters.ch10_ledger.table import LedgerTable
from labkit.documents import ledger, pages
from labkit.documents.report import printed as report
from labkit.documents.slips import single_slips
from labkit.exercises import course

ex = course("10-ledger")
found = pages.entries()

# %% the-question [markdown]
# ## The question
#
# Four documents, written with care, and read by many: the lab sheet *Kalibrierung*, a master thesis, a research report, the lecture *Lokalisierung*.
# **Which of their numbers can be trusted?** Setup has just computed all of them afresh, from the data they print and the functions of chapters 1 to 9.
# What is printed, and where, stands in `data/ledger.csv`; value, bound and status are computed by `labkit.documents`. A test moves the numbers of the tables a little and refuses a row whose value follows its own printed one.
#
# First a small one: **a document prints 0.37, its own inputs give 0.3746. What is that?** Then search the table, by words, kind, status and document: *why* opens a row's argument, its numbers and the lines of code that compute it.

# %% predict-digits
guess = ...  # your code here
### BEGIN SOLUTION
guess = "reproduced"
### END SOLUTION
ex.predict("digits", guess, reveal=partial(LedgerTable, found))

# %% half-unit-text [markdown]
# ## What a digit hides
#
# A printed number is an interval. Half a unit of its last digit may have been rounded away: 1.05 can be anything from 1.045 to 1.055. Mind the decimal comma of the
# German and Czech documents, and exponents.


# %% half_unit
@ex.half_unit
def half_unit(printed):
    """Return half a unit in the last digit of a printed number, a string such as
    "1.010000", "-0,5", "12", "3e-4" or "1.2e+03"."""
    ### BEGIN SOLUTION
    number, _, exponent = printed.partition("e")
    decimals = len(number.replace(",", ".").partition(".")[2])
    return 0.5 * 10.0 ** (int(exponent or 0) - decimals)
    ### END SOLUTION


# %% bound-text [markdown]
# ## What the inputs hide
#
# A result computed from printed numbers inherits what each of them hides. Move one input at a time by its half unit, up and down, and see how far the result
# goes; the larger move counts, and the moves of all inputs add up. That is the *bound* of the table; what several moves at once do beyond their sum is left out. Where inputs were never published, it is what a reconstruction leaves open.


# %% bound
@ex.bound
def bound(f, printed):
    """Return how far rounding can move f(x): printed is a list of strings, f takes the
    array of their numbers."""
    ### BEGIN SOLUTION
    x, found = np.array([float(text.replace(",", ".")) for text in printed]), 0.0
    for k, text in enumerate(printed):
        step = half_unit(text) * np.eye(len(x))[k]
        found += max(abs(f(x + step) - f(x)), abs(f(x - step) - f(x)))
    return found
    ### END SOLUTION


# %% bound-used
def fused(z):
    """The lecture's fusion of two measured positions with variances 0.25 and 1 and the
    prior 0 with variance 20."""
    return (z[0] / 0.25 + z[1]) / (1 / 0.25 + 1 + 1 / 20)


print(f"fused: {fused([9.4, 10.6]):.4f}, bound {bound(fused, ['9.4', '10.6']):.4f}; "
      "the page prints 9.6")
sides = ["98.5415", "99.9165", "181.6006"]  # x_P' of the thesis, table 6-3
print(f"length: {np.linalg.norm([98.5415, 99.9165, 181.6006]):.4f} mm, bound "
      f"{bound(np.linalg.norm, sides):.1e} mm")

# %% status-text [markdown]
# ## The words
#
# The status follows from the printed number, the computed value, and what is known about it: a *bound*, by which the digits of the printed
# inputs can move the value; whether a *misprint* is proved, all single slips elsewhere having been tried; whether inputs had to be *simulated*. What was simulated is judged by that alone: what lands within bound
# and half unit together is *consistent*, all else decides nothing: *not computable*. Otherwise the milder word wins: *reproduced* within the half unit, *rounding* within
# half unit plus bound, *misprint* where one is proved, *contradiction* where nothing else is left. (*Cut off* and *refuted* are left out here.) Printed numbers come as strings, some with a decimal comma.
# What we chose ourselves: the order of the words, and what counts as one slip.


# %% status
@ex.status
def status(printed, value, bound, misprint, simulated):
    """Return the word for a printed string, a computed value and its bound; the other
    two are True or False."""
    ### BEGIN SOLUTION
    half, off = half_unit(printed) + 1e-9, abs(value - float(printed.replace(",", ".")))
    if simulated:
        return "consistent" if off <= half + bound else "not computable"
    if off <= half:
        return "reproduced"
    if off <= half + bound:
        return "rounding"
    return "misprint" if misprint else "contradiction"
    ### END SOLUTION


# %% suspects-text [markdown]
# ## Who slipped?
#
# Numbers that disagree accuse everybody. A *misprint* is proved when a single slip of one number explains everything, and no slip of another does. `single_slips(text)`
# lists, as texts, all numbers one slip away: a sign lost, digits swapped, one wrong, one too many, one missing, the point moved. Entries and their average were printed; find everyone who could be it. Try each slip as if it had been printed so.


# %% suspects
@ex.suspects
def suspects(entries, average):
    """Return the set of positions whose single slip explains a disagreement.

    entries: strings, no commas; average: one more, at len(entries). Rounding explains
    `bound` of the mean and half a unit of the average; if that suffices: empty.
    """
    ### BEGIN SOLUTION
    def agree(numbers):
        x, h = [float(text) for text in numbers], [half_unit(text) for text in numbers]
        return abs(np.mean(x[:-1]) - x[-1]) <= np.mean(h[:-1]) + h[-1] + 1e-12

    printed = [*entries, average]
    slips = [(k, [*printed[:k], s, *printed[k + 1 :]])
             for k in range(len(printed)) for s in single_slips(printed[k])]
    return set() if agree(printed) else {k for k, trial in slips if agree(trial)}
    ### END SOLUTION


# %% suspects-used
table = report.table_d_texts()
*runs, average, rozptyl = table[:, report.COLUMNS.index("max_mm")].tolist()
print(f"largest errors {', '.join(runs)}; average {average}: suspects "
      f"{suspects(runs, average)}")
for text in ("6", "9"):
    variance = np.var(np.array([*runs[:2], text, *runs[3:]], float))
    print(f"run 3 with {text}: variance {variance:.4f}, printed {rozptyl}")

# %% suspects-verdict [markdown]
# Two suspects: run 3, whose 6 would be a 9, or the average, which may have lost a zero (9.0468). One more printed number, the variance (*Rozptyl*), clears the average. That is what the ledger
# calls a misprint: the slip is in one place, and all that is printed around it has been asked.

# %% totals-text [markdown]
# ## The totals
#
# Results and claims by document and status, as they come out now. The cell fails if one row states another status than its computation finds.

# %% totals tags=["nbval-ignore-output"]
assert all(entry.status == entry.row.status for entry in found)
rows = [entry.row for entry in found]
Markdown(f"{pages.headline(rows)}\n\n{pages.totals_markdown(rows)}")

# %% wrong-text [markdown]
# ## What does not fit
#
# Misprints, contradictions and refuted claims, each with its argument: another printed number, a sum, an average or a geometry says otherwise.
# Our texts were made from PDFs: a digit, a sign or a point may have been lost on the way, and none of this is laid at anybody's door. A number without its data could not even be wrong.

# %% wrong tags=["nbval-ignore-output"]
HTML(pages.findings_html(found, pages.WRONG))

# %% open-text [markdown]
# ## What nobody can check
#
# Measured frames, logs, solver settings, drives shown as pictures were not published. Some reconstructions agree with what is printed, and prove that it is possible; the data of the lab
# sheet's rows were even solved from the printed answers. Which file would have turned each of these rows into a check?

# %% open tags=["nbval-ignore-output"]
HTML(pages.findings_html(found, pages.OPEN))

# %% break-it [markdown]
# ## Break it
#
# Does the ledger notice? Take three reproduced rows that print 0.99..., move the last digit of the printed number by five, and judge again.

# %% break-it-code
from dataclasses import replace

rows = [entry.row for entry in found if entry.status == "reproduced"]
rows = [row for row in rows if row.printed.startswith("0.99")][:3]
for row in rows:
    other = replace(row, printed=row.printed[:-1]
                    + str((int(row.printed[-1]) + 5) % 10))
    computed = ledger.compute(row)
    words = ledger.judge(row, computed), ledger.judge(other, computed)
    print(f"{row.id:20} printed {row.printed}: {words[0]}, if it were {other.printed}: "
          f"{words[1]}")

# %% in-practice [markdown]
# ## In practice
#
# - Print one digit more than you think you need, and the unit.
# - Publish the raw data beside the result, as a file, with the code.
# - Check a table by its own sums, means and norms before it goes to print. A rotation matrix must be orthonormal, an average lies between its entries.
# - Record corrections beside the original, with the reason. Never overwrite it.

# %% questions [markdown]
# ## Three questions, to answer in words
#
# 1. Why is *misprint* allowed only after the slips elsewhere have been tried, and what do we call a number that merely looks odd?
# 2. A row is *rounding* with a bound of 0.4 mm. What would you ask the authors for?
# 3. Pick one *not computable* row. Which is the smallest file that would have made it checkable?
#
# Chapter 11 asks the same of data of your own.

# %% progress
ex.progress()
