/* MPU-9250 register map (RM-MPU-9250A-00, "map") and product specification (PS-MPU-9250A-01, "specification"). Linux's
   drivers/iio/imu/inv_mpu6050 and PX4's src/drivers/imu/invensense/mpu9250 have the same registers, bits and speeds. */
#include "byte_registers.h"
#include "drivers.h"
#include "port.h"
#include "settings.h"

#define IDENTITY 0x71u /* 0x73 is an MPU-9255, 0x70 an MPU-6500: parts with other figures */
#define REGISTERS_HZ 1000000u /* section 7.5 */
#define DATA_HZ 5000000u /* sensor and interrupt registers can be read at 20 MHz (section 3.6), but not over loose wires */

enum register_address {
    XG_OFFSET_H = 0x13, /* and five more, to 0x18 */
    ZG_OFFSET_L = 0x18,
    SMPLRT_DIV = 0x19,
    CONFIG = 0x1A,
    GYRO_CONFIG = 0x1B,
    ACCEL_CONFIG = 0x1C,
    ACCEL_CONFIG_2 = 0x1D,
    FIFO_EN = 0x23,
    INT_PIN_CFG = 0x37,
    INT_ENABLE = 0x38,
    INT_STATUS = 0x3A, /* then the seven words of acceleration, temperature and rates, high byte first */
    USER_CTRL = 0x6A,
    PWR_MGMT_1 = 0x6B,
    PWR_MGMT_2 = 0x6C,
    WHO_AM_I = 0x75,
};

#define INT_ENABLE_RAW_RDY 0x01u
#define INT_STATUS_RAW_DATA_RDY 0x01u
#define INT_STATUS_ALWAYS_0 0x80u /* reads 1 if no part drives the wire */
#define USER_CTRL_I2C_IF_DIS 0x10u
#define PWR_MGMT_1_SLEEP 0x40u
#define PWR_MGMT_1_CLKSEL_BEST 0x01u /* the gyroscope's own clock, required for full performance (map, register 107) */

/* The low-pass filter is always on: without it the part converts at 8 kHz independent of SMPLRT_DIV (map, register 25), too
   fast for the serial line. With it the divider acts on 1 kHz. */
#define BASE_HZ 1000.0
#define DIVIDER_MAX 250u /* 4 Hz, the slowest in the specification */

/* Section 3.1: the gyroscope starts within 35 ms; Linux's INV_MPU6500_GYRO_STARTUP_TIME is 70 ms, which also covers the slowest
   filter's 33 ms delay (map, register 26). */
#define SETTLING_US 70000u
#define LATCHED_US 2u /* the registers are frozen from the select on (map, section 4.22) */
#define WAKING_US 10000u /* until registers can be written: Linux's INV_MPU6050_REG_UP_TIME_MAX */

/* Sensitivities are those of section 3.1, not range / 32768. FS_SEL: map, register 27. */
static const struct range ranges[] = {
    {250.0, 0, RADIANS(1.0 / 131.0)},
    {500.0, 1, RADIANS(1.0 / 65.5)},
    {1000.0, 2, RADIANS(1.0 / 32.8)},
    {2000.0, 3, RADIANS(1.0 / 16.4)},
};

/* Section 3.2; AFS_SEL: map, register 28. */
static const struct range accelerations[] = {
    NO_ACCELERATION,
    {2.0, 0, 1.0 / 16384.0},
    {4.0, 1, 1.0 / 8192.0},
    {8.0, 2, 1.0 / 4096.0},
    {16.0, 3, 1.0 / 2048.0},
};

/* Bandwidth at DLPF_CFG 1 … 6: map, register 26. A_DLPFCFG's are near them: 184, 92, 41, 20, 10, 5 (register 29). */
static const float bandwidths_hz[] = {184.0f, 92.0f, 41.0f, 20.0f, 10.0f, 5.0f};

static uint16_t identify(unsigned device)
{
    return byte_register_read(device, REGISTERS_HZ, WHO_AM_I);
}

static void keep_to_spi(unsigned device)
{
    byte_register_write(device, REGISTERS_HZ, USER_CTRL, USER_CTRL_I2C_IF_DIS);
}

