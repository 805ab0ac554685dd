/* An interrupt with three samples between two updates, and a task beside it: what=samples, what=moved, what=task. */
#include "standstill.h"

#include <string.h>

static char what[16];
static uint64_t first_task, last_task, tasks, wrong, last_interrupt;
static uint32_t calls;

#define TASK 70000u

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    const char *at = strstr(config, "what=");
    size_t length = at == NULL ? 0 : strcspn(at + 5, "\n");
    (void)drive, (void)seed, (void)refused;
    memcpy(what, at == NULL ? "" : at + 5, length < sizeof what ? length : 0);
    return what;
}

/* Once in each period of its own, after the interrupt that was before it. */
static void task(void *detector, uint64_t time_ns)
{
    (void)detector;
    if (tasks == 0) {
        first_task = time_ns;
        wrong += time_ns > TASK;
    } else {
        wrong += time_ns != last_task + TASK;
    }
    wrong += calls > 0 && time_ns < last_interrupt;
    last_task = time_ns;
    tasks++;
}

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    const sts_sample *first = sts_reading(readings, 0), *last = sts_reading(readings, readings->count - 1);
    uint64_t now = last->time_ns;
    uint32_t k;
    (void)detector;
    result->angle = 0.0f;
    if (legs->size != sizeof *legs || readings->count != 3) {
        return STS_FAILED;
    }
    if (strcmp(what, "task") == 0) {
        /* All that were due before this interrupt have run, and none that was not. */
        wrong += (tasks == 0 ? now > TASK : last_task + TASK < now) || (tasks > 0 && last_task >= now);
        last_interrupt = now;
        if (++calls < 60) {
            return STS_GO_ON;
        }
        result->angle = (float)first_task / (float)TASK;
        return wrong == 0 && tasks >= 60u * 80u / 70u - 1u ? STS_FOUND : STS_FAILED;
    }
    /* A period of 80 us: three samples from 8 us on, one each 16 us, or where the interrupt before asked for them. */
    for (k = 0; k < 3; k++) {
        uint64_t at = calls < 2 || strcmp(what, "moved") != 0 ? 8000 + 16000 * k : 40000 + 10000 * k;
        wrong += sts_reading(readings, k)->time_ns != 80000u * (uint64_t)calls + at;
    }
    wrong += first->time_ns >= now;
    if (strcmp(what, "moved") == 0 && calls == 1) {
        legs->sample_at = 0.5f;
        legs->sample_every = 0.125f;
    }
    return ++calls < 6 ? STS_GO_ON : wrong == 0 ? STS_FOUND : STS_FAILED;
}

#ifdef COMMANDS
static int32_t step(void *detector, const sts_readings *readings, sts_command *command, sts_result *result)
{
    (void)detector, (void)readings, (void)command, (void)result;
    return STS_FAILED;
}
#define LEVEL 0
#define STEP step
#else
#define STEP NULL
#define LEVEL STS_INTERRUPT
#endif
#ifndef EVERY
#define EVERY 0.2f
#endif
#ifndef PERIOD
#define PERIOD TASK
#endif
#ifndef SAMPLES
#define SAMPLES 3
#endif

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof table, .flags = LEVEL, .name = "beside", .create = create, .isr = isr, .step = STEP,
        .pwm_hz = 12500, .sample_at = 0.1f, .update_delay = 1, .samples = SAMPLES, .sample_every = EVERY, .task = task,
        .task_ns = PERIOD,
    };
    return abi == STS_ABI ? &table : NULL;
}
