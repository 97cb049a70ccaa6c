"""Two streams of poses of one motion on two clocks: poses between samples, and the offset of the clocks.

The angular speed of a body is the same for every sensor on it, wherever it sits and whatever its frame, so two curves
of angular speed tell how far two clocks are apart before anything is calibrated. Times s, angles rad; gaps are never
bridged.
"""

from dataclasses import dataclass

import numpy as np

from ..checks import MOST, as_finite, as_positive, as_positive_number, as_shape, as_transforms, shown
from ..documented import documented
from ..geometry.lie import interpolate, log_so3

GAP = 3.5  # steps without a sample: more than this many median ones are a gap
SPAN = 0.3  # s over which a rotation is measured: shorter ones drown in noise; at least two steps of the slower stream
LEAST_OVERLAP = 0.3  # of the shorter stream
BLOCKS = 12  # of the jackknife: long beside the correlation of the speeds, enough to judge a spread


@dataclass(frozen=True, eq=False)
class ClockOffset:
    """How far the second clock is ahead of the first, t_b = t_a + offset (s), with its standard deviation.

    agreement: correlation of the two angular speeds where they overlap. overlap: the time both cover (s).
    """

    offset: float
    std: float
    agreement: float
    overlap: float


def longest_step(time):
    """The longest step between samples of a stream that is no gap (s)."""
    time = as_shape(time, "time", "n")
    if len(time) < 2:
        raise ValueError(f"time must hold at least two samples, got {len(time)}")
    return GAP * float(np.median(np.diff(time)))


def sample_stream(time, T, when, max_gap=None):
    """Poses of a stream at other times, interpolated at constant twist between neighbors.

    Parameters
    ----------
    time : array-like, shape (k,)
        Increasing (s).
    T : array-like, shape (k, 4, 4)
    when : array-like, shape (n,)
    max_gap : float, optional
        Neighbors farther apart are not joined (s); by default 3.5 median steps.

    Returns
    -------
    poses : array, shape (n, 4, 4)
        Identity where there is none.
    known : bool array, shape (n,)
        False before the first sample, behind the last, and in gaps.

    Raises
    ------
    ValueError
        Wrong shapes, fewer than two samples, a time that does not increase.
    """
    time, T, when = as_finite(time, "time"), as_transforms(T, "T"), as_shape(when, "when", "n")
    if T.ndim != 3 or len(T) < 2 or time.shape != T.shape[:1]:
        raise ValueError(f"time and T must have shapes (k,) and (k, 4, 4) with k >= 2, got {time.shape} and {T.shape}")
    if (np.diff(time) <= 0).any():
        raise ValueError(f"time must increase, but does not after sample {int(np.argmax(np.diff(time) <= 0))}")
    max_gap = longest_step(time) if max_gap is None else as_positive_number(max_gap, "max_gap")
    k = np.clip(np.searchsorted(time, when, side="right") - 1, 0, len(time) - 2)
    step = time[k + 1] - time[k]
    known = (when >= time[0]) & (when <= time[-1]) & ((step <= max_gap) | (when == time[k]) | (when == time[k + 1]))
    poses = np.tile(np.eye(4), (len(when), 1, 1))
    poses[known] = interpolate(T[k[known]], T[k[known] + 1], ((when - time[k]) / step)[known])
    return poses, known


@documented
def angular_speed(time, T, when, span):
    """Mean angular speed of a stream of poses around given times.

    Parameters
    ----------
    time : array, shape (k,), s
    T : array, shape (k, 4, 4)
    when : array, shape (n,), s
    span : float
        Width of the interval around each time (s).

    Returns
    -------
    speed : array, shape (n,), rad/s
        NaN where the stream does not cover the interval.
    """
    (before, known_0), (after, known_1) = (sample_stream(time, T, when + side * span / 2) for side in (-1, 1))
    turn = np.linalg.norm(log_so3(np.swapaxes(before[:, :3, :3], -1, -2) @ after[:, :3, :3]), axis=1)
    return np.where(known_0 & known_1, turn / span, np.nan)


