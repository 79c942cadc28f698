#include "board.h"

#include <string.h>

#include "acquisition.h"
#include "alone.h"
#include "calibrating.h"
#include "clock.h"
#include "hand.h"
#include "heater.h"
#include "link.h"
#include "port.h"
#include "reply.h"
#include "sensors.h"
#include "setups.h"
#include "stored.h"

#define BEACON_US 500000u

static uint64_t last_beacon_us;
static uint8_t stop_to_acknowledge; /* sequence of a stop whose last samples are not sent yet */
static bool restart_wanted;
static uint8_t calibrated; /* mask of sensors, since the latest start */

void board_reset(void)
{
    clock_reset();
    link_reset();
    acquisition_reset();
    calibrating_reset();
    hand_reset();
    sensors_reset();
    setups_reset();
    alone_reset();
    heater_reset();
    last_beacon_us = clock_now();
    stop_to_acknowledge = 0;
    restart_wanted = false;
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
        identity.items[i].present = sensors_identify(i, &who_am_i) == 0;
        identity.items[i].who_am_i = who_am_i;
        identity.items[i].quantity = drivers[i]->quantity;
        memcpy(identity.items[i].part, drivers[i]->part, sizeof identity.items[i].part);
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
        reply_refused(request, ERROR_NO_SUCH_SENSOR, wanted.sensor);
        return;
    }
    if (acquisition_is_running()) {
        reply_refused(request, ERROR_BUSY_STREAMING, wanted.sensor);
        return;
    }
    enum error_code error = setups_configure(&wanted);
    struct setup_payload setup = *setups_of(wanted.sensor);
    acquisition_set_rate(wanted.sensor, setup.rate_hz);
    calibrating_forget(wanted.sensor);
    hand_forget(wanted.sensor);
    if (error) {
        reply_refused(request, error, wanted.sensor);
        return;
    }
    setup.reply_to = request->sequence;
    link_send(MESSAGE_SETUP, &setup, sizeof setup);
}

/* Starts the stream; sensors with their bit in `mask` send calibrated rates. */
static void start(const struct frame *request, uint8_t mask)
{
    uint8_t sensor;
    enum error_code error = setups_check_mask(mask, &sensor);
    for (uint8_t i = 0; i < SENSOR_COUNT && !error; i++)
        if (is_named(mask, i)) {
            sensor = i;
            error = stored_correction(i, acquisition_correction(i));
        }
    if (!error && !acquisition_start(mask)) {
        sensor = 0;
        error = ERROR_NOT_CONFIGURED;
    }
    if (error) {
        reply_refused(request, error, sensor);
        return;
    }
    calibrated = mask;
    reply_done(request->sequence);
}

/* A host that missed the ack asks again, so starting twice must not restart the sequence. */
static void on_start(const struct frame *request)
{
    uint8_t mask = request->payload[0];
    if (!acquisition_is_running())
        start(request, mask);
    else if (mask == calibrated)
        reply_done(request->sequence);
    else
        reply_refused(request, ERROR_BUSY_STREAMING, 0);
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
    reply_done(request->sequence);
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
    {MESSAGE_HEAT, sizeof(struct heat_payload), heater_on_heat},
    {MESSAGE_KEEP, sizeof(struct keep_payload), calibrating_on_keep},
    {MESSAGE_OBSERVE, sizeof(struct observe_payload), calibrating_on_observe},
    {MESSAGE_RECALL, sizeof(struct recall_payload), calibrating_on_recall},
    {MESSAGE_SOLVE, sizeof(struct solve_payload), calibrating_on_solve},
    {MESSAGE_READ_CALIBRATION, sizeof(struct read_calibration_payload), stored_on_read},
    {MESSAGE_WRITE_CALIBRATION, sizeof(struct write_calibration_payload), stored_on_write},
    {MESSAGE_ERASE_CALIBRATION, sizeof(struct erase_calibration_payload), stored_on_erase},
    {MESSAGE_BY_HAND, sizeof(struct by_hand_payload), hand_on_begin},
    {MESSAGE_HAND_STATUS, 0, hand_on_status},
    {MESSAGE_HAND_SOLVE, 0, hand_on_solve},
};

static void answer(const struct frame *request)
{
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        if (requests[i].type != request->type)
            continue;
        if (requests[i].size == request->size)
            requests[i].handle(request);
        else
            reply_refused(request, ERROR_BAD_LENGTH, 0);
        return;
    }
    reply_refused(request, ERROR_UNKNOWN_MESSAGE, 0);
}

static void send_beacon(void)
{
    bool idle = !acquisition_is_running();
    if (idle && clock_now() - last_beacon_us < BEACON_US)
        return;
    last_beacon_us = clock_now(); /* so that the first follows a stop's last samples */
    if (idle)
        send_identity(0);
}

void board_run(void)
{
    struct frame request;
    while (link_receive(&request))
        answer(&request);
    acquisition_run();
    alone_run();
    heater_run();
    if (stop_to_acknowledge != 0 && acquisition_is_empty() && link_has_room()) {
        reply_done(stop_to_acknowledge);
        stop_to_acknowledge = 0;
    }
    send_beacon();
    link_transmit();
    if (restart_wanted && link_is_idle())
        port_restart();
}
