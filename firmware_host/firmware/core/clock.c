#include "clock.h"

#include "port.h"

static uint64_t now_us;

void clock_reset(void)
{
    now_us = port_time_us();
}

uint64_t clock_now(void)
{
    now_us += (uint32_t)(port_time_us() - (uint32_t)now_us);
    return now_us;
}

/* The difference is signed: an interrupt may capture a moment before or after the last clock_now(). */
uint64_t clock_at(uint32_t captured_us)
{
    return now_us + (uint64_t)(int64_t)(int32_t)(captured_us - (uint32_t)now_us);
}
