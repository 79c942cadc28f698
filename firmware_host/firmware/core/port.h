/* What the core asks of the chip it runs on. */
#ifndef PORT_H
#define PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Free-running microsecond counter; it wraps. */
uint32_t port_time_us(void);

/* Lets at least so much time pass, busily: for pauses a part needs within one conversation. */
void port_wait_us(uint32_t duration_us);

/* Selects the device, which has the number of its sensor, exchanges `size` bytes in place at `max_hz` or the next slower
   clock, deselects. `size` is even: the SPI FIFO takes two bytes an access. */
void bus_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);

/* From now on only these sensors' data-ready lines interrupt: bit i is sensor i. What they did before is forgotten. */
void port_listen(uint8_t mask);

/* Whether a sensor's data-ready line is up now. */
bool port_line_is_high(unsigned sensor);

/* A lamp, and a button on the same wire: while the lamp is lit nobody can tell whether the button is down. */
void port_set_lamp(bool lit);
bool port_button_is_down(void);

/* Starts sending; the bytes stay untouched until the port calls link_sent(). */
void port_transmit(const uint8_t *bytes, size_t size);

/* Starts the board afresh once the last byte has left. */
void port_restart(void);

/* Drives the heater's pin so many 255ths of the time; 0 is what it does after every reset of the chip. */
void port_heat(uint8_t power);

/* Pages of flash for what must survive a power loss. What an erase leaves reads as 0xFF. A doubleword can be programmed once
   after an erase. Each returns false when the flash refuses; a read also when a doubleword is torn, cut off in its writing. */
#define FLASH_PAGES 16u /* two for each of the most sensors that messages can name */
#define FLASH_PAGE_BYTES 2048u
bool port_flash_read(unsigned page, size_t offset, void *bytes, size_t size);
bool port_flash_erase(unsigned page);
bool port_flash_program(unsigned page, size_t offset, uint64_t doubleword);

struct port_health {
    uint8_t reset_cause; /* enum reset_cause */
    uint8_t clock_locked;
    uint32_t fault_pc;
    uint32_t stack_high_water;
};

void port_health(struct port_health *health);
const uint8_t *port_unique_id(void); /* 12 bytes */

#endif
