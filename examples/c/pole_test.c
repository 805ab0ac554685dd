/* Two pole tests of open firmware, at interrupt level, after the axis was found by rotating injection.
 *
 *   12.5 kHz, an interrupt at each update, two in a period. First the axis, as in rotating.c: 16 directions a turn, each one
 *   half period forth and one back, the second harmonic of the rises. Then one of two tests along that axis:
 *
 *   test=both     a current loop holds i_d = +bias, then -bias, with a square voltage on top: forth in one half, back in the
 *                 next. The ripple is larger where the iron saturates: where i_d adds to the magnet's flux.
 *
 *        i_d  bias ┤    ┌/\/\/\/\/\┐
 *                0 ┼────┘          └┐          ┌──
 *            -bias ┤                └\/\/\/\/\/┘
 *
 *   test=single   one pulse along the axis, as long as a motor that does not saturate takes to reach `current`. More than that by
 *                 `threshold`, a share: north is there. Otherwise it is the other end: nothing else was looked at.
 *
 * Build: cc -O2 -shared -fPIC -o pole_test.so pole_test.c -lm
 * Config: test=both or single, voltage=… V of the injection, bias=… A and least=… (standard deviations that the ripples must
 *         differ by; 0: any difference decides), settle=… and count=… halves for each sign, current=… A, threshold=… (a share),
 *         halves=… that the single pulse lasts. What is left out follows from what the drive knows.
 */
#include "standstill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DIRECTIONS 16
#define TURNS 3                      /* the first does not count */
#define PI 3.14159265f

enum stage { AXIS, REST, FORTH_BIAS, BACK_BIAS, PULSE };

typedef struct test {
    sts_drive drive;
    float half_s;                    /* of a half period, s */
    float voltage, bias, least, current, threshold;
    int settle, count, halves, single;
    enum stage stage;
    uint32_t tick, begun;            /* interrupts so far; the one at which the stage began */
    float before[2];                 /* current at the last interrupt, A */
    float second[2];                 /* second harmonic of the rises */
    float axis, integral;
    float ripple[2], square[2];      /* sums over the halves that count, for each sign of the bias */
} test;

static const char *text(const char *config, const char *key)
{
    size_t length = strlen(key);
    const char *line = config;
    while (line != NULL && *line != '\0') {
        if (strncmp(line, key, length) == 0 && line[length] == '=') {
            return line + length + 1;
        }
        line = strchr(line, '\n');
        line = line == NULL ? NULL : line + 1;
    }
    return NULL;
}

static float number(const char *config, const char *key, float usual)
{
    const char *found = text(config, key);
    return found == NULL ? usual : strtof(found, NULL);
}

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    const char *kind = text(config, "test");
    float l = fminf(drive->ld, drive->lq), most = 0.577f * drive->dc_link;
    test *of = calloc(1, sizeof *of);
    (void)seed;
    if (of == NULL) {
        *refused = "no memory";
        return NULL;
    }
    of->drive = *drive;
    of->half_s = 0.5e-9f * (float)drive->period_ns;
    of->single = kind != NULL && strncmp(kind, "single", 6) == 0;
    of->voltage = number(config, "voltage", fminf(0.4f * drive->dc_link, 0.2f * drive->rated_current * l / of->half_s));
    of->bias = number(config, "bias", 0.5f * drive->rated_current);
    of->least = number(config, "least", 0.0f);
    of->settle = (int)number(config, "settle", 100.0f);
    of->count = (int)number(config, "count", 100.0f);
    of->current = number(config, "current", drive->rated_current);
    of->threshold = number(config, "threshold", 0.05f);
    of->halves = (int)number(config, "halves", ceilf(drive->ld * of->current / (0.9f * most * of->half_s)));
    if (kind != NULL && !of->single && strncmp(kind, "both", 4) != 0) {
        *refused = "test must be both or single";
    } else if (!(of->voltage > 0.0f && of->voltage <= most)) {
        *refused = "voltage must be more than 0 and at most 0.577 of the DC link";
    } else if (of->settle < 1 || of->count < 2 || of->count > 10000 || of->settle > 10000) {
        *refused = "settle must be from 1 to 10000, count from 2 to 10000";
    } else if (of->halves < 1 || drive->ld * of->current > most * of->half_s * (float)of->halves) {
        *refused = "the pulse's voltage would be more than 0.577 of the DC link: more halves, or less current";
    } else {
        return of;
    }
    free(of);
    return NULL;
}

/* Duties of a voltage vector, centred in what the link has, and no longer than it has. */
static void modulate(const test *of, float alpha, float beta, sts_legs *legs)
{
    float v[3], most, least, length = hypotf(alpha, beta), longest = 0.577f * of->drive.dc_link;
    int k;
    if (length > longest) {
        alpha *= longest / length;
        beta *= longest / length;
    }
    v[0] = alpha;
    v[1] = -0.5f * alpha + 0.8660254f * beta;
    v[2] = -0.5f * alpha - 0.8660254f * beta;
    most = fmaxf(v[0], fmaxf(v[1], v[2]));
    least = fminf(v[0], fminf(v[1], v[2]));
    for (k = 0; k < 3; k++) {
        legs->leg[k] = STS_DUTY;
        legs->duty[k] = 0.5f + (v[k] - 0.5f * (most + least)) / of->drive.dc_link;
    }
}

static void enter(test *of, enum stage stage)
{
    of->stage = stage;
    of->begun = of->tick;
    of->integral = 0.0f;
}

