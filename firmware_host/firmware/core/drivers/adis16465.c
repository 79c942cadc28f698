/* ADIS16465 data sheet; the same registers, times and checksum in Linux's drivers/iio/imu/adis16475.c, which serves this
   part, in PX4's src/drivers/imu/analog_devices/adis16470 and in ArduPilot's AP_InertialSensor_ADIS1647x.cpp. */
#include "drivers.h"
#include "port.h"
#include "settings.h"

#define WRITE 0x80u /* first bit of a frame of 16 bits, the high byte first */
#define IDENTITY 0x4051u /* 16465 */
#define BURST_HZ 1000000u /* data sheet, table 2; Linux's ADIS16475_BURST_MAX_SPEED */
#define FRAME_HZ 2000000u /* of all other frames, the same table */
#define STALL_US 16u /* between frames (table 2; Linux's cs_change_delay) */

#define LATCHED_US 50u /* a pause of STALL_US, then the frame that begins the burst, 26 µs; later words are checked by their
                          counter */

enum register_address {
    DIAG_STAT = 0x02,
    X_GYRO_LOW = 0x04, /* every four, as of the accelerations, to 0x18: the lower halves of numbers of 32 bits */
    X_ACCL_LOW = 0x10,
    DATA_CNTR = 0x22,
    XG_BIAS_LOW = 0x40, /* and eleven more, to 0x56: of the rates, then of the accelerations */
    ZA_BIAS_HIGH = 0x56,
    FILT_CTRL = 0x5C,
    RANG_MDL = 0x5E,
    MSC_CTRL = 0x60,
    DEC_RATE = 0x64,
    GLOB_CMD = 0x68, /* reading it starts a burst */
    PROD_ID = 0x72,
};

#define RANG_MDL_RANGE(value) ((value) >> 2 & 3u)
#define MSC_CTRL_AS_DELIVERED 0x00C1u /* data-ready rises, own clock, corrected for acceleration and the sensors' positions */
#define DIAG_STAT_UPDATE_FAILED 0x0004u /* a failed write to its flash, which is not used here: readings are not affected */
#define BASE_HZ 2000.0
#define DIVIDER_MAX 2000u
#define SETTLING 2u /* the conversion in progress at the change of rate, and one more */

/* A setting reads back only after its update, 30 µs after the write, MSC_CTRL 200 µs (Analog's no-OS, drivers/imu/adis1646x.c);
   more than 60 was observed (EngineerZone, thread 581040). Two conversions suffice. */
#define TAKEN_WITHIN_US 1000u
#define POLL_US 100u /* between two reads: the part allows a dozen words between conversions */

#define GLOB_CMD_RESET 0x0080u
#define RESET_US 260000u /* Analog's no-OS: 255 ms */

/* By the value of RANG_MDL: the model determines the range. */
static const struct range ranges[] = {
    {125.0, 0, RADIANS(1.0 / 160.0)},
    {500.0, 1, RADIANS(1.0 / 40.0)},
    {2000.0, 3, RADIANS(1.0 / 10.0)},
};

static const struct range accelerations[] = {NO_ACCELERATION, {8.0, 0, 1.0 / 4000.0}};

static uint16_t word_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] << 8 | bytes[1]);
}

static struct {
    uint32_t idle_since_us; /* the latest frame's end */
    uint16_t counter;       /* of conversions, at the latest reading */
} states[SENSOR_COUNT];

static void reset(unsigned device)
{
    states[device].idle_since_us = port_time_us();
    states[device].counter = 0;
}

static void transfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size)
{
    if (port_time_us() - states[device].idle_since_us <= STALL_US)
        port_wait_us(STALL_US);
    bus_xfer(device, max_hz, bytes, size);
    states[device].idle_since_us = port_time_us();
}

