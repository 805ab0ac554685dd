# %% [markdown]
# The error of two methods over the rotor's angle, as points and as their mean. Cells of this script run in an editor that
# knows `# %%`, or all of it at once:
#
#     python examples/python/error_over_angle.py error_over_angle.png

# %%
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import standstill as st

# %% Two methods, the same drives and sensors.
METHODS = {"line-inductance-fast": "the paper's, fast decay", "bipolar": "line pulses both ways"}
results = {method: st.run(f'trials = 4000\n[detector]\nmethod = "{method}"') for method in METHODS}

# %% Errors, and their mean in bins of 5°.
figure, axes = plt.subplots(len(METHODS), 1, sharex=True, figsize=(8, 6), layout="constrained")
edges = np.arange(0, 361, 5)
for panel, (method, title) in zip(axes, METHODS.items()):
    angle, error = results[method]["true_angle_deg"], results[method]["axis_error_deg"]
    bins = np.digitize(angle, edges)
    mean = [error[bins == k].mean() for k in range(1, len(edges))]
    panel.plot(angle, error, ".", markersize=2, alpha=0.4, label="a detection")
    panel.stairs(mean, edges, color="black", label="mean")
    rms = results[method].summary["rms_deg"]["value"]
    panel.set_title(f"{title}: {rms:.2f}° rms")
    panel.set_ylabel("error of the axis (°)")
    panel.legend(loc="upper right")
    panel.grid(alpha=0.3)
axes[-1].set_xlabel("rotor angle (electrical °)")
axes[-1].set_xlim(0, 360)

# %%
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "error_over_angle.png", dpi=120)
