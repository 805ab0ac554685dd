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
 * Then the axis once more: a rotor that has moved by 10 degrees is a failure. It needs a brake: at i_d < 0 the rotor stands on its head.
 *
 * Build: cc -O2 -shared -fPIC -o pole_test.so pole_test.c -lm
 * Config: test=both or single, voltage=… V of the injection, bias=… A and least=… (standard deviations that the ripples must
 *         differ by; 0: any difference decides), floor=… (what drive and sensors make of the ripples, unlike for both signs, as a
 *         share), settle=… and count=… halves for each sign, current=… A, threshold=… (a share), halves=… that the single pulse
 *         lasts. What is left out follows from what the drive knows.
 */
#include "standstill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DIRECTIONS 16
#define TURNS 3                      /* the first does not count */
#define BATCH 10                     /* halves whose mean is one number: neighbouring rises share a sample */
#define MOVED 0.17f                  /* rad that the axis may have moved */
#define PI 3.14159265f

enum stage { AXIS, REST, FORTH_BIAS, BACK_BIAS, PULSE, AXIS_AGAIN };
enum reasons { CLIPPED = 1, ALIKE, NO_POLES, HIDDEN, TURNED };

typedef struct test {
    sts_drive drive;
    float half_s;                    /* of a half period, s */
    float voltage, bias, least, floor, current, threshold;
    int settle, count, halves, single;
    enum stage stage;
    uint32_t tick, begun;            /* interrupts so far; the one at which the stage began */
    float before[2];                 /* current at the last interrupt, A */
    float second[2];                 /* second harmonic of the rises */
    float axis, integral;
    float first;                     /* the first ripple, from which the others are counted: no digits are lost */
    double batch, sum[2], square[2]; /* of the batch so far; over the batches, for each sign of the bias */
    int opposite, tested;            /* north is the other end; the pole test is done */
    float evidence;
} test;

static const char *const KEYS[] = { "test", "voltage", "bias", "least", "floor", "settle", "count", "current", "threshold", "halves" };

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

