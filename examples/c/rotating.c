/* Rotating injection, at interrupt level, as open firmware for electronic speed controllers has it.
 *
 *   12.5 kHz, an interrupt at each update, two in a period:
 *
 *            half 0      half 1     half 0      half 1
 *          |  +v at 0° | −v at 0° | +v at 22° | −v at 22° | …       16 directions are a turn
 *   sample ●           ●          ●           ●
 *           └─ rise ──┘            └─ rise ──┘
 *
 * A vector is applied for one half period forth and one back. How far the current rises in its direction is larger where the
 * inductance is less: along d (second harmonic of the rises over the direction), and towards north, where the current adds to
 * the magnet's flux and saturates the iron (first harmonic).
 *
 * What is kept in globals here is kept so on purpose: firmware does, and the bench sets them back before each start.
 *
 * Build: cc -O2 -shared -fPIC -o rotating.so rotating.c -lm
 * Config: voltage=… V, turns=… that count, ignore=… turns before them, pole=vote or threshold, threshold=… (a share),
 *         read=rise, or level: the current at the end of a half period, as if it had begun at zero,
 *         begin=forth, or back: the first vector goes back without having gone forth, as when the interrupt is enabled at the
 *         other end of the counter. What it leaves behind is a current of one rise, which has to settle.
 */
#include "standstill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DIRECTIONS 16
#define PI 3.14159265f

/* Options. */
static float voltage, threshold;
static int turns, ignore, by_threshold, by_level;
static uint32_t lead;                  /* halves of the turn before the first one that the injection begins with */
/* What the drive knows. */
static float dc_link;
static int inverted, south;
/* State. */
static uint32_t tick;
static float before[2];
static float sum1[2], sum2[2], sum0;   /* harmonics of the rises over all turns that count */
static float turn1[2], turn2[2];       /* of this turn */
static float square2[3];               /* of the turns' second harmonics, for their scatter: xx, xy, yy */
static float turn_first[64][2];        /* first harmonics of the turns */

static const char *const KEYS[] = { "pole", "voltage", "turns", "ignore", "threshold", "read", "begin" };

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
    return found == NULL ? usual : parsed(found);
}

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    const char *pole = text(config, "pole");
    float whole[2];
    (void)seed;
    if (!known(config)) {
        *refused = "the keys of the configuration are pole, voltage, turns, ignore, threshold, read, begin";
        return NULL;
    }
    dc_link = drive->dc_link;
    inverted = drive->ld > drive->lq;
    south = drive->stronger_pole < 0;
    voltage = number(config, "voltage", 0.4f * dc_link);
    whole[0] = number(config, "turns", 8.0f);
    whole[1] = number(config, "ignore", 1.0f);
    threshold = number(config, "threshold", 0.002f);
    by_level = text(config, "read") != NULL && strncmp(text(config, "read"), "level", 5) == 0;
    lead = text(config, "begin") != NULL && strncmp(text(config, "begin"), "back", 4) == 0 ? 2 * DIRECTIONS - 1 : 0;
    by_threshold = pole != NULL && strncmp(pole, "threshold", 9) == 0;
    if (pole != NULL && !by_threshold && strncmp(pole, "vote", 4) != 0) {
        *refused = "pole must be vote or threshold";
        return NULL;
    }
    /* What three legs can make in any direction. */
    if (!(threshold >= 0.0f)) {
        *refused = "threshold must be 0 or more";
        return NULL;
    }
    if (!(voltage > 0.0f && voltage <= 0.577f * dc_link)) {
        *refused = "voltage must be more than 0 and at most 0.577 of the DC link";
        return NULL;
    }
    if (!(whole[0] >= 1.0f && whole[0] <= 64.0f && whole[1] >= 0.0f && whole[1] <= 64.0f)) {
        *refused = "turns must be from 1 to 64, ignore from 0 to 64";
        return NULL;
    }
    turns = (int)whole[0];
    ignore = (int)whole[1];
    return &tick;
}

static void direction(uint32_t half, float *x, float *y)
{
    float angle = 2.0f * PI / DIRECTIONS * (float)(half / 2 % DIRECTIONS);
    *x = cosf(angle);
    *y = sinf(angle);
}

/* Duties of a voltage vector, centred in what the link has. */
static void modulate(float alpha, float beta, sts_legs *legs)
{
    float v[3], most, least;
    int k;
    v[0] = alpha;
    v[1] = -0.5f * alpha + 0.8660254f * beta;
    v[2] = -0.5f * alpha - 0.8660254f * beta;
    most = fmaxf(v[0], fmaxf(v[1], v[2]));
    least = fminf(v[0], fminf(v[1], v[2]));
    for (k = 0; k < 3; k++) {
        legs->leg[k] = STS_DUTY;
        legs->duty[k] = 0.5f + (v[k] - 0.5f * (most + least)) / dc_link;
    }
}

