"""How well a change of uncertain size explains information: its likelihood ratio."""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr

from urdyn.diagnose.kinds.suspects import Suspects
from urdyn.types import Array

ANY = (1.0, 5.0, 25.0)  # of a very recent change, relative to the expected size


def log_ratio(C: Array, d: Array, sd: Array, sign: int) -> Array:
    """ln of the mean over delta ~ N(0, sd²) of exp(d' delta - delta' C delta / 2), (..., m)."""
    r = d.shape[-1]
    precision = C + np.zeros_like(C)
    precision[..., range(r), range(r)] += sd**-2.0
    cov = np.linalg.inv(precision)
    mean = np.einsum("...ij,...j->...i", cov, d)
    _, logdet = np.linalg.slogdet(precision)
    ratio = 0.5 * np.sum(d * mean, axis=-1) - 0.5 * logdet - np.sum(np.log(sd), axis=-1)
    if sign:
        spread = np.sqrt(cov[..., 0, 0])
        ratio = ratio + np.log(2.0) + log_ndtr(sign * mean[..., 0] / spread)
    return np.asarray(ratio)


def instant_evidence(C: Array, d: Array, of: Suspects) -> float:
    """Evidence of a joint's best suspect, of any size, in moments [nats]."""
    best, sizes = 0.0, np.reshape(ANY, (-1, 1, 1))
    for kind, _, places, sd in of.by_kind:
        if not kind.of_tool:
            own = np.repeat(C[None, places[:, :, None], places[:, None, :]], len(ANY), axis=0)
            best = max(best, float(log_ratio(own, d[places], sizes * sd, kind.sign).max()))
    return best
