/* Counts the calls of the C library that open, read, change or flush files below one folder, and brings about a fault
   at one of them: a signal before it takes place, or an error in its place. Loaded with LD_PRELOAD; nothing happens
   before arm() is called, and in no process but the one that called it. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

enum { TAKES_SPACE = 1 };

static char folder[PATH_MAX];
static long fault_at, seen;
static int fault_signal, fault_error, lasts, hit;
static pid_t owner;

/* at: number of the event, from 1 on, 0 for none. number: a signal, or an error as a negative number. lasting: an error
   stays: ENOSPC for all that takes space, any other for everything. */
void arm(const char *below, long at, int number, int lasting)
{
    snprintf(folder, sizeof folder, "%s", below);
    fault_at = at;
    fault_signal = number > 0 ? number : 0;
    fault_error = number < 0 ? -number : 0;
    lasts = lasting;
    seen = hit = 0;
    owner = getpid();
}

long events(void) { return seen; }

static int below(const char *path)
{
    size_t length = strlen(folder);
    return length && !strncmp(path, folder, length) && (path[length] == '/' || !path[length]);
}

static int named(int at, const char *path)
{
    char link[64], place[PATH_MAX];
    if (path[0] == '/')
        return below(path);
    snprintf(link, sizeof link, at == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", at);
    ssize_t length = readlink(link, place, sizeof place - 1);
    if (length < 0)
        return 0;
    place[length] = 0;
    return below(place);
}

static int opened(int file) { return named(file, ""); }

/* Whether the call is to fail: errno is set then. */
static int event(int counts, int kind)
{
    if (!owner || owner != getpid() || !counts)
        return 0;
    seen++;
    if (seen == fault_at) {
        hit = 1;
        if (fault_signal) {
            kill(owner, fault_signal);
            return 0;
        }
    } else if (!hit || !lasts || (fault_error == ENOSPC && kind != TAKES_SPACE)) {
        return 0;
    }
    if (!fault_error)
        return 0;
    errno = fault_error;
    return 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define WRAP(result, name, parameters, arguments, counts, kind, failed) \
    result name parameters                                              \
    {                                                                   \
        static __typeof__(&name) real;                                  \
        if (!real)                                                      \
            real = REAL(name);                                          \
        if (owner && event(counts, kind))                               \
            return failed;                                              \
        return real arguments;                                          \
    }

#define WRAP_OPEN(name, parameters, arguments, at)                                     \
    int name parameters                                                                \
    {                                                                                  \
        static __typeof__(&name) real;                                                 \
        mode_t mode = 0;                                                               \
        if (!real)                                                                     \
            real = REAL(name);                                                         \
        if (flags & (O_CREAT | __O_TMPFILE)) {                                         \
            va_list rest;                                                              \
            va_start(rest, flags);                                                     \
            mode = va_arg(rest, mode_t);                                               \
            va_end(rest);                                                              \
        }                                                                              \
        if (owner && event(named(at, path), flags & O_CREAT ? TAKES_SPACE : 0))        \
            return -1;                                                                 \
        return real arguments;                                                         \
    }

WRAP_OPEN(open, (const char *path, int flags, ...), (path, flags, mode), AT_FDCWD)
WRAP_OPEN(open64, (const char *path, int flags, ...), (path, flags, mode), AT_FDCWD)
WRAP_OPEN(openat, (int at, const char *path, int flags, ...), (at, path, flags, mode), at)
WRAP_OPEN(openat64, (int at, const char *path, int flags, ...), (at, path, flags, mode), at)
WRAP(DIR *, opendir, (const char *path), (path), named(AT_FDCWD, path), 0, NULL)
WRAP(DIR *, fdopendir, (int file), (file), opened(file), 0, NULL)
WRAP(ssize_t, read, (int file, void *data, size_t size), (file, data, size), opened(file), 0, -1)
WRAP(ssize_t, pread, (int file, void *data, size_t size, off_t at), (file, data, size, at), opened(file), 0, -1)
WRAP(ssize_t, pread64, (int file, void *data, size_t size, off_t at), (file, data, size, at), opened(file), 0, -1)
WRAP(ssize_t, write, (int file, const void *data, size_t size), (file, data, size), opened(file), TAKES_SPACE, -1)
WRAP(ssize_t, pwrite, (int file, const void *data, size_t size, off_t at), (file, data, size, at), opened(file), TAKES_SPACE, -1)
WRAP(ssize_t, pwrite64, (int file, const void *data, size_t size, off_t at), (file, data, size, at), opened(file), TAKES_SPACE, -1)
WRAP(ssize_t, sendfile, (int into, int from, off_t *at, size_t size), (into, from, at, size), opened(into), TAKES_SPACE, -1)
WRAP(ssize_t, sendfile64, (int into, int from, off_t *at, size_t size), (into, from, at, size), opened(into), TAKES_SPACE, -1)
WRAP(ssize_t, copy_file_range, (int from, off_t *at, int into, off_t *to, size_t size, unsigned flags), (from, at, into, to, size, flags), opened(into), TAKES_SPACE, -1)
WRAP(int, fsync, (int file), (file), opened(file), TAKES_SPACE, -1)
WRAP(int, fdatasync, (int file), (file), opened(file), TAKES_SPACE, -1)
WRAP(int, ftruncate, (int file, off_t size), (file, size), opened(file), TAKES_SPACE, -1)
WRAP(int, ftruncate64, (int file, off_t size), (file, size), opened(file), TAKES_SPACE, -1)
WRAP(int, rename, (const char *from, const char *to), (from, to), named(AT_FDCWD, to), 0, -1)
WRAP(int, renameat, (int at, const char *from, int into, const char *to), (at, from, into, to), named(into, to), 0, -1)
WRAP(int, link, (const char *from, const char *to), (from, to), named(AT_FDCWD, to), TAKES_SPACE, -1)
WRAP(int, linkat, (int at, const char *from, int into, const char *to, int flags), (at, from, into, to, flags), named(into, to), TAKES_SPACE, -1)
WRAP(int, symlink, (const char *from, const char *to), (from, to), named(AT_FDCWD, to), TAKES_SPACE, -1)
WRAP(int, unlink, (const char *path), (path), named(AT_FDCWD, path), 0, -1)
WRAP(int, unlinkat, (int at, const char *path, int flags), (at, path, flags), named(at, path), 0, -1)
WRAP(int, rmdir, (const char *path), (path), named(AT_FDCWD, path), 0, -1)
WRAP(int, mkdir, (const char *path, mode_t mode), (path, mode), named(AT_FDCWD, path), TAKES_SPACE, -1)
WRAP(int, mkdirat, (int at, const char *path, mode_t mode), (at, path, mode), named(at, path), TAKES_SPACE, -1)
