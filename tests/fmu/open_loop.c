/* Legs by a fixed plan, whatever the samples say: pulses, rests and PWM. tests/fmu/importers.py gives the same to an FMU. */
#include "standstill.h"

#define STEPS 40u

static uint32_t tick;

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    (void)drive, (void)config, (void)seed, (void)refused;
    tick = 0;
    return &tick;
}

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    uint32_t n = ++tick;
    int k;
    (void)detector, (void)readings;
    if (n == STEPS) {
        result->reason = 0;
        return STS_FAILED;
    }
    for (k = 0; k < 3; k++) {
        legs->leg[k] = n % 8 == 0 ? (k == 0 ? STS_HIGH : k == 1 ? STS_LOW : STS_OFF) : n % 8 == 1 ? STS_OFF : STS_DUTY;
        legs->duty[k] = 0.5f + (float)((n * (uint32_t)(k + 1)) % 5) / 128.0f;
    }
    return STS_GO_ON;
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof(sts_detector), .flags = STS_INTERRUPT, .name = "open loop", .create = create, .isr = isr,
        .pwm_hz = 12500, .sample_at = 0.5f, .update_delay = 1,
    };
    return abi == STS_ABI ? &table : 0;
}
