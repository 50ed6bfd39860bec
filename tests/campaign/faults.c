/* Makes one call of a process fail; for faults.py, which says what it is for. Linux with glibc alone.

   Loaded by LD_PRELOAD, it passes everything on until faults_arm() is called. From then on it counts
   the calls of each kind, and lets the number-th call of one kind fail. File calls count only if their
   path, or that of their descriptor, begins with a prefix; it is asked of /proc each time, as they are
   few and a cache would have to follow close, dup2 and rename.

   Not seen: what libc does inside itself, as opening a folder to list it, fgets(), the stacks of threads. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdio_ext.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum kind { READ, OPEN, WRITE, CREATE, RENAME, FSYNC, MKDIR, UNLINK, TRUNCATE, MMAP, ALLOC, KINDS };

/* In memory shared with the parent, so that it is known even of a process that was killed. */
struct told {
    long long counts[KINDS];
    long long struck; /* whether the call was reached */
    char path[4096];  /* of the call that failed */
};

enum { LARGE = 256 << 10 }; /* bytes; see faults.py */

static struct told *told; /* NULL: not armed */
static int fail_kind, fail_errno, lines_to = -1;
static long long fail_number;
static char scope[PATH_MAX];
static size_t scope_length;
static __thread int inside __attribute__((tls_model("initial-exec"))); /* this library itself is at work */

/* Begin to count, and let a call fail: none if kind is -1. Where it fails, SIGUSR1 is raised if that is
   caught: faulthandler writes there which lines of Python are at work. If lines >= 0, nothing fails, and
   that is done at each call, below a line about the call that is written to the descriptor `lines`. */
void faults_arm(int kind, long long number, int error, const char *prefix, void *shared, int lines)
{
    fail_kind = kind;
    fail_number = number;
    fail_errno = error;
    lines_to = lines;
    snprintf(scope, sizeof scope, "%s", prefix);
    scope_length = strlen(scope);
    told = shared;
}

static void say_where(void)
{
    struct sigaction caught;
    if (!sigaction(SIGUSR1, NULL, &caught) && caught.sa_handler != SIG_DFL)
        raise(SIGUSR1);
}

/* Count a call; whether it is the one that fails. */
static int strike(enum kind kind, const char *path)
{
    static pthread_mutex_t one_at_a_time = PTHREAD_MUTEX_INITIALIZER;
    long long number = __atomic_add_fetch(&told->counts[kind], 1, __ATOMIC_RELAXED);
    int fails = (int)kind == fail_kind && number == fail_number;
    if (!fails && lines_to < 0)
        return 0;
    inside = 1;
    if (fails) {
        snprintf(told->path, sizeof told->path, "%s", path);
        told->struck = 1;
        say_where();
    } else {
        pthread_mutex_lock(&one_at_a_time);
        dprintf(lines_to, "call %d %lld\n", kind, number);
        say_where();
        pthread_mutex_unlock(&one_at_a_time);
    }
    inside = 0;
    errno = fail_errno;
    return fails;
}

static int behind(int descriptor, char *path) /* the path of a descriptor */
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t length = readlink(link, path, PATH_MAX - 1);
    path[length < 0 ? 0 : length] = 0;
    return length > 0;
}

static int descriptor_fails(enum kind kind, int descriptor)
{
    if (!told || inside)
        return 0;
    int before = errno;
    char path[PATH_MAX];
    if (behind(descriptor, path) && !strncmp(path, scope, scope_length) && strike(kind, path))
        return 1;
    errno = before;
    return 0;
}

static int path_fails(enum kind kind, int folder, const char *name)
{
    if (!told || inside || !name)
        return 0;
    if (!strncmp(name, "/dev/fd/", 8))
        return descriptor_fails(kind, atoi(name + 8));
    int before = errno;
    char path[2 * PATH_MAX] = "";
    if (name[0] != '/') {
        if (folder == AT_FDCWD ? !getcwd(path, PATH_MAX) : !behind(folder, path))
            path[0] = 0;
        strncat(path, "/", 2);
    }
    strncat(path, name, PATH_MAX - 1);
    if (!strncmp(path, scope, scope_length) && strike(kind, path))
        return 1;
    errno = before;
    return 0;
}

