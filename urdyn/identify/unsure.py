"""What a fit leaves unknown of a current that it predicts."""

from __future__ import annotations

import numpy as np

from urdyn.identify.design import blocks, design
from urdyn.identify.fit import Fit
from urdyn.identify.map_estimate import linearised
from urdyn.identify.unknowns import unknowns_of
from urdyn.types import Array, Motion


def unsure(fit: Fit, motion: Motion) -> Array:
    """sd of predicted currents by what is not known of the parameters, (N, J) [A].

    i_j = Phi_j w_j(x),    var i_j = Phi_j (dw_j/dx) cov(x) (dw_j/dx)ᵀ Phi_jᵀ
    """
    unknowns = unknowns_of(fit)
    at = [fit.names.index(name) for name in unknowns.names]
    z = (fit.belief.mean[at] - unknowns.mean) / unknowns.sd
    cov = fit.belief.cov[np.ix_(at, at)] / np.outer(unknowns.sd, unknowns.sd)
    joints = range(fit.dynamics.arm.joints)
    slopes = [linearised(unknowns, [(j, None)], fit.dynamics, z)[1] for j in joints]
    own = [slope @ cov @ slope.T for slope in slopes]
    var = []
    for block in blocks(fit.dynamics, motion):
        each = map(design(fit.dynamics, block).columns, joints)
        var.append([np.sum(Phi @ C * Phi, axis=1) for Phi, C in zip(each, own, strict=True)])
    return np.asarray(np.sqrt(np.maximum(np.hstack(var).T, 0.0)))
