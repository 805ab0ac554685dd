/* Six pulses with a comparator and a timer, at command level: how the application notes of small drives find a rotor at rest.
 *
 *   a high, b and c low ──► comparator trips ──► all off ──► 60° further: a and b high, c low ──► … six times
 *   timer captures              t0                                      t1                         t5
 *
 * No converter takes part in it. y = 1 / (t U) is the mean slope of the current up to the threshold, in the direction of the pulse.
 * It is larger along the rotor's axis (L_d < L_q), and a little larger still where the magnet saturates the iron further:
 *
 *   y(n) = Y (1 + k cos 2(θ − n 60°) + p cos(θ − n 60°))
 *
 * The second harmonic of the six values has the axis, the first one the pole; what is left, the third, fits neither and says how much
 * more there is than noise is known to make.
 *
 * Build: cc -O2 -shared -fPIC -o six_pulse.so six_pulse.c -lm
 * Config: threshold=… A (rated current otherwise), longest_us=… of a pulse, evidence=… standard deviations that a pole needs (4).
 * Drive: sensors.timer, and sensors.comparators.
 */
#include "standstill.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PULSES = 6 };

/* Why it has no angle, or no pole. */
enum { NO_TRIP = 1, TOO_EARLY, NO_SALIENCY, NOT_CERTAIN };

struct six {
    sts_drive drive;     /* a copy: what create() is given is gone when it returns */
    float threshold;     /* A */
    float evidence;      /* what a pole needs */
    uint64_t longest_ns; /* of a pulse */
    uint32_t given;      /* pulses so far */
    float y[PULSES];     /* 1/(V s) */
    float time;          /* sum of the times, s */
};

static const char *const KEYS[] = { "threshold", "evidence", "longest_us" };

/* Whether each line of the configuration has a key that there is. */
static int known(const char *config)
{
    const char *line = config;
    while (line != NULL && *line != '\0') {
        size_t k, length = strcspn(line, "=\n");
        for (k = 0; k < sizeof KEYS / sizeof KEYS[0]; k++) {
            if (strlen(KEYS[k]) == length && strncmp(line, KEYS[k], length) == 0) {
                break;
            }
        }
        if (k == sizeof KEYS / sizeof KEYS[0]) {
            return 0;
        }
        line = strchr(line, '\n');
        line = line == NULL ? NULL : line + 1;
    }
    return 1;
}

/* The number behind a key; NAN if there is something else. */
static float parsed(const char *text)
{
    char *end;
    float value = strtof(text, &end);
    return end == text || (*end != '\n' && *end != '\0') ? NAN : value;
}

/* A number of the configuration, or what is usual. */
static float option(const char *config, const char *key, float usual)
{
    size_t length = strlen(key);
    const char *line = config;
    while (line != NULL && *line != '\0') {
        if (strncmp(line, key, length) == 0 && line[length] == '=') {
            return parsed(line + length + 1);
        }
        line = strchr(line, '\n');
        line = line == NULL ? NULL : line + 1;
    }
    return usual;
}

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    struct six *six;
    float larger = drive->ld > drive->lq ? drive->ld : drive->lq, longest_us;
    (void)seed;
    if (drive->timer_tick == 0.0f) {
        *refused = "this drive captures no time: sensors.timer";
        return NULL;
    }
    if (!known(config)) {
        *refused = "the keys of the configuration are threshold, evidence, longest_us";
        return NULL;
    }
    six = calloc(1, sizeof *six);
    if (six == NULL) {
        *refused = "out of memory";
        return NULL;
    }
    six->drive = *drive;
    six->threshold = option(config, "threshold", drive->rated_current);
    six->evidence = option(config, "evidence", 4.0f);
    /* One leg against two is one and a half phases; half as much again to spare, and a fifth of the link for resistances. */
    longest_us = 1.5f * 1.5f * larger * six->threshold / (0.8f * drive->dc_link) * 1e6f;
    longest_us = option(config, "longest_us", longest_us + 1e6f * (drive->comparator_delay + drive->dead_time) + 1.0f);
    if (!(six->threshold > 0.0f && longest_us >= 1.0f && longest_us <= 1e6f && six->evidence >= 0.0f)) {
        *refused = "threshold must be above 0 A, longest_us from 1 to 1000000, evidence 0 or more";
        free(six);
        return NULL;
    }
    six->longest_ns = (uint64_t)(longest_us * 1000.0f);
    return six;
}

static void destroy(void *detector)
{
    free(detector);
}

/* The pulse in the direction n · 60°, until the threshold; then all switches off until the current is gone, which against the whole
 * link takes less time than it took to rise. The reading at the end of the pulse has the captured time. */
static void pulse(const struct six *six, sts_command *command)
{
    static const uint8_t high[PULSES][3] = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 1}};
    int phase;
    command->stages = 2;
    for (phase = 0; phase < 3; phase++) {
        command->stage[0].leg[phase] = high[six->given][phase] ? STS_HIGH : STS_LOW;
        command->stage[1].leg[phase] = STS_OFF;
    }
    command->stage[0].duration_ns = six->longest_ns;
    command->stage[1].duration_ns = six->longest_ns + six->longest_ns / 2;
    command->until = six->threshold;
    command->samples = 1;
    command->first_ns = 0;
}

