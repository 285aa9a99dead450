"""The gate of executions, with teeth: `python -m tests.benchmarks.execution_gate [--quick]`.

Every closed form at masses, stiffnesses and sizes of a wide range, with the worst figure of each;
what each setting that is broken on purpose is refused for; and the processor time of a gate.
"""

import sys
import time
from dataclasses import replace
from itertools import product

from sim_validate.execution.gate import measured_case
from tests.sim_validate.execution.gate.settings_of_gates import BROKEN, RIGHT, held_case

MASSES, STIFFNESSES, RADII = (0.05, 0.3, 2.0), (500.0, 2000.0, 10_000.0), (0.02, 0.07, 0.2)


def main(arguments):
    """Print the tables; the exit status is 1 if a check of the usual settings fails."""
    quick = "--quick" in arguments
    table = list(product(*(values[1:2] if quick else values for values in
                           (MASSES, STIFFNESSES, RADII))))  # fmt: skip
    worst, failed, seconds = {}, 0, []
    for mass, stiffness, radius in table:
        began = time.process_time()
        gate = measured_case(held_case(mass, stiffness, radius))
        seconds.append(time.process_time() - began)
        figures = " ".join(f"{check.value:.4g}" for check in gate.checks)
        print(f"{mass:g} kg {stiffness:g} N/m {radius:g} m: {figures}", flush=True)
        failed += not gate.passed
        for check in gate.checks:
            middle = 0.5 * (check.least + check.largest) if check.least > 0.0 else 0.0
            last = worst.get(check.name, (-1.0, check))
            worst[check.name] = max(last, (abs(check.value - middle), check), key=lambda of: of[0])
    print("\nworst of each:")
    for _, check in worst.values():
        print(f"  {check}")
    print(f"\nprocessor time of a gate: {min(seconds):.2f} to {max(seconds):.2f} s")
    print("\nbroken settings:")
    for where, numbers in BROKEN[:3] if quick else BROKEN:
        case = held_case(*where)
        gate = measured_case(replace(case, physics=replace(case.physics, **numbers)))
        says = [str(check) for check in gate.checks if not check.passed]
        print(f"  {numbers}: {says[0] if says else 'ACCEPTED'}")
        failed += not says
    print("\nright settings:")
    for where, numbers in RIGHT[:1] if quick else RIGHT:
        case = held_case(*where)
        gate = measured_case(replace(case, physics=replace(case.physics, **numbers)))
        print(f"  {numbers}: {'accepted' if gate.passed else 'REFUSED'}")
        failed += not gate.passed
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
