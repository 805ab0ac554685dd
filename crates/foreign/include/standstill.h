/* standstill.h: detectors written in C, in the loop of Standstill. ABI 2.
 *
 * SI units; angles in electrical radians from the axis of phase a; currents flow into the motor.
 * A library exports sts_entry(). docs/firmware.md explains it with examples.
 *
 * Sizes.     Structs that may grow begin with `size`, their size in bytes where they were made; samples lie `stride` bytes apart.
 *            Later versions of ABI 2 append fields: what lies beyond `size` does not exist and must not be touched, and a field
 *            that a library does not write keeps the meaning that it has at zero. STS_ABI rises when this no longer suffices.
 *            Libraries of ABI 1 are still loaded; they get what ABI 1 has.
 * Lifetimes. `drive` and `config` are valid during create() alone, but for drive->log and drive->log_to: until destroy() returns.
 *            Readings, commands, legs and results are valid during the call. Texts that a library returns must be valid until
 *            the next call of the same detector; `name` and the table as long as the library is loaded.
 * Threads.   Calls of one image never overlap; different images (copies of the library) are called at the same time.
 */
#ifndef STANDSTILL_H
#define STANDSTILL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define STS_ABI 2u

/* What a leg does. */
enum sts_leg {
    STS_OFF = 0,  /* both switches off */
    STS_LOW = 1,  /* lower switch on */
    STS_HIGH = 2, /* upper switch on */
    STS_DUTY = 3, /* PWM: the upper switch for this share (0 to 1), centred but for sts_legs.shift; at interrupt level a share of the time up to the
                     next update, next to the middle of the period */
    STS_RISE = 4, /* command level only: low, and from edge_ns after the begin of the stage on high */
    STS_FALL = 5  /* command level only: high, and from edge_ns after the begin of the stage on low */
};

/* Where a current comes from. */
enum sts_sensed {
    STS_MEASURED = 0, /* its own sensor */
    STS_DERIVED = 1,  /* the other two phases */
    STS_CLIPPED = 2,  /* the end of the converter's range: it may be more */
    STS_HIDDEN = 3    /* no sensor sees it now; the value is meaningless */
};

/* What step() and isr() return. */
enum sts_status {
    STS_GO_ON = 0, /* the command, or the legs, are to be carried out */
    STS_FOUND = 1, /* result: the angle of the north pole */
    STS_AXIS = 2,  /* result: the angle of one end of the axis; which one is north is not known (reason) */
    STS_FAILED = 3 /* result: no angle (reason) */
};

enum sts_flags {
    STS_INTERRUPT = 1,     /* isr() is called, otherwise step() */
    STS_DOUBLE_UPDATE = 2, /* isr() runs twice in each PWM period: counting up and counting down */
    STS_REENTRANT = 4      /* nothing is kept but in what create() returns: one image serves all, no memory is set back */
};

/* What the drive knows, and nothing else of the motor. */
typedef struct sts_drive {
    uint32_t size;
    uint32_t current_bits;  /* resolution of the current converters, also of that of a shunt in the DC link; 0: none */
    uint32_t dc_link_bits;  /* resolution of the DC link's converter; 0: none */
    float amps_per_count;   /* a current is amps_at_zero + count * amps_per_count; a count is the sum of all conversions of a sample */
    float amps_at_zero;
    float volts_per_count;
    float dc_link;          /* nominal, V */
    float rated_current;    /* of a phase, A, peak */
    float resistance;       /* of a phase, ohm */
    float ld;               /* H, without current */
    float lq;               /* H, without current */
    float flux;             /* of the magnet, Wb; 0 without magnet */
    float dead_time;        /* s */
    int32_t stronger_pole;  /* near rated current, 1: the north pole draws the larger current, -1: the south pole; 0: neither */
    uint64_t period_ns;     /* of the PWM carrier */
    uint64_t settle_ns;     /* after a request to a leg, how long shunts are not read: dead time and settling; 0: not at all */
    uint32_t terminal_bits; /* resolution of the converters behind the terminals' dividers; 0: none */
    float terminal_volts_per_count;
    float timer_tick;       /* of the timer that captures trips of comparators, s; 0: there is none, and no sts_command.until */
    float comparator_delay; /* from the threshold to the captured time, s */
    float comparator_offset; /* standard deviation of a comparator's offset, A */
    float comparator_noise; /* of the current at a comparator, A rms */
    uint32_t comparators;   /* 0: none, 1: one for the current in the DC link, 6: two for each leg, one a direction */
    float comparator_delay_spread; /* standard deviation of a comparator's delay, s */
    float comparator_blanking; /* after the begin of each stage, how long comparators are ignored, s */
    float threshold_highest; /* of sts_command.until, A; 0: any */
    void *log_to;
    void (*log)(void *log_to, const char *text); /* see sts_log() */
} sts_drive;

