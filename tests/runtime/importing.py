"""Run FMUs by FMPy where modalprep cannot be imported: python -I importing.py JOBS.json RESULTS.npz.

A job has name, file, kind (fmpy's), stop, step, tolerance, start values, outputs, pieces of constant inputs, and the
law of a controller, an input as a sum of outputs times gains, for which it is called at each communication point.
"""

import json
import sys

import numpy as np

sys.modules["modalprep"] = None


def signals(pieces):
    """Return inputs that jump between pieces (until, value): two rows at each jump, as FMI has events."""
    names = [name for name in pieces[0] if name != "until"]
    rows, begin = [], 0.0
    for piece in pieces:
        rows += [(t, *(piece[name] for name in names)) for t in (begin, piece["until"])]
        begin = piece["until"]
    return np.array(rows, dtype=[("time", float), *((name, float) for name in names)])


def controller(job):
    """Return what FMPy calls after each step, which sets the input by the outputs."""
    from fmpy import read_model_description

    law = job["law"]
    reference = {v.name: v.valueReference for v in read_model_description(job["file"]).modelVariables}[law["input"]]

    def control(time, recorder):
        row = dict(zip(["time", *job["outputs"]], recorder.rows[-1], strict=True))
        put = getattr(recorder.fmu, "setReal", None) or recorder.fmu.setFloat64
        put([reference], [sum(gain * row[name] for name, gain in law["gains"].items())])
        return True

    return control


def main(jobs, results):
    from fmpy import simulate_fmu
    from fmpy.validation import validate_fmu

    found = {}
    problems = {job["file"]: validate_fmu(job["file"]) for job in jobs}
    for job in jobs:
        inputs = signals(job["pieces"]) if job.get("pieces") else None
        run = simulate_fmu(
            job["file"],
            fmi_type=job["kind"],
            stop_time=job["stop"],
            output_interval=job["step"],
            relative_tolerance=job["tolerance"],
            start_values=job.get("start", {}),
            input=inputs,
            output=job["outputs"],
            step_finished=controller(job) if "law" in job else None,
            early_return_allowed=job["kind"] == "CoSimulation",
        )
        found[job["name"]] = np.array([run[name] for name in ("time", *job["outputs"])])
    np.savez(results, problems=json.dumps(problems), **found)


if __name__ == "__main__":
    main(json.loads(open(sys.argv[1]).read()), sys.argv[2])
