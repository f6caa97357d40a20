"""The load on one of the five machines of `tests/machines`, from its calibration to its band.

    python tests/studies/machine_loads.py press --folder /tmp/press

Simulates a calibration run and a test (SciPy), fits the first unless the folder has its posterior,
and prints how often the 90 % band of the test's load holds the true one.
"""

import argparse
import shutil
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
DRAWS = 16


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("machine", choices=("press", "table", "shaker", "swing", "hanging"))
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--draws", type=int, default=DRAWS)
    return parser.parse_args()


def main() -> int:
    args = options()
    from machines.pressing import SOUGHT, simulated_test
    from machines.simulated import MACHINES

    import rigid
    from rigid.io.runtime import prepare
    from rigid.smoothing.laws import read_law
    from rigid.smoothing.reading import read_fields
    from rigid.smoothing.reference_check import against_reference
    from rigid.smoothing.run import bands, learned, ways

    prepare()
    args.folder.mkdir(parents=True, exist_ok=True)
    MACHINES[args.machine](args.folder / f"{args.machine}.csv")
    spec, load = simulated_test(args.machine, args.folder)
    posterior = args.folder / "posterior.nc"
    if not posterior.exists():
        rigid.load(spec.path).fit(out=args.folder / "fit")
        shutil.copy(args.folder / "fit" / "posterior.nc", posterior)
    law = read_law(spec, posterior, np.random.default_rng(1))
    law = law.only(np.random.default_rng(2).choice(law.size, args.draws, replace=False))
    ((field,),) = read_fields(spec)
    under = ways([field], [learned(spec, [field], law, lambda _: None)], [law])
    made = bands(under, 1, apart=False)
    band = made.bands[f"load_{SOUGHT[args.machine]}"].quantiles[:, ::4]
    true = load[: band.shape[1]]
    held, off = (band[0] <= true) & (true <= band[4]), band[2] - true
    sys.stdout.write(
        f"{args.machine}: {held.mean():.3f} of samples held, rms error "
        f"{np.sqrt(np.mean(off**2)):.4g} N, loads from {true.min():.5g} to {true.max():.5g} N\n"
    )
    for line in made.budget:
        sys.stdout.write(f"  {line.name}: {line.median:.5g} ({line.q05:.5g} to {line.q95:.5g})\n")
    for check in against_reference(under, spec.sensors):
        sys.stdout.write(f"  {check.says}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
