/* What the core asks of the chip it runs on. */
#ifndef PORT_H
#define PORT_H

#include <stddef.h>
#include <stdint.h>

/* Free-running microsecond counter; it wraps. */
uint32_t port_time_us(void);

/* Selects `device`, exchanges `size` bytes in place, deselects. `size` is even: the SPI FIFO takes two bytes an access. */
void bus_xfer(unsigned device, uint8_t *bytes, size_t size);

/* Starts sending; the bytes stay untouched until the port calls link_sent(). */
void port_transmit(const uint8_t *bytes, size_t size);

/* Starts the board afresh once the last byte has left. */
void port_restart(void);

struct port_health {
    uint8_t reset_cause; /* enum reset_cause */
    uint8_t clock_locked;
    uint32_t fault_pc;
    uint32_t stack_high_water;
};

void port_health(struct port_health *health);
const uint8_t *port_unique_id(void); /* 12 bytes */

#endif
