/* LSM6DSV16X data sheet (DS13510, revision 4): registers section 9, SPI section 5. ST's own lsm6dsv16x_reg.c and Zephyr's
   drivers/sensor/st/lsm6dsv16x have the same registers and bits. */
#include "byte_registers.h"
#include "drivers.h"
#include "port.h"
#include "settings.h"

#define IDENTITY 0x70u /* section 9.13 */
#define BUS_HZ 5000000u /* half the limit of table 7: the wires are loose */

enum register_address {
    FUNC_CFG_ACCESS = 0x01,
    IF_CFG = 0x03,
    INT1_CTRL = 0x0D,
    WHO_AM_I = 0x0F,
    CTRL1 = 0x10,
    CTRL2 = 0x11,
    CTRL3 = 0x12,
    CTRL4 = 0x13,
    CTRL6 = 0x15,
    CTRL8 = 0x17,
    STATUS_REG = 0x1E, /* then one more, and the seven words of temperature, rates and accelerations, low byte first */
    HAODR_CFG = 0x62,
};

#define FUNC_CFG_ACCESS_EMBEDDED 0x80u
#define FUNC_CFG_ACCESS_HUB 0x40u
#define IF_CFG_I2C_I3C_DISABLE 0x01u /* the rest 0: four wires, INT1 push-pull and active high */
#define INT1_CTRL_DRDY_G 0x02u
#define CTRL3_BDU 0x40u    /* low and high byte of one conversion */
#define CTRL3_IF_INC 0x04u /* the address counts up in a burst */
#define CTRL3_SW_RESET 0x01u
#define CTRL4_DRDY_PULSED 0x02u /* 65 µs: a missed read does not cost an edge */
#define HIGH_ACCURACY 0x10u /* OP_MODE of both: the data rate within 1 % of the nominal one (table 3) */
#define STATUS_GDA 0x02u
#define STATUS_ALWAYS_0 0x40u /* bit 6 (table 82); reads 1 if no part drives the wire */
#define RESETTING_US 1000u /* the data sheet has no figure; like ST's driver, this one waits for the bit to clear */
#define POLL_US 50u

/* Table 4: the gyroscope turns on within 30 ms; then the settling of its low-pass at 12.5 Hz, 5.5 Hz wide: some 30 ms, twice.
   */
#define SETTLING_US 90000u
#define SETTLING 2u
/* A burst of 29 µs may contain words of two conversions; such a burst is discarded. */
#define LATCHED_US 45u

/* Table 20: three sets of rates, codes 4 to 10 of each HAODR_SEL, and code 3 of two. The gyroscope's low-pass is narrower than
   half of each rate (table 21), the accelerometer's is half (table 69). */
static const struct {
    double hz;
    uint8_t set, code;
} rates[] = {
    {12.5, 2, 3},  {15.0, 0, 3},  {15.625, 1, 3}, {25.0, 2, 4},  {30.0, 0, 4},   {31.25, 1, 4}, {50.0, 2, 5},   {60.0, 0, 5},
    {62.5, 1, 5},  {100.0, 2, 6}, {120.0, 0, 6},  {125.0, 1, 6}, {200.0, 2, 7},  {240.0, 0, 7}, {250.0, 1, 7},  {400.0, 2, 8},
    {480.0, 0, 8}, {500.0, 1, 8}, {800.0, 2, 9},  {960.0, 0, 9}, {1000.0, 1, 9}, {1600.0, 2, 10}, {1920.0, 0, 10},
    {2000.0, 1, 10},
};

/* Table 3, not range / 32768: that would be 14 % off. FS_G: table 63. The table's noise and tolerance are valid up to 2000 °/s,
   so 4000 is not used. */
static const struct range ranges[] = {
    {125.0, 0, RADIANS(4.375e-3)}, {250.0, 1, RADIANS(8.75e-3)},  {500.0, 2, RADIANS(17.5e-3)},
    {1000.0, 3, RADIANS(35.0e-3)}, {2000.0, 4, RADIANS(70.0e-3)},
};

/* Table 3; FS_XL: table 68. */
static const struct range accelerations[] = {
    NO_ACCELERATION, {2.0, 0, 0.061e-3}, {4.0, 1, 0.122e-3}, {8.0, 2, 0.244e-3}, {16.0, 3, 0.488e-3},
};

/* An earlier image may have mapped other registers here. Only a plausible value is changed, because the part is not identified
   yet. */
