/* A detector of Standstill in a drive's own C: one detection, replayed from recorded readings.
 *
 *   recording.h ── samples ──► sts_step() ──► command ──► compared in number with what was recorded next
 *                                         └─► result  ──► its bits, compared with those that Rust got
 *
 * In a drive the samples come from its converters, and command.stage goes to its timer; all else is as here. Returns 0 if the
 * bits are the same, so that it can be run on the target itself.
 *
 * Build: cargo build --release --manifest-path crates/firmware/Cargo.toml --target-dir target/firmware
 *        cc -std=c99 -O2 -I crates/foreign/include -I crates/firmware/include -o replay examples/c/drive/main.c \
 *            target/firmware/release/libsts_detectors.a
 */
#include "sts_detectors.h"

#include <stdio.h>
#include <string.h>

/* recorded_method, recorded_plate; recorded_samples, of which step k gets recorded_counts[k]; recorded_result.
 * The tests write one for each method: RECORDING=renew cargo test -p standstill-scenario --test embedded */
#include "recording.h"

static sts_state detector;

static unsigned bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (unsigned)bits;
}

/* A drive loads its timer with this. */
static void drive(const sts_command *command)
{
    uint32_t s, k;
    printf("drive");
    for (s = 0; s < command->stages; s++) {
        const sts_stage *stage = &command->stage[s];
        for (k = 0; k < 3; k++) {
            printf(" %u:%08x:%lu", stage->leg[k], bits(stage->duty[k]), (unsigned long)stage->edge_ns[k]);
        }
        printf(" for %lu ns,", (unsigned long)stage->duration_ns);
    }
    if (command->until != 0.0f) {
        printf(" until %08x,", bits(command->until));
    }
    printf(" sample %lu from %lu every %lu\n", (unsigned long)command->samples, (unsigned long)command->first_ns,
           (unsigned long)command->interval_ns);
}

int main(void)
{
    const unsigned steps = sizeof recorded_counts / sizeof recorded_counts[0];
    sts_readings readings = {sizeof readings, 0, sizeof(sts_sample), 0, recorded_samples};
    const char *refused = sts_begin(&detector, recorded_method, &recorded_plate, NULL, 0);
    sts_command command;
    sts_result result;
    int32_t status = STS_GO_ON;
    unsigned k;
    if (refused != NULL) {
        printf("refused: %s\n", refused);
        return 2;
    }
    for (k = 0; k < steps && status == STS_GO_ON; k++) {
        if (k > 0 && command.samples != recorded_counts[k]) {
            printf("step %u asks for %u samples, recorded were %u\n", k, (unsigned)command.samples, recorded_counts[k]);
            return 1;
        }
        readings.count = recorded_counts[k];
        status = sts_step(&detector, &readings, &command, &result);
        readings.first = (const sts_sample *)readings.first + recorded_counts[k];
        if (status == STS_GO_ON) {
            drive(&command);
        }
    }
    printf("done %d: angle %08x, deviation %08x, evidence %08x of %08x, reason %u\n", (int)status, bits(result.angle),
           bits(result.angle_deviation), bits(result.pole_evidence), bits(result.pole_needed), (unsigned)result.reason);
    return k == steps && status == recorded_status && bits(result.angle) == recorded_result[0] &&
                   bits(result.angle_deviation) == recorded_result[1] && bits(result.pole_evidence) == recorded_result[2]
               ? 0
               : 1;
}
