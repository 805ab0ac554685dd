/* standstill.h: detectors written in C, in the loop of Standstill. ABI 1.
 *
 * SI units; angles in electrical radians from the axis of phase a; currents flow into the motor.
 * A library exports sts_entry(). docs/firmware.md tells the rest.
 */
#ifndef STANDSTILL_H
#define STANDSTILL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define STS_ABI 1u

/* What a leg does. */
enum sts_leg {
    STS_OFF = 0,  /* both switches off */
    STS_LOW = 1,  /* lower switch on */
    STS_HIGH = 2, /* upper switch on */
    STS_DUTY = 3, /* PWM: the upper switch for this share (0 to 1), centred; at interrupt level a share of the time up to the
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
    uint32_t size;          /* of this struct in bytes; later versions only append */
    uint32_t current_bits;  /* resolution of the current converters; 0: none */
    uint32_t dc_link_bits;  /* resolution of the DC link's converter; 0: none */
    float amps_per_count;   /* a current is amps_at_zero + count * amps_per_count */
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
} sts_drive;

/* One trigger of the converters. */
typedef struct sts_sample {
    uint64_t time_ns;          /* isr(): since the start of the detection; step(): since the start of the command */
    float current[3];          /* A */
    float dc_link;             /* V */
    uint32_t current_count[3]; /* codes of the converters; 0 for a phase without sensor */
    uint32_t dc_link_count;
    uint8_t sensed[3];         /* enum sts_sensed */
    uint8_t dc_link_clipped;
    uint8_t half;              /* isr() twice a period: 0 while the counter counts up (a duty ends the half high), 1 down */
    uint8_t reserved[3];
} sts_sample;

/* What the three legs do. */
typedef struct sts_legs {
    uint8_t leg[3]; /* enum sts_leg */
    uint8_t reserved;
    float duty[3];  /* of STS_DUTY */
} sts_legs;

typedef struct sts_stage {
    sts_legs legs;
    uint32_t edge_ns[3]; /* of STS_RISE and STS_FALL, at most duration_ns */
    uint32_t reserved;
    uint64_t duration_ns;
} sts_stage;

/* Command level: one or two stages, and when the converters sample meanwhile, counted from the start of the command. */
typedef struct sts_command {
    sts_stage stage[2];
    uint32_t stages;  /* 1 or 2 */
    uint32_t samples; /* number of triggers */
    uint64_t first_ns;
    uint64_t interval_ns;
} sts_command;

/* How a detection ends. What the detector does not know stays as it is; a pole_evidence that is no number is a failure. */
typedef struct sts_result {
    float angle;           /* rad, at most 1000 either way */
    float angle_deviation; /* standard deviation that the angle has, rad */
    float pole_evidence;   /* for the north pole at `angle`, in standard deviations; negative: for the other end */
    float pole_needed;     /* what the detector asks for before it names a pole, 0 or more; goes with pole_evidence */
    uint32_t reason;       /* of STS_AXIS and STS_FAILED: given to reason() */
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
    int32_t (*step)(void *detector, const sts_sample *samples, uint32_t count, sts_command *command, sts_result *result);
    /* Interrupt level: from one sample to the legs; they hold what was returned last. */
    int32_t (*isr)(void *detector, const sts_sample *sample, sts_legs *legs, sts_result *result);
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

#ifdef __cplusplus
}
#endif
#endif
