"""Data sheets as types. Written by crates/python/scripts/write_types.py from the program's schema; a test compares."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, Union

class SourcedFloatStr(TypedDict, total=False):
    "`SourcedFloatStr` of a scenario."

    reason: str
    #: Where a number comes from.
    source: Literal["given", "measured", "inferred", "assumed"]
    #: a number
    value: Union[float, str]

class BridgeTable(TypedDict, total=False):
    "`BridgeTable` of a scenario."

    a_b: Union[Union[float, str], SourcedFloatStr]
    a_bp: Union[Union[float, str], SourcedFloatStr]
    k_q: Union[Union[float, str], SourcedFloatStr]
    psi_n: Union[Union[float, str], SourcedFloatStr]
    w: Union[Union[float, str], SourcedFloatStr]

class EddyTable(TypedDict, total=False):
    "`EddyTable` of a scenario."

    d_depth: Union[Union[float, str], SourcedFloatStr]
    q_depth: Union[Union[float, str], SourcedFloatStr]
    time_constant: Union[Union[float, str], SourcedFloatStr]

class HarmonicsTable(TypedDict, total=False):
    "`HarmonicsTable` of a scenario."

    asymmetry: Union[Union[float, str], SourcedFloatStr]
    flux_5: Union[Union[float, str], SourcedFloatStr]
    flux_7: Union[Union[float, str], SourcedFloatStr]
    inductance_4: Union[Union[float, str], SourcedFloatStr]

class HysteresisTable(TypedDict, total=False):
    "`HysteresisTable` of a scenario."

    cells: Union[Union[float, str], SourcedFloatStr]
    coercive_current: Union[Union[float, str], SourcedFloatStr]
    depth: Union[Union[float, str], SourcedFloatStr]

#: How a map goes on where its file has no data.
Beyond: TypeAlias = Literal["fitted"]

#: Where a number comes from.
Source: TypeAlias = Literal["given", "measured", "inferred", "assumed"]

class SourcedStr(TypedDict, total=False):
    "The name of a file, with its source."

    reason: str
    source: Source
    value: str

#: The name of a file, with its source.
WholeFile: TypeAlias = SourcedStr

#: The name of a file, which may have a source.
SourcedFile: TypeAlias = Union[str, WholeFile]

#: How a file counts currents and fluxes.
MapValues: TypeAlias = Literal["peak", "rms"]

class MapTable(TypedDict, total=False):
    "`MapTable` of a scenario."

    #: Continuation beyond a file that has one side of the d-axis only; without it, none.
    beyond: Beyond
    #: The columns of a text in place of its header.
    columns: str
    file: SourcedFile
    #: Whether the file has peak or rms values; peak values without it.
    values: MapValues

class WrittenNameplateSaturation(TypedDict, total=False):
    "By what share the inductances fall at rated current."

    #: L_d with a current along the magnet.
    d: Union[Union[float, str], SourcedFloatStr]
    #: L_d with a current against it.
    minus_d: Union[Union[float, str], SourcedFloatStr]
    #: L_q with a current across it.
    q: Union[Union[float, str], SourcedFloatStr]

class WrittenNameplate(TypedDict, total=False):
    "The keys that may be written into a `[nameplate]`: resistance, inductances, flux and current each in one of the ways that data sheets and controllers give them."

    Ke_line_peak: Union[Union[float, str], SourcedFloatStr]
    Ke_line_rms: Union[Union[float, str], SourcedFloatStr]
    Ke_phase_peak: Union[Union[float, str], SourcedFloatStr]
    Ke_phase_rms: Union[Union[float, str], SourcedFloatStr]
    Kt_peak: Union[Union[float, str], SourcedFloatStr]
    Kt_rms: Union[Union[float, str], SourcedFloatStr]
    Kv: Union[Union[float, str], SourcedFloatStr]
    L_d: Union[Union[float, str], SourcedFloatStr]
    L_delta: Union[Union[float, str], SourcedFloatStr]
    L_line_to_line: Union[Union[float, str], SourcedFloatStr]
    L_line_to_line_max: Union[Union[float, str], SourcedFloatStr]
    L_line_to_line_min: Union[Union[float, str], SourcedFloatStr]
    L_q: Union[Union[float, str], SourcedFloatStr]
    dc_link: Union[Union[float, str], SourcedFloatStr]
    leakage: Union[Union[float, str], SourcedFloatStr]
    magnet_flux: Union[Union[float, str], SourcedFloatStr]
    pole_pairs: Union[Union[float, str], SourcedFloatStr]
    power: Union[Union[float, str], SourcedFloatStr]
    rated_current: Union[Union[float, str], SourcedFloatStr]
    rated_current_delta: Union[Union[float, str], SourcedFloatStr]
    rated_current_rms: Union[Union[float, str], SourcedFloatStr]
    rated_speed: Union[Union[float, str], SourcedFloatStr]
    rated_torque: Union[Union[float, str], SourcedFloatStr]
    resistance: Union[Union[float, str], SourcedFloatStr]
    resistance_delta: Union[Union[float, str], SourcedFloatStr]
    resistance_line_to_line: Union[Union[float, str], SourcedFloatStr]
    saturation: Union[Union[float, str], WrittenNameplateSaturation]
    vesc_L: Union[Union[float, str], SourcedFloatStr]
    vesc_R: Union[Union[float, str], SourcedFloatStr]
    vesc_lambda: Union[Union[float, str], SourcedFloatStr]
    vesc_ld_lq_diff: Union[Union[float, str], SourcedFloatStr]

class RatingTable(TypedDict, total=False):
    "`RatingTable` of a scenario."

    current: Union[Union[float, str], SourcedFloatStr]
    dc_link: Union[Union[float, str], SourcedFloatStr]
    power: Union[Union[float, str], SourcedFloatStr]
    speed: Union[Union[float, str], SourcedFloatStr]
    torque: Union[Union[float, str], SourcedFloatStr]

class MotorRotorTable(TypedDict, total=False):
    "`MotorRotorTable` of a scenario."

    brake_backlash: Union[Union[float, str], SourcedFloatStr]
    cogging_periods: Union[Union[float, str], SourcedFloatStr]
    cogging_torque: Union[Union[float, str], SourcedFloatStr]
    coulomb: Union[Union[float, str], SourcedFloatStr]
    inertia: Union[Union[float, str], SourcedFloatStr]
    stiction: Union[Union[float, str], SourcedFloatStr]
    viscous: Union[Union[float, str], SourcedFloatStr]

class SaturationTable(TypedDict, total=False):
    "`SaturationTable` of a scenario."

    a_d0: Union[Union[float, str], SourcedFloatStr]
    a_dd: Union[Union[float, str], SourcedFloatStr]
    a_dq: Union[Union[float, str], SourcedFloatStr]
    a_q0: Union[Union[float, str], SourcedFloatStr]
    a_qq: Union[Union[float, str], SourcedFloatStr]
    i_f: Union[Union[float, str], SourcedFloatStr]
    s: Union[Union[float, str], SourcedFloatStr]
    t: Union[Union[float, str], SourcedFloatStr]
    u: Union[Union[float, str], SourcedFloatStr]
    v: Union[Union[float, str], SourcedFloatStr]

class ThermalTable(TypedDict, total=False):
    "`ThermalTable` of a scenario."

    magnet_coefficient: Union[Union[float, str], SourcedFloatStr]
    reference: Union[Union[float, str], SourcedFloatStr]
    winding_coefficient: Union[Union[float, str], SourcedFloatStr]

class WindingTable(TypedDict, total=False):
    "`WindingTable` of a scenario."

    leakage: Union[Union[float, str], SourcedFloatStr]
    magnet_flux: Union[Union[float, str], SourcedFloatStr]
    mean_inductance: Union[Union[float, str], SourcedFloatStr]
    pole_pairs: Union[Union[float, str], SourcedFloatStr]
    resistance: Union[Union[float, str], SourcedFloatStr]
    saliency: Union[Union[float, str], SourcedFloatStr]

class MotorSpecTable(TypedDict, total=False):
    "A motor as its file states it. Without a `[saturation]` table the core is linear; a `[bridge]` table adds the iron bridges of a magnet-assisted reluctance rotor to it; a `[map]` is a core by itself, from which `[winding]` may take all inductances. A `[nameplate]` takes the place of `[rating]`, `[winding]` and the core, and of the rotor where there is none. `[harmonics]`, `[eddy]`, `[hysteresis]` and `[thermal]` may be left out. Currents and fluxes are peak values of a phase."

    #: The motor that this one differs from: a built-in name or a path.
    base: str
    bridge: BridgeTable
    eddy: EddyTable
    harmonics: HarmonicsTable
    hysteresis: HysteresisTable
    map: MapTable
    name: str
    nameplate: WrittenNameplate
    notes: str
    rating: RatingTable
    rotor: MotorRotorTable
    saturation: SaturationTable
    thermal: ThermalTable
    title: str
    winding: WindingTable

#: 
MotorSpec: TypeAlias = Union[Literal["paper-5k5", "gearless-hoist", "pm-reluctance", "surface-magnet", "low-inertia", "cross-saturation", "slot-harmonics", "reluctance-6k7", "light-vehicle", "light-vehicle-stiff", "outrunner", "gimbal", "fan-ceiling", "pump-submersible", "drone-u8", "hub-hoverboard"], str, MotorSpecTable]