/* A line for the log, with its time: an event of `standstill trace`, and on standard error in other commands. At most 1000 lines
 * of a detection are kept. A firmware that prints may as well print: what goes to standard output is not mixed with results. */
static inline void sts_log(const sts_drive *drive, const char *text)
{
    drive->log(drive->log_to, text);
}

/* One trigger of the converters. */
typedef struct sts_sample {
    uint64_t time_ns;          /* isr(): since the start of the detection; step(): since the start of the command, of one with
                                  `until` since the end of its first stage */
    float current[3];          /* of the phases, A */
    float dc_link;             /* V */
    uint32_t current_count[3]; /* codes of the converters; 0 for a phase without sensor */
    uint32_t dc_link_count;
    uint8_t sensed[3];         /* enum sts_sensed */
    uint8_t dc_link_clipped;
    uint8_t half;              /* isr() twice a period: 0 while the counter counts up (begins with all legs low: a duty ends the
                                  half high), 1 while it counts down (begins with all legs high, but those of duty 0) */
    uint8_t link_sensed;       /* enum sts_sensed; STS_HIDDEN without a shunt in the DC link */
    uint8_t captured;          /* 1: a comparator has tripped in this command, up to this sample */
    uint8_t comparator;        /* then its leg, 0 to 2; 0 where one comparator serves all */
    float link_current;        /* through the shunt between link capacitor and bridge, A, positive into the bridge */
    uint32_t link_current_count;
    float terminal[3];         /* voltages of the terminals against the negative rail, V */
    uint32_t terminal_count[3];
    uint8_t terminal_sensed[3]; /* enum sts_sensed; STS_HIDDEN without dividers */
    uint8_t reserved;
    uint32_t capture_ticks;    /* if captured: whole ticks of the timer from the start of the command to the trip */
} sts_sample;

/* Samples in order of time: read them by sts_reading(). */
typedef struct sts_readings {
    uint32_t size;
    uint32_t count;
    uint32_t stride;   /* from one sample to the next, bytes: not sizeof(sts_sample) if the program is newer than the library */
    uint32_t reserved;
    const void *first; /* not to be indexed */
} sts_readings;

/* The sample of this number, from 0 to count - 1. */
static inline const sts_sample *sts_reading(const sts_readings *readings, uint32_t number)
{
    return (const sts_sample *)((const char *)readings->first + (size_t)number * readings->stride);
}

/* What the three legs do from the next update on. */
typedef struct sts_legs {
    uint32_t size;
    uint8_t leg[3]; /* enum sts_leg */
    uint8_t reserved;
    float duty[3];  /* of STS_DUTY */
    float shift[3]; /* of STS_DUTY, with one update a period: the pulse so much later than centred, a share of the period; at most half
                       the duty, and half of what is left of the period. With two updates each half has a duty of its own instead */
    float sample_at; /* the first trigger after that update, as in sts_detector, whose values stand here at first */
    float sample_every;
} sts_legs;

typedef struct sts_stage {
    uint8_t leg[3];      /* enum sts_leg */
    uint8_t reserved;
    float duty[3];       /* of STS_DUTY */
    uint32_t edge_ns[3]; /* of STS_RISE and STS_FALL, at most duration_ns */
    uint32_t reserved_too;
    uint64_t duration_ns;
} sts_stage;

/* Command level: one or two stages, and when the converters sample meanwhile, counted from the start of the command. */
typedef struct sts_command {
    uint32_t size;
    uint32_t stages;      /* 1 or 2 */
    sts_stage stage[2];
    uint32_t samples;     /* number of triggers */
    float until;          /* 0: the first stage lasts duration_ns. Else a threshold in A: the first stage ends when a comparator
                             trips there, at the latest after duration_ns. In the first stage no leg may switch: off, low or high.
                             The second stage then lasts its whole duration, and first_ns counts from its begin */
    uint64_t first_ns;
    uint64_t interval_ns;
} sts_command;

