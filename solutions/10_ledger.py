# %% title [markdown]
# # 10 · The ledger
#
# **What you will do.** Look up every number the four documents print as a result, and judge a few yourself.
#
# **What you will learn.** What a printed digit hides, how an error in print is *proved* rather than suspected, and what a document must publish so that
# others can check it.
#
# **What you need.** Any of the chapters before. About 30 minutes, and as long as the table keeps you.

# %% notation [markdown]
# | word | meaning |
# | --- | --- |
# | reproduced | equal to the printed digits |
# | rounding | off, but by no more than half a unit of the last digit plus what the rounding of the printed inputs allows: the *bound* |
# | misprint | the arithmetic around it proves another value |
# | superseded | computable, and the document's claim does not hold |
# | unpublished | the inputs were never published; a simulation of the stated setup stands beside it |

# %% setup
from functools import partial

from IPython.display import HTML, Markdown

from labkit.chapters.ch10_ledger.table import LedgerTable
from labkit.documents import ledger, pages
from labkit.exercises import course

ex = course("10-ledger")
found = pages.entries()

# %% the-question [markdown]
# ## The question
#
# Four documents, written with care, and read by many: the lab sheet *Kalibrierung*, a master thesis, a research report, the lecture *Lokalisierung*.
# **Which of their numbers can be trusted?** Setup has just computed all of them afresh, from the data they print and the functions of chapters 1 to 9.
# Nothing on these pages is typed in: the rows stand in `data/ledger.csv`, the values come from `labkit.documents`.
#
# First a small one. Then search the table: every line shows what is printed, what is computed, and the chapter. *why* opens its argument.

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
    """Return half a unit in the last digit of a printed number, a string such as "1.010000", "-0,5", "12" or "3e-4"."""
    ### BEGIN SOLUTION
    number, _, exponent = printed.partition("e")
    decimals = len(number.replace(",", ".").partition(".")[2])
    return 0.5 * 10.0 ** (int(exponent or 0) - decimals)
    ### END SOLUTION


# %% status-text [markdown]
# ## Five words
#
# The status is not an opinion. It follows from the printed number, the computed value, and what is known about it: a *bound*, by which rounding of the printed
# inputs can move the value; whether a computed check proves a *misprint*; whether the value had to be *simulated*. A simulation that lands within bound
# and half unit together makes the row *unpublished*; one that does not shows the claim *superseded*. Otherwise the milder word wins: *reproduced* within the half unit, *rounding* within
# half unit plus bound, *misprint* where one is proved, and *superseded* where nothing else is left. Printed numbers come as strings, some with a decimal comma.

# %% status
@ex.status
def status(printed, value, bound, misprint, simulated):
    """Return the word for a printed string, a computed value and its bound; the other two are True or False."""
    ### BEGIN SOLUTION
    half, off = half_unit(printed) + 1e-9, abs(value - float(printed.replace(",", ".")))
    if simulated:
        return "unpublished" if off <= half + bound else "superseded"
    if off <= half:
        return "reproduced"
    if off <= half + bound:
        return "rounding"
    return "misprint" if misprint else "superseded"
    ### END SOLUTION


# %% totals-text [markdown]
# ## The totals
#
# Rows by document and status, as they come out now. The cell fails if one row states another status than its computation finds.

# %% totals tags=["nbval-ignore-output"]
assert all(entry.status == entry.row.status for entry in found)
Markdown(pages.totals_markdown([entry.row for entry in found]))

# %% wrong-text [markdown]
# ## What the documents got wrong
#
# Misprints and superseded claims, each with its argument. A misprint is found by computing: another printed number, a sum, an average or a geometry says otherwise.
# None of this makes the documents bad. A number without its data could not even be wrong.

# %% wrong tags=["nbval-ignore-output"]
HTML(pages.findings_html(found, pages.WRONG))

# %% unpublished-text [markdown]
# ## What was never published
#
# Measured frames, logs, drives shown as pictures: here the workbook can only simulate the stated setup and say what comes out. Which file would have turned each of these
# rows into a check?

# %% unpublished tags=["nbval-ignore-output"]
HTML(pages.findings_html(found, pages.UNPUBLISHED))

# %% break-it [markdown]
# ## Break it
#
# Does the ledger notice? Take three reproduced rows that print 0.99..., move the last digit of the printed number by five, and judge again.

# %% break-it-code
from dataclasses import replace

rows = [entry.row for entry in found if entry.status == "reproduced" and entry.row.printed.startswith("0.99")][:3]
for row in rows:
    other = replace(row, printed=row.printed[:-1] + str((int(row.printed[-1]) + 5) % 10))
    computed = ledger.compute(row)
    words = ledger.judge(row, computed), ledger.judge(other, computed)
    print(f"{row.id:20} printed {row.printed}: {words[0]}, if it were {other.printed}: {words[1]}")

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
# 1. Why is *misprint* allowed only with a computed proof, and what do we call a number that merely looks odd?
# 2. A row is *rounding* with a bound of 0.4 mm. What would you ask the authors for?
# 3. Pick one *unpublished* row. Which is the smallest file that would have made it checkable?
#
# Chapter 11 asks the same of data of your own.

# %% progress
ex.progress()