/* The pole from both ripples. */
static int32_t decided(const test *of, sts_result *result)
{
    float n = (float)of->count, plus = of->ripple[0] / n, minus = of->ripple[1] / n;
    float variance = (of->square[0] / n - plus * plus + of->square[1] / n - minus * minus) / (n - 1.0f);
    float difference = of->drive.stronger_pole < 0 ? minus - plus : plus - minus;
    result->angle = difference < 0.0f ? of->axis + PI : of->axis;
    result->pole_evidence = variance > 0.0f ? fabsf(difference) / sqrtf(variance) : 0.0f;
    result->pole_needed = of->least;
    if (variance > 0.0f && result->pole_evidence < of->least) {
        result->reason = 2;
        return STS_AXIS;
    }
    return STS_FOUND;
}

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    test *of = detector;
    const sts_sample *sample = sts_reading(readings, 0);
    float alpha = sample->current[0], beta = (sample->current[1] - sample->current[2]) * 0.57735027f;
    float c = cosf(of->axis), s = sinf(of->axis), along = alpha * c + beta * s, across = beta * c - alpha * s;
    float rise_along = (alpha - of->before[0]) * c + (beta - of->before[1]) * s;
    /* Interrupts since the stage began. What the first of them orders lasts from the next update to the one after it. */
    uint32_t since = of->tick - of->begun;
    if (sample->sensed[0] == STS_CLIPPED || sample->sensed[1] == STS_CLIPPED || sample->sensed[2] == STS_CLIPPED) {
        result->reason = 1;
        return STS_FAILED;
    }
    if (of->stage == AXIS) {
        float angle;
        if (since >= 2 && since % 2 == 0) {
            /* The forth half that ended now. */
            uint32_t half = since - 2;
            float x, y, rise;
            angle = 2.0f * PI / DIRECTIONS * (float)(half / 2 % DIRECTIONS);
            x = cosf(angle);
            y = sinf(angle);
            rise = (alpha - of->before[0]) * x + (beta - of->before[1]) * y;
            if (half >= 2 * DIRECTIONS) {
                of->second[0] += rise * (x * x - y * y);
                of->second[1] += rise * 2.0f * x * y;
            }
        }
        if (since == 2 * DIRECTIONS * TURNS) {
            of->axis = 0.5f * atan2f(of->second[1], of->second[0]) + (of->drive.ld > of->drive.lq ? 0.5f * PI : 0.0f);
            if (of->drive.stronger_pole == 0) {
                result->angle = of->axis;
                result->reason = 3;
                return STS_AXIS;
            }
            enter(of, REST);
        } else {
            float sign = since % 2 == 0 ? of->voltage : -of->voltage;
            angle = 2.0f * PI / DIRECTIONS * (float)(since / 2 % DIRECTIONS);
            modulate(of, sign * cosf(angle), sign * sinf(angle), legs);
        }
    }
    if (of->stage == REST) {
        /* Legs off: what flows returns to the link. */
        legs->leg[0] = legs->leg[1] = legs->leg[2] = STS_OFF;
        if (of->tick - of->begun == 20) {
            enter(of, of->single ? PULSE : FORTH_BIAS);
        }
    }
    since = of->tick - of->begun;
    if (of->stage == PULSE) {
        if (since == (uint32_t)of->halves + 1) {
            /* Without saturation, resistance, drops and dead time it would be `current`. */
            int stronger = along > of->current * (1.0f + of->threshold);
            result->angle = stronger == (of->drive.stronger_pole > 0) ? of->axis : of->axis + PI;
            return STS_FOUND;
        }
        {
            float v = since < (uint32_t)of->halves ? of->drive.ld * of->current / ((float)of->halves * of->half_s) : 0.0f;
            modulate(of, v * c, v * s, legs);
        }
    } else if (of->stage == FORTH_BIAS || of->stage == BACK_BIAS) {
        int sign = of->stage == BACK_BIAS;
        float target = sign ? -of->bias : of->bias;
        /* The loop sees the mean of both halves, so the square voltage is none of its business. */
        float mean = along - 0.5f * rise_along, gain = 0.2f * of->drive.ld / of->half_s;
        float square = since % 2 == 0 ? of->voltage : -of->voltage, d, q;
        of->integral += 0.05f * gain * (target - mean);
        d = gain * (target - mean) + of->integral + square;
        q = -0.2f * of->drive.lq / of->half_s * across;
        modulate(of, d * c - q * s, d * s + q * c, legs);
        if (since >= (uint32_t)of->settle + 2) {
            /* The half that ended now was ordered two interrupts ago, with the sign that this one has. */
            float ripple = since % 2 == 0 ? rise_along : -rise_along;
            of->ripple[sign] += ripple;
            of->square[sign] += ripple * ripple;
        }
        if (since + 1 == (uint32_t)(of->settle + 2 + of->count)) {
            if (sign) {
                return decided(of, result);
            }
            of->tick++;
            enter(of, BACK_BIAS);
            of->tick--;
        }
    }
    of->before[0] = alpha;
    of->before[1] = beta;
    of->tick++;
    return STS_GO_ON;
}

static const char *reason(uint32_t code)
{
    switch (code) {
    case 1: return "a current beyond the range of its sensor";
    case 2: return "both signs of the current have the same ripple";
    case 3: return "both poles draw the same current, as the drive knows the motor";
    default: return NULL;
    }
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof(sts_detector), .flags = STS_INTERRUPT | STS_DOUBLE_UPDATE | STS_REENTRANT,
        .name = "pole test", .create = create, .destroy = free, .reason = reason, .isr = isr, .pwm_hz = 12500, .sample_at = 0.0f,
        .update_delay = 1,
    };
    return abi == STS_ABI ? &table : NULL;
}
