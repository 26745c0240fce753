"""The moving arm: energy, MuJoCo's opinion, and agreement with the equation it is made of."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.library import find
from urdyn.model.population import population
from urdyn.simulate.plant import Gears, Plant, PlantState, Surroundings

ARMATURE = np.array([8.0, 8.0, 2.0, 0.5, 0.5, 0.5])
VISCOUS = np.array([30.0, 40.0, 20.0, 6.0, 6.0, 6.0])


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur10e")


def around(joints: int) -> Surroundings:
    one, zero = np.ones(joints), np.zeros(joints)
    return Surroundings(zero, one, one, zero, np.full(joints, np.nan))


def frictionless(arm, viscous) -> Dynamics:
    """The published arm with nothing but rotors and viscous friction."""
    typical = population(arm).typical()
    zero = np.zeros(arm.joints)
    drive = replace(
        typical.drive,
        rotor_inertia=ARMATURE,
        coulomb=zero,
        structural=zero,
        offset=zero,
        viscous=viscous,
    )
    return Dynamics(arm, arm.inertials, drive)


def energy(dynamics: Dynamics, x: PlantState) -> float:
    """Kinetic energy of links and rotors; the potential by the work of gravity is left to tests."""
    zero = np.zeros_like(x.q)
    mass = dynamics.arm.torque_derivatives(x.q, zero, zero, dynamics.loaded())[2]
    links = 0.5 * x.v @ mass @ x.v
    return float(links + 0.5 * dynamics.drive.rotor_inertia @ x.omega**2)


@pytest.mark.parametrize("falls", [3, pytest.param(10, marks=pytest.mark.slow)])
def test_a_falling_arm_falls_as_in_mujoco(arm, falls):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(find("ur10e")))
    model.opt.timestep, model.opt.integrator = 2e-4, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    model.dof_armature[:], model.dof_damping[:] = ARMATURE, VISCOUS
    plant, rng = Plant(frictionless(arm, VISCOUS)), np.random.default_rng(0)
    for _ in range(falls):
        data = mujoco.MjData(model)
        q, v = rng.uniform(-2.0, 2.0, 6), rng.uniform(-0.5, 0.5, 6)
        data.qpos[:], data.qvel[:] = q, v
        for _ in range(25_000):
            mujoco.mj_step(model, data)
        x = replace(PlantState.rest(q), v=v, omega=v)
        for _ in range(5_000):
            x = plant.step(x, np.zeros(6), around(6), 1e-3)
        assert np.abs(x.q - data.qpos).max() < 1e-3


@pytest.mark.parametrize("gears", [None, Gears(np.full(6, 5e3), np.full(6, 0.5))])
def test_energy_is_neither_made_nor_lost(arm, gears):
    dynamics = population(arm).draw(np.random.default_rng(3))
    plant = Plant(dynamics, gears)
    h = 1e-3 if gears is None else 5e-5
    x = PlantState.rest(np.array([0.0, -1.2, 0.8, 0.1, 0.2, 0.3]))
    work = lost = weight = sprung = 0.0
    for k in range(int(0.5 / h)):
        tau = 30.0 * np.sin(np.arange(6) + 6.0 * k * h) * np.array([3, 3, 2, 0.3, 0.3, 0.3])
        y = plant.step(x, tau, around(6), h)
        omega, v = 0.5 * (x.omega + y.omega), 0.5 * (x.v + y.v)
        gravity = dynamics.arm.torque(0.5 * (x.q + y.q), 0 * v, 0 * v, dynamics.loaded())
        work += h * tau @ omega
        lost += h * y.lost @ omega
        weight += h * gravity @ v
        if gears is not None:
            sprung += h * y.load @ (omega - v)
        x = y
    stored = energy(dynamics, x) + weight
    assert abs(work - lost - sprung - stored) < 1e-3 * (abs(work) + abs(lost))


def test_stiff_gears_are_rigid_gears(arm):
    dynamics = frictionless(arm, VISCOUS)
    stiff = Gears(np.full(6, 2e4), np.full(6, 2.0))
    start = PlantState.rest(np.array([0.3, -1.0, 0.5, 0.2, -0.4, 0.1]))
    rigid = elastic = start
    for _ in range(300):
        rigid = Plant(dynamics).step(rigid, np.zeros(6), around(6), 1e-3)
    soft = Plant(dynamics, stiff)
    for _ in range(6_000):
        elastic = soft.step(elastic, np.zeros(6), around(6), 5e-5)
    # Gravity of some 100 N·m twists a gear by load over stiffness; motion differs by no more.
    assert np.abs(elastic.theta - rigid.q).max() < 2.0 * 100.0 / 2e4
