"""A tool that is known, in the problem that is solved."""

from dataclasses import replace

import numpy as np

from urdyn.identify import PayloadPrior
from urdyn.identify.design import coefficients_at
from urdyn.identify.expressions import dynamics
from urdyn.identify.map_estimate import linearised
from urdyn.identify.unknowns import Unknowns
from urdyn.model.population import OPTIONAL, population
from urdyn.simulate import Payload


def test_what_is_sought_bears_the_tool_that_the_arm_bears(ur10e):
    tool = Payload(1.2, np.array([0.01, 0.0, 0.05])).inertials()
    unknowns = Unknowns(
        population(ur10e), (OPTIONAL,) * 6, None, (PayloadPrior(), PayloadPrior(3.0)), tool
    )
    z = 0.3 * np.random.default_rng(0).standard_normal(len(unknowns.mean))
    point, payloads = dynamics(unknowns, z, 0.0, np.full(6, np.nan))
    np.testing.assert_array_equal(point.payload, tool)
    for payload in (None, 0, 1):
        borne = tool if payload is None else tool + payloads[payload]
        places = [(joint, payload) for joint in range(6)]
        w = linearised(unknowns, places, point, z)[0]
        expected = coefficients_at(replace(point, payload=borne))
        np.testing.assert_allclose(w, np.concatenate(expected), rtol=1e-9, atol=1e-12)
