/* LSM9DS1 datasheet (DocID025715): register map section 6, the magnetometer's registers section 8, SPI section 5. */
#include <stddef.h>

#include "byte_registers.h"
#include "drivers.h"
#include "port.h"
#include "settings.h"

#define IDENTITY 0x3Du
#define BUS_HZ 5000000u /* half the limit of section 5.2.1: the wires are loose */

enum register_address {
    OFFSET_X_REG_L_M = 0x05, /* and five more, to 0x0A */
    WHO_AM_I_M = 0x0F,
    CTRL_REG1_M = 0x20,
    CTRL_REG2_M = 0x21,
    CTRL_REG3_M = 0x22,
    CTRL_REG4_M = 0x23,
    CTRL_REG5_M = 0x24,
    STATUS_REG_M = 0x27, /* then the six bytes of OUT_X_M … OUT_Z_M */
};

#define COUNT_UP 0x40u /* bit of an address; the other die has this in CTRL_REG8 */

#define CTRL_REG1_M_BEST 0xE0u /* temperature compensation, x and y of ultra-high performance */
#define CTRL_REG1_M_DO(code) ((code) << 2)
#define CTRL_REG2_M_FS(code) ((code) << 5)
#define CTRL_REG3_M_I2C_DISABLE 0x80u /* and continuous conversion */
#define CTRL_REG3_M_QUIET 0x83u       /* and powered down, as after a start */
#define CTRL_REG4_M_BEST 0x0Cu        /* z of ultra-high performance, low byte first */
#define CTRL_REG5_M_BDU 0x40u         /* low and high byte of one conversion */
#define STATUS_ZYXDA 0x08u
#define NOTHING 0xFFu /* reading of an undriven wire */
#define SETTLING 2u   /* first conversions after a change; assumed, without a figure in the data sheet */

static const double rates_hz[] = {0.625, 1.25, 2.5, 5.0, 10.0, 20.0, 40.0, 80.0}; /* by code */

/* Table 3, not range / 32768: that would be 15 % off. */
static const struct range ranges[] = {{4.0, 0, 0.14e-3}, {8.0, 1, 0.29e-3}, {12.0, 2, 0.43e-3}, {16.0, 3, 0.58e-3}};

static uint16_t identify(unsigned device)
{
    return byte_register_read(device, BUS_HZ, WHO_AM_I_M);
}

/* Also without answers of the die. It continues its present operation. */
static void keep_to_spi(unsigned device)
{
    uint8_t control = byte_register_read(device, BUS_HZ, CTRL_REG3_M);
    if (control == NOTHING || !(control & CTRL_REG3_M_I2C_DISABLE))
        byte_register_write(device, BUS_HZ, CTRL_REG3_M, CTRL_REG3_M_QUIET);
}

static unsigned nearest_rate(float hz)
{
    unsigned best = 0;
    for (unsigned i = 1; i < COUNT(rates_hz); i++)
        if (is_nearer(rates_hz[i], rates_hz[best], hz))
            best = i;
    return best;
}

/* Off first, and on again last, so that conversions begin with all settings. The user's offsets, which the part subtracts, are
   cleared. */
static enum error_code configure(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup)
{
    const struct range *range = choose_range(wanted->range_gauss, ranges, COUNT(ranges));
    if (range == NULL)
        return ERROR_BAD_RANGE;
    unsigned rate = nearest_rate(wanted->rate_hz);
    const struct byte_setting settings[] = {
        {CTRL_REG3_M, CTRL_REG3_M_QUIET},
        {OFFSET_X_REG_L_M, 0},
        {OFFSET_X_REG_L_M + 1, 0},
        {OFFSET_X_REG_L_M + 2, 0},
        {OFFSET_X_REG_L_M + 3, 0},
        {OFFSET_X_REG_L_M + 4, 0},
        {OFFSET_X_REG_L_M + 5, 0},
        {CTRL_REG1_M, (uint8_t)(CTRL_REG1_M_BEST | CTRL_REG1_M_DO(rate))}, /* no self-test: it would add a field */
        {CTRL_REG2_M, (uint8_t)CTRL_REG2_M_FS(range->code)},
        {CTRL_REG4_M, CTRL_REG4_M_BEST},
        {CTRL_REG5_M, CTRL_REG5_M_BDU},
        {CTRL_REG3_M, CTRL_REG3_M_I2C_DISABLE},
    };
    if (!byte_registers_write(device, BUS_HZ, settings, COUNT(settings)))
        return ERROR_SETUP_FAILED;
    setup->rate_hz = rates_hz[rate];
    setup->range_t = TESLA(range->full_scale);
    setup->sensitivity_t = TESLA(range->per_count);
    return 0;
}

/* One chip select for status and field. Any status may be valid, except all ones before a field of all ones. */
static enum read_result read(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    uint8_t bytes[8] = {STATUS_REG_M | BYTE_REGISTER_READ | COUNT_UP}, all = NOTHING;
    (void)setup;
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    for (unsigned i = 1; i < sizeof bytes; i++)
        all &= bytes[i];
    for (unsigned axis = 0; axis < 3; axis++)
        reading->counts[axis] = (int16_t)(bytes[2 * axis + 2] | bytes[2 * axis + 3] << 8);
    return (bytes[1] & STATUS_ZYXDA) != 0 && all != NOTHING ? READ_FRESH : READ_STALE;
}

const struct sensor_driver lsm9ds1_magnetometer = {
    "LSM9DS1-M", IDENTITY, QUANTITY_FIELD, 0, SETTLING, true, 0, NULL, keep_to_spi, identify, configure, read};
