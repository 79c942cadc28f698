/* The interface of the core to its chip. */
#ifndef PORT_H
#define PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Returns the free-running microsecond counter; it wraps. */
uint32_t port_time_us(void);

/* Waits at least this time in a loop, for pauses that a part needs within one exchange. */
void port_wait_us(uint32_t duration_us);

/* Selects the device, which has the number of its sensor, exchanges `size` bytes in place at `max_hz` or the next slower
   clock, deselects. `size` is even: the SPI FIFO takes two bytes an access. */
void bus_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);

/* Enables the interrupts of these sensors' data-ready lines alone: bit i is sensor i. Earlier edges are discarded. */
void port_listen(uint8_t mask);

/* Returns whether a sensor's data-ready line is high. */
bool port_line_is_high(unsigned sensor);

/* A lamp, and a button on the same wire: the button cannot be read while the lamp is lit. */
void port_set_lamp(bool lit);
bool port_button_is_down(void);

/* Starts sending; the bytes must not change until the port calls link_sent(). */
void port_transmit(const uint8_t *bytes, size_t size);

/* Restarts the board once the last byte has been sent. */
void port_restart(void);

/* Sets the duty of the heater's pin in 255ths; it is 0 after every reset of the chip. */
void port_heat(uint8_t power);

/* Pages of flash for data that must survive a power loss. Erased bytes read as 0xFF. A doubleword can be programmed once after
   an erase. Each returns false if the flash fails; a read also if a doubleword is torn by an interrupted write. */
#define FLASH_PAGES 16u /* two for each of the eight sensors that messages can address */
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
