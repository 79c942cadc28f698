/* LSM9DS1 datasheet (DocID025715): register map section 6, registers section 7, SPI section 5. */
#include "byte_registers.h"
#include "drivers.h"
#include "port.h"
#include "settings.h"

#define IDENTITY 0x68u
#define BUS_HZ 5000000u /* half the limit of section 5.2.1: the wires are loose */

enum register_address {
    ACT_THS = 0x04,
    ACT_DUR = 0x05,
    INT1_CTRL = 0x0C,
    WHO_AM_I = 0x0F,
    CTRL_REG1_G = 0x10,
    CTRL_REG2_G = 0x11,
    CTRL_REG3_G = 0x12,
    ORIENT_CFG_G = 0x13,
    OUT_TEMP_L = 0x15, /* then OUT_TEMP_H, STATUS_REG and the six bytes of OUT_X_G … OUT_Z_G */
    CTRL_REG4 = 0x1E,
    CTRL_REG5_XL = 0x1F,
    CTRL_REG6_XL = 0x20,
    CTRL_REG7_XL = 0x21,
    CTRL_REG8 = 0x22,
    CTRL_REG9 = 0x23,
    CTRL_REG10 = 0x24,
    STATUS_REG = 0x27, /* the same as before the rates */
    OUT_X_L_XL = 0x28, /* and five more, to 0x2D */
    FIFO_CTRL = 0x2E,
};

#define INT1_CTRL_DRDY_G 0x02u
#define CTRL_REG4_AXES 0x38u       /* z, y, x on */
#define CTRL_REG5_XL_AXES 0x38u
#define CTRL_REG6_XL_BW_SCAL_ODR 0x04 /* the filter is selected explicitly, not by the data rate */
#define CTRL_REG8_BDU 0x40u        /* low and high byte of one conversion */
#define CTRL_REG8_IF_ADD_INC 0x04u /* the address counts up in a burst */
#define CTRL_REG9_I2C_DISABLE 0x04u
#define STATUS_XLDA 0x01u
#define STATUS_GDA 0x02u
#define STATUS_ALWAYS_0 0x80u /* reads 1 if no part drives the wire */
#define SETTLING 8u           /* table 12: 2 at 14.9 Hz to 8 at 952 Hz, without the second filter */

/* With the accelerometer's filter, whose default is as wide for the slowest rate as for the fastest: 408, 211, 105 or, of code
   3, 50 Hz. */
static const struct {
    double hz;
    uint8_t code, bandwidth_code;
} rates[] = {{14.9, 1, 3}, {59.5, 2, 3}, {119.0, 3, 3}, {238.0, 4, 2}, {476.0, 5, 1}, {952.0, 6, 0}};

/* Sensitivities are the datasheet's table 3, not range / 32768: that would be 15 % off. Code 2 is unused by the part. */
static const struct range ranges[] = {
    {245.0, 0, RADIANS(8.75e-3)},
    {500.0, 1, RADIANS(17.5e-3)},
    {2000.0, 3, RADIANS(70.0e-3)},
};

/* The same table; here 16 g would be 50 % off. ST's own driver (lsm9ds1_reg.c) has the same codes and figures. */
static const struct range accelerations[] = {
    NO_ACCELERATION,
    {2.0, 0, 0.061e-3},
    {4.0, 2, 0.122e-3},
    {8.0, 3, 0.244e-3},
    {16.0, 1, 0.732e-3},
};

static uint16_t identify(unsigned device)
{
    return byte_register_read(device, BUS_HZ, WHO_AM_I);
}

/* For both dies: the magnetometer receives even if its own output wire is not connected. */
static void keep_to_spi(unsigned device)
{
    byte_register_write(device, BUS_HZ, CTRL_REG9, CTRL_REG9_I2C_DISABLE);
    lsm9ds1_magnetometer.keep_to_spi(SENSOR_lsm9ds1_magnetometer);
}

static size_t nearest_rate(float hz)
{
    size_t best = 0;
    for (size_t i = 1; i < COUNT(rates); i++)
        if (is_nearer(rates[i].hz, rates[best].hz, hz))
            best = i;
    return best;
}

