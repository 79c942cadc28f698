/* What the start leaves for the port to report. */
#ifndef STARTUP_H
#define STARTUP_H

#include <stdint.h>

/* Survives a reset, for the next start to tell where the last one died. */
struct fault_record {
    uint32_t magic;
    uint32_t pc;
};

#define FAULT_MAGIC 0xFA017EDu

extern struct fault_record fault_record;

uint32_t stack_high_water(void);

/* Everything written to memory before is there afterwards. */
_Noreturn void reset_chip(void);

#endif