/* The turns' first harmonics along the axis: mean and standard deviation of the mean. */
static float evidence(float c, float s, float *deviation)
{
    float mean = 0.0f, square = 0.0f;
    int k;
    for (k = 0; k < turns; k++) {
        mean += (turn_first[k][0] * c + turn_first[k][1] * s) / (float)turns;
    }
    for (k = 0; k < turns; k++) {
        float off = turn_first[k][0] * c + turn_first[k][1] * s - mean;
        square += off * off;
    }
    *deviation = turns > 1 ? sqrtf(square / (float)(turns - 1) / (float)turns) : 0.0f;
    return mean;
}

static int32_t done(sts_result *result)
{
    float axis = 0.5f * atan2f(sum2[1], sum2[0]);
    float c, s, mean, deviation, n = (float)turns, length2 = sum2[0] * sum2[0] + sum2[1] * sum2[1];
    int k, votes = 0, opposite;
    if (inverted) {
        axis += 0.5f * PI;
    }
    c = cosf(axis);
    s = sinf(axis);
    mean = evidence(c, s, &deviation);
    if (south) {
        mean = -mean;
    }
    if (by_threshold) {
        /* Only a clear south turns the axis round: by how much north exceeds south, as a share of both. */
        float difference = 2.0f * mean * n / (sum0 + sqrtf(length2));
        opposite = difference < -threshold;
    } else {
        for (k = 0; k < turns; k++) {
            float along = turn_first[k][0] * c + turn_first[k][1] * s;
            votes += (south ? -along : along) >= 0.0f ? 1 : -1;
        }
        /* An even vote is settled by all turns together. */
        opposite = votes < 0 || (votes == 0 && mean < 0.0f);
    }
    result->angle = opposite ? axis + PI : axis;
    if (turns > 1 && deviation > 0.0f) {
        /* Across the second harmonic: half of its angle's scatter. */
        float across = square2[0] * sum2[1] * sum2[1] - 2.0f * square2[1] * sum2[0] * sum2[1] + square2[2] * sum2[0] * sum2[0];
        result->angle_deviation = 0.5f * sqrtf(across / length2 / length2 * n / (n - 1.0f));
        result->pole_evidence = (opposite ? -mean : mean) / deviation;
        result->pole_needed = 0.0f;
    }
    return STS_FOUND;
}

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    const sts_sample *sample = sts_reading(readings, 0);
    float alpha = sample->current[0];
    float beta = (sample->current[1] - sample->current[2]) * 0.57735027f;
    float x, y;
    (void)detector;
    if (sample->sensed[0] == STS_CLIPPED || sample->sensed[1] == STS_CLIPPED || sample->sensed[2] == STS_CLIPPED) {
        result->reason = 1;
        return STS_FAILED;
    }
    /* The half that ended now. What this interrupt orders begins with the next update: injection is there from half 2 on. */
    if (tick >= 3 && (tick - 3 + lead) % 2 == 0) {
        uint32_t half = tick - 3 + lead;
        int turn = (int)(half / (2 * DIRECTIONS)) - (lead > 0 ? 1 : 0) - ignore;
        float rise;
        direction(half, &x, &y);
        if (by_level) {
            before[0] = before[1] = 0.0f;
        }
        rise = (alpha - before[0]) * x + (beta - before[1]) * y;
        if (turn >= 0) {
            turn1[0] += rise * x;
            turn1[1] += rise * y;
            turn2[0] += rise * (x * x - y * y);
            turn2[1] += rise * 2.0f * x * y;
            sum0 += rise;
            if (half % (2 * DIRECTIONS) == 2 * (DIRECTIONS - 1)) {
                int k;
                for (k = 0; k < 2; k++) {
                    sum1[k] += turn1[k];
                    sum2[k] += turn2[k];
                    turn_first[turn][k] = turn1[k];
                }
                square2[0] += turn2[0] * turn2[0];
                square2[1] += turn2[0] * turn2[1];
                square2[2] += turn2[1] * turn2[1];
                turn1[0] = turn1[1] = turn2[0] = turn2[1] = 0.0f;
                if (turn + 1 == turns) {
                    return done(result);
                }
            }
        }
    }
    before[0] = alpha;
    before[1] = beta;
    if (tick >= 1) {
        uint32_t half = tick - 1 + lead;
        float sign = half % 2 == 0 ? voltage : -voltage;
        direction(half, &x, &y);
        modulate(sign * x, sign * y, legs);
    }
    tick++;
    return STS_GO_ON;
}

static const char *reason(uint32_t code)
{
    return code == 1 ? "a current beyond the range of its sensor" : NULL;
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof(sts_detector), .flags = STS_INTERRUPT | STS_DOUBLE_UPDATE, .name = "rotating injection",
        .create = create, .reason = reason, .isr = isr, .pwm_hz = 12500, .sample_at = 0.0f, .update_delay = 1,
    };
    return abi == STS_ABI ? &table : NULL;
}
