"""Reads the results of a small sweep back, from CSV and from Parquet, with pandas and with polars.

    python read_results.py path/to/standstill

Exits with an assertion that fails where docs/campaigns.md is wrong.
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import pandas as pd
import polars as pl
import pyarrow.parquet as pq

SCENARIO = """
trials = 200
seed = 7
[detector]
method = "line-inductance-fast"
[axes]
"sensors.noise" = { from = "10 mA", to = "80 mA", points = 3, log = true }
"errors" = ["default", "harsh"]
"""


def main(standstill):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "s.toml").write_text(SCENARIO)
        for kind in ("csv", "parquet"):
            arguments = ["run", "s.toml", "--format", kind, "--out", kind]
            subprocess.run([standstill, *arguments], cwd=folder, check=True, capture_output=True)
        path = {kind: folder / kind / f"trials.{kind}" for kind in ("csv", "parquet")}
        summary = json.loads((folder / "csv" / "summary.json").read_text())

        text = pd.read_csv(path["csv"], low_memory=False)
        run = json.loads(text["run"].iloc[0])
        assert run == {key: str(summary["run"][key]) for key in ("version", "numerics", "seed", "scenario")}
        assert text["run"].iloc[1:].isna().all()
        binary = pd.read_parquet(path["parquet"])
        metadata = pq.read_schema(path["parquet"]).metadata
        assert {key: metadata[key.encode()].decode() for key in run} == run
        text = text.drop(columns="run")
        assert list(text.columns) == list(binary.columns)
        for name in text.columns:
            a, b = text[name], binary[name]
            same = (a == b) | (a.isna() & b.isna())
            assert same.all(), name
        assert list(binary.columns[:3]) == ["sensors.noise", "errors", "trial"]
        assert binary["trial"].dtype == "int64" and binary["sensors.noise"].dtype == "float64"

        frame = pl.read_parquet(path["parquet"])
        assert pl.read_csv(path["csv"], infer_schema_length=None).drop("run").equals(frame)
        with path["csv"].open(newline="", encoding="utf-8") as file:
            assert len(list(csv.DictReader(file))) == len(frame) == 1200

        # The summaries are those of the rows.
        for point in summary["points"]:
            rows = binary
            for key, value in point["values"].items():
                rows = rows[rows[key] == value]
            assert len(rows) == point["summary"]["trials"] == 200
            wrap = (rows["axis_deg"] - rows["true_angle_deg"]) % 180
            wrapped = wrap.where(wrap <= 90, wrap - 180)
            error = rows["axis_error_deg"].dropna()
            assert len(error) == rows["axis_deg"].notna().sum() and ((error - wrapped).abs().dropna() < 1e-9).all()
            rms = float((error**2).mean() ** 0.5)
            assert abs(rms / point["summary"]["rms_deg"]["value"] - 1) < 1e-9
            assert (rows["outcome"] == "undetermined").sum() == point["summary"]["undetermined"]
            assert (rows["pole_correct"] == False).sum() == point["summary"]["wrong_poles"]  # noqa: E712
        print(f"{len(frame)} rows read alike by pandas {pd.__version__} and polars {pl.__version__}")


if __name__ == "__main__":
    main(str(pathlib.Path(sys.argv[1]).resolve()))