/* Returns the widest filter with a bandwidth below half the data rate. */
static uint8_t filter_code(double rate_hz)
{
    uint8_t i = 0;
    while (i < COUNT(bandwidths_hz) - 1 && 2.0f * bandwidths_hz[i] > (float)rate_hz)
        i++;
    return (uint8_t)(i + 1);
}

static bool wake(unsigned device)
{
    bool asleep = byte_register_read(device, REGISTERS_HZ, PWR_MGMT_1) & PWR_MGMT_1_SLEEP;
    bool is_written = byte_register_write(device, REGISTERS_HZ, PWR_MGMT_1, PWR_MGMT_1_CLKSEL_BEST);
    if (asleep)
        port_wait_us(WAKING_US);
    return is_written;
}

/* Settings of an earlier image, such as an offset or the self-test, are cleared. Interrupts last. The interrupt is a pulse for
   each conversion, not a level that a read clears: a missed read does not cost an edge. The offsets of the gyroscope are the
   user's; those of the accelerometer (registers 119 to 126) are the factory's trim and remain unchanged. */
static bool write_settings(unsigned device, uint16_t divider, uint8_t filter, uint8_t range, uint8_t acceleration_range)
{
    const struct byte_setting settings[] = {
        {USER_CTRL, USER_CTRL_I2C_IF_DIS},
        {INT_ENABLE, 0},
        {PWR_MGMT_2, 0}, /* all axes on */
        {FIFO_EN, 0},
        {CONFIG, filter},
        {SMPLRT_DIV, (uint8_t)(divider - 1)},
        {GYRO_CONFIG, (uint8_t)(range << 3)}, /* FCHOICE_B 0: through the filter */
        {ACCEL_CONFIG, (uint8_t)(acceleration_range << 3)}, /* no self-test */
        {ACCEL_CONFIG_2, filter},             /* ACCEL_FCHOICE_B 0: through the filter */
        {INT_PIN_CFG, 0},                     /* active high, push-pull, 50 µs; reading the status clears it */
        {INT_ENABLE, INT_ENABLE_RAW_RDY},
    };
    for (uint8_t address = XG_OFFSET_H; address <= ZG_OFFSET_L; address++)
        if (!byte_register_write(device, REGISTERS_HZ, address, 0))
            return false;
    return byte_registers_write(device, REGISTERS_HZ, settings, COUNT(settings));
}

static enum error_code configure(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup)
{
    const struct range *range = choose_range(wanted->range_deg_s, ranges, COUNT(ranges));
    const struct range *acceleration = choose_range(wanted->range_g, accelerations, COUNT(accelerations));
    if (range == NULL || acceleration == NULL)
        return ERROR_BAD_RANGE;
    uint16_t divider = nearest_divider(BASE_HZ, wanted->rate_hz, DIVIDER_MAX);
    setup->rate_hz = BASE_HZ / divider;
    if (!wake(device) || !write_settings(device, divider, filter_code(setup->rate_hz), range->code, acceleration->code))
        return ERROR_SETUP_FAILED;
    tell_ranges(range, acceleration, setup);
    setup->temperature_scale_c = 1.0 / 333.87; /* section 3.4.2: not the MPU-6050's formula */
    setup->temperature_offset_c = 21.0;
    return 0;
}

static int16_t int16_at(const uint8_t *bytes)
{
    return (int16_t)(bytes[0] << 8 | bytes[1]);
}

/* One chip select for status, acceleration, temperature and rates: they are adjacent, and one burst is of one instant. */
static enum read_result read(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    (void)setup;
    uint8_t bytes[16] = {INT_STATUS | BYTE_REGISTER_READ};
    bus_xfer(device, DATA_HZ, bytes, sizeof bytes);
    reading->temperature_counts = int16_at(&bytes[8]);
    for (unsigned axis = 0; axis < 3; axis++) {
        reading->acceleration[axis] = int16_at(&bytes[2 + 2 * axis]);
        reading->counts[axis] = int16_at(&bytes[10 + 2 * axis]);
    }
    uint8_t status = bytes[1] & (INT_STATUS_RAW_DATA_RDY | INT_STATUS_ALWAYS_0);
    return status == INT_STATUS_RAW_DATA_RDY ? READ_FRESH : READ_STALE;
}

const struct sensor_driver mpu9250_gyro = {
    "MPU-9250", IDENTITY, QUANTITY_RATE, SETTLING_US, 1, false, LATCHED_US, NULL, keep_to_spi, identify, configure, read};
