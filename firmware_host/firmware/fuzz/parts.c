#include "parts.h"

#include <string.h>

#define PARTS 4u
#define MEMORY 256u

/* All but the third: registers behind a byte of address, of which the magnetometer has one bit less. The third: words of 16
   bits, high byte first, answered a frame later, but for the burst, whose ten words begin at BURST_DATA. */
enum { LSM9DS1, MPU9250, ADIS16465, MAGNETOMETER };

#define READ 0x80u
#define ADIS_WRITE 0x80u
#define ADIS_BURST 0x68u
#define BURST_DATA 0x80u /* above the registers */
#define BURST_SIZE 20u

static uint8_t memory[PARTS][MEMORY];
static uint8_t answer_at; /* of the ADIS16465: the register its next frame answers */

void parts_reset(void)
{
    memset(memory, 0, sizeof memory);
    memory[LSM9DS1][0x0F] = 0x68;   /* WHO_AM_I */
    memory[LSM9DS1][0x17] = 0x02;   /* STATUS_REG: new data, always; its twin at 0x27 says none after the rates */
    memory[MPU9250][0x75] = 0x71;   /* WHO_AM_I */
    memory[MPU9250][0x6B] = 0x01;   /* PWR_MGMT_1 */
    memory[MPU9250][0x3A] = 0x01;   /* INT_STATUS: new data, always */
    memory[MAGNETOMETER][0x0F] = 0x3D; /* WHO_AM_I_M */
    memory[MAGNETOMETER][0x27] = 0x0F; /* STATUS_REG_M: new data, always */
    memory[ADIS16465][0x72] = 0x40; /* PROD_ID */
    memory[ADIS16465][0x73] = 0x51;
    memory[ADIS16465][0x5F] = 0x07; /* RANG_MDL: 500 °/s */
    answer_at = 0;
}

static void burst(uint8_t *bytes, size_t size)
{
    uint8_t data[BURST_SIZE];
    memcpy(data, &memory[ADIS16465][BURST_DATA], sizeof data);
    uint16_t sum = (uint16_t)(data[18] << 8 | data[19]); /* what the fuzzer put there damages it */
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
    if (device == ADIS16465) {
        adis_xfer(bytes, size);
        return;
    }
    uint8_t mask = device == MAGNETOMETER ? 0x3Fu : 0x7Fu, address = bytes[0] & mask;
    for (size_t i = 1; i < size; i++, address = (address + 1) & mask) {
        if (bytes[0] & READ)
            bytes[i] = memory[device][address];
        else
            memory[device][address] = bytes[i];
    }
}

void parts_convert(unsigned device, uint8_t value)
{
    static const struct {
        uint8_t first, size;
    } outputs[PARTS][2] = {{{0x18, 6}, {0x28, 6}}, {{0x3B, 6}, {0x43, 6}}, {{BURST_DATA + 2, 12}, {0x04, 24}}, {{0x28, 6}}};
    for (unsigned block = 0; block < 2; block++)
        for (uint8_t i = 0; i < outputs[device][block].size; i++)
            memory[device][outputs[device][block].first + i] = (uint8_t)(value * (i + 1));
    memory[ADIS16465][0x23] = ++memory[ADIS16465][BURST_DATA + 17]; /* the counter of conversions, low byte */
}

void parts_disturb(unsigned device, uint8_t address, uint8_t value)
{
    memory[device][address] = value;
}