static uint16_t exchange(unsigned device, uint8_t first, uint8_t second)
{
    uint8_t bytes[2] = {first, second};
    transfer(device, FRAME_HZ, bytes, sizeof bytes);
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

static const struct range *range_of_model(unsigned device)
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

/* A persistent flag, such as of an overrun data path, may remain set until the part is reset (data sheet, DIAG_STAT), and its
   RST pin is not connected. Half a second at most: the watchdog allows one. */
static bool cure(unsigned device)
{
    if (is_well(device))
        return true;
    exchange(device, GLOB_CMD | WRITE, (uint8_t)GLOB_CMD_RESET);
    exchange(device, (GLOB_CMD + 1) | WRITE, 0);
    port_wait_us(RESET_US);
    return identify(device) == IDENTITY && is_well(device);
}

/* A stored user bias would be added to every reading and so enter the calibration. */
static bool clear_biases(unsigned device)
{
    for (uint8_t address = XG_BIAS_LOW; address <= ZA_BIAS_HIGH; address += 2)
        if (!write_register(device, address, 0))
            return false;
    return true;
}

static enum error_code configure(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup)
{
    const struct range *range = range_of_model(device);
    if (range == NULL)
        return ERROR_SENSOR_MISMATCH;
    const struct range *acceleration = choose_range(wanted->range_g, accelerations, COUNT(accelerations));
    if (choose_range(wanted->range_deg_s, range, 1) == NULL || acceleration == NULL)
        return ERROR_BAD_RANGE;
    uint16_t divider = nearest_divider(BASE_HZ, wanted->rate_hz, DIVIDER_MAX);
    if (!cure(device))
        return ERROR_SENSOR_FAULT;
    if (!clear_biases(device) || !write_register(device, FILT_CTRL, 0) ||
        !write_register(device, MSC_CTRL, MSC_CTRL_AS_DELIVERED) ||
        !write_register(device, DEC_RATE, (uint16_t)(divider - 1)))
        return ERROR_SETUP_FAILED;
    setup->rate_hz = BASE_HZ / divider;
    tell_ranges(range, acceleration, setup);
    setup->temperature_scale_c = 0.1;
    setup->temperature_offset_c = 0.0;
    return 0;
}

/* Outputs that average have 32 bits, of which a burst carries the upper 16: alone they would be rounded down, with a mean error
   of half a count. The lower ones are read after it, each answer with the request for the next, and then the counter, which
   shows whether they belong to the same conversion. Without averaging they are empty. The part allows a limited number of words
   between two conversions: a dozen frames at full speed, 288 of 500 µs, without averaging, in proportion more with it (data
   sheet of the ADIS16467, maximum throughput). At 1000 Hz burst and eight frames take 564 of 576 µs. */
static enum read_result round_to_nearest(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    unsigned words = setup->range_m_s2 > 0.0 ? 6 : 3;
    exchange(device, X_GYRO_LOW, 0);
    for (unsigned word = 0; word < words; word++) {
        bool last = word + 1 == words;
        uint16_t low = exchange(device, last ? DATA_CNTR : (uint8_t)(X_GYRO_LOW + 4 * (word + 1)), 0);
        int16_t *upper = word < 3 ? &reading->counts[word] : &reading->acceleration[word - 3];
        if (low & 0x8000u && *upper != INT16_MAX)
            ++*upper;
    }
    return exchange(device, 0, 0) == states[device].counter ? READ_FRESH : READ_TORN;
}

/* A burst: after the command, ten words, namely DIAG_STAT, rates, accelerations, temperature, a counter of conversions and the
   sum of all bytes before. The sum is 0 only on a wire that is stuck low: gravity makes it nonzero. */
static enum read_result read(unsigned device, const struct setup_payload *setup, struct reading *reading)
{
    uint8_t bytes[22] = {GLOB_CMD};
    transfer(device, BURST_HZ, bytes, sizeof bytes);

    uint16_t sum = 0;
    for (unsigned i = 2; i < 20; i++)
        sum = (uint16_t)(sum + bytes[i]);
    if (sum == 0 || sum != word_at(&bytes[20]))
        return READ_DAMAGED;
    if (word_at(&bytes[2]) & ~DIAG_STAT_UPDATE_FAILED)
        return READ_FAULTY;

    for (unsigned axis = 0; axis < 3; axis++) {
        reading->counts[axis] = (int16_t)word_at(&bytes[4 + 2 * axis]);
        reading->acceleration[axis] = (int16_t)word_at(&bytes[10 + 2 * axis]);
    }
    reading->temperature_counts = (int16_t)word_at(&bytes[16]);
    uint16_t counter = word_at(&bytes[18]);
    bool fresh = counter != states[device].counter;
    states[device].counter = counter;
    if (!fresh)
        return READ_STALE;
    return setup->rate_hz < BASE_HZ ? round_to_nearest(device, setup, reading) : READ_FRESH;
}

const struct sensor_driver adis16465_gyro = {
    "ADIS16465", IDENTITY, QUANTITY_RATE, 0, SETTLING, false, LATCHED_US, reset, NULL, identify, configure, read};
