#!/usr/bin/env python3
"""Writes the netlists of ngspice/cases.txt, and compares two folders of what they gave. Standard library only.

    netlists.py                      write ngspice/*.cir
    netlists.py --into DIR [--step US] [--reltol X]
                                     write them elsewhere, with another maximum step in µs and another tolerance
    netlists.py --csv DATA CSV       turn a run's output into a golden CSV file
    netlists.py --compare DIR        the largest difference between ngspice/*.csv and DIR/*.csv, per case

The gate edges are computed here from the description of the drive alone: a leg is told something at the start of a
stage and, under PWM, at the edges of an on-time in the middle of the carrier's period; told anything new, it opens
both switches after the turn-off delay and closes the wanted one after the dead time plus the turn-on delay, unless it
was told something else by then.
"""

import argparse
import pathlib

HERE = pathlib.Path(__file__).resolve().parent / "ngspice"
DC_LINK = 550
CARRIER = 100_000  # ns
# Half the width of a gate edge, in ns.
HALF_EDGE = 0.1
# From a sample to the nearest gate edge, in ns at least.
CLEARANCE = 200
STEP = 0.1  # µs
# Where terminals ring: ngspice's method turns an oscillation by (ω step)²/3 too little, per radian.
RINGING_STEP = 0.1  # of STEP
RELTOL = 1e-7


def ns(text):
    return round(float(text) * 1000)


def read_cases(path):
    """Motors, devices, timings and sequences by name; cases in order."""
    tables = {"motor": {}, "devices": {}, "timing": {}, "short": {}}
    sequences, cases = {}, []
    for line in path.read_text().splitlines():
        words = line.split("#")[0].split()
        if not words:
            continue
        kind, rest = words[0], words[1:]
        if kind == "devices":
            tables[kind][rest[0]] = [float(x) for x in rest[1:5]] + rest[5:]
        elif kind == "short":
            tables[kind][rest[0]] = [rest[1]] + [float(x) for x in rest[2:]]
        elif kind in tables:
            tables[kind][rest[0]] = [float(x) for x in rest[1:]]
        elif kind == "sequence":
            commands = []
            sequences[rest[0]] = {"first": ns(rest[1]), "interval": ns(rest[2]), "commands": commands}
        elif kind == "case":
            keys = ["name", "sequence", "angle", "motor", "devices", "timing", "capacitance", "resistance", "load", "short"]
            missing = ["0", "0", "0", ""][len(rest) - len(keys) :] if len(rest) < len(keys) else []
            cases.append(dict(zip(keys, [*rest, *missing], strict=True)))
        else:
            stages = [(ns(words[k]), words[k + 1 : k + 4]) for k in range(0, len(words), 4)]
            commands.append(stages)
    return tables, sequences, cases


def requests(commands, leg):
    """What a leg is told: (time in ns, "H", "L" or "-")."""
    start = 0
    for stages in commands:
        for duration, legs in stages:
            what = legs[leg]
            if what in "HL-":
                yield start, what
            else:
                on = round(float(what) * CARRIER)
                begin = start
                while begin < start + duration:
                    idle = (CARRIER - on) // 2
                    for at, to in [(0, "L"), (idle, "H"), (idle + on, "L")]:
                        # An on-time of nothing or of the whole period has no edges.
                        to = "L" if on == 0 else "H" if idle == 0 else to
                        if begin + at < start + duration:
                            yield begin + at, to
                    begin += CARRIER
            start += duration


def gate_edges(commands, leg, timing):
    """Times in ns at which the upper and the lower switch of a leg change: two lists of (time, on)."""
    dead, off_delay, on_delay = (ns(x) for x in timing)
    told, changes = "-", []
    for at, wanted in requests(commands, leg):
        if wanted == told:
            continue
        told = wanted
        off_at = at + off_delay
        while changes and changes[-1][0] >= off_at:
            changes.pop()
        changes.append((off_at, "-"))
        if wanted != "-":
            changes.append((max(at + dead + on_delay, off_at), wanted))
    result = []
    for switch in "HL":
        edges, on = [], False
        for at, state in changes:
            if (state == switch) != on:
                on = not on
                edges.append((at, on))
        result.append(edges)
    return result


