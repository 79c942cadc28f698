/* ICM-42688-P data sheet (DS-000347, revision 1.8). Linux's drivers/iio/imu/inv_icm42600 and PX4's
   src/drivers/imu/invensense/icm42688p have the same registers, bits and times. */
#include "byte_registers.h"
#include "drivers.h"
#include "port.h"
#include "settings.h"

#define IDENTITY 0x47u /* section 14.58 */
#define BUS_HZ 5000000u /* table 6 has 24 MHz; loose wires do not */

enum register_address { /* of bank 0; section 13.1 */
    DEVICE_CONFIG = 0x11,
    INT_CONFIG = 0x14,
    TEMP_DATA1 = 0x1D, /* then the seven words of temperature, accelerations and rates, high byte first */
    INT_STATUS = 0x2D,
    INTF_CONFIG0 = 0x4C,
    INTF_CONFIG1 = 0x4D,
    PWR_MGMT0 = 0x4E,
    GYRO_CONFIG0 = 0x4F,
    ACCEL_CONFIG0 = 0x50,
    GYRO_ACCEL_CONFIG0 = 0x52,
    INT_CONFIG1 = 0x64,
    INT_SOURCE0 = 0x65,
    WHO_AM_I = 0x75,
    REG_BANK_SEL = 0x76, /* of all banks */
};

#define DEVICE_CONFIG_SOFT_RESET 0x01u
#define RESET_US 2000u /* section 14.1: 1 ms */
#define INT_CONFIG_INT1_RISES 0x03u /* a pulse, push-pull, active high: a missed read does not cost an edge */
#define INT_STATUS_DATA_RDY 0x08u
#define INT_STATUS_ALWAYS_0 0x80u /* reads 1 if no part drives the wire */
#define INTF_CONFIG0_FULL_RANGE 0x80u /* -32768 is a reading: saturation as in other parts (section 12.8) */
#define INTF_CONFIG0_BIG_ENDIAN 0x30u
#define INTF_CONFIG0_I2C_OFF 0x03u
#define INTF_CONFIG1_BEST_CLOCK 0x91u /* the gyroscope's oscillator, required for the accuracy of section 3 (section 4.10) */
#define PWR_MGMT0_BOTH_LOW_NOISE 0x0Fu
#define SWITCHING_US 200u /* section 14.36: no write within this time */
#define GYRO_ACCEL_CONFIG0_HALF_RATE 0x00u /* both low-passes at half the data rate, the widest below 1 kHz */
#define INT_SOURCE0_DATA_RDY 0x08u

/* Table 1: the gyroscope's drive is ready after 30 ms; then the settling of the low-pass at 25 Hz, 26 ms, three times. */
#define SETTLING_US 100000u
/* The data sheet does not state that outputs are frozen during a read, so a reading with a conversion between the status and
   the last byte of both transfers is discarded. */
#define LATCHED_US 60u

/* Section 14.37. Slower ones have a bandwidth above half their rate (section 5.5), faster ones need shorter pulses. */
static const struct {
    double hz;
    uint8_t code;
} rates[] = {{25.0, 0xA}, {50.0, 0x9}, {100.0, 0x8}, {200.0, 0x7}, {500.0, 0xF}, {1000.0, 0x6}, {2000.0, 0x5}};

/* Table 1, sensitivity scale factors; GYRO_FS_SEL: section 14.37. */
static const struct range ranges[] = {
    {15.625, 7, RADIANS(1.0 / 2097.2)}, {31.25, 6, RADIANS(1.0 / 1048.6)}, {62.5, 5, RADIANS(1.0 / 524.3)},
    {125.0, 4, RADIANS(1.0 / 262.0)},   {250.0, 3, RADIANS(1.0 / 131.0)},  {500.0, 2, RADIANS(1.0 / 65.5)},
    {1000.0, 1, RADIANS(1.0 / 32.8)},   {2000.0, 0, RADIANS(1.0 / 16.4)},
};

/* Table 2; ACCEL_FS_SEL: section 14.38. */
static const struct range accelerations[] = {
    NO_ACCELERATION,      {2.0, 3, 1.0 / 16384.0}, {4.0, 2, 1.0 / 8192.0},
    {8.0, 1, 1.0 / 4096.0}, {16.0, 0, 1.0 / 2048.0},
};

/* An earlier image may have selected another bank, without this register. Only a plausible value is changed, because the part
   is not identified yet. */
static uint16_t identify(unsigned device)
{
    uint8_t bank = byte_register_read(device, BUS_HZ, REG_BANK_SEL);
    if (bank >= 1 && bank <= 4)
        byte_register_write(device, BUS_HZ, REG_BANK_SEL, 0);
    return byte_register_read(device, BUS_HZ, WHO_AM_I);
}