@documented
def clock_offset(time_a, T_a, time_b, T_b, max_offset=None):
    """How far the clock of one stream is ahead of another's, from the angular speeds of the motion both saw.

    Parameters
    ----------
    time_a, time_b : array-like, shape (n,) and (m,)
        Times of the samples (s), increasing; rates and origins may differ.
    T_a, T_b : array-like, shape (n, 4, 4) and (m, 4, 4)
        Poses of anything fixed on the body, each in any frame at rest.
    max_offset : float, optional
        Search within this much (s); everywhere the streams overlap by 30 % of the shorter without it.

    Returns
    -------
    ClockOffset
        std by a jackknife over blocks of the common time, so that smooth errors do not feign precision.

    Raises
    ------
    ValueError
        When a stream does not turn, or no offset brings the two speeds together.
    """
    time_a, time_b = as_shape(time_a, "time_a", "n"), as_shape(time_b, "time_b", "m")
    if min(len(time_a), len(time_b)) < 2:
        raise ValueError(f"streams must hold at least 2 samples each, got {len(time_a)} and {len(time_b)}")
    medians = [np.median(np.diff(time)) for time in (time_a, time_b)]
    step, span = min(medians), max(SPAN, 2 * max(medians))
    as_positive(step, "the median step of both streams")
    steps = max(np.ptp(time_a), np.ptp(time_b)) / step
    if steps > MOST:
        raise ValueError(f"streams must last at most {MOST:.0e} of their median steps, got {shown(steps)}")
    grids = [np.arange(time[0] + span / 2, time[-1] - span / 2, step) for time in (time_a, time_b)]
    if min(map(len, grids)) < 2 * BLOCKS:
        raise ValueError(f"streams must hold at least {2 * BLOCKS} steps each beyond {span:.2g} s to be aligned")
    a, b = angular_speed(time_a, T_a, grids[0], span), angular_speed(time_b, T_b, grids[1], span)
    for name, speed in (("first", a), ("second", b)):
        if not np.nanstd(speed) > 1e-4:
            raise ValueError(f"the {name} stream never changes its angular speed, so its clock cannot be aligned")
    offset = _coarse(a, b, grids[0][0], grids[1][0], step, max_offset)
    b_known = np.isfinite(b)
    for _ in range(20):
        when = grids[0] + offset
        d, slope, good = _compare(a, b, b_known, grids[1], when)
        change = float((slope * d)[good].sum() / max((slope[good] ** 2).sum(), 1e-300))
        offset += float(np.clip(change, -step, step))
        if abs(change) < 1e-9:
            break
    agreement = float(np.corrcoef(a[good], (a - d)[good])[0, 1])
    if not agreement > 0.5:
        raise ValueError(
            f"no time offset brings the angular speeds together, their correlation is at best {agreement:.2f}: "
            "are they of one motion?"
        )
    return ClockOffset(offset, _jackknife(slope[good], d[good]), agreement, float(good.sum() * step))


def _compare(a, b, b_known, grid_b, when):
    """Difference a - b, the slope of b, and where both are known, at the times `when` of the second clock."""
    position = (when - grid_b[0]) / (grid_b[1] - grid_b[0])
    k = np.clip(np.floor(position).astype(int), 0, len(b) - 2)
    share = position - k
    good = np.isfinite(a) & (share >= 0) & (share <= 1) & b_known[k] & b_known[k + 1]
    slope = np.gradient(np.where(b_known, b, 0.0), grid_b)
    level, slope = ((1 - share) * v[k] + share * v[k + 1] for v in (np.where(b_known, b, 0.0), slope))
    return np.where(good, a - level, 0.0), np.where(good, slope, 0.0), good


def _coarse(a, b, start_a, start_b, step, max_offset):
    """Offset on the grid with the least mean squared difference, over all lags at once by Fourier transforms."""
    n = 1 << int(np.ceil(np.log2(len(a) + len(b))))
    seen = [np.isfinite(v).astype(float) for v in (a, b)]
    level = [np.nan_to_num(v) for v in (a, b)]

    def correlate(u, v):
        return np.fft.irfft(np.conj(np.fft.rfft(u, n)) * np.fft.rfft(v, n), n)

    count = correlate(seen[0], seen[1])
    cost = correlate(level[0] ** 2, seen[1]) + correlate(seen[0], level[1] ** 2) - 2 * correlate(level[0], level[1])
    lags = np.arange(n)
    lags[n - len(a) + 1 :] -= n
    offsets = start_b - start_a + lags * step
    allowed = count >= LEAST_OVERLAP * min(seen[0].sum(), seen[1].sum())
    if max_offset is not None:
        allowed &= np.abs(offsets) <= as_positive_number(max_offset, "max_offset")
    if not allowed.any():
        raise ValueError("the streams do not overlap enough within the offsets that may be tried")
    return float(offsets[np.argmin(np.where(allowed, cost / np.maximum(count, 1e-9), np.inf))])


def _jackknife(slope, d):
    """Standard deviation of the last Gauss-Newton step when blocks of the common time are left out in turn."""
    top = np.array([block.sum() for block in np.array_split(slope * d, BLOCKS)])
    bottom = np.array([block.sum() for block in np.array_split(slope**2, BLOCKS)])
    without = (top.sum() - top) / np.maximum(bottom.sum() - bottom, 1e-300)
    return float(np.sqrt((BLOCKS - 1) / BLOCKS * ((without - without.mean()) ** 2).sum()))