def source(edges):
    """A gate's voltage, 1 V while the switch is on: each edge centred on its instant."""
    initial = 0
    if edges and edges[0][0] == 0:
        initial, edges = 1, edges[1:]
    if not edges:
        return str(initial)
    points = []
    for at, on in edges:
        points.append(f"{(at - HALF_EDGE) / 1000:.4f}u {1 - on} {(at + HALF_EDGE) / 1000:.4f}u {int(on)}")
    lines = [" ".join(points[k : k + 4]) for k in range(0, len(points), 4)]
    return "PWL(" + "\n+ ".join(lines) + ")"


def describe(commands):
    """The sequence as comment lines, equal commands counted."""
    lines = []
    for stages in commands:
        text = ", then ".join(f"{duration / 1000:g} us {' '.join(legs)}" for duration, legs in stages)
        if lines and lines[-1][0] == text:
            lines[-1][1] += 1
        else:
            lines.append([text, 1])
    return [f"*   {text}" + (f", {count} times" if count > 1 else "") for text, count in lines]


def switches(drop, slope, mosfets):
    """The two switches of a leg between p and m."""
    if mosfets:
        return f"""\
* One leg between p and m. A channel is a conductance that is the same both ways and rises with its gate, up to
* 1/{slope:g} mOhm; each has a diode beside it.
.subckt leg p m out up low
Bup p out i=v(p,out)*(1n+v(up)/{slope:g}m)
Blow out m i=v(out,m)*(1n+v(low)/{slope:g}m)"""
    return f"""\
* One leg between p and m. A switch is a drop, a slope and a junction; to open it, its gate's source rises by
* 600 V, more than the link, against the junction. Each switch has a diode beside it.
.global one
.subckt leg p m out up low
Eup p 1 one up 600
Vup 1 2 {drop:g}
Rup 2 3 {slope:g}m
Dup 3 out junction
Elow out 4 one low 600
Vlow 4 5 {drop:g}
Rlow 5 6 {slope:g}m
Dlow 6 m junction"""


def met_by_ringing(resistance, switch_drop, diode_drop, mosfets):
    """A resistance in Ω for each terminal that no device feeds."""
    lines = [
        f"* A terminal floats where its potential is between those at which a device of its leg begins to conduct. Its",
        f"* current then meets {resistance:g} Ohm. 0.2 ns lie between.",
    ]
    for leg in "abc":
        low = f"({DC_LINK - switch_drop:g}*v(up{leg})-{diode_drop:g}*(1-v(up{leg})))"
        high = f"({switch_drop:g}*v(low{leg})+{DC_LINK + diode_drop:g}*(1-v(low{leg})))"
        inside = f"(1+tanh((v({leg})-{low})/10m-5))*(1+tanh(({high}-v({leg}))/10m-5))/4"
        if mosfets:
            # A channel conducts at any potential.
            inside = f"(1-v(up{leg}))*(1-v(low{leg}))*" + inside
        lines.append(f"Bin{leg} in{leg} 0 v={inside}\nRin{leg} in{leg} floats{leg} 1k\nCin{leg} floats{leg} 0 0.2p ic=0")
        lines.append(f"Rmet{leg} {leg} w{leg} r='1u+{resistance:g}*v(floats{leg})'")
    return "\n".join(lines)


def winding(phase, terminal, resistance):
    """A phase from its terminal to the star point."""
    return f"""L{phase} {terminal} x{phase} {{l{phase * 2}}}
R{phase} x{phase} star {resistance:g}"""


def coupled(phases):
    """What couples the windings of whole phases."""
    return "\n".join(
        f"K{m}{n} L{m} L{n} {{m{m}{n}/sqrt(l{m * 2}*l{n * 2})}}" for m, n in phases
    )


