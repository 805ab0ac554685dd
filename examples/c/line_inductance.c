/* The paper's method (Chen and Tao 2019) as an interrupt: line pulses ab, bc, ca, then a vector along the axis and one against.
 *
 *   20 kHz, one interrupt a period, sample at the update:
 *
 *      ab        bc        ca        along +d    along −d
 *     ┌──┐      ┌──┐      ┌──┐      ┌─────┐     ┌─────┐
 *   ──┘  └──────┘  └──────┘  └──────┘     └─────┘     └──    legs off in between: the current returns to the link
 *        ● end of pulse: L = (U − R i) t / i
 *
 * The line ab has its current at −30°, bc at 90°, ca at 210°, and the inductance 2 (L_A + L_B cos 2(θ − φ)) there. So the sum
 * of the three, each turned by twice its angle, points to 2θ. The larger of the last two currents is at the north pole.
 *
 * Build: cc -O2 -shared -fPIC -o line_inductance.so line_inductance.c -lm
 * Config: line=… current of the lines, pole=… of the two vectors, as shares of the rated current.
 */
#include "standstill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265f
#define PERIOD 50e-6f

enum { LINES = 3, PULSES = 5, SEGMENTS = 2 * PULSES - 1 };

static const float ANGLE[LINES] = {-PI / 6.0f, PI / 2.0f, 7.0f * PI / 6.0f};
static const uint8_t FIRST[LINES] = {0, 1, 2}, SECOND[LINES] = {1, 2, 0};

static sts_drive drive;
static uint32_t length[SEGMENTS]; /* in periods; odd segments are those in which all is off */
static uint32_t interval;         /* the one that begins now */
static float link_voltage;
static float line[LINES];
static float axis, amplitude;
static float along[2];

static float number(const char *config, const char *key, float usual)
{
    size_t size = strlen(key);
    const char *at = config;
    while (at != NULL && *at != '\0') {
        if (strncmp(at, key, size) == 0 && at[size] == '=') {
            return strtof(at + size + 1, NULL);
        }
        at = strchr(at, '\n');
        at = at == NULL ? NULL : at + 1;
    }
    return usual;
}

static void *create(const sts_drive *knows, const char *config, uint64_t seed, const char **refused)
{
    float line_share = number(config, "line", 0.3f), pole_share = number(config, "pole", 0.9f);
    float line_periods, pole_periods;
    int k;
    (void)seed;
    drive = *knows;
    amplitude = 0.5f * drive.dc_link;
    /* i = U t / (L_d + L_q) in a line; i = v t / L_d of a vector. */
    line_periods = line_share * drive.rated_current * (drive.ld + drive.lq) / drive.dc_link / PERIOD;
    pole_periods = pole_share * drive.rated_current * drive.ld / amplitude / PERIOD;
    if (line_periods < 0.2f || pole_periods < 0.5f) {
        *refused = "a period of 20 kHz raises too large a current in this motor";
        return NULL;
    }
    for (k = 0; k < SEGMENTS; k++) {
        float periods = k < 2 * LINES ? line_periods : pole_periods;
        length[k] = (uint32_t)fmaxf(1.0f, roundf(periods));
        if (k % 2 == 1) {
            length[k] = 3 * length[k] + 1;
        }
    }
    return &interval;
}

/* The segment of an interval, and which of its periods it is; SEGMENTS after the last. */
static int segment(uint32_t number_of, uint32_t *place)
{
    int k;
    for (k = 0; k < SEGMENTS && number_of >= length[k]; k++) {
        number_of -= length[k];
    }
    *place = number_of;
    return k;
}

static void order(int pulse, sts_legs *legs)
{
    int k;
    float v[3], turn;
    memset(legs, 0, sizeof *legs);
    if (pulse < LINES) {
        legs->leg[FIRST[pulse]] = STS_HIGH;
        legs->leg[SECOND[pulse]] = STS_LOW;
        return;
    }
    turn = pulse == LINES ? axis : axis + PI;
    v[0] = amplitude * cosf(turn);
    v[1] = amplitude * cosf(turn - 2.0f * PI / 3.0f);
    v[2] = amplitude * cosf(turn + 2.0f * PI / 3.0f);
    for (k = 0; k < 3; k++) {
        legs->leg[k] = STS_DUTY;
        legs->duty[k] = fminf(1.0f, fmaxf(0.0f, 0.5f + v[k] / link_voltage));
    }
}

static void find_axis(void)
{
    float x = 0.0f, y = 0.0f, sign = drive.ld > drive.lq ? 1.0f : -1.0f;
    int k;
    for (k = 0; k < LINES; k++) {
        x += sign * line[k] * cosf(2.0f * ANGLE[k]);
        y += sign * line[k] * sinf(2.0f * ANGLE[k]);
    }
    axis = 0.5f * atan2f(y, x);
}

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    const sts_sample *sample = sts_reading(readings, 0);
    uint32_t place;
    int ended, next, k;
    (void)detector;
    for (k = 0; k < 3; k++) {
        if (sample->sensed[k] == STS_CLIPPED) {
            result->reason = 1;
            return STS_FAILED;
        }
    }
    link_voltage = sample->dc_link;
    /* Interval 0 is off; the segments begin with interval 1. */
    if (interval >= 2) {
        ended = segment(interval - 2, &place);
        if (ended % 2 == 0 && ended < SEGMENTS && place + 1 == length[ended]) {
            int pulse = ended / 2;
            if (pulse < LINES) {
                float current = 0.5f * (sample->current[FIRST[pulse]] - sample->current[SECOND[pulse]]);
                float seconds = PERIOD * (float)length[ended];
                if (current < 0.01f * drive.rated_current) {
                    result->reason = 2;
                    return STS_FAILED;
                }
                line[pulse] = (link_voltage - drive.resistance * current) * seconds / current;
                if (pulse == LINES - 1) {
                    find_axis();
                }
            } else {
                float turn = pulse == LINES ? axis : axis + PI;
                float beta = (sample->current[1] - sample->current[2]) * 0.57735027f;
                along[pulse - LINES] = sample->current[0] * cosf(turn) + beta * sinf(turn);
            }
            if (pulse == PULSES - 1) {
                int north = along[0] >= along[1];
                if (drive.stronger_pole < 0) {
                    north = !north;
                }
                result->angle = north ? axis : axis + PI;
                return STS_FOUND;
            }
        }
    }
    next = segment(interval, &place);
    if (next % 2 == 0 && next < SEGMENTS) {
        order(next / 2, legs);
    } else {
        memset(legs, 0, sizeof *legs);
    }
    interval++;
    return STS_GO_ON;
}

static const char *reason(uint32_t code)
{
    switch (code) {
    case 1: return "a current beyond the range of its sensor";
    case 2: return "a line without current: is the motor connected?";
    default: return NULL;
    }
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof(sts_detector), .flags = STS_INTERRUPT, .name = "line inductance",
        .create = create, .reason = reason, .isr = isr, .pwm_hz = 20000, .sample_at = 0.0f, .update_delay = 1,
    };
    return abi == STS_ABI ? &table : NULL;
}
