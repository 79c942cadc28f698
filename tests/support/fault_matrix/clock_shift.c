/* Preloaded into a program: its wall clock is off by the seconds that the file named in CLOCK_SHIFT_FILE says.
   The monotonic clock is the system's, as after somebody has set the time. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>
#include <time.h>

static long shift_s(void)
{
    const char *name = getenv("CLOCK_SHIFT_FILE");
    FILE *file = name ? fopen(name, "r") : NULL;
    long seconds = 0;

    if (file) {
        if (fscanf(file, "%ld", &seconds) != 1)
            seconds = 0;
        fclose(file);
    }
    return seconds;
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static int (*real)(clockid_t, struct timespec *);
    int failed;

    if (!real)
        real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    failed = real(clock, now);
    if (!failed && clock == CLOCK_REALTIME)
        now->tv_sec += shift_s();
    return failed;
}

int gettimeofday(struct timeval *now, void *zone)
{
    struct timespec shifted;
    (void)zone;

    if (clock_gettime(CLOCK_REALTIME, &shifted))
        return -1;
    now->tv_sec = shifted.tv_sec;
    now->tv_usec = shifted.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *where)
{
    struct timespec shifted;

    clock_gettime(CLOCK_REALTIME, &shifted);
    if (where)
        *where = shifted.tv_sec;
    return shifted.tv_sec;
}
