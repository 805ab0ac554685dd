/* sts_detectors.h: Standstill's detectors in a drive of yours, from the static library libsts_detectors.a. ABI 2.
 *
 * The other way round than standstill.h, with the same types: here the drive is C and the detector is Rust. No standard
 * library, no allocation; all that a detector keeps is in the memory that you give it. Detectors compute in single precision;
 * sts_begin() needs a few numbers in double precision. SI units; angles in electrical radians from the axis of phase a;
 * currents flow into the motor. docs/firmware.md explains it with examples.
 */
#ifndef STS_DETECTORS_H
#define STS_DETECTORS_H

#include "standstill.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Memory of a detector of any method, in bytes, with room for the samples of a command. */
#define STS_DETECTOR_BYTES 16384u

/* A command of a detector asks for no more samples. */
#define STS_MOST_SAMPLES 128u

/* A detector: static, or wherever you have that much memory. It may be moved between two calls. */
typedef struct sts_state {
    uint64_t memory[STS_DETECTOR_BYTES / 8u];
} sts_state;

/* Kinds of readings that a drive hands over in its samples, beside the voltage of the DC link. */
enum sts_kinds {
    STS_PHASE_CURRENTS = 1, /* current[], by sensors in line or shunts below the legs */
    STS_LINK_CURRENT = 2,   /* link_current, and current[] of the phase whose current it is */
    STS_TERMINALS = 4,      /* terminal[] */
    STS_CAPTURES = 8,       /* capture_ticks, of commands with `until` */
    STS_BELOW_LEGS = 16     /* beside STS_PHASE_CURRENTS: its sensors are shunts below the legs */
};

/* What the data sheets of motor and drive say. Zeros where they say nothing, but for what is marked "needed". */
typedef struct sts_plate {
    uint64_t rated_pulse_ns;    /* needed: across two phases in series, until the rated current flows where it rises fastest */
    uint64_t dead_time_ns;
    uint64_t period_ns;         /* needed: of the PWM carrier */
    uint64_t skew_ns;           /* phase b is converted so much later than a, and c than b */
    float rated_current;        /* needed: of a phase, A, peak */
    float resistance;           /* of a phase, ohm */
    float ld;                   /* needed: H, without current */
    float lq;                   /* needed: H, without current */
    float flux;                 /* of the magnet, Wb */
    int32_t stronger_pole;      /* near rated current, 1: the north pole draws the larger current, -1: the south; 0: neither */
    int32_t stronger_pole_half; /* the same near half the rated current */
    float pole_difference;      /* by which share one pole's current exceeds the other's near rated current */
    float gain_tolerance;       /* standard deviation of the current sensors' gains, a share */
    float dc_link;              /* needed: V */
    float switch_drop[2];       /* across a conducting switch: V, and ohm */
    float diode_drop[2];        /* across a diode whose leg is off: V, and ohm */
    float reverse_drop[2];      /* where the current flows against the switch that is on: V, and ohm */
    float sensor_bandwidth;     /* corner frequency of the current sensors' filters, Hz; 0: no filter */
    float bandwidth_mismatch;   /* by which share at most a sensor's corner differs from the others' */
    float pick_up[2];           /* of the current sensors at an edge: A, and the time constant of its decay, s */
    uint64_t settle_ns;         /* after a request to a leg, how long shunts are not read: dead time and settling */
    uint32_t readings;          /* enum sts_kinds, added up; 0: STS_PHASE_CURRENTS */
    uint32_t comparators;       /* 1: one for the current in the DC link, 6: two for each leg, one a direction */
    float timer_tick;           /* of the timer that captures trips of comparators, s */
    float comparator_delay;     /* from the threshold to the captured time, s */
    float comparator_delay_spread; /* standard deviation of a comparator's delay, s */
    float comparator_offset;    /* standard deviation of a comparator's offset, A */
    float comparator_noise;     /* of the current at a comparator, A rms */
    float divider_tolerance;    /* standard deviation of the gains of the terminals' dividers, a share */
    float divider_offset;       /* standard deviation of their offsets, V of the terminal */
    float divider_bandwidth;    /* corner frequency of the dividers' filters, Hz; 0: no filter */
    float comparator_blanking;  /* after the begin of a pulse, how long comparators are ignored, s */
    float threshold_highest;    /* highest threshold that the drive can set, A; 0: any */
    float timer_error;          /* standard deviation of the timer's clock, a share */
    float link_noise;           /* of a reading of the DC link's voltage, with its rounding, V rms */
    uint64_t averaged_ns;       /* a reading is the mean of several conversions: from the first to the last of them; 0: of one */
    float delay_mismatch;       /* standard deviation of the legs' turn-off delays, s, such as 50e-9; 0: all alike */
} sts_plate;

