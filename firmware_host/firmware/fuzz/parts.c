#include "parts.h"

#include <string.h>

#include "sensors.h"
#include "settings.h"

#define BURST_DATA 0x80u /* of the ADIS16465: above the registers, where its burst of ten words begins */

#define MEMORY 256u
#define READ 0x80u
#define WORDS 0u /* in the place of a mask: words of 16 bits, high byte first, answered a frame later */

/* A part: the address bits of the first byte, which selects the bytes of the answer; its memory after power-up, such as its
   identity and a constant flag of new data; and the addresses of its outputs. */
static const struct part {
    uint8_t mask;
    struct {
        uint8_t address, value;
    } initial[3];
    struct {
        uint8_t first, size;
    } outputs[2];
} parts[SENSOR_COUNT] = {
    [SENSOR_lsm9ds1_gyro] = {0x7F, {{0x0F, 0x68}, {0x17, 0x02}}, {{0x18, 6}, {0x28, 6}}}, /* no new accelerations at 0x27 */
    [SENSOR_mpu9250_gyro] = {0x7F, {{0x75, 0x71}, {0x6B, 0x01}, {0x3A, 0x01}}, {{0x3B, 6}, {0x43, 6}}},
    [SENSOR_adis16465_gyro] = {WORDS, {{0x72, 0x40}, {0x73, 0x51}, {0x5F, 0x07}}, {{BURST_DATA + 2, 12}, {0x04, 24}}},
    [SENSOR_icm42688p_gyro] = {0x7F, {{0x75, 0x47}, {0x2D, 0x08}}, {{0x1F, 6}, {0x25, 6}}},
    [SENSOR_lsm6dsv16x_gyro] = {0x7F, {{0x0F, 0x70}, {0x1E, 0x07}}, {{0x22, 6}, {0x28, 6}}},
    [SENSOR_lsm9ds1_magnetometer] = {0x3F, {{0x0F, 0x3D}, {0x27, 0x0F}}, {{0x28, 6}}},
};

#define ADIS16465 SENSOR_adis16465_gyro
#define ADIS_WRITE 0x80u
#define ADIS_BURST 0x68u
#define BURST_SIZE 20u

static uint8_t memory[SENSOR_COUNT][MEMORY];
static uint8_t answer_at; /* of the ADIS16465: the register its next frame answers */

void parts_reset(void)
{
    memset(memory, 0, sizeof memory);
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        for (unsigned k = 0; k < COUNT(parts[i].initial); k++)
            memory[i][parts[i].initial[k].address] = parts[i].initial[k].value;
    answer_at = 0;
}

static void burst(uint8_t *bytes, size_t size)
{
    uint8_t data[BURST_SIZE];
    memcpy(data, &memory[ADIS16465][BURST_DATA], sizeof data);
    uint16_t sum = (uint16_t)(data[18] << 8 | data[19]); /* a byte from the fuzzer damages it */
    for (size_t i = 0; i < 18; i++)
        sum = (uint16_t)(sum + data[i]);
    data[18] = (uint8_t)(sum >> 8);
    data[19] = (uint8_t)sum;
    memcpy(&bytes[2], data, size - 2 < sizeof data ? size - 2 : sizeof data);
}

static void adis_xfer(uint8_t *bytes, size_t size)
{
    uint8_t address = bytes[0] & 0x7Fu;
    uint8_t asked = answer_at;
    if (bytes[0] & ADIS_WRITE)
        memory[ADIS16465][address ^ 1u] = bytes[1]; /* the even address is the low byte */
    else
        answer_at = address & 0x7Eu;
    if (size > 2 && bytes[0] == ADIS_BURST)
        burst(bytes, size);
    memcpy(bytes, &memory[ADIS16465][asked], 2);
}

void parts_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size)
{
    (void)max_hz;
    uint8_t mask = parts[device].mask, address = bytes[0] & mask;
    if (mask == WORDS) {
        adis_xfer(bytes, size);
        return;
    }
    for (size_t i = 1; i < size; i++, address = (address + 1) & mask) {
        if (bytes[0] & READ)
            bytes[i] = memory[device][address];
        else
            memory[device][address] = bytes[i];
    }
}

void parts_convert(unsigned device, uint8_t value)
{
    for (unsigned block = 0; block < COUNT(parts[device].outputs); block++)
        for (uint8_t i = 0; i < parts[device].outputs[block].size; i++)
            memory[device][parts[device].outputs[block].first + i] = (uint8_t)(value * (i + 1));
    memory[ADIS16465][0x23] = ++memory[ADIS16465][BURST_DATA + 17]; /* the counter of conversions, low byte */
}

void parts_disturb(unsigned device, uint8_t address, uint8_t value)
{
    memory[device][address] = value;
}