/* y of the pulse that has ended; the reason, if there is none. */
static uint32_t measure(struct six *six, const sts_sample *sample)
{
    const sts_drive *drive = &six->drive;
    char line[80];
    float time;
    if (!sample->captured) {
        return NO_TRIP;
    }
    /* The middle of the tick. The pulse begins after the dead time, the capture comes after the comparator's delay. */
    time = ((float)sample->capture_ticks + 0.5f) * drive->timer_tick - drive->comparator_delay - drive->dead_time;
    if (time <= drive->timer_tick || sample->dc_link <= 0.0f) {
        return TOO_EARLY;
    }
    six->y[six->given - 1] = 1.0f / (time * sample->dc_link);
    six->time += time;
    snprintf(line, sizeof line, "pulse %u: %.2f us at %.1f V", (unsigned)six->given, 1e6 * (double)time, (double)sample->dc_link);
    sts_log(drive, line);
    return 0;
}

/* A component of a harmonic of the six values, as a share of their mean. */
static float harmonic(const struct six *six, float mean, int order, int sine)
{
    float sum = 0.0f;
    int n;
    for (n = 0; n < PULSES; n++) {
        float angle = 1.04719755f * (float)(order * n % PULSES);
        sum += six->y[n] * (sine ? sinf(angle) : cosf(angle));
    }
    return sum / (3.0f * mean);
}

static int32_t answer(const struct six *six, sts_result *result)
{
    const sts_drive *drive = &six->drive;
    float time = six->time / PULSES, mean = 0.0f, third = 0.0f, along, known, variance, unknown, axis;
    float x1, y1, x2, y2;
    int n;
    for (n = 0; n < PULSES; n++) {
        mean += six->y[n] / PULSES;
        third += (n % 2 == 0 ? six->y[n] : -six->y[n]) / PULSES;
    }
    third /= mean;
    x1 = harmonic(six, mean, 1, 0);
    y1 = harmonic(six, mean, 1, 1);
    x2 = harmonic(six, mean, 2, 0);
    y2 = harmonic(six, mean, 2, 1);
    axis = 0.5f * atan2f(y2, x2);
    if (drive->ld > drive->lq) {
        axis += 1.57079633f;
    }
    /* What is known to err in a time: the tick, noise at the comparator, and comparators of their own. */
    known = drive->timer_tick / time * (drive->timer_tick / time) / 12.0f;
    known += drive->comparator_noise / six->threshold * (drive->comparator_noise / six->threshold);
    if (drive->comparators > 1) {
        known += drive->comparator_offset / six->threshold * (drive->comparator_offset / six->threshold);
    }
    /* Of six values with the variance σ² a component of a harmonic has σ²/3, the third harmonic σ²/6. */
    variance = known / 3.0f;
    unknown = 0.5f * third * third - variance;
    variance += unknown > 0.0f ? unknown : 0.0f;
    result->angle = axis;
    if (x2 * x2 + y2 * y2 < 16.0f * variance) {
        result->reason = NO_SALIENCY;
        return STS_FAILED;
    }
    result->angle_deviation = 0.5f * sqrtf(variance / (x2 * x2 + y2 * y2));
    along = (x1 * cosf(axis) + y1 * sinf(axis)) * (drive->stronger_pole < 0 ? -1.0f : 1.0f);
    if (along < 0.0f) {
        result->angle += 3.14159265f;
        along = -along;
    }
    result->pole_evidence = along / sqrtf(variance);
    result->pole_needed = six->evidence;
    if (drive->stronger_pole == 0 || result->pole_evidence < six->evidence) {
        result->reason = NOT_CERTAIN;
        return STS_AXIS;
    }
    return STS_FOUND;
}

static int32_t step(void *detector, const sts_readings *readings, sts_command *command, sts_result *result)
{
    struct six *six = detector;
    if (readings->count > 0) {
        result->reason = measure(six, sts_reading(readings, 0));
        if (result->reason != 0) {
            return STS_FAILED;
        }
    }
    if (six->given == PULSES) {
        return answer(six, result);
    }
    pulse(six, command);
    six->given++;
    return STS_GO_ON;
}

static const char *reason(uint32_t code)
{
    switch (code) {
    case NO_TRIP: return "a pulse whose current did not reach the threshold";
    case TOO_EARLY: return "a comparator that trips at once";
    case NO_SALIENCY: return "the six times differ by no more than they err";
    case NOT_CERTAIN: return "the poles answer too much alike";
    default: return NULL;
    }
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof(sts_detector), .flags = STS_REENTRANT, .name = "six pulses with a timer",
        .create = create, .destroy = destroy, .reason = reason, .step = step,
    };
    return abi == STS_ABI ? &table : NULL;
}