static uint16_t identify(unsigned device)
{
    uint8_t access = byte_register_read(device, BUS_HZ, FUNC_CFG_ACCESS);
    if (access == FUNC_CFG_ACCESS_EMBEDDED || access == FUNC_CFG_ACCESS_HUB)
        byte_register_write(device, BUS_HZ, FUNC_CFG_ACCESS, 0);
    return byte_register_read(device, BUS_HZ, WHO_AM_I);
}

static void keep_to_spi(unsigned device)
{
    if (byte_register_read(device, BUS_HZ, IF_CFG) != IF_CFG_I2C_I3C_DISABLE)
        byte_register_write(device, BUS_HZ, IF_CFG, IF_CFG_I2C_I3C_DISABLE);
}

static size_t nearest_rate(float hz)
{
    size_t best = 0;
    for (size_t i = 1; i < COUNT(rates); i++)
        if (is_nearer(rates[i].hz, rates[best].hz, hz))
            best = i;
    return best;
}

/* After it everything but the interface has its default: FIFO, filters, self-test, the user's offset, embedded functions. */
static bool reset_part(unsigned device)
{
    uint8_t bytes[2] = {CTRL3, CTRL3_BDU | CTRL3_IF_INC | CTRL3_SW_RESET};
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    for (uint32_t waited_us = 0; waited_us < RESETTING_US; waited_us += POLL_US) {
        port_wait_us(POLL_US);
        if (!(byte_register_read(device, BUS_HZ, CTRL3) & CTRL3_SW_RESET))
            return true;
    }
    return false;
}

/* Both sensors always run, at one rate: the mode requires it (section 6.5), and so a conversion is one of both. Rates come
   last, because they start the part. */
static bool write_settings(unsigned device, uint8_t set, uint8_t code, uint8_t range, uint8_t acceleration_range)
{
    const struct byte_setting settings[] = {
        {IF_CFG, IF_CFG_I2C_I3C_DISABLE},
        {CTRL3, CTRL3_BDU | CTRL3_IF_INC},
        {CTRL4, CTRL4_DRDY_PULSED},
        {HAODR_CFG, set},
        {CTRL6, range},
        {CTRL8, acceleration_range},
        {INT1_CTRL, INT1_CTRL_DRDY_G},
        {CTRL1, HIGH_ACCURACY | code},
        {CTRL2, HIGH_ACCURACY | code},
    };
    return byte_registers_write(device, BUS_HZ, settings, COUNT(settings));
}

static enum error_code configure(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup)
{
    const struct range *range = choose_range(wanted->range_deg_s, ranges, COUNT(ranges));
    const struct range *acceleration = choose_range(wanted->range_g, accelerations, COUNT(accelerations));
    if (range == NULL || acceleration == NULL)
        return ERROR_BAD_RANGE;
    size_t rate = nearest_rate(wanted->rate_hz);
    if (!reset_part(device) ||
        !write_settings(device, rates[rate].set, rates[rate].code, range->code, acceleration->code))
        return ERROR_SETUP_FAILED;
    setup->rate_hz = rates[rate].hz;
    tell_ranges(range, acceleration, setup);
    setup->temperature_scale_c = 1.0 / 256.0; /* table 6 */
    setup->temperature_offset_c = 25.0;
    return 0;
}

static int16_t int16_at(const uint8_t *bytes)
{
    return (int16_t)(bytes[0] | bytes[1] << 8);
}

/* One chip select for status, temperature, rates and accelerations. The axes of both triads are right-handed (figure 2; of the
   ISM330DLC, a part of the same family, PX4's driver turns two signs of each). */
static enum read_result read(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    (void)setup;
    uint8_t bytes[18] = {STATUS_REG | BYTE_REGISTER_READ}; /* and one more register, for an even number */
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    reading->temperature_counts = int16_at(&bytes[3]);
    for (unsigned axis = 0; axis < 3; axis++) {
        reading->counts[axis] = int16_at(&bytes[5 + 2 * axis]);
        reading->acceleration[axis] = int16_at(&bytes[11 + 2 * axis]);
    }
    return (bytes[1] & (STATUS_GDA | STATUS_ALWAYS_0)) == STATUS_GDA ? READ_FRESH : READ_STALE;
}

const struct sensor_driver lsm6dsv16x_gyro = {
    "LSM6DSV16X", IDENTITY, QUANTITY_RATE, SETTLING_US, SETTLING, false, LATCHED_US, NULL, keep_to_spi, identify, configure,
    read};
