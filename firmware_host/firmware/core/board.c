#include "board.h"

#include <string.h>

#include "acquisition.h"
#include "adis16465.h"
#include "clock.h"
#include "link.h"
#include "lsm9ds1.h"
#include "mpu9250.h"
#include "port.h"

#define BEACON_US 500000u

const struct sensor sensors[SENSOR_COUNT] = {{&lsm9ds1_gyro, 0}, {&mpu9250_gyro, 1}, {&adis16465_gyro, 2}};

static uint64_t last_beacon_us;
static uint8_t stop_to_acknowledge; /* sequence of a stop whose last samples are still waiting */
static bool restart_wanted;

void board_reset(void)
{
    clock_reset();
    link_reset();
    acquisition_reset();
    last_beacon_us = clock_now();
    stop_to_acknowledge = 0;
    restart_wanted = false;
}

static void acknowledge(uint8_t sequence)
{
    struct ack_payload ack = {.reply_to = sequence};
    link_send(MESSAGE_ACK, &ack, sizeof ack);
}

static void refuse(const struct frame *request, enum error_code code, uint8_t sensor)
{
    struct error_payload error = {.reply_to = request->sequence, .code = (uint8_t)code, .sensor = sensor};
    link_send(MESSAGE_ERROR, &error, sizeof error);
}

static void send_identity(uint8_t reply_to)
{
    struct {
        struct identity_payload head;
        struct identity_item items[SENSOR_COUNT];
    } __attribute__((packed)) identity = {.head = {.reply_to = reply_to, .protocol = PROTOCOL_VERSION}};
    struct port_health health;
    port_health(&health);
    identity.head.reset_cause = health.reset_cause;
    memcpy(identity.head.firmware, FIRMWARE_VERSION, sizeof FIRMWARE_VERSION);
    memcpy(identity.head.unique_id, port_unique_id(), sizeof identity.head.unique_id);
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        uint16_t who_am_i;
        identity.items[i].present = sensors[i].driver->identify(sensors[i].device, &who_am_i);
        identity.items[i].who_am_i = who_am_i;
        memcpy(identity.items[i].part, sensors[i].driver->part, sizeof identity.items[i].part);
    }
    link_send(MESSAGE_IDENTITY, &identity, sizeof identity);
}

static void on_hello(const struct frame *request)
{
    send_identity(request->sequence);
}

static void on_configure(const struct frame *request)
{
    struct configure_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    if (wanted.sensor >= SENSOR_COUNT) {
        refuse(request, ERROR_NO_SUCH_SENSOR, wanted.sensor);
        return;
    }
    if (acquisition_is_running()) {
        refuse(request, ERROR_BUSY_STREAMING, wanted.sensor);
        return;
    }
    struct setup_payload setup = {.reply_to = request->sequence, .sensor = wanted.sensor};
    const struct sensor *sensor = &sensors[wanted.sensor];
    uint8_t error = sensor->driver->configure(sensor->device, &wanted, &setup);
    acquisition_set_rate(wanted.sensor, error ? 0.0 : setup.rate_hz);
    if (error)
        refuse(request, (enum error_code)error, wanted.sensor);
    else
        link_send(MESSAGE_SETUP, &setup, sizeof setup);
}

/* A host that missed the ack asks again, so starting twice must not restart the sequence. */
static void on_start(const struct frame *request)
{
    if (request->payload[0] != 0)
        refuse(request, ERROR_NO_CALIBRATION, 0);
    else if (acquisition_is_running() || acquisition_start())
        acknowledge(request->sequence);
    else
        refuse(request, ERROR_NOT_CONFIGURED, 0);
}

static void on_stop(const struct frame *request)
{
    acquisition_stop();
    stop_to_acknowledge = request->sequence;
}

static void on_status(const struct frame *request)
{
    struct {
        struct report_payload head;
        struct report_item items[SENSOR_COUNT];
    } __attribute__((packed)) report;
    struct port_health health;
    port_health(&health);
    report.head = (struct report_payload){
        .reply_to = request->sequence,
        .uptime_us = clock_now(),
        .rx_errors = link_rx_errors(),
        .tx_overruns = link_tx_overruns(),
        .bus_errors = acquisition_bus_errors(),
        .stack_high_water = health.stack_high_water,
        .fault_pc = health.fault_pc,
        .reset_cause = health.reset_cause,
        .clock_locked = health.clock_locked,
        .streaming = acquisition_is_running(),
    };
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        acquisition_report(i, &report.items[i]);
    link_send(MESSAGE_REPORT, &report, sizeof report);
}

static void on_reboot(const struct frame *request)
{
    acknowledge(request->sequence);
    restart_wanted = true;
}

static const struct {
    uint8_t type, size;
    void (*handle)(const struct frame *request);
} requests[] = {
    {MESSAGE_HELLO, 0, on_hello},
    {MESSAGE_CONFIGURE, sizeof(struct configure_payload), on_configure},
    {MESSAGE_START, sizeof(struct start_payload), on_start},
    {MESSAGE_STOP, 0, on_stop},
    {MESSAGE_STATUS, 0, on_status},
    {MESSAGE_REBOOT, 0, on_reboot},
};

static void answer(const struct frame *request)
{
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        if (requests[i].type != request->type)
            continue;
        if (requests[i].size == request->size)
            requests[i].handle(request);
        else
            refuse(request, ERROR_BAD_LENGTH, 0);
        return;
    }
    refuse(request, ERROR_UNKNOWN_MESSAGE, 0);
}

static void send_beacon(void)
{
    if (acquisition_is_running() || clock_now() - last_beacon_us < BEACON_US)
        return;
    last_beacon_us = clock_now();
    send_identity(0);
}

void board_run(void)
{
    struct frame request;
    while (link_receive(&request))
        answer(&request);
    acquisition_run();
    if (stop_to_acknowledge != 0 && acquisition_is_empty() && link_has_room()) {
        acknowledge(stop_to_acknowledge);
        stop_to_acknowledge = 0;
    }
    send_beacon();
    link_transmit();
    if (restart_wanted && link_is_idle())
        port_restart();
}
