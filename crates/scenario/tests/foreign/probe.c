/* A library that does what the test asks for: `what=…`. */
#include "standstill.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int starts, calls;
static char big[4096];
static const char *config;
static sts_drive drive;
static float angle, last_current;
static uint64_t seen;

/* Names that the C library has too, as firmware does not know. */
long timezone;

long random(void)
{
    return 1;
}

/* Crashes of each kind, for those who ask for one by a name that ends so. */
static void misbehave(const char *how)
{
    if (strcmp(how, "crash") == 0) {
        *(volatile int *)(uintptr_t)(calls * 0) = 1;
    }
    if (strcmp(how, "exit") == 0) {
        exit(0);
    }
    if (strcmp(how, "hang") == 0) {
        for (;;) {
            calls++;
        }
    }
}

#ifdef AT_LOAD
__attribute__((constructor)) static void loaded(void)
{
    misbehave(AT_LOAD);
}
#endif

#ifdef KEEPS
#include <time.h>
char *date_of_the_c_library(time_t at);
char *date_of_the_c_library(time_t at)
{
    return ctime(&at);
}
#endif

#ifdef OTHER
int of_another_library(void);
int of_another_library(void)
{
    static int calls;
    return OTHER + calls++;
}
#endif

#ifdef LINKED
int of_another_library(void);
#else
#define of_another_library() 0
#endif

#ifdef LOADS
__attribute__((constructor)) static void loads_another(void)
{
    dlopen(LOADS, RTLD_NOW);
}
#endif

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
    if (is("create-crash") || is("create-exit") || is("create-hang")) {
        misbehave(is("create-crash") ? "crash" : is("create-exit") ? "exit" : "hang");
    }
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

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    const sts_sample *sample = sts_reading(readings, 0);
    int call = calls++, k;
    (void)detector;
    last_current = sample->current[0];
    result->angle = angle;
    if (drive.size != sizeof drive) {
        return STS_FAILED;
    }
    if (is("starts")) {
        result->angle = 0.1f * (float)starts;
        return STS_FOUND;
    }
    if (is("linked")) {
        result->angle = 0.1f * (float)of_another_library();
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
        result->age = 0.0f;
        return STS_FOUND;
    }
    if (is("age-long")) {
        result->age = 2.0f;
        return STS_FOUND;
    }
    if (is("age-negative")) {
        result->age = -1.0f;
        return STS_FOUND;
    }
    if (is("angle-huge")) {
        result->angle = 1e30f;
        return STS_FOUND;
    }
    if (is("evidence-nan")) {
        result->pole_evidence = 0.0f / (angle - 1.0f);
        result->pole_needed = 3.0f;
        return STS_FOUND;
    }
    if (is("deviation")) {
        result->angle_deviation = -1.0f;
        return STS_FOUND;
    }
    if (is("beyond-result")) {
        *(volatile uint32_t *)(result + 1) = 7;
        return STS_FOUND;
    }
    if (is("beyond-legs")) {
        *(volatile float *)(legs + 1) = 0.5f;
        return STS_GO_ON;
    }
    if (is("before-result")) {
        ((volatile float *)result)[-1] = 0.5f;
        return STS_FOUND;
    }
    if (is("opens")) {
        return dlopen("libm.so.6", RTLD_NOW) == NULL ? STS_GO_ON : STS_FOUND;
    }
    if (is("abort")) {
        abort();
    }
    if (is("logs")) {
        sts_log(&drive, call == 0 ? "{ \"first\"" : "another\n");
        return call == 3 ? STS_FOUND : STS_GO_ON;
    }
    if (is("prints")) {
        puts("{ \"printed\": \"by the library\"");
        return STS_FOUND;
    }
    if (is("evidence-alone")) {
        result->pole_evidence = 4.0f;
        return STS_AXIS;
    }
    if (is("needed-negative")) {
        result->pole_evidence = -4.0f;
        result->pole_needed = -1.0f;
        return STS_FOUND;
    }
    if (is("needed-alone")) {
        result->pole_needed = 3.0f;
        return STS_AXIS;
    }
    if (is("reads")) {
        /* What stands for 1 A is the angle that is configured. */
        result->angle = angle * sample->current[0];
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
    if (seen % 8 == 0 && (is("crash") || is("exit") || is("hang"))) {
        misbehave(is("crash") ? "crash" : is("exit") ? "exit" : "hang");
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

/* Two channels: calls so far, and the current that phase a had last. */
static const char *probe(void *detector, uint32_t channel, float *value)
{
    (void)detector;
    *value = channel == 0 ? (float)calls : last_current;
    return channel == 0 ? "calls" : channel == 1 ? "last_A" : NULL;
}

#ifdef COMMANDS
#define LEVEL 0
#define STEP step
/* For ever the shortest command that there is. */
static int32_t step(void *detector, const sts_readings *readings, sts_command *command, sts_result *result)
{
    (void)detector, (void)readings, (void)result;
    command->stages = 1;
    command->stage[0].duration_ns = is("short") ? 1 : 2000;
    if (is("edge")) {
        command->stage[0].leg[1] = STS_RISE;
        command->stage[0].edge_ns[1] = 2001;
    }
    if (is("beyond-command")) {
        ((volatile uint64_t *)(command + 1))[1] = 7;
    }
    return STS_GO_ON;
}
#else
#define LEVEL (STS_INTERRUPT | STS_DOUBLE_UPDATE)
#define STEP NULL
#endif

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
        .abi = ABI, .size = SIZE, .flags = LEVEL | FLAGS, .pwm_hz = 12500, .sample_at = 0.25f, .update_delay = DELAY,
        .name = "probe", .create = create, .reason = reason, .step = STEP, .isr = isr, .probe = probe,
    };
#ifdef STRICT
    return abi == ABI ? &table : NULL;
#else
    (void)abi;
    return &table;
#endif
}
