#include "byte_registers.h"

#include "port.h"

uint8_t byte_register_read(unsigned device, uint32_t max_hz, uint8_t address)
{
    uint8_t bytes[2] = {(uint8_t)(address | BYTE_REGISTER_READ), 0};
    bus_xfer(device, max_hz, bytes, sizeof bytes);
    return bytes[1];
}

bool byte_register_write(unsigned device, uint32_t max_hz, uint8_t address, uint8_t value)
{
    uint8_t bytes[2] = {address, value};
    bus_xfer(device, max_hz, bytes, sizeof bytes);
    return byte_register_read(device, max_hz, address) == value;
}

bool byte_registers_write(unsigned device, uint32_t max_hz, const struct byte_setting *settings, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!byte_register_write(device, max_hz, settings[i].address, settings[i].value))
            return false;
    return true;
}
