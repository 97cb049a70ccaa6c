"""Whoever leaves weak directions out of what is solved, as a coarse `rcond` does, is refused whatever is drawn."""

import numpy as np
import pytest

from labkit.exercises import session
from labkit.exercises.outcome import CORRECT

CUT = 0.02  # of the largest singular value: below it a direction counts as none


def gate(innovation, cov_innovation, limit):
    return bool(innovation @ np.linalg.pinv(cov_innovation, rcond=CUT) @ innovation < limit)


def nearest_to_rays(origins, directions):
    d = directions / np.linalg.norm(directions, axis=1)[:, None]
    across = np.eye(3) - d[:, :, None] * d[:, None]
    return np.linalg.pinv(across.sum(0), rcond=CUT) @ (across @ origins[..., None]).sum(0)[:, 0]


def translation_lsq(A, B, R):
    rows, right = A[:, :3, :3] - np.eye(3), B[:, :3, 3] @ R.T - A[:, :3, 3]
    return np.linalg.lstsq(rows.reshape(-1, 3), right.ravel(), rcond=CUT)[0]


def li_translation(T_BF, x_S, R_FS):
    R = T_BF[:, :3, :3]
    rows = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], axis=2).reshape(-1, 6)
    right = -(T_BF[:, :3, 3] + (R @ (x_S @ R_FS.T)[..., None])[..., 0]).ravel()
    u = np.linalg.lstsq(rows, right, rcond=CUT)[0]
    return u[:3], u[3:]


def dogleg_step(g, B, radius):
    newton, corner = -np.linalg.pinv(B, rcond=CUT) @ g, -(g @ g) / (g @ B @ g) * g if g.any() else 0 * g
    if np.linalg.norm(newton) <= radius:
        return newton
    if np.linalg.norm(corner) >= radius:
        return -radius * g / np.linalg.norm(g)
    leg = newton - corner
    a, b, c = leg @ leg, corner @ leg, corner @ corner - radius**2
    return corner + (-b + np.sqrt(b * b - a * c)) / a * leg


@pytest.mark.parametrize("answer", [gate, nearest_to_rays, translation_lsq, li_translation, dogleg_step])
@pytest.mark.parametrize("seed", range(4))
def test_who_leaves_weak_directions_out_is_refused(answer, seed):
    item = next(c[answer.__name__] for c in session.chapters() if any(i.id == answer.__name__ for i in c.items))
    assert item.judge(answer, rng=np.random.default_rng(seed)).status != CORRECT


@pytest.mark.parametrize("answer", [gate, nearest_to_rays, translation_lsq, li_translation, dogleg_step])
def test_these_answers_are_right_without_the_cut(answer, monkeypatch):
    monkeypatch.setitem(globals(), "CUT", 1e-12)
    item = next(c[answer.__name__] for c in session.chapters() if any(i.id == answer.__name__ for i in c.items))
    assert item.judge(answer, rng=np.random.default_rng(0)).status == CORRECT