def with_short(short, terminals, resistance):
    """The three windings, of which one has turns that a resistance shorts: two coils in series. Beyond their shares of
    the phase's inductance both have what the coupling of the shorted one with the whole phase leaves, against each other."""
    phase, share, fault, coupling = short
    others = [other for other in "abc" if other != phase]
    mutual = {frozenset(pair): "m" + pair for pair in ("ab", "bc", "ca")}
    l, own = f"l{phase * 2}", "beyond"
    lines = [
        f"* {share:g} of the turns of phase {phase}, whose coupling with the phase is {coupling:g}, shorted by {fault:g} Ohm.",
        f".param share={share:g} beyond={{share*share*(la+ls)*(1/{coupling:g}/{coupling:g}-1)}}",
        f".param lwhole={{(1-share)*(1-share)*{l}+{own}}} lshort={{share*share*{l}+{own}}} mshort={{share*(1-share)*{l}-{own}}}",
        f"L{phase} {terminals['abc'.index(phase)]} x{phase} {{lwhole}}",
        f"R{phase} x{phase} tap {{{resistance:g}*(1-share)}}",
        "Lshort tap xshort {lshort}",
        f"Rshort xshort star {{{resistance:g}*share}}",
        f"Rfault tap star {max(fault, 1e-6):g}",
        f"Kshort L{phase} Lshort {{mshort/sqrt(lwhole*lshort)}}",
    ]
    for other in others:
        m = mutual[frozenset((phase, other))]
        lines += [
            winding(other, terminals["abc".index(other)], resistance),
            f"Kwhole{other} L{phase} L{other} {{(1-share)*{m}/sqrt(lwhole*l{other * 2})}}",
            f"Kshort{other} Lshort L{other} {{share*{m}/sqrt(lshort*l{other * 2})}}",
        ]
    both = next(pair for pair in ("ab", "bc", "ca") if set(pair) == set(others))
    lines.append(coupled([both]))
    return "\n".join(lines)


def sensed(case):
    """Whether terminals' potentials and the link's current are written."""
    return case["name"].startswith("sensed_")


def netlist(case, tables, sequences, step, reltol):
    sequence = sequences[case["sequence"]]
    commands = sequence["commands"]
    mean, saliency, leakage, resistance = tables["motor"][case["motor"]]
    switch_drop, switch_slope, diode_drop, diode_slope, *kind = tables["devices"][case["devices"]]
    mosfets = kind == ["mosfet"]
    assert mosfets or not kind, case["devices"]
    assert not mosfets or switch_drop == 0, "a channel has no threshold"
    timing = tables["timing"][case["timing"]]
    edges = [gate_edges(commands, leg, timing) for leg in range(3)]
    end = sum(duration for stages in commands for duration, _ in stages)
    first, interval = sequence["first"], sequence["interval"]
    for stages in commands:
        assert sum(duration for duration, _ in stages) % interval == 0, "samples must be equally spaced"
    for leg in edges:
        for at, _ in leg[0] + leg[1]:
            place = (at - first) % interval
            assert min(place, interval - place) >= CLEARANCE, f"{case['name']}: edge at {at} ns is on a sample"
    last = first + (end - first) // interval * interval
    gates = "\n".join(
        f"V{name}{phase} {name}{phase} 0 {source(edges[leg][k])}"
        for leg, phase in enumerate("abc")
        for k, name in enumerate(["up", "low"])
    )
    modulated = any(word not in "HL-" for stages in commands for _, legs in stages for word in legs)
    # Without currents nothing else tells the terminals their potentials where a channel goes off. Damped, or it rings.
    capacitance = float(case["capacitance"])
    if capacitance:
        step *= RINGING_STEP
        # A potential that rings shows the turn that is too little, a current hardly.
        if sensed(case):
            step /= 2
    # Before the first switch comes on, half the link's voltage, or what dividers hold the terminals at.
    load = float(case["load"])
    held = 0 if load else DC_LINK / 2
    terminals = "".join(f"C{leg} {leg} 0 {capacitance:g}n ic={held:g}\n" for leg in "abc")
    if load:
        assert capacitance, case["name"]
        terminals += "".join(f"Rload{leg} {leg} 0 {load:g}k\n" for leg in "abc")
    damped, windings = float(case["resistance"]), "abc"
    if damped:
        assert capacitance, case["name"]
        terminals += met_by_ringing(damped, switch_drop, diode_drop, mosfets)
        windings = ["wa", "wb", "wc"]
    if case["short"]:
        phases = with_short(tables["short"][case["short"]], windings, resistance)
    else:
        inductors = [f"L{leg} {windings[k]} x{leg} {{l{leg * 2}}}" for k, leg in enumerate("abc")]
        phases = "\n".join([*inductors, coupled(["ab", "bc", "ca"]), *(f"R{leg} x{leg} star {resistance:g}" for leg in "abc")])
    # Between link capacitor and bridge, without a resistance.
    shunt = "Vdc link 0 {0}\nVshunt link p 0" if sensed(case) else "Vdc p 0 {0}"
    seen = " v(a) v(b) v(c) i(Vshunt)" if sensed(case) else ""
    stray = "".join(f"C{leg} {leg} damped{leg} 0.1p\nRdamp{leg} damped{leg} 0 1meg\n" for leg in "abc")
    return f"""\
* {case["name"]}: written by netlists.py from cases.txt, to be changed there.
* Legs a, b, c are H (upper switch on), L (lower), - (both off) or a PWM duty at 10 kHz, centred in its period:
{chr(10).join(describe(commands))}
* Dead time {timing[0]:g} us, turn-off delay {timing[1]:g} us, turn-on delay {timing[2]:g} us.

* Motor, equations (1) and (2), rotor locked; the leakage keeps the three coupled inductors regular.
.param la={mean:g}m lb={saliency:g}m ls={leakage:g}m pi=3.141592653589793
.param theta={{{case["angle"]}*pi/180}} third={{2*pi/3}}
.param laa={{la+ls+lb*cos(2*theta)}}
.param lbb={{la+ls+lb*cos(2*theta-2*third)}}
.param lcc={{la+ls+lb*cos(2*theta+2*third)}}
.param mab={{-la/2+lb*cos(2*theta-third)}}
.param mbc={{-la/2+lb*cos(2*theta)}}
.param mca={{-la/2+lb*cos(2*theta+third)}}
{phases}
* Gives the star point a potential while no leg conducts.
Rstar star 0 1g

* A junction lets current through one way only and drops 2.0 to 2.3 mV between 0.1 A and 5 A.
.model junction d(is=1e-12 n=0.003)
{switches(switch_drop, switch_slope, mosfets)}
Dpd out 7 junction
Rpd 7 8 {diode_slope:g}m
Vpd 8 p {diode_drop:g}
Dmd m 9 junction
Rmd 9 10 {diode_slope:g}m
Vmd 10 out {diode_drop:g}
.ends
Vone one 0 1
{shunt.format(DC_LINK)}
Xa p 0 a upa lowa leg
Xb p 0 b upb lowb leg
Xc p 0 c upc lowc leg
{terminals if capacitance else stray if mosfets and modulated else ''}
* Gates: edges of {2 * HALF_EDGE:g} ns about their instants.
{gates}

.options reltol={reltol:g} abstol=1e-8 vntol=1e-6 trtol=1 method=gear
.tran {interval / 1000:g}u {last / 1000:g}u {first / 1000:g}u {step:g}u uic
.control
set wr_singlescale
set wr_vecnames
option numdgt=10
run
linearize
wrdata {case["name"]}.data i(La) i(Lb) i(Lc){seen}
quit
.endc
.end
"""


