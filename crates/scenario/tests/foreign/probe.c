/* A library that does what the test asks for: `what=…`. */
#include "standstill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int starts, calls;
static char big[4096];
static const char *config;
static sts_drive drive;
static float angle;
static uint64_t seen;

/* Names that the C library has too, as firmware does not know. */
long timezone;

long random(void)
{
    return 1;
}

static int is(const char *what)
{
    const char *line = strstr(config, "what=");
    size_t size = strlen(what);
    return line != NULL && strncmp(line + 5, what, size) == 0 && (line[5 + size] == '\n' || line[5 + size] == 0);
}

static void *create(const sts_drive *knows, const char *given, uint64_t seed, const char **refused)
{
    const char *at = strstr(given, "angle=");
    config = given;
    drive = *knows;
    starts++;
    big[starts]++;
    seen = seed;
    angle = at == NULL ? 1.0f : strtof(at + 6, NULL);
    if (is("refuse") || (is("refuse-some") && seed % 8 == 0)) {
        *refused = "this motor is not for me";
        return NULL;
    }
    return &starts;
}

static const char *reason(uint32_t code)
{
    return code == 7 ? "the hall sensors disagree" : NULL;
}

static int32_t isr(void *detector, const sts_sample *sample, sts_legs *legs, sts_result *result)
{
    int call = calls++, k;
    (void)detector;
    result->angle = angle;
    if (drive.size != sizeof drive) {
        return STS_FAILED;
    }
    if (is("starts")) {
        result->angle = 0.1f * (float)starts;
        return STS_FOUND;
    }
    if (is("own")) {
        timezone += random();
        result->angle = 0.1f * (float)timezone;
        return STS_FOUND;
    }
    if (is("seed")) {
        result->angle = (float)(seen >> 40) * (1.0f / 16777216.0f);
        return STS_FOUND;
    }
    if (is("found")) {
        result->angle_deviation = 0.25f;
        result->pole_evidence = 4.0f;
        result->pole_needed = 3.0f;
        return STS_FOUND;
    }
    if (is("axis")) {
        result->reason = 7;
        return STS_AXIS;
    }
    if (is("failed")) {
        result->reason = 9;
        return STS_FAILED;
    }
    if (is("status")) {
        return 17;
    }
    if (is("angle")) {
        result->angle = NAN;
        return STS_FOUND;
    }
    if (is("counts")) {
        for (k = 0; k < 3; k++) {
            float value = drive.amps_at_zero + drive.amps_per_count * (float)sample->current_count[k];
            if (fabsf(value - sample->current[k]) > 1e-3f * drive.amps_per_count + 1e-4f || sample->current_count[k] == 0) {
                return STS_FAILED;
            }
        }
        return fabsf(drive.volts_per_count * (float)sample->dc_link_count - sample->dc_link) < 1e-3f ? STS_FOUND : STS_FAILED;
    }
    if (is("times")) {
        /* Twice a period of 80 us, a quarter into each half. */
        if (sample->time_ns != 10000u + 40000u * (uint64_t)call || sample->half != call % 2) {
            return STS_FAILED;
        }
        return call == 9 ? STS_FOUND : STS_GO_ON;
    }
    if (is("delay")) {
        /* Off until a current flows: how many calls after asking for a vector that is. */
        legs->leg[0] = STS_HIGH;
        legs->leg[1] = STS_LOW;
        legs->leg[2] = STS_LOW;
        if (sample->current[0] > 0.02f * drive.rated_current) {
            result->angle = (float)call;
            return STS_FOUND;
        }
        return STS_GO_ON;
    }
    if (is("crash") && seen % 8 == 0) {
        *(volatile int *)(uintptr_t)(calls * 0) = 1;
    }
    if (is("exit") && seen % 8 == 0) {
        exit(0);
    }
    if (is("hang") && seen % 8 == 0) {
        for (;;) {
            calls++;
        }
    }
    if (is("crash") || is("exit") || is("hang")) {
        return STS_FOUND;
    }
    for (k = 0; k < 3; k++) {
        legs->leg[k] = is("leg") ? 9 : STS_DUTY;
        legs->duty[k] = is("duty") ? 1.5f : is("nan") ? NAN : 0.5f;
    }
    return STS_GO_ON;
}

#ifndef ABI
#define ABI STS_ABI
#endif
#ifndef SIZE
#define SIZE sizeof(sts_detector)
#endif
#ifndef FLAGS
#define FLAGS 0
#endif
#ifndef DELAY
#define DELAY 1
#endif

#ifdef THREAD_LOCAL
__thread int of_a_thread = 3;
#endif

#ifdef MISSING
void HAL_ADC_Start(void);
extern int TIM1_CNT;
void use(void);
void use(void)
{
    HAL_ADC_Start();
    TIM1_CNT++;
}
#endif

#ifdef NO_ENTRY
#define sts_entry another_entry
const sts_detector *another_entry(uint32_t abi);
#endif

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        ABI, SIZE, STS_INTERRUPT | STS_DOUBLE_UPDATE | FLAGS, 12500, 0.25f, DELAY, "probe", create, NULL, reason, NULL, isr,
    };
    (void)abi;
    return &table;
}
