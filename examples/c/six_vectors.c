/* Six vectors, at command level: how a firmware that can start a pulse and wait for its end detects.
 *
 *            c̄   b          Six voltage vectors, one after the other, each as long as the others. The current that a vector
 *             \ /           raises is larger where the rotor's axis lies (less inductance along d), and a little larger still
 *         a̅ ───+─── a       towards the north pole, which saturates the iron further:
 *             / \               i(v) = i0 + i2 cos 2(v − θ) + i1 cos(v − θ)
 *            b̅   c          The second harmonic of the six currents has the axis, the first the pole.
 *
 * Build: cc -O2 -shared -fPIC -o six_vectors.so six_vectors.c
 * Config: pulse_us=… length of a pulse, least=… smallest pole difference that is believed, as a share of the mean current.
 */
#include "standstill.h"

#include <stdlib.h>
#include <string.h>

enum { VECTORS = 6 };

struct six {
    uint64_t pulse_ns;
    float least;
    float peak[VECTORS];
    uint32_t next; /* vector whose pulse comes next */
    int inverted;  /* L_d > L_q: the current is smaller along the axis */
    int south;     /* the south pole draws the larger current */
};

/* cos and sin of 0°, 60°, 120° … */
static const float COS[VECTORS] = {1.0f, 0.5f, -0.5f, -1.0f, -0.5f, 0.5f};
static const float S = 0.8660254f;

static float sine(uint32_t k)
{
    static const float sign[VECTORS] = {0.0f, 1.0f, 1.0f, 0.0f, -1.0f, -1.0f};
    return sign[k] * S;
}

/* atan2 by a polynomial, to 1e-5 rad: the same bits wherever floats are IEEE 754, unlike a C library's. */
static float arc(float y, float x)
{
    float ax = x < 0.0f ? -x : x, ay = y < 0.0f ? -y : y;
    float big = ax > ay ? ax : ay, small = ax > ay ? ay : ax;
    float z, z2, a;
    if (big == 0.0f) {
        return 0.0f;
    }
    z = small / big;
    z2 = z * z;
    a = -0.01172120f;
    a = a * z2 + 0.05265332f;
    a = a * z2 - 0.11643287f;
    a = a * z2 + 0.19354346f;
    a = a * z2 - 0.33262347f;
    a = a * z2 + 0.99997726f;
    a = a * z;
    if (ay > ax) {
        a = 1.57079633f - a;
    }
    if (x < 0.0f) {
        a = 3.14159265f - a;
    }
    return y < 0.0f ? -a : a;
}

/* A number of the configuration, or what is usual. */
static float option(const char *config, const char *key, float usual)
{
    size_t length = strlen(key);
    const char *line = config;
    while (line != NULL && *line != '\0') {
        if (strncmp(line, key, length) == 0 && line[length] == '=') {
            return strtof(line + length + 1, NULL);
        }
        line = strchr(line, '\n');
        line = line == NULL ? NULL : line + 1;
    }
    return usual;
}

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    /* Up to half the rated current along d: i = 2/3 U t / L_d. */
    float usual = 0.5f * drive->rated_current * drive->ld * 1.5f / drive->dc_link * 1e6f;
    float pulse_us = option(config, "pulse_us", usual);
    struct six *six;
    (void)seed;
    if (!(pulse_us >= 1.0f && pulse_us <= 10000.0f)) {
        *refused = "pulse_us must be from 1 to 10000";
        return NULL;
    }
    six = calloc(1, sizeof *six);
    if (six == NULL) {
        *refused = "out of memory";
        return NULL;
    }
    six->pulse_ns = (uint64_t)(pulse_us * 1000.0f);
    six->least = option(config, "least", 0.002f);
    six->inverted = drive->ld > drive->lq;
    six->south = drive->stronger_pole < 0;
    return six;
}

/* The vector at k times 60°, then all switches off until the current is gone: against the whole link it takes less time. */
static void pulse(const struct six *six, sts_command *command)
{
    static const uint8_t high[VECTORS][3] = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 1}};
    int phase;
    command->stages = 2;
    for (phase = 0; phase < 3; phase++) {
        command->stage[0].leg[phase] = high[six->next][phase] ? STS_HIGH : STS_LOW;
        command->stage[1].leg[phase] = STS_OFF;
    }
    command->stage[0].duration_ns = six->pulse_ns;
    command->stage[1].duration_ns = 3 * six->pulse_ns;
    command->samples = 1;
    command->first_ns = six->pulse_ns;
}

static int32_t step(void *detector, const sts_readings *readings, sts_command *command, sts_result *result)
{
    struct six *six = detector;
    float x1 = 0.0f, y1 = 0.0f, x2 = 0.0f, y2 = 0.0f, mean = 0.0f, axis, along;
    uint32_t k;
    if (readings->count > 0) {
        /* The current's component along its vector. */
        const sts_sample *sample = sts_reading(readings, 0);
        uint32_t last = six->next - 1;
        float alpha = sample->current[0];
        float beta = (sample->current[1] - sample->current[2]) * 0.57735027f;
        for (k = 0; k < 3; k++) {
            if (sample->sensed[k] == STS_CLIPPED) {
                result->reason = 1;
                return STS_FAILED;
            }
        }
        six->peak[last] = alpha * COS[last] + beta * sine(last);
    }
    if (six->next < VECTORS) {
        pulse(six, command);
        six->next++;
        return STS_GO_ON;
    }
    for (k = 0; k < VECTORS; k++) {
        mean += six->peak[k] / 6.0f;
        x1 += six->peak[k] * COS[k] / 3.0f;
        y1 += six->peak[k] * sine(k) / 3.0f;
        x2 += six->peak[k] * COS[2 * k % 6] / 3.0f;
        y2 += six->peak[k] * sine(2 * k % 6) / 3.0f;
    }
    axis = 0.5f * arc(y2, x2);
    if (six->inverted) {
        axis += 1.57079633f;
    }
    /* cos and sin of the axis, without a C library: from the second harmonic by the half angle. */
    {
        float length2 = x2 * x2 + y2 * y2, cos2, c, s;
        float root = length2, turn;
        int i;
        for (i = 0; i < 40 && root > 0.0f; i++) {
            root = 0.5f * (root + length2 / root);
        }
        cos2 = root > 0.0f ? x2 / root : 1.0f;
        c = 0.5f * (1.0f + cos2);
        s = c;
        for (i = 0; i < 40 && s > 0.0f; i++) {
            s = 0.5f * (s + c / s);
        }
        c = s;
        s = c > 0.0f && root > 0.0f ? y2 / root / (2.0f * c) : 1.0f;
        if (six->inverted) {
            turn = c;
            c = -s;
            s = turn;
        }
        along = x1 * c + y1 * s;
    }
    if (six->south) {
        along = -along;
    }
    if (along < 0.0f) {
        axis += 3.14159265f;
        along = -along;
    }
    result->angle = axis;
    if (along < six->least * mean) {
        result->reason = 2;
        return STS_AXIS;
    }
    return STS_FOUND;
}

static void destroy(void *detector)
{
    free(detector);
}

static const char *reason(uint32_t code)
{
    switch (code) {
    case 1: return "a current beyond the range of its sensor";
    case 2: return "the poles answer too much alike";
    default: return NULL;
    }
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof(sts_detector), .flags = STS_REENTRANT, .name = "six vectors",
        .create = create, .destroy = destroy, .reason = reason, .step = step,
    };
    return abi == STS_ABI ? &table : NULL;
}
