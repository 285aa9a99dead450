"""Settings with which executions must be refused, or accepted, and the cases that show it."""

from sim_validate.execution.gate import HeldCase

USUAL, STIFF, SOFT = (0.3, 2000.0, 0.07), (0.05, 10_000.0, 0.02), (2.0, 500.0, 0.2)
"""Mass of the object [kg], stiffness of the springs [N/m], radius of the object [m]."""


def held_case(mass_kg, stiffness_n_per_m, radius_m, **more):
    """The usual case with a mass, a stiffness and a size, and the physics that suit them."""
    fields = {
        "push_n": 10.0, "friction": 0.5, "tip_radius_m": 0.1 * radius_m, "tip_mass_kg": 0.05,
        "damping_ratio": 0.5, "physics": None,
    } | more  # fmt: skip
    case = HeldCase(mass_kg, stiffness_n_per_m, radius_m=radius_m, **fields)
    if case.physics is None:
        own = case.held_box().physics
        case = held_case(mass_kg, stiffness_n_per_m, radius_m, **(more | {"physics": own}))
    return case


DEFAULTS = {
    "cone": "pyramidal", "impratio": 1.0, "integrator": "Euler", "tolerance": 1e-8,
    "solref": (0.02, 1.0), "solimp": (0.9, 0.95, 0.001, 0.5, 2.0), "timestep": 0.0025,
}  # fmt: skip
"""MuJoCo's own defaults, with the nearest step that divides a sample; executions are refused."""
BROKEN = (
    (USUAL, {"timestep": 0.005}),
    (USUAL, {"impratio": 0.1}),
    (SOFT, {"iterations": 2}),
    (USUAL, {"solver": "CG"}),
    (USUAL, {"condim": 1}),
)
"""One of several kinds, for every day."""
MORE_BROKEN = (
    (STIFF, {"timestep": 0.0025}),
    (USUAL, {"integrator": "discrete"}),
    (USUAL, {"cone": "pyramidal"}),
    (STIFF, {"solref": (0.02, 1.0)}),
    (USUAL, {"ls_iterations": 1}),
    (USUAL, {"viscosity": 0.1}),
    (USUAL, {"density": 1.2, "wind": (10.0, 0.0, 0.0)}),
    (USUAL, {"ccd_tolerance": 0.01}),
)
SELDOM_BROKEN = (
    (STIFF, {"timestep": 0.00125}),
    (USUAL, {"integrator": "implicitfast"}),
    (STIFF, {"integrator": "discrete"}),
    (STIFF, {"impratio": 10.0}),
    (USUAL, {"solimp": (0.9, 0.95, 0.001, 0.5, 2.0)}),
    (USUAL, {"solref": (0.005, 0.2)}),
    (USUAL, {"tolerance": 1e-7}),
    (STIFF, {"solver": "PGS", "iterations": 10}),
    (USUAL, {"margin": 1e-4}),
    (USUAL, {"margin": 1e-3, "gap": 1e-3}),
    (USUAL, {"density": 1000.0}),
    (USUAL, DEFAULTS),
)
RIGHT = (
    (USUAL, {}),
    (USUAL, {"timestep": 0.0005}),
    (USUAL, {"integrator": "RK4"}),
    (USUAL, {"impratio": 1000.0}),
    (USUAL, {"jacobian": "sparse"}),
    (USUAL, {"tolerance": 1e-12}),
    (USUAL, {"condim": 6}),
    (USUAL, {"autoreset": True}),
    (USUAL, {"diagexact": True}),
    (USUAL, {"gap": 1e-3}),
    (USUAL, {"solimp": (0.99, 0.99, 0.001, 0.5, 2.0)}),
)
"""They change nothing that matters: fingertips have no torsional friction to use, a blow-up that is
reset is still reported, and wind needs air."""
