/* A drive of FMI 2.0 by its C functions, on Linux and on Windows: the same legs, and every output of each step to its last bit.
 *
 *   importer LIBRARY RESOURCES TOKEN   < one line for each input and output: `in|out REFERENCE Real|Integer`
 *
 * Inputs are in the order mode_a, mode_b, mode_c, duty_a, duty_b, duty_c. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(name) ((void *)LoadLibraryA(name))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#define LOAD_ERROR(name) fprintf(stderr, "%s: error %lu of Windows; ", name, GetLastError())
#else
#include <dlfcn.h>
#define OPEN(name) dlopen(name, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#define LOAD_ERROR(name) fprintf(stderr, "%s: %s; ", name, library ? "loaded" : dlerror())
#endif

#define STEPS 60
#define PERIOD 80e-6
#define MOST 64

typedef void logger(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    logger *log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished, *environment;
} callbacks;

static void log_it(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    va_list more;
    (void)environment;
    va_start(more, message);
    fprintf(stderr, "%s: %d %s: ", name, status, category);
    vfprintf(stderr, message, more);
    fputc('\n', stderr);
    va_end(more);
}

static void *library;

static void *find(const char *name)
{
    void *there = FIND(library, name);
    if (!there) {
        fprintf(stderr, "the library has no %s\n", name);
        exit(1);
    }
    return there;
}

static void must(int status, const char *what)
{
    if (status != 0) {
        fprintf(stderr, "%s: status %d\n", what, status);
        exit(1);
    }
}

int main(int count, char **words)
{
    static const callbacks functions = {log_it, calloc, free, 0, 0};
    unsigned inputs[MOST], outputs[MOST], given, seen = 0, shown = 0;
    int whole[MOST], n, k;
    char role[8], kind[16];
    void *drive;
    if (count != 4) {
        fprintf(stderr, "usage: importer LIBRARY RESOURCES TOKEN\n");
        return 2;
    }
    while (scanf("%7s %u %15s", role, &given, kind) == 3 && seen < MOST && shown < MOST) {
        if (role[0] == 'i') {
            inputs[seen++] = given;
        } else {
            whole[shown] = strcmp(kind, "Real") != 0;
            outputs[shown++] = given;
        }
    }
    library = OPEN(words[1]);
    if (!library || seen != 6 || shown == 0) {
        LOAD_ERROR(words[1]);
        fprintf(stderr, "%u inputs and %u outputs\n", seen, shown);
        return 1;
    }
    void *(*instantiate)(const char *, int, const char *, const char *, const callbacks *, int, int) = find("fmi2Instantiate");
    int (*setup)(void *, int, double, double, int, double) = find("fmi2SetupExperiment");
    int (*enter)(void *) = find("fmi2EnterInitializationMode"), (*leave)(void *) = find("fmi2ExitInitializationMode");
    int (*step)(void *, double, double, int) = find("fmi2DoStep");
    int (*set_whole)(void *, const unsigned *, size_t, const int *) = find("fmi2SetInteger");
    int (*set_real)(void *, const unsigned *, size_t, const double *) = find("fmi2SetReal");
    int (*get_whole)(void *, const unsigned *, size_t, int *) = find("fmi2GetInteger");
    int (*get_real)(void *, const unsigned *, size_t, double *) = find("fmi2GetReal");
    void (*end)(void *) = find("fmi2FreeInstance");
    drive = instantiate("drive", 1, words[3], words[2], &functions, 0, 1);
    if (!drive) return 1;
    must(setup(drive, 0, 0.0, 0.0, 0, 0.0), "fmi2SetupExperiment");
    must(enter(drive), "fmi2EnterInitializationMode");
    must(leave(drive), "fmi2ExitInitializationMode");
    for (n = 0; n < STEPS; n++) {
        int modes[3];
        double duties[3];
        for (k = 0; k < 3; k++) {
            modes[k] = n % 8 == 0 ? 2 - k : n % 8 == 1 ? 0 : 3;
            duties[k] = 0.5 + (double)(n * (k + 1) % 5) / 128.0;
        }
        must(set_whole(drive, inputs, 3, modes), "fmi2SetInteger");
        must(set_real(drive, inputs + 3, 3, duties), "fmi2SetReal");
        must(step(drive, n * PERIOD, PERIOD, 1), "fmi2DoStep");
        printf("%d", n);
        for (k = 0; k < (int)shown; k++) {
            if (whole[k]) {
                int value = -1;
                must(get_whole(drive, outputs + k, 1, &value), "fmi2GetInteger");
                printf(" %d", value);
            } else {
                union { double number; unsigned long long bits; } value;
                value.number = -1.0;
                must(get_real(drive, outputs + k, 1, &value.number), "fmi2GetReal");
                printf(" %08lx%08lx", (unsigned long)(value.bits >> 32), (unsigned long)(value.bits & 0xffffffffu));
            }
        }
        printf("\n");
    }
    end(drive);
    return 0;
}
