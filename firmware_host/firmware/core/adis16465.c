/* ADIS16465 data sheet; the same registers, times and checksum in Linux's drivers/iio/imu/adis16475.c, which serves this
   part, in PX4's src/drivers/imu/analog_devices/adis16470 and in ArduPilot's AP_InertialSensor_ADIS1647x.cpp. */
#include "adis16465.h"

#include "port.h"
#include "settings.h"

#define WRITE 0x80u /* first bit of a frame of 16 bits, the high byte first */
#define IDENTITY 0x4051u /* 16465 */
#define BUS_HZ 1000000u /* a burst's limit (data sheet, table 2; Linux's ADIS16475_BURST_MAX_SPEED); other frames take 2 MHz */
#define STALL_US 16u /* between frames (table 2; Linux's cs_change_delay) */

#define LATCHED_US 50u /* a pause of STALL_US, then the frame that begins the burst, 26 µs */

enum register_address {
    DIAG_STAT = 0x02,
    XG_BIAS_LOW = 0x40, /* and five more, to 0x4A */
    ZG_BIAS_HIGH = 0x4A,
    FILT_CTRL = 0x5C,
    RANG_MDL = 0x5E,
    MSC_CTRL = 0x60,
    DEC_RATE = 0x64,
    GLOB_CMD = 0x68, /* reading it starts a burst */
    PROD_ID = 0x72,
};

#define RANG_MDL_RANGE(value) ((value) >> 2 & 3u)
#define MSC_CTRL_AS_DELIVERED 0x00C1u /* data-ready rises, own clock, corrected for acceleration and place */
#define DIAG_STAT_UPDATE_FAILED 0x0004u /* a write to its flash, which nobody does here: no reading suffers */
#define BASE_HZ 2000.0
#define DIVIDER_MAX 2000u
#define SETTLING 2u /* the conversion under way when the rate changed, and one more */

/* A setting reads back only when the part has worked it in, 30 µs after its writing, MSC_CTRL 200 µs (Analog's no-OS,
   drivers/imu/adis1646x.c); more than 60 was seen (EngineerZone, thread 581040). Two conversions are time enough. */
#define TAKEN_WITHIN_US 1000u
#define POLL_US 100u /* between two looks: the part bears a dozen words from one conversion to the next */

#define GLOB_CMD_RESET 0x0080u
#define RESET_US 260000u /* Analog's no-OS: 255 ms */

/* By what RANG_MDL says: the model decides the range. */
static const struct gyro_range ranges[] = {
    {125.0, 0, RADIANS(1.0 / 160.0)},
    {500.0, 1, RADIANS(1.0 / 40.0)},
    {2000.0, 3, RADIANS(1.0 / 10.0)},
};

static uint16_t word_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

static struct {
    uint32_t idle_since_us; /* the latest frame's end */
    uint16_t counter;       /* of conversions, at the latest reading */
} states[BUS_DEVICES];

static void reset(unsigned device)
{
    states[device].idle_since_us = port_time_us();
    states[device].counter = 0;
}

static void transfer(unsigned device, uint8_t *bytes, size_t size)
{
    if (port_time_us() - states[device].idle_since_us <= STALL_US)
        port_wait_us(STALL_US);
    bus_xfer(device, BUS_HZ, bytes, size);
    states[device].idle_since_us = port_time_us();
}

static uint16_t exchange(unsigned device, uint8_t first, uint8_t second)
{
    uint8_t bytes[2] = {first, second};
    transfer(device, bytes, sizeof bytes);
    return word_at(bytes);
}

/* The answer comes with the next frame. */
static uint16_t read_register(unsigned device, uint8_t address)
{
    exchange(device, address, 0);
    return exchange(device, address, 0);
}

static bool write_register(unsigned device, uint8_t address, uint16_t value)
{
    exchange(device, address | WRITE, (uint8_t)value);
    exchange(device, (uint8_t)(address + 1) | WRITE, (uint8_t)(value >> 8));
    uint32_t written_us = port_time_us();
    do {
        port_wait_us(POLL_US);
        if (read_register(device, address) == value)
            return true;
    } while (port_time_us() - written_us < TAKEN_WITHIN_US);
    return false;
}

