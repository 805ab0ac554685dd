/* Kinds of state that a firmware keeps and forgets to clear: `what=…`. Each counts its trials: 1 wherever all is set back. */
#define _GNU_SOURCE
#include "standstill.h"

#include <errno.h>
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <wchar.h>
#ifdef LOADS
#include <dlfcn.h>
#endif

static int global;
static int *made_at_load, *made_at_call;
static size_t length;
static char *text;
static char words[] = "one two three";
static FILE *file;
static char *printed_at_load, *printed_at_call;
static void (*take)(void *);
static void *(*lengthen)(void *, size_t);

static int first(void);
static int local(void);
static int second(void);
static int (*table[2])(void) = { first, second };

static int first(void)
{
    table[0] = second;
    return 1;
}

static int second(void)
{
    return 2;
}

__attribute__((constructor)) static void loaded(void)
{
    made_at_load = calloc(16, sizeof *made_at_load);
    text = strdup("loaded");
    if (asprintf(&printed_at_load, "%s %d", "loaded", 1) < 0) {
        abort();
    }
#ifdef OPENS
    file = fopen("/proc/self/maps", "r");
#endif
#ifdef LOADS
    {
        void *other = dlopen(LOADS, RTLD_NOW);
        *(void **)&take = dlsym(other, "take");
        *(void **)&lengthen = dlsym(other, "lengthen");
    }
#endif
}

/* Memory that the C library makes: freed in each trial, made anew in each. */
static int printed(void)
{
    const char *as = "1 two 3.0 4 5 6.25 7 8.5 9";
    int fresh = printed_at_call == NULL && strcmp(printed_at_load, "loaded 1") == 0;
    free(printed_at_load);
    return asprintf(&printed_at_call, "%d %s %.1f %d %d %.2f %ld %.1f %d", 1, "two", 3.0, 4, 5, 6.25, 7L, 8.5, 9)
               == (int)strlen(as) && strcmp(printed_at_call, as) == 0 && fresh ? 1 : 2;
}

static int lines(void)
{
    char content[] = "one\ntwo and more", *line = malloc(2), *path = realpath("/", NULL), *here = getcwd(NULL, 0);
    size_t room = 2;
    FILE *from = fmemopen(content, strlen(content), "r");
    wchar_t *wide = wcsdup(L"wide");
    int right = getline(&line, &room, from) == 4 && strcmp(line, "one\n") == 0 && getline(&line, &room, from) == 12
        && strcmp(line, "two and more") == 0 && getline(&line, &room, from) == -1 && strcmp(path, "/") == 0
        && here[0] == '/' && wcscmp(wide, L"wide") == 0;
    fclose(from);
    free(line), free(path), free(here), free(wide);
    return right ? 1 : 2;
}

/* Blocks that another library takes back, or makes longer. */
static int given(void)
{
    int *block = malloc(100);
    block[0] = 7;
    take(malloc(1000));
    block = lengthen(block, 100000);
    free(block);
    return block != NULL && local() == 1 ? 1 : 2;
}

static int local(void)
{
    static int calls;
    return ++calls;
}

static int heap_at_call(void)
{
    if (made_at_call == NULL) {
        made_at_call = malloc(1000 * sizeof *made_at_call);
        made_at_call[0] = 0;
    }
    return ++made_at_call[0];
}

/* Grows by as much in each trial as if it were the only one. */
static int grown(void)
{
    int k, *more;
    length += 1000;
    more = realloc(made_at_load, (16 + length) * sizeof *more);
    for (k = 0; k < 1000; k++) {
        more[16 + (int)length - 1000 + k] = k;
    }
    made_at_load = more;
    free(text);
    text = malloc(length);
    return (int)(length / 1000);
}

/* 1/3 has other last digits when it is rounded up. */
static int rounding(void)
{
    volatile double one = 1, three = 3, to_nearest = one / three;
    fesetround(FE_UPWARD);
    return to_nearest == 0x1.5555555555555p-2 ? 1 : 2;
}

/* The x87 unit and flags of exceptions. */
static int exceptions(void)
{
    volatile long double zero = 0, one = 1, third = one / 3;
    volatile double small = 0;
    int seen = fetestexcept(FE_DIVBYZERO) != 0;
    fesetround(FE_DOWNWARD);
    one /= zero;
    small = 1 / small;
    return seen || third != 1.0L / 3 ? 2 : 1;
}

static int numbers(void)
{
    return rand() == 1804289383 && random() == 846930886 && lrand48() == 0 && drand48() < 1e-3 ? 1 : 2;
}

static int token(void)
{
    const char *word = strtok(local() == 1 ? words : NULL, " ");
    return word != NULL && strcmp(word, "one") == 0 ? 1 : 2;
}

static int error_number(void)
{
    int before = errno;
    errno = ERANGE;
    return before == 0 ? 1 : 2;
}

static int place(void)
{
    return setlocale(LC_ALL, NULL)[0] == 'C' && setlocale(LC_ALL, "de_DE.UTF-8") == NULL ? 1 : 2;
}

static int ends;
static void at_end(void)
{
    abort();
}

/* Registered in each trial, as a static variable of C++ is. */
static int at_exit_of_the_program(void)
{
    atexit(at_end);
    return ++ends;
}

static const struct {
    const char *name;
    int (*of)(void);
} kinds[] = {
    { "local", local }, { "heap-at-call", heap_at_call }, { "grown", grown }, { "rounding", rounding },
    { "exceptions", exceptions }, { "numbers", numbers }, { "token", token }, { "errno", error_number },
    { "locale", place }, { "at-exit", at_exit_of_the_program }, { "printed", printed }, { "lines", lines },
    { "given", given },
};

static int count;

static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    const char *at = strstr(config, "what=") + 5;
    size_t size = strcspn(at, "\n"), k;
    (void)drive, (void)seed;
    *refused = "no such state";
    count = 0;
#define IS(word) (strlen(word) == size && strncmp(at, word, size) == 0)
    if (IS("global")) {
        count = ++global;
    }
    if (IS("heap-at-load")) {
        count = ++made_at_load[3];
    }
    if (IS("table")) {
        count = table[0]();
    }
    if (IS("file")) {
        count = file != NULL && ftell(file) == 0 ? 1 : 2;
    }
    for (k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        if (IS(kinds[k].name)) {
            count = kinds[k].of();
        }
    }
    return count == 0 ? NULL : &count;
}

static int32_t isr(void *detector, const sts_readings *readings, sts_legs *legs, sts_result *result)
{
    (void)readings, (void)legs;
    /* What the trial has set holds from one call to the next. */
    result->angle = 0.1f * (float)*(int *)detector;
    return STS_FOUND;
}

#ifndef FLAGS
#define FLAGS 0
#endif

const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector detector = {
        .abi = STS_ABI, .size = sizeof detector, .flags = STS_INTERRUPT | FLAGS, .name = "states", .create = create, .isr = isr,
        .pwm_hz = 12500, .update_delay = 1,
    };
    (void)abi;
    return &detector;
}
