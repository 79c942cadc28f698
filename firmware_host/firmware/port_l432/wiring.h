/* The pins of the sensors' selects and data-ready lines, from the table of parts. */
#ifndef WIRING_H
#define WIRING_H

#include <stdint.h>

#include "sensors.h"

/* The lines of external interrupts have the numbers of their pins: bit `pin` of the interrupt's registers. */
#define READY_LINE(driver, select_port, select_pin, ready_port, ready_pin) | 1u << (ready_pin)
#define READY_LINES (0u SENSORS(READY_LINE))

struct select {
    volatile uint32_t *set_reset;
    uint32_t select, deselect;
};

struct ready_line {
    const volatile uint32_t *level;
    uint32_t bit;
};

extern const struct select selects[SENSOR_COUNT];
extern const struct ready_line ready_lines[SENSOR_COUNT];

/* Selects are outputs and high, data-ready lines are inputs pulled down, whose rising edges are external interrupts; which of
   them interrupt, port_listen says. */
void wiring_setup(void);

#endif
