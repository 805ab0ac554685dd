/* A pulse of phase a against both others, until a threshold or for its length, and one reading at its end, of which one field becomes
 * the angle: `field=…`. Refuses what a drive does not offer: `needs=…`. */
#include "standstill.h"

#include <stdlib.h>
#include <string.h>

static char field[32];
static float until;
static int pulses;
static sts_drive knows;

static const char *value(const char *config, const char *key)
{
    const char *at = strstr(config, key);
    return at == NULL ? NULL : at + strlen(key);
}

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    const char *name = value(config, "field="), *threshold = value(config, "until=");
    size_t length = name == NULL ? 0 : strcspn(name, "\n");
    (void)seed;
    if (drive->size != sizeof *drive || length >= sizeof field) {
        *refused = "another drive than its header has";
        return NULL;
    }
    memcpy(field, length == 0 ? "" : name, length);
    field[length] = '\0';
    knows = *drive;
    until = threshold == NULL ? 0.0f : strtof(threshold, NULL);
    if (strcmp(field, "log") == 0) {
        sts_log(drive, "made\n");
    }
    return &pulses;
}

static float of(const sts_sample *s)
{
#define IS(name) if (strcmp(field, #name) == 0) return (float)s->name
    IS(captured); IS(comparator); IS(capture_ticks); IS(link_current); IS(link_current_count); IS(link_sensed);
    IS(terminal[0]); IS(terminal[1]); IS(terminal_count[0]); IS(terminal_count[2]); IS(terminal_sensed[0]);
    IS(current[0]); IS(time_ns); IS(dc_link_count);
    return 0.0f;
}

static int32_t step(void *detector, const sts_readings *readings, sts_command *command, sts_result *result)
{
    int k;
    (void)detector;
    if (readings->size != sizeof *readings || command->size != sizeof *command || result->size != sizeof *result) {
        return STS_FAILED;
    }
    if (strcmp(field, "log") == 0) {
        sts_log(&knows, pulses == 0 ? "begins" : "ends");
    }
    if (pulses++ == 0 || strncmp(field, "ever", 4) == 0) {
        command->stages = 2;
        for (k = 0; k < 3; k++) {
            command->stage[0].leg[k] = k == 0 ? STS_HIGH : STS_LOW;
        }
        if (strcmp(field, "duty") == 0) {
            command->stage[0].leg[1] = STS_DUTY;
        }
        command->stage[0].duration_ns = 300000;
        command->stage[1].duration_ns = strcmp(field, "ever-short") == 0 ? 100 : 500000;
        command->samples = 1;
        command->until = until;
        command->first_ns = strcmp(field, "late") == 0 ? 500001 : until == 0.0f ? 300000 : 0;
        return STS_GO_ON;
    }
    result->angle = of(sts_reading(readings, 0));
    return STS_FOUND;
}

static void destroy(void *detector)
{
    (void)detector;
    if (strcmp(field, "log") == 0) {
        sts_log(&knows, "gone");
    }
}

static const char *probe(void *detector, uint32_t channel, float *value)
{
    (void)detector;
    *value = (float)pulses;
    return channel == 0 ? "pulses" : NULL;
}

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {
        .abi = STS_ABI, .size = sizeof table, .name = "readings", .create = create, .step = step, .probe = probe,
        .destroy = destroy,
    };
    return abi == STS_ABI ? &table : NULL;
}
