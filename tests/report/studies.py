"""Rows of studies, as batch.json has them, with numbers that a test can count."""


def study_rows(count: int, waiting: int = 0) -> list[dict]:
    """Return jobs on a grid of thickness and material: every tenth failed, every tenth does not meet its margin."""
    rows = []
    for k in range(count):
        job, thickness = f"arm-{k}", (1 + k % 6) / 1000
        row = {"job": job, "folder": f"out/{job}", "pipeline": f"out/{job}/{job}.toml", "cause": "", "seconds": 1.0 + k}
        row["parameters"] = {"thickness": thickness, "material": ("steel", "alloy")[k % 2]}
        margin = -0.5 if k % 10 == 1 else k / count
        met = {"name": "margin of strut N", "result": "FAILED" if margin < 0 else "passed", "says": ""}
        if k % 10 == 0:
            row |= {"status": "failed", "cause": f"{row['pipeline']}: element {k} has no volume"}
        elif k >= count - waiting:
            row |= {"status": "waiting"}
            del row["seconds"]
        else:
            word = "FAIL" if margin < 0 else "PASS WITH WARNINGS" if k % 10 == 2 else "PASS"
            row |= {"status": "done", "verdict": {"word": word, "requirements": [met], "warnings": []}}
            row["quantities"] = {"mass_kg": 2700 * thickness, "margin": margin, "mode_1": "1st bending in y"}
            row["quantities"] |= {"end_time_s": 1.0, "energy_error": 10.0 ** -(k % 7), "centre_x_m": 0.5}
        rows.append(row)
    return rows
