#!/usr/bin/env bash
# Looks for code that fell out of the functions compiled for wide registers: bash scripts/wide-code.sh BINARY
# BINARY: the program, or libstandstill_sim.rlib, whose release build has all of that code.
#
# A method of an effect that is not inlined, or a closure in one, is compiled without AVX: each of its operations is then a call of
# an intrinsic, and a detection takes up to three times as long. Both leave symbols of their own. Code for one lane or for one machine may have
# symbols; arithmetic of the engine's registers, effects and places in a step may not.
set -euo pipefail

stray() {
    local intrinsic='core_arch::x86::avx[0-9a-z]*::_mm(256|512)_(add|sub|mul|div|sqrt)_pd'
    local register='standstill_numeric::lane::x86::(avx2|avx512)::(negative|magnitude|above|choose)'
    local method='effect::(Effect|CoreBranch)<.*>>::(predict|correct|error|within|keep|find_modes|at|take|room|set_stiffness)'
    local part='standstill_sim::effect::(context::(Looked|Span|keep)|winding::|eddies::|rotor::|play::|link::|terminals::)'
    # The accounts and the start of one machine are no wide code, and neither are the cells of one whose wire breaks.
    local alone='effect::(Effect|CoreBranch)<.*>>::(rest|energy|power|work|between|slope|start|like|ends|pinned_at|pinned_rise)|::without_a_state|play::leap::straight'
    grep -E "$intrinsic|$register|$method|$part" | grep -vE "$alone" || true
}

# It finds what it looks for.
planted='t core::core_arch::x86::avx512f::_mm512_mul_pd
t standstill_sim::effect::winding::flux_within::{{closure}}
t <standstill_sim::physics::links::Links<V> as standstill_sim::effect::Effect<V>>::correct
t <standstill_sim::physics::links::Links<V> as standstill_sim::effect::Effect<V>>::power'
[ "$(stray <<<"$planted" | wc -l)" = 3 ] || { echo "wide-code.sh does not find what it looks for"; exit 2; }

symbols=$(nm -C "$1" 2>/dev/null | cut -d ' ' -f 2-)
grep -q 'with_features' <<<"$symbols" || { echo "$1 has no symbols of wide code"; exit 2; }
found=$(stray <<<"$symbols")
if [ -n "$found" ]; then
    printf 'outside of the functions for wide registers:\n%s\n' "$found"
    exit 1
fi