static int memory_fails(size_t size)
{
    return told && !inside && size >= LARGE && strike(ALLOC, "");
}

#define REAL(name) \
    static __typeof__(name) *real; \
    if (!real) \
        real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

/* A call NAME of TYPE that fails with BAD if FAILS; else the one of libc. */
#define CALL(type, name, declared, given, fails, bad) \
    type name declared \
    { \
        REAL(name); \
        return (fails) ? (bad) : real given; \
    }

CALL(ssize_t, read, (int fd, void *data, size_t size), (fd, data, size), descriptor_fails(READ, fd), -1)
CALL(ssize_t, readv, (int fd, const struct iovec *parts, int count), (fd, parts, count),
     descriptor_fails(READ, fd), -1)
CALL(ssize_t, pread, (int fd, void *data, size_t size, off_t at), (fd, data, size, at),
     descriptor_fails(READ, fd), -1)
CALL(ssize_t, pread64, (int fd, void *data, size_t size, off64_t at), (fd, data, size, at),
     descriptor_fails(READ, fd), -1)
CALL(ssize_t, write, (int fd, const void *data, size_t size), (fd, data, size),
     descriptor_fails(WRITE, fd), -1)
CALL(ssize_t, writev, (int fd, const struct iovec *parts, int count), (fd, parts, count),
     descriptor_fails(WRITE, fd), -1)
CALL(ssize_t, pwrite, (int fd, const void *data, size_t size, off_t at), (fd, data, size, at),
     descriptor_fails(WRITE, fd), -1)
CALL(ssize_t, pwrite64, (int fd, const void *data, size_t size, off64_t at), (fd, data, size, at),
     descriptor_fails(WRITE, fd), -1)
CALL(ssize_t, copy_file_range, (int in, off64_t *from, int out, off64_t *to, size_t size, unsigned flags),
     (in, from, out, to, size, flags), descriptor_fails(WRITE, out), -1)
ssize_t sendfile(int, int, off_t *, size_t);
ssize_t sendfile64(int, int, off64_t *, size_t);
CALL(ssize_t, sendfile, (int out, int in, off_t *at, size_t size), (out, in, at, size),
     descriptor_fails(WRITE, out), -1)
CALL(ssize_t, sendfile64, (int out, int in, off64_t *at, size_t size), (out, in, at, size),
     descriptor_fails(WRITE, out), -1)
CALL(int, fsync, (int fd), (fd), descriptor_fails(FSYNC, fd), -1)
CALL(int, fdatasync, (int fd), (fd), descriptor_fails(FSYNC, fd), -1)
CALL(int, ftruncate, (int fd, off_t size), (fd, size), descriptor_fails(TRUNCATE, fd), -1)
CALL(int, ftruncate64, (int fd, off64_t size), (fd, size), descriptor_fails(TRUNCATE, fd), -1)
CALL(int, posix_fallocate, (int fd, off_t at, off_t size), (fd, at, size),
     descriptor_fails(TRUNCATE, fd), fail_errno)
CALL(int, posix_fallocate64, (int fd, off64_t at, off64_t size), (fd, at, size),
     descriptor_fails(TRUNCATE, fd), fail_errno)

/* A rename, or another name of a file, counts by the new name. */
CALL(int, link, (const char *from, const char *to), (from, to), path_fails(RENAME, AT_FDCWD, to), -1)
CALL(int, linkat, (int one, const char *from, int other, const char *to, int flags),
     (one, from, other, to, flags), path_fails(RENAME, other, to), -1)
CALL(int, rename, (const char *from, const char *to), (from, to), path_fails(RENAME, AT_FDCWD, to), -1)
CALL(int, renameat, (int one, const char *from, int other, const char *to), (one, from, other, to),
     path_fails(RENAME, other, to), -1)
CALL(int, renameat2, (int one, const char *from, int other, const char *to, unsigned flags),
     (one, from, other, to, flags), path_fails(RENAME, other, to), -1)
CALL(int, mkdir, (const char *path, mode_t mode), (path, mode), path_fails(MKDIR, AT_FDCWD, path), -1)
CALL(int, mkdirat, (int folder, const char *path, mode_t mode), (folder, path, mode),
     path_fails(MKDIR, folder, path), -1)
