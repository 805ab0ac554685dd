/* Calls of the system that end as they seldom do, for tests: put before the C library by LD_PRELOAD.
 *
 * FAULT_CALLS   kinds of calls that count, by commas: write open rename unlink rmdir mkdir sync truncate close
 * FAULT_AT      the call that ends otherwise, from 1; without it none does
 * FAULT_DO      kill: the process is killed before that call, within it if it writes (half of the bytes are there)
 *               a number: the call fails with this errno; a write of several bytes is short first, as on a full disk
 *               a number and +: all such calls after it fail, too
 * FAULT_COUNT   file that gets the kinds of all calls, a line each, as they are made
 * FAULT_CLOCK   the clock of the day goes back by an hour after this many looks at it
 *
 * Only files and folders count: no pipes, no terminals, no memory, and of open and close what is opened to be written. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

static atomic_long calls, looks;
static long at, clock_at;
static int error, stays, list = -1;
static const char *kinds;

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("FAULT_COUNT");
    if (path) list = (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND, 0600);
    const char *text = getenv("FAULT_AT"), *what = getenv("FAULT_DO"), *looked = getenv("FAULT_CLOCK");
    kinds = getenv("FAULT_CALLS");
    at = text ? atol(text) : 0;
    error = what ? atoi(what) : 0; /* 0: kill */
    stays = what && strchr(what, '+');
    clock_at = looked ? atol(looked) : 0;
}

static void die(void) {
    kill(getpid(), SIGKILL);
    for (;;) pause();
}

/* Whether this call, of this kind, ends otherwise: 1 the first that does, 2 one after it. */
static int due(const char *kind) {
    const char *found = kinds ? strstr(kinds, kind) : NULL;
    if (!found) return 0;
    if (list >= 0) {
        char line[16];
        syscall(SYS_write, list, line, (size_t)snprintf(line, sizeof line, "%s\n", kind));
    }
    long call = atomic_fetch_add(&calls, 1) + 1;
    if (!at || call < at) return 0;
    return call == at ? 1 : stays ? 2 : 0;
}

/* Fails as asked for, or kills. */
static int fails(const char *kind) {
    if (!due(kind)) return 0;
    if (!error) die();
    errno = error;
    return 1;
}

/* A file that a disk has: nothing without a name, no memory. */
static int on_disk(int file) {
    struct stat of;
    int before = errno;
    int found = fstat(file, &of) == 0 && S_ISREG(of.st_mode) && of.st_nlink > 0;
    errno = before;
    return found;
}

static int is_written(int file) {
    int flags = fcntl(file, F_GETFL);
    return flags >= 0 && (flags & O_ACCMODE) != O_RDONLY;
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

/* The bytes that a write is to write now: all, some, or none and an error. */
static long allowed(size_t count) {
    int now = due("write");
    if (!now) return (long)count;
    if (!error) return -2;
    if (now == 1 && count > 1) return (long)(count / 2);
    errno = error;
    return -1;
}

ssize_t write(int file, const void *bytes, size_t count) {
    static atomic_int rest;
    __typeof__(&write) next = NEXT(write);
    if (!on_disk(file)) return next(file, bytes, count);
    /* What follows a write that was cut short is the rest of it. */
    if (atomic_exchange(&rest, 0)) {
        errno = error;
        return -1;
    }
    long some = allowed(count);
    if (some == -2) {
        if (count > 1 && next(file, bytes, count / 2) < 0) perror("write");
        die();
    }
    if (some < 0) return -1;
    if ((size_t)some < count) atomic_store(&rest, 1);
    return next(file, bytes, (size_t)some);
}

ssize_t writev(int file, const struct iovec *parts, int count) {
    if (on_disk(file) && fails("write")) return -1;
    return NEXT(writev)(file, parts, count);
}

ssize_t copy_file_range(int from, off64_t *read, int to, off64_t *written, size_t count, unsigned flags) {
    if (on_disk(to) && fails("write")) return -1;
    return NEXT(copy_file_range)(from, read, to, written, count, flags);
}

#define OPENS(name, ...) \
    mode_t mode = 0; \
    if (flags & (O_CREAT | __O_TMPFILE)) { \
        va_list more; \
        va_start(more, flags); \
        mode = va_arg(more, mode_t); \
        va_end(more); \
    } \
    if ((flags & O_ACCMODE) != O_RDONLY && strncmp(path, "/dev/", 5) && strncmp(path, "/proc/", 6) && fails("open")) \
        return -1; \
    return NEXT(name)(__VA_ARGS__, flags, mode)

int open(const char *path, int flags, ...) { OPENS(open, path); }
int open64(const char *path, int flags, ...) { OPENS(open64, path); }
int openat(int at_folder, const char *path, int flags, ...) { OPENS(openat, at_folder, path); }
int openat64(int at_folder, const char *path, int flags, ...) { OPENS(openat64, at_folder, path); }

#define PLAIN(kind, name, parameters, arguments) \
    int name parameters { return fails(kind) ? -1 : NEXT(name) arguments; }

PLAIN("rename", rename, (const char *from, const char *to), (from, to))
PLAIN("rename", renameat, (int a, const char *from, int b, const char *to), (a, from, b, to))
PLAIN("rename", renameat2, (int a, const char *from, int b, const char *to, unsigned flags), (a, from, b, to, flags))
PLAIN("rename", link, (const char *from, const char *to), (from, to))
PLAIN("rename", linkat, (int a, const char *from, int b, const char *to, int flags), (a, from, b, to, flags))
PLAIN("unlink", unlink, (const char *path), (path))
PLAIN("unlink", unlinkat, (int folder, const char *path, int flags), (folder, path, flags))
PLAIN("rmdir", rmdir, (const char *path), (path))
PLAIN("mkdir", mkdir, (const char *path, mode_t mode), (path, mode))
PLAIN("sync", fsync, (int file), (file))
PLAIN("sync", fdatasync, (int file), (file))
PLAIN("truncate", ftruncate, (int file, off_t length), (file, length))
PLAIN("truncate", ftruncate64, (int file, off64_t length), (file, length))

/* The file is closed all the same, as Linux does. */
int close(int file) {
    int failed = is_written(file) && on_disk(file) && fails("close");
    int before = errno, code = NEXT(close)(file);
    if (!failed) return code;
    errno = before;
    return -1;
}

int clock_gettime(clockid_t clock, struct timespec *time) {
    int code = NEXT(clock_gettime)(clock, time);
    if (code == 0 && clock == CLOCK_REALTIME && clock_at && atomic_fetch_add(&looks, 1) >= clock_at) time->tv_sec -= 3600;
    return code;
}
