#!/usr/bin/env python3
"""The problem with ngspice: writes the netlist, runs it, prints what it took and how far it is off.

    ngspice_pulses.py NGSPICE FOLDER       the program, and where netlists and results go

The time is ngspice's own for the transient analysis: no process start, no reading, no output.
"""

import pathlib
import re
import subprocess
import sys

from problem import (
    A_D0, A_DD, A_Q0, DEAD, DIODE, END, I_F, PERIOD, PULSE, PULSES, RESISTANCE, SAMPLES, SWITCH, THETA, U_DC,
    error, reference, rest_flux,
)  # fmt: skip

# What a junction with n = 0.003 drops on average; taken off the drops, so that their sum is that of the problem.
JUNCTION = 2.1e-3
# Half of a gate edge in µs.
HALF_EDGE = 1e-4


def gate(edges):
    """A gate's voltage from (time in µs, on)."""
    points = [f"{at + d:.4f}u {int(on == (d > 0))}" for at, on in edges for d in (-HALF_EDGE, HALF_EDGE)]
    return "PWL(" + "\n+ ".join(points) + ")"


def netlist(step, reltol, data):
    period, pulse, dead = PERIOD * 1e6, PULSE * 1e6, DEAD * 1e6
    upper = [edge for k in range(PULSES) for edge in [(k * period + dead, True), (k * period + pulse, False)]]
    lower = [(k * period + pulse + dead, True) for k in range(PULSES)]
    lower = sorted(lower + [(k * period, False) for k in range(1, PULSES)])
    first, interval = SAMPLES[0] * 1e6, (SAMPLES[1] - SAMPLES[0]) * 1e6
    return f"""\
* Three line pulses on a saturating motor: written by ngspice_pulses.py.
.param theta={THETA!r} rest={rest_flux()!r}

* The motor. Nodes fd and fq are its fluxes in mWb, less the magnet's: capacitors that the voltages charge.
.func psid(x)={{rest+x/1000}}
.func id(x)={{({A_D0}+{A_DD}*psid(x)**5)*psid(x)-{I_F}}}
.func iq(x)={{{A_Q0}*x/1000}}
Bal al 0 V=(2*V(a)-V(b)-V(c))/3
Bbe be 0 V=(V(b)-V(c))/sqrt(3)
Bfd 0 fd I=cos(theta)*V(al)+sin(theta)*V(be)-{RESISTANCE}*id(V(fd))
Bfq 0 fq I=cos(theta)*V(be)-sin(theta)*V(al)-{RESISTANCE}*iq(V(fq))
Cfd fd 0 1m
Cfq fq 0 1m
* Its currents, out of the legs.
Bia ia 0 V=cos(theta)*id(V(fd))-sin(theta)*iq(V(fq))
Bib ib 0 V=cos(theta-2*pi/3)*id(V(fd))-sin(theta-2*pi/3)*iq(V(fq))
Bic ic 0 V=cos(theta+2*pi/3)*id(V(fd))-sin(theta+2*pi/3)*iq(V(fq))
Ga a 0 ia 0 1
Gb b 0 ib 0 1
Gc c 0 ic 0 1
* Gives the legs a potential while none conducts.
Ra a 0 1g
Rb b 0 1g
Rc c 0 1g

* Legs as in tests/cross/netlists.py: a drop, a slope and a junction each; an open switch has 600 V against it.
.model junction d(is=1e-12 n=0.003)
.global one
.subckt leg p m out up low
Eup p 1 one up 600
Vup 1 2 {SWITCH[0] - JUNCTION}
Rup 2 3 {SWITCH[1]}
Dup 3 out junction
Elow out 4 one low 600
Vlow 4 5 {SWITCH[0] - JUNCTION}
Rlow 5 6 {SWITCH[1]}
Dlow 6 m junction
Dpd out 7 junction
Rpd 7 8 {DIODE[1]}
Vpd 8 p {DIODE[0] - JUNCTION}
Dmd m 9 junction
Rmd 9 10 {DIODE[1]}
Vmd 10 out {DIODE[0] - JUNCTION}
.ends
Vone one 0 1
Vdc p 0 {U_DC}
Xa p 0 a upa lowa leg
Xb p 0 b upb lowb leg
Xc p 0 c upc lowc leg
Vupa upa 0 {gate(upper)}
Vlowa lowa 0 {gate(lower)}
Vupb upb 0 0
Vlowb lowb 0 {gate([(dead, True)])}
Vupc upc 0 0
Vlowc lowc 0 0

.options reltol={reltol:g} abstol=1e-8 vntol=1e-6 method=gear
.tran {interval:g}u {END * 1e6:g}u {first:g}u {step:g}u uic
.control
save ia ib ic
set wr_singlescale
set wr_vecnames
option numdgt=12
run
rusage trantime tranpoints traniter
linearize
wrdata {data} v(ia) v(ib) v(ic)
quit
.endc
.end
"""


def run(program, folder, step, reltol):
    """Seconds of analysis and phase currents at the samples."""
    name = f"pulses_{step:g}us_{reltol:g}"
    data = folder / f"{name}.data"
    data.unlink(missing_ok=True)
    (folder / f"{name}.cir").write_text(netlist(step, reltol, data))
    done = subprocess.run([program, "-b", f"{name}.cir"], cwd=folder, capture_output=True, text=True)
    log = done.stdout + done.stderr
    (folder / f"{name}.log").write_text(log)
    if not data.exists() or "aborted" in log or "too small" in log:
        sys.exit(f"ngspice gave up on {name}.cir, see {folder / name}.log")
    seconds = float(re.search(r"[Tt]ransient (?:analysis )?time.*?([0-9.]+)", log).group(1))
    rows = [[float(x) for x in line.split()] for line in data.read_text().splitlines()[1:]]
    taken = {round(row[0], 9): row[1:] for row in rows}
    return seconds, [taken[t] for t in SAMPLES]


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    for step, reltol in [(1, 1e-3), (1, 1e-7), (0.1, 1e-7), (40, 1e-6)]:
        seconds, rows = run(program, folder, step, reltol)
        print(f"ngspice {step:g} µs reltol {reltol:g},{END / seconds:.6g},{error(rows, reference()):.3g}")


if __name__ == "__main__":
    main()