static uint16_t identify(unsigned device)
{
    return read_register(device, PROD_ID);
}

static const struct gyro_range *range_of_model(unsigned device)
{
    uint16_t code = RANG_MDL_RANGE(read_register(device, RANG_MDL));
    for (size_t i = 0; i < COUNT(ranges); i++)
        if (ranges[i].code == code)
            return &ranges[i];
    return NULL;
}

static bool is_well(unsigned device)
{
    return (read_register(device, DIAG_STAT) & ~DIAG_STAT_UPDATE_FAILED) == 0;
}

/* A flag that stands, such as of a data path that was overrun, may stand until the part is reset (data sheet, DIAG_STAT), and
   its RST pin is not connected. Half a second at most: the watchdog allows one. */
static bool cure(unsigned device)
{
    if (is_well(device))
        return true;
    exchange(device, GLOB_CMD | WRITE, (uint8_t)GLOB_CMD_RESET);
    exchange(device, (GLOB_CMD + 1) | WRITE, 0);
    port_wait_us(RESET_US);
    return identify(device) == IDENTITY && is_well(device);
}

/* What somebody stored there would be added to every reading, and a calibration would be one of the part with it. */
static bool clear_biases(unsigned device)
{
    for (uint8_t address = XG_BIAS_LOW; address <= ZG_BIAS_HIGH; address += 2)
        if (!write_register(device, address, 0))
            return false;
    return true;
}

static enum error_code configure(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup)
{
    const struct gyro_range *range = range_of_model(device);
    if (range == NULL)
        return ERROR_SENSOR_MISMATCH;
    if (!(wanted->range_deg_s <= (float)range->deg_s))
        return ERROR_BAD_RANGE;
    uint16_t divider = nearest_divider(BASE_HZ, wanted->rate_hz, DIVIDER_MAX);
    if (!cure(device))
        return ERROR_SENSOR_FAULT;
    if (!clear_biases(device) || !write_register(device, FILT_CTRL, 0) ||
        !write_register(device, MSC_CTRL, MSC_CTRL_AS_DELIVERED) ||
        !write_register(device, DEC_RATE, (uint16_t)(divider - 1)))
        return ERROR_SETUP_FAILED;
    setup->rate_hz = BASE_HZ / divider;
    setup->range_deg_s = range->deg_s;
    setup->sensitivity_rad_s = range->sensitivity_rad_s;
    setup->temperature_scale_c = 0.1;
    setup->temperature_offset_c = 0.0;
    return 0;
}

/* A burst: after the command, ten words, namely DIAG_STAT, rates, accelerations, temperature, a counter of conversions and
   the sum of all bytes before. The sum is 0 only on a wire that is held low: gravity would show. */
static enum read_result read(unsigned device, struct reading *reading)
{
    uint8_t bytes[22] = {GLOB_CMD};
    transfer(device, bytes, sizeof bytes);

    uint16_t sum = 0;
    for (unsigned i = 2; i < 20; i++)
        sum = (uint16_t)(sum + bytes[i]);
    if (sum == 0 || sum != word_at(&bytes[20]))
        return READ_DAMAGED;
    if (word_at(&bytes[2]) & ~DIAG_STAT_UPDATE_FAILED)
        return READ_FAULTY;

    for (unsigned axis = 0; axis < 3; axis++)
        reading->counts[axis] = (int16_t)word_at(&bytes[4 + 2 * axis]);
    reading->temperature_counts = (int16_t)word_at(&bytes[16]);
    uint16_t counter = word_at(&bytes[18]);
    bool fresh = counter != states[device].counter;
    states[device].counter = counter;
    return fresh ? READ_FRESH : READ_STALE;
}

const struct sensor_driver adis16465_gyro = {
    "ADIS16465", IDENTITY, 0, SETTLING, false, LATCHED_US, reset, NULL, identify, configure, read};
