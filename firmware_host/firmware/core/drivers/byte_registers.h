/* Parts whose registers are bytes at 7-bit addresses, with a first bit of a transfer that selects read or write. */
#ifndef BYTE_REGISTERS_H
#define BYTE_REGISTERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BYTE_REGISTER_READ 0x80u

uint8_t byte_register_read(unsigned device, uint32_t max_hz, uint8_t address);

/* Writes a register; true if it then reads back as written. */
bool byte_register_write(unsigned device, uint32_t max_hz, uint8_t address, uint8_t value);

struct byte_setting {
    uint8_t address, value;
};

/* Writes registers in order, up to the first that does not read back; true if all do. */
bool byte_registers_write(unsigned device, uint32_t max_hz, const struct byte_setting *settings, size_t count);

#endif
