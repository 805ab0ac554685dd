/* The problem as an engineer would write it in an afternoon: a loop of fixed steps over the machine's equations, Euler's rule or the
 * midpoint rule, with the legs' devices chosen once a step by gate and current.
 *
 *   cc -O3 -march=native fixed_step.c -lm -o fixed_step && ./fixed_step < reference.csv
 *
 * Prints a line for each rule and step: name, simulated seconds per second, largest error in A against the reference.
 * The numbers are those of problem.py. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define U_DC 550.0
#define RESISTANCE 1.2
#define A_D0 89.14
#define A_DD 43.0
#define A_Q0 59.0
#define I_F 40.47
enum { PULSES = 3, SAMPLES = 18, PERIOD_US = 2400, PULSE_US = 80, DEAD_US = 2, BETWEEN_US = 400, ROUNDS = 7 };

static const double ROOT = 1.7320508075688772;
static double cosine, sine;

/* Phase currents at a flux. */
static void currents(const double flux[2], double i[3])
{
    double size = fabs(flux[0]), square = size * size;
    double d = (A_D0 + A_DD * square * square * size) * flux[0] - I_F, q = A_Q0 * flux[1];
    double alpha = cosine * d - sine * q, beta = sine * d + cosine * q;
    i[0] = alpha;
    i[1] = (ROOT * beta - alpha) / 2.0;
    i[2] = (-ROOT * beta - alpha) / 2.0;
}

/* What a flux along the axis of leg c, (axis[0], axis[1]), does to its current. */
static double own(const double flux[2], double axis[2], double across[2])
{
    double size = fabs(flux[0]), square = size * size;
    axis[0] = -0.5 * cosine - ROOT / 2.0 * sine;
    axis[1] = 0.5 * sine - ROOT / 2.0 * cosine;
    across[0] = axis[0] * (A_D0 + 6.0 * A_DD * square * square * size);
    across[1] = axis[1] * A_Q0;
    return across[0] * axis[0] + across[1] * axis[1];
}

/* dψ/dt while leg a's upper switch is on or its lower diode carries the current, b's lower switch is on and c is off. Without current
 * c keeps it so, unless its potential would fall below where its lower diode begins: it then conducts. */
static void slope(const double flux[2], int high, int *blocked, double rise[2])
{
    double i[3], axis[2], across[2];
    currents(flux, i);
    double a = high ? U_DC - 0.9 - 50e-3 * i[0] : -1.0 - 30e-3 * i[0], b = 0.9 - 50e-3 * i[1], c = -1.0 - 30e-3 * i[2];
    double drop_alpha = RESISTANCE * i[0], drop_beta = RESISTANCE * (i[1] - i[2]) / ROOT;
    if (*blocked) {
        double alpha = (2.0 * a - b) / 3.0 - drop_alpha, beta = b / ROOT - drop_beta;
        double per_volt = own(flux, axis, across) * 2.0 / 3.0;
        double potential = -(across[0] * (cosine * alpha + sine * beta) + across[1] * (cosine * beta - sine * alpha)) / per_volt;
        *blocked = potential >= -1.0;
        c = *blocked ? potential : -1.0;
    }
    double alpha = (2.0 * a - b - c) / 3.0 - drop_alpha, beta = (b - c) / ROOT - drop_beta;
    rise[0] = cosine * alpha + sine * beta;
    rise[1] = cosine * beta - sine * alpha;
}

/* The three pulses in steps of which a microsecond has so many; the largest error against the reference in A. */
static double simulate(int per_us, int midpoint, const double reference[SAMPLES][3])
{
    double h = 1e-6 / per_us, worst = 0.0, flux[2] = {0.45, 0.0}, i[3], rise[2];
    for (int k = 0; k < 20; k++) {
        double fifth = flux[0] * flux[0] * flux[0] * flux[0] * flux[0];
        flux[0] -= ((A_D0 + A_DD * fifth) * flux[0] - I_F) / (A_D0 + 6.0 * A_DD * fifth);
    }
    long steps = (long)PULSES * PERIOD_US * per_us, in_period = 0, next = (long)PULSE_US * per_us;
    int sample = 0, blocked = 1;
    for (long n = 1; n <= steps; n++) {
        /* In the dead time before the first pulse nothing conducts. */
        int high = in_period >= DEAD_US * per_us && in_period < PULSE_US * per_us;
        if (high || n > DEAD_US * per_us) {
            slope(flux, high, &blocked, rise);
            if (midpoint) {
                double half[2] = {flux[0] + h / 2.0 * rise[0], flux[1] + h / 2.0 * rise[1]};
                slope(half, high, &blocked, rise);
            }
            flux[0] += h * rise[0];
            flux[1] += h * rise[1];
            currents(flux, i);
            if (blocked || i[2] < 0.0) {
                double axis[2], across[2], share = i[2] / own(flux, axis, across);
                flux[0] -= share * axis[0];
                flux[1] -= share * axis[1];
                blocked = 1;
            }
        }
        if (++in_period == (long)PERIOD_US * per_us)
            in_period = 0;
        if (n == next) {
            currents(flux, i);
            for (int k = 0; k < 3; k++)
                worst = fmax(worst, fabs(i[k] - reference[sample][k]));
            sample++;
            long within = sample % 6;
            next = ((long)(sample / 6) * PERIOD_US + PULSE_US + within * BETWEEN_US) * per_us;
        }
    }
    return sample == SAMPLES ? worst : NAN;
}

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

int main(void)
{
    char line[256];
    double reference[SAMPLES][3], t;
    if (!fgets(line, sizeof line, stdin) || strncmp(line, "t_s,", 4) != 0)
        return fprintf(stderr, "fixed_step: no reference.csv on the standard input\n"), 2;
    for (int k = 0; k < SAMPLES; k++)
        if (scanf("%lf,%lf,%lf,%lf", &t, &reference[k][0], &reference[k][1], &reference[k][2]) != 4)
            return fprintf(stderr, "fixed_step: reference.csv has no row %d\n", k + 1), 2;
    cosine = cos(20.0 / 180.0 * 3.14159265358979323846);
    sine = sin(20.0 / 180.0 * 3.14159265358979323846);
    for (int rule = 0; rule < 2; rule++)
        for (int per_us = 1; per_us <= 10; per_us *= 10) {
            double best = HUGE_VAL, worst = 0.0;
            for (int round = 0; round < ROUNDS; round++) {
                double begin = now();
                worst = simulate(per_us, rule, (const double (*)[3])reference);
                best = fmin(best, now() - begin);
            }
            printf("fixed steps in C %s %s µs,%.6g,%.3g\n", rule ? "midpoint" : "Euler", per_us == 1 ? "1" : "0.1",
                PULSES * PERIOD_US * 1e-6 / best, worst);
        }
    return 0;
}