/* Data rate last: it starts a part that was off, with the accelerometer at the same rate; a write to the accelerometer's
   register would run that alone (section 3.1). Settings of an earlier image, such as the self-test, are cleared. */
static bool write_settings(unsigned device, uint8_t control_g, uint8_t control_xl)
{
    const struct byte_setting settings[] = {
        {CTRL_REG9, CTRL_REG9_I2C_DISABLE},
        {CTRL_REG8, CTRL_REG8_BDU | CTRL_REG8_IF_ADD_INC},
        {CTRL_REG4, CTRL_REG4_AXES},
        {CTRL_REG2_G, 0}, /* output before the second filter */
        {CTRL_REG3_G, 0}, /* no high-pass: it would remove the bias to be measured */
        {ORIENT_CFG_G, 0},
        {CTRL_REG10, 0}, /* no self-test: it would add a rate */
        {FIFO_CTRL, 0},
        {ACT_THS, 0}, /* no sleep at rest */
        {ACT_DUR, 0},
        {INT1_CTRL, INT1_CTRL_DRDY_G},
        {CTRL_REG5_XL, CTRL_REG5_XL_AXES}, /* every conversion, not a mean of some */
        {CTRL_REG7_XL, 0},                 /* no high-pass, no second filter */
        {CTRL_REG6_XL, control_xl},
        {CTRL_REG1_G, control_g},
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
    uint8_t control_g = (uint8_t)(rates[rate].code << 5 | range->code << 3);
    uint8_t control_xl = (uint8_t)(rates[rate].code << 5 | acceleration->code << 3 | CTRL_REG6_XL_BW_SCAL_ODR |
                                   rates[rate].bandwidth_code);
    if (!write_settings(device, control_g, acceleration->full_scale > 0.0 ? control_xl : 0))
        return ERROR_SETUP_FAILED;
    setup->rate_hz = rates[rate].hz;
    tell_ranges(range, acceleration, setup);
    setup->temperature_scale_c = 1.0 / 16.0;
    setup->temperature_offset_c = 25.0;
    return 0;
}

static int16_t int16_at(const uint8_t *bytes)
{
    return (int16_t)(bytes[0] | bytes[1] << 8);
}

/* Both triads of this die are left-handed: by figure 1 their x is opposite to the magnetometer's, y and z are the same.
   ArduPilot's driver, proven in flight, inverts one of their signs and none of the magnetometer's (docs/board.md, "Axes", has
   more evidence). After the inversion here, all are in the axes of the magnetometer. */
static void take_right_handed(const uint8_t *bytes, int16_t counts[3])
{
    for (unsigned axis = 0; axis < 3; axis++)
        counts[axis] = int16_at(&bytes[2 * axis]);
    counts[0] = counts[0] == INT16_MIN ? INT16_MAX : (int16_t)-counts[0];
}

/* Reading the rates cleared their flag, and reading the accelerations clears theirs. If one of them is set again, the next
   conversion came in between. */
static enum read_result read_acceleration(unsigned device, struct reading *reading)
{
    uint8_t bytes[8] = {OUT_X_L_XL | BYTE_REGISTER_READ}; /* and one more register, for an even number */
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    take_right_handed(&bytes[1], reading->acceleration);
    uint8_t status = byte_register_read(device, BUS_HZ, STATUS_REG);
    return status & (STATUS_GDA | STATUS_XLDA) ? READ_TORN : READ_FRESH;
}

/* One chip select for temperature, status and rates: they are adjacent, and one burst is of one instant. */
static enum read_result read(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    uint8_t bytes[10] = {OUT_TEMP_L | BYTE_REGISTER_READ};
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    reading->temperature_counts = int16_at(&bytes[1]);
    take_right_handed(&bytes[4], reading->counts);
    if ((bytes[3] & (STATUS_GDA | STATUS_ALWAYS_0)) != STATUS_GDA)
        return READ_STALE;
    return setup->range_m_s2 > 0.0 ? read_acceleration(device, reading) : READ_FRESH;
}

const struct sensor_driver lsm9ds1_gyro = {
    "LSM9DS1", IDENTITY, QUANTITY_RATE, 0, SETTLING, true, 0, NULL, keep_to_spi, identify, configure, read};