/* A number, within its range; not a number where it is none or beyond. */
static float number(const char *config, const char *key, float usual, float low, float high)
{
    const char *found = text(config, key);
    char *end;
    float value = usual;
    if (found != NULL) {
        value = strtof(found, &end);
        if (end == found || (*end != '\n' && *end != '\0')) {
            return NAN;
        }
    }
    return value >= low && value <= high ? value : NAN;
}

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

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    const char *kind = text(config, "test");
    float l = fminf(drive->ld, drive->lq), most = 0.577f * drive->dc_link, rated = drive->rated_current;
    float settle, count, halves;
    test *of = calloc(1, sizeof *of);
    (void)seed;
    if (of == NULL) {
        *refused = "no memory";
        return NULL;
    }
    of->drive = *drive;
    of->half_s = 0.5e-9f * (float)drive->period_ns;
    of->single = kind != NULL && strncmp(kind, "single", 6) == 0;
    of->voltage = number(config, "voltage", fminf(0.4f * drive->dc_link, 0.2f * rated * l / of->half_s), 0.0f, 0.5f * drive->dc_link);
    of->bias = number(config, "bias", 0.5f * rated, 1e-3f * rated, 2.0f * rated);
    of->least = number(config, "least", 0.0f, 0.0f, 1000.0f);
    of->floor = number(config, "floor", 0.001f, 0.0f, 1.0f);
    settle = number(config, "settle", 100.0f, 1.0f, 10000.0f);
    count = number(config, "count", 100.0f, 2.0f * BATCH, 10000.0f);
    of->current = number(config, "current", rated, 1e-3f * rated, 10.0f * rated);
    of->threshold = number(config, "threshold", 0.05f, -1.0f, 1.0f);
    halves = number(config, "halves", ceilf(drive->ld * of->current / (0.9f * most * of->half_s)), 1.0f, 10000.0f);
    if (!known(config)) {
        *refused = "keys are test, voltage, bias, least, floor, settle, count, current, threshold and halves";
    } else if (kind != NULL && !of->single && strncmp(kind, "both", 4) != 0) {
        *refused = "test must be both or single";
    } else if (isnan(of->voltage)) {
        *refused = "voltage must be a number from 0 to half the DC link: beyond, its pulses are as short as the dead time";
    } else if (isnan(of->bias) || isnan(of->least) || isnan(of->floor)) {
        *refused = "bias must be from 0.001 to 2 times the rated current, least from 0 to 1000, floor from 0 to 1";
    } else if (isnan(settle) || isnan(count) || fmodf(count, BATCH) != 0.0f) {
        *refused = "settle must be from 1 to 10000, count a multiple of 10 from 20 to 10000";
    } else if (isnan(of->current) || isnan(of->threshold)) {
        *refused = "current must be from 0.001 to 10 times the rated one, threshold from -1 to 1";
    } else if (isnan(halves) || drive->ld * of->current > most * of->half_s * halves) {
        *refused = "halves must be from 1 to 10000, and so many that the pulse takes no more than 0.577 of the DC link";
    } else if (of->voltage * of->half_s / l < 8.0f * drive->amps_per_count) {
        *refused = "a vector of this voltage raises the current by less than 8 counts of the converters: more voltage";
    } else {
        of->settle = (int)settle;
        of->count = (int)count;
        of->halves = (int)halves;
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

static void enter(test *of, enum stage stage, uint32_t begun)
{
    of->stage = stage;
    of->begun = begun;
    of->integral = 0.0f;
    of->second[0] = of->second[1] = 0.0f;
}

/* The pole from both ripples. What the mean of so many batches scatters by counts, and the floor that no mean takes away. */
static void decide(test *of)
{
    double n = (double)(of->count / BATCH), plus = of->sum[0] / n, minus = of->sum[1] / n;
    double scatter = (of->square[0] / n - plus * plus + of->square[1] / n - minus * minus) / (n - 1.0);
    double floor = of->floor * (of->first + 0.5 * (plus + minus));
    double difference = of->drive.stronger_pole < 0 ? minus - plus : plus - minus;
    double deviation = sqrt(fmax(scatter, 0.0) + floor * floor);
    of->opposite = difference < 0.0;
    of->evidence = deviation > 0.0 ? (float)(fabs(difference) / deviation) : 0.0f;
}

/* The angle of north, or of one end of the axis. */
static int32_t answer(const test *of, sts_result *result)
{
    result->angle = of->opposite ? of->axis + PI : of->axis;
    if (!of->single) {
        result->pole_evidence = of->evidence;
        result->pole_needed = of->least;
        if (of->evidence < of->least) {
            result->reason = ALIKE;
            return STS_AXIS;
        }
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
        result->reason = CLIPPED;
        return STS_FAILED;
    }
    if (sample->sensed[0] == STS_HIDDEN || sample->sensed[1] == STS_HIDDEN || sample->sensed[2] == STS_HIDDEN) {
        result->reason = HIDDEN;
        return STS_FAILED;
    }
    if (of->stage == AXIS || of->stage == AXIS_AGAIN) {
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
            float axis = 0.5f * atan2f(of->second[1], of->second[0]) + (of->drive.ld > of->drive.lq ? 0.5f * PI : 0.0f);
            if (of->stage == AXIS_AGAIN) {
                /* Half turns are the other end of the same axis. */
                float by = remainderf(axis - of->axis, PI);
                if (fabsf(by) > MOVED) {
                    result->reason = TURNED;
                    return STS_FAILED;
                }
                of->axis += by;
                return answer(of, result);
            }
            of->axis = axis;
            if (of->drive.stronger_pole == 0) {
                result->angle = of->axis;
                result->reason = NO_POLES;
                return STS_AXIS;
            }
            enter(of, REST, of->tick);
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
            if (of->tested) {
                enter(of, AXIS_AGAIN, of->tick + 1);
            } else {
                enter(of, of->single ? PULSE : FORTH_BIAS, of->tick);
            }
        }
    }
    since = of->tick - of->begun;
    if (of->stage == PULSE) {
        if (since == (uint32_t)of->halves + 1) {
            /* Without saturation, resistance, drops and dead time it would be `current`. */
            int stronger = along > of->current * (1.0f + of->threshold);
            of->opposite = stronger != (of->drive.stronger_pole > 0);
            of->tested = 1;
            enter(of, REST, of->tick + 1);
        } else {
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
            uint32_t counted = since - (uint32_t)of->settle - 2;
            float ripple = since % 2 == 0 ? rise_along : -rise_along;
            if (counted == 0 && !sign) {
                of->first = ripple;
            }
            of->batch += (double)(ripple - of->first) / BATCH;
            if (counted % BATCH == BATCH - 1) {
                of->sum[sign] += of->batch;
                of->square[sign] += of->batch * of->batch;
                of->batch = 0.0;
            }
            if (counted + 1 == (uint32_t)of->count) {
                if (sign) {
                    decide(of);
                    of->tested = 1;
                }
                enter(of, sign ? REST : BACK_BIAS, of->tick + 1);
            }
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
    case CLIPPED: return "a current beyond the range of its sensor";
    case ALIKE: return "both signs of the current make ripples that differ by less than `least` deviations";
    case NO_POLES: return "both poles draw the same current, as the drive knows the motor";
    case HIDDEN: return "a sensor that does not see its phase: this test needs all three currents, at each interrupt";
    case TURNED: return "the rotor has moved by more than 10 degrees meanwhile: it needs a brake";
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