CALL(int, unlink, (const char *path), (path), path_fails(UNLINK, AT_FDCWD, path), -1)
CALL(int, rmdir, (const char *path), (path), path_fails(UNLINK, AT_FDCWD, path), -1)
CALL(int, unlinkat, (int folder, const char *path, int flags), (folder, path, flags),
     path_fails(UNLINK, folder, path), -1)

static enum kind opening(int flags) { return flags & (O_CREAT | O_WRONLY | O_RDWR) ? CREATE : OPEN; }

static mode_t mode_of(int flags, va_list more)
{
    return flags & O_CREAT || (flags & O_TMPFILE) == O_TMPFILE ? va_arg(more, mode_t) : 0;
}

#define OPENING(name, declared, given, folder) \
    int name declared \
    { \
        va_list more; \
        va_start(more, flags); \
        mode_t mode = mode_of(flags, more); \
        va_end(more); \
        REAL(name); \
        return path_fails(opening(flags), folder, path) ? -1 : real given; \
    }

OPENING(open, (const char *path, int flags, ...), (path, flags, mode), AT_FDCWD)
OPENING(open64, (const char *path, int flags, ...), (path, flags, mode), AT_FDCWD)
OPENING(openat, (int folder, const char *path, int flags, ...), (folder, path, flags, mode), folder)
OPENING(openat64, (int folder, const char *path, int flags, ...), (folder, path, flags, mode), folder)

static enum kind reading(const char *mode) { return strpbrk(mode, "wa+") ? CREATE : OPEN; }

CALL(FILE *, fopen, (const char *path, const char *mode), (path, mode),
     path_fails(reading(mode), AT_FDCWD, path), NULL)
CALL(FILE *, fopen64, (const char *path, const char *mode), (path, mode),
     path_fails(reading(mode), AT_FDCWD, path), NULL)

static int stream_fails(enum kind kind, FILE *file)
{
    if (!told || inside || !file || !descriptor_fails(kind, fileno(file)))
        return 0;
    file->_flags |= 0x20; /* what ferror() asks for */
    return 1;
}

CALL(size_t, fread, (void *data, size_t size, size_t count, FILE *file), (data, size, count, file),
     stream_fails(READ, file), 0)
CALL(size_t, fwrite, (const void *data, size_t size, size_t count, FILE *file), (data, size, count, file),
     stream_fails(WRITE, file), 0)
CALL(int, fflush, (FILE *file), (file), file && __fwritable(file) && stream_fails(WRITE, file), EOF)

int fclose(FILE *file)
{
    REAL(fclose);
    if (!__fwritable(file) || !stream_fails(WRITE, file))
        return real(file);
    __fpurge(file); /* what was not written yet is lost */
    real(file);
    errno = fail_errno;
    return EOF;
}

/* By the system's call, and malloc by its inner name: dlsym allocates itself. */
void *mmap64(void *at, size_t size, int protection, int flags, int fd, off64_t offset)
{
    if (flags & MAP_ANONYMOUS ? memory_fails(size) : descriptor_fails(MMAP, fd))
        return MAP_FAILED;
    return (void *)syscall(SYS_mmap, at, size, protection, flags, fd, offset);
}

void *mmap(void *at, size_t size, int protection, int flags, int fd, off_t offset)
{
    return mmap64(at, size, protection, flags, fd, offset);
}

void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);

void *malloc(size_t size) { return memory_fails(size) ? NULL : __libc_malloc(size); }

void *calloc(size_t count, size_t size)
{
    size_t all;
    if (!__builtin_mul_overflow(count, size, &all) && memory_fails(all))
        return NULL;
    return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) { return memory_fails(size) ? NULL : __libc_realloc(old, size); }

void *memalign(size_t step, size_t size) { return memory_fails(size) ? NULL : __libc_memalign(step, size); }

void *aligned_alloc(size_t step, size_t size) { return memalign(step, size); }

int posix_memalign(void **out, size_t step, size_t size)
{
    void *got = memory_fails(size) ? NULL : __libc_memalign(step, size);
    if (!got)
        return ENOMEM;
    *out = got;
    return 0;
}