def write_csv(data, path):
    rows = [[float(x) for x in line.split()] for line in data.read_text().splitlines()[1:]]
    lines = ["t_s,i_a_A,i_b_A,i_c_A" + (",v_a_V,v_b_V,v_c_V,i_link_A" if len(rows[0]) > 4 else "")]
    # Adding zero turns a rounded −0 into 0.
    lines += [f"{row[0]:.8f}".rstrip("0") + "".join(f",{round(x, 6) + 0.0:.6f}" for x in row[1:]) for row in rows]
    path.write_text("\n".join(lines) + "\n")


def read_csv(path):
    return [[float(x) for x in line.split(",")] for line in path.read_text().splitlines()[1:]]


def compare(other):
    overall = 0.0
    for path in sorted(HERE.glob("*.csv")):
        ours, theirs = read_csv(path), read_csv(other / path.name)
        assert [row[0] for row in ours] == [row[0] for row in theirs], path.name
        # Of what has potentials the currents alone are compared here.
        scale = max(abs(x) for row in ours for x in row[1:4])
        worst = max(abs(x - y) for a, b in zip(ours, theirs) for x, y in zip(a[1:4], b[1:4]))
        overall = max(overall, worst / scale)
        print(f"{path.stem:26} {worst / scale:.1e} of {scale:.3f} A")
    print(f"{'largest':26} {overall:.1e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--into", type=pathlib.Path, default=HERE)
    parser.add_argument("--step", type=float, default=STEP)
    parser.add_argument("--reltol", type=float, default=RELTOL)
    parser.add_argument("--csv", type=pathlib.Path, nargs=2)
    parser.add_argument("--compare", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.csv:
        write_csv(*arguments.csv)
    elif arguments.compare:
        compare(arguments.compare)
    else:
        tables, sequences, cases = read_cases(HERE / "cases.txt")
        for case in cases:
            text = netlist(case, tables, sequences, arguments.step, arguments.reltol)
            (arguments.into / f"{case['name']}.cir").write_text(text)


if __name__ == "__main__":
    main()