static bool register_is(unsigned device, uint8_t address, uint8_t value)
{
    return byte_register_read(device, BUS_HZ, address) == value;
}

/* While a sensor is on, only its rate, range and mode may change (section 12.9); by then it is set to SPI. */
static void keep_to_spi(unsigned device)
{
    uint8_t setting = INTF_CONFIG0_FULL_RANGE | INTF_CONFIG0_BIG_ENDIAN | INTF_CONFIG0_I2C_OFF;
    if (register_is(device, PWR_MGMT0, 0) && !register_is(device, INTF_CONFIG0, setting))
        byte_register_write(device, BUS_HZ, INTF_CONFIG0, setting);
}

static size_t nearest_rate(float hz)
{
    size_t best = 0;
    for (size_t i = 1; i < COUNT(rates); i++)
        if (is_nearer(rates[i].hz, rates[best].hz, hz))
            best = i;
    return best;
}

/* The reset restores the defaults in all banks, also of the user's offsets (section 5.4), the self-test and the filters before
   the one that is set here. */
static void reset_part(unsigned device)
{
    uint8_t bytes[2] = {DEVICE_CONFIG, DEVICE_CONFIG_SOFT_RESET};
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    port_wait_us(RESET_US);
}

/* Both sensors always run, at one rate: so a conversion is one of both. They start last, after the setup of the interrupt.
   INT_CONFIG1: INT_ASYNC_RESET must be cleared (section 12.6). */
static bool write_settings(unsigned device, uint8_t rate, uint8_t range, uint8_t acceleration_range)
{
    const struct byte_setting settings[] = {
        {INTF_CONFIG0, INTF_CONFIG0_FULL_RANGE | INTF_CONFIG0_BIG_ENDIAN | INTF_CONFIG0_I2C_OFF},
        {INTF_CONFIG1, INTF_CONFIG1_BEST_CLOCK},
        {INT_CONFIG, INT_CONFIG_INT1_RISES},
        {INT_CONFIG1, 0},
        {INT_SOURCE0, INT_SOURCE0_DATA_RDY},
        {GYRO_ACCEL_CONFIG0, GYRO_ACCEL_CONFIG0_HALF_RATE},
        {GYRO_CONFIG0, (uint8_t)(range << 5 | rate)},
        {ACCEL_CONFIG0, (uint8_t)(acceleration_range << 5 | rate)},
        {PWR_MGMT0, PWR_MGMT0_BOTH_LOW_NOISE},
    };
    bool is_written = byte_registers_write(device, BUS_HZ, settings, COUNT(settings));
    port_wait_us(SWITCHING_US);
    return is_written;
}

static enum error_code configure(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup)
{
    const struct range *range = choose_range(wanted->range_deg_s, ranges, COUNT(ranges));
    const struct range *acceleration = choose_range(wanted->range_g, accelerations, COUNT(accelerations));
    if (range == NULL || acceleration == NULL)
        return ERROR_BAD_RANGE;
    size_t rate = nearest_rate(wanted->rate_hz);
    reset_part(device);
    if (!write_settings(device, rates[rate].code, range->code, acceleration->code))
        return ERROR_SETUP_FAILED;
    setup->rate_hz = rates[rate].hz;
    tell_ranges(range, acceleration, setup);
    setup->temperature_scale_c = 1.0 / 132.48; /* section 4.13 */
    setup->temperature_offset_c = 25.0;
    return 0;
}

static int16_t int16_at(const uint8_t *bytes)
{
    return (int16_t)(bytes[0] << 8 | bytes[1]);
}

/* The status comes first: reading it after the outputs would clear the flag of a conversion in between. The axes of both triads
   are right-handed (figure 16; PX4's driver turns two signs of each). */
static enum read_result read(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    (void)setup;
    uint8_t status = byte_register_read(device, BUS_HZ, INT_STATUS);
    uint8_t bytes[16] = {TEMP_DATA1 | BYTE_REGISTER_READ}; /* and one more register, for an even number */
    bus_xfer(device, BUS_HZ, bytes, sizeof bytes);
    reading->temperature_counts = int16_at(&bytes[1]);
    for (unsigned axis = 0; axis < 3; axis++) {
        reading->acceleration[axis] = int16_at(&bytes[3 + 2 * axis]);
        reading->counts[axis] = int16_at(&bytes[9 + 2 * axis]);
    }
    return (status & (INT_STATUS_DATA_RDY | INT_STATUS_ALWAYS_0)) == INT_STATUS_DATA_RDY ? READ_FRESH : READ_STALE;
}

const struct sensor_driver icm42688p_gyro = {
    "ICM-42688-P", IDENTITY, QUANTITY_RATE, SETTLING_US, 1, false, LATCHED_US, NULL, keep_to_spi, identify, configure, read};