/* How a detection ends. What the detector does not know stays as it is; a pole_evidence that is no number is a failure. */
typedef struct sts_result {
    uint32_t size;
    float angle;           /* rad, at most 1000 either way */
    float angle_deviation; /* standard deviation that the angle has, rad */
    float pole_evidence;   /* for the north pole at `angle`, in standard deviations; negative: for the other end */
    float pole_needed;     /* what the detector asks for before it names a pole, 0 or more; goes with pole_evidence */
    uint32_t reason;       /* of STS_AXIS and STS_FAILED: given to reason() */
    float age;             /* s from the instant for which the angle holds to the end of the last command, from 0 to the detection's duration; only if `size` has it */
} sts_result;

typedef struct sts_detector {
    uint32_t abi;          /* STS_ABI */
    uint32_t size;         /* sizeof(sts_detector) */
    uint32_t flags;        /* enum sts_flags */
    uint32_t pwm_hz;       /* interrupt level: frequency of the PWM */
    float sample_at;       /* interrupt level: when the converters sample, as a share (0 to 1) of the time between two updates */
    uint32_t update_delay; /* interrupt level: what isr() returns takes effect so many updates later, 1 to 4; 1: at the next */
    const char *name;

    /* A detector, ready for its first call; config: lines KEY=VALUE. NULL: refused, then *refused says why. */
    void *(*create)(const sts_drive *drive, const char *config, uint64_t seed, const char **refused);
    void (*destroy)(void *detector);
    /* The text of a reason; NULL where there are none. */
    const char *(*reason)(uint32_t code);
    /* Command level: from the readings of the last command (none at first) to the next one. */
    int32_t (*step)(void *detector, const sts_readings *readings, sts_command *command, sts_result *result);
    /* Interrupt level: from the samples since the last update to the legs; they hold what was returned last. */
    int32_t (*isr)(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result);
    /* Variables of yours as channels of `standstill trace`: the name of the channel of this number, from 0 on, and its value now; NULL:
       there are no more, 64 at most. Asked after each call of step() or isr(), of trials that are traced alone. NULL: none. */
    const char *(*probe)(void *detector, uint32_t channel, float *value);
    /* Interrupt level: several triggers between two updates, as a shunt in the DC link needs them. isr() runs with the last one. */
    uint32_t samples;      /* 1 to 16; 0 is 1 */
    float sample_every;    /* from one to the next, a share of the time between two updates */
    /* Interrupt level: what runs beside the interrupt, once in task_ns (1000 to 10^10), for no time of its own. Its phase against the
       interrupts is drawn for each trial. An interrupt that is due at the same time goes first. NULL: none. */
    void (*task)(void *detector, uint64_t time_ns);
    uint64_t task_ns;
} sts_detector;

#if defined(_WIN32)
#define STS_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define STS_EXPORT __attribute__((visibility("default")))
#else
#define STS_EXPORT
#endif

/* The library's table; NULL: it does not speak this version. */
STS_EXPORT const sts_detector *sts_entry(uint32_t abi);

/* A compiler that lays structs out in another way than the program does is told so here. */
#if defined(__cplusplus)
#define STS_HOLDS(name, fact) static_assert(fact, #name)
#else
#define STS_HOLDS(name, fact) typedef char sts_holds_##name[(fact) ? 1 : -1]
#endif
STS_HOLDS(sample, sizeof(sts_sample) == 88 && offsetof(sts_sample, link_current) == 48);
STS_HOLDS(readings, sizeof(sts_readings) == 16 + sizeof(void *) && offsetof(sts_readings, first) == 16);
STS_HOLDS(legs, sizeof(sts_legs) == 40 && offsetof(sts_legs, duty) == 8);
STS_HOLDS(stage, sizeof(sts_stage) == 40 && offsetof(sts_stage, duration_ns) == 32);
STS_HOLDS(command, sizeof(sts_command) == 112 && offsetof(sts_command, first_ns) == 96);
STS_HOLDS(result, sizeof(sts_result) == 28 && offsetof(sts_result, age) == 24);
STS_HOLDS(drive, offsetof(sts_drive, period_ns) == 56 && offsetof(sts_drive, log_to) == 112);

#ifdef __cplusplus
}
#endif
#endif