/* A setting of a method, as in a scenario's table [detector]: its key, and its value in SI units (0 or 1 for no or yes; of
 * "checks" also a sum of 2 link, 4 sensors, 8 inductance, 16 both-ways, 32 contact, 64 codes, 128 turning). */
typedef struct sts_setting {
    const char *key;
    double value;
} sts_setting;

/* Why a detection ended as it did: result.reason of STS_AXIS and STS_FAILED. */
enum sts_reason {
    STS_POLE_BELOW_NOISE = 1,      /* the poles answer too much alike for the noise that was measured */
    STS_POLE_NO_SIGNATURE = 2,     /* stronger_pole is 0 */
    STS_POLE_NOT_DECIDED = 3,      /* not certain enough after all vectors */
    STS_POLE_OFF_AXIS = 4,         /* the pole's answer does not lie along the axis */
    STS_POLE_MAY_HAVE_TURNED = 5,  /* the rotor may have turned since its axis was measured: hold it, or detect again */
    STS_CURRENT_CLIPPED = 16,      /* a converter at the end of its range */
    STS_DC_LINK_CLIPPED = 17,
    STS_NOT_A_NUMBER = 18,         /* a sample that is not finite */
    STS_CURRENT_HIDDEN = 19,       /* a current that no sensor sees */
    STS_NO_CURRENT = 20,           /* too little current: a phase may be open */
    STS_CURRENT_PERSISTS = 21,     /* the current does not decay */
    STS_NO_SALIENCY = 22,
    STS_NOT_INDUCTIVE = 23,        /* a line does not answer as an inductance */
    STS_DID_NOT_FOLLOW = 24,       /* the rotor did not follow an alignment */
    STS_ROTOR_MOVES = 25,
    STS_UNEXPECTED_SAMPLES = 26,   /* others than were asked for, or a state that sts_begin() did not make */
    STS_TRIPPED_EARLY = 27,        /* a comparator tripped during its blanking, or less than a tick and a half after it */
    STS_TERMINAL_CLIPPED = 28,
    STS_TERMINAL_HIDDEN = 29,
    STS_NO_VOLTAGE = 30,           /* too little voltage across a line */
    STS_TERMINALS_SWING = 31,      /* the terminals do not come to rest */
    STS_SENSORS_DISAGREE = 32,     /* sensors of one current disagree, or one shows a current where none can flow */
    STS_DC_LINK_OUT_OF_RANGE = 33, /* the DC link is not as on the data sheet */
    STS_INDUCTANCE_OUT_OF_RANGE = 34, /* a line's inductance is not as on the data sheet */
    STS_DIRECTIONS_DIFFER = 35,    /* both ways of a line differ by more than the poles can make them */
    STS_COARSE_TIMER = 36,         /* no saliency found, because the timer's tick hides it */
    STS_ROTOR_TURNS = 37,          /* the rotor turns, and which way is unknown, as the pole is */
    STS_ROTOR_TURNS_FORWARD = 38,  /* towards larger electrical angles */
    STS_ROTOR_TURNS_BACKWARD = 39,
    STS_CONTACT_RESISTIVE = 40,    /* a phase has more resistance than the others */
    STS_SALIENCY_OUT_OF_RANGE = 41 /* the saliency is not as on the data sheet: turns may be shorted */
};

/* Makes a detector of a method ("bipolar", "line-inductance-fast", …: standstill explain names them) in `state`.
 * NULL: it is ready for sts_step(). Otherwise why it is refused, a text inside `state`. */
const char *sts_begin(
    sts_state *state, const char *method, const sts_plate *plate, const sts_setting *settings, uint32_t settings_count);

/* From the samples of the last command (none at first: NULL, or a count of 0) to the next one. STS_GO_ON: carry out `command`; its
 * samples are due at first_ns, first_ns + interval_ns, … after its begin, of a command with `until` after the end of its first
 * stage; sts_sample.time_ns counts from there. readings->stride is sizeof(sts_sample); command and result are written
 * as a whole. Otherwise the detection is over:
 * STS_FOUND, STS_AXIS or STS_FAILED with `result`, in which NaN stands for what the method does not know. */
int32_t sts_step(sts_state *state, const sts_readings *readings, sts_command *command, sts_result *result);

#ifdef __cplusplus
}
#endif
#endif
