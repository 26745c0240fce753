"""A tool that is known, in the problem that is solved."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.identify import PayloadPrior, identify
from urdyn.identify.batch import _borne
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


@pytest.mark.parametrize(
    "tool", [1.2, [1.2], [-1.0, *[0.0] * 9], [1.0, 0.1, *[0.0] * 8], [np.nan] * 10]
)
def test_a_tool_that_no_body_is_like_is_refused(ur5e, motion, tool):
    with pytest.raises(InputError, match="tool"):
        identify(ur5e, motion, tool=tool)


def test_nothing_a_point_and_a_ball_are_tools():
    ball = Payload(1.2, np.array([0.1, 0.0, 0.06])).inertials()
    for tool in (np.zeros(10), np.eye(10)[0], ball):
        np.testing.assert_array_equal(_borne(tool), tool)
