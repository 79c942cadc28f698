#include "acquisition.h"

#include <string.h>

#include "batch.h"
#include "clock.h"
#include "hand.h"
#include "kept.h"
#include "link.h"
#include "port.h"
#include "sensors.h"
#include "setups.h"

#define RING 64u              /* a power of two */
#define FIELD_RING 16u        /* a power of two, for a magnetometer, which is slower */
#define SILENCE_PERIODS 10u   /* more conversions missing in a row are a fault, not jitter */
#define SILENCE_US 100000u    /* plus the start-up time of a part */
#define BAD_READS 10u         /* bad reads in a row that are reported */
#define GOOD_READS 8u         /* good reads that cancel a bad one */

struct stream {
    volatile uint32_t edges; /* written by the interrupt */
    volatile uint32_t captured_us;
    uint32_t edges_seen;
    uint32_t period_us; /* 0: not configured */
    uint64_t last_us;   /* latest conversion, or the start */
    uint64_t watched_us; /* time from which a silence is measured */
    uint32_t settling;  /* conversions still to discard */
    uint32_t distrust;  /* grows by bad reads, shrinks by good ones */
    bool overtaken;     /* the next edge came during a read */
    bool silence_reported, bad_reads_reported;
    uint32_t conversions, sent, dropped;
    uint64_t good_us; /* latest good reading, 0: none since the start */
    int16_t temperature_counts; /* of that reading */
    struct sample *ring;
    uint32_t ring_size, written, read;
    const struct batch_layout *layout;
    struct correction correction; /* if calibrated */
};

static struct stream streams[SENSOR_COUNT];
static struct sample rings[GYROSCOPE_COUNT][RING], field_rings[SENSOR_COUNT - GYROSCOPE_COUNT][FIELD_RING];
static bool running;
static uint32_t bus_errors;

void acquisition_reset(void)
{
    memset(streams, 0, sizeof streams);
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        bool gyroscope = i < GYROSCOPE_COUNT;
        streams[i].ring = gyroscope ? rings[i] : field_rings[i - GYROSCOPE_COUNT];
        streams[i].ring_size = gyroscope ? RING : FIELD_RING;
    }
    running = false;
    bus_errors = 0;
}

void acquisition_data_ready(unsigned sensor, uint32_t captured_us)
{
    streams[sensor].captured_us = captured_us;
    streams[sensor].edges++;
}

void acquisition_set_rate(unsigned sensor, double rate_hz)
{
    const struct sensor_driver *driver = drivers[sensor];
    struct stream *stream = &streams[sensor];
    stream->period_us = rate_hz > 0.0 ? (uint32_t)(1e6f / (float)rate_hz) : 0;
    stream->settling = driver->settling;
    if (stream->period_us != 0 && stream->settling * stream->period_us < driver->settling_us)
        stream->settling = driver->settling_us / stream->period_us + 1;
}

static enum read_result read_sensor(unsigned sensor, struct reading *reading)
{
    return drivers[sensor]->read(sensor, setups_of(sensor), reading);
}

#define TRIES 3u /* more reads would not calm a bouncing line */

/* Discards the conversion from before the start. A part with a level on its line makes no edge until a read lowers it. A part
   with pulses is read only once: an ADIS16465 allows a limited number of words between conversions. */
static void rearm(unsigned sensor)
{
    const struct sensor_driver *driver = drivers[sensor];
    struct stream *stream = &streams[sensor];
    struct reading discarded;
    unsigned tries = driver->holds_line ? TRIES : 1;
    do {
        stream->edges_seen = stream->edges;
        read_sensor(sensor, &discarded);
    } while (--tries != 0 && (stream->edges != stream->edges_seen || port_line_is_high(sensor)));
    if (!driver->holds_line)
        stream->edges_seen = stream->edges; /* it has been read, or the next makes an edge */
}

/* A line that rose again before a low level was detected made no edge, and would stay high. */
static void lower_line(unsigned sensor)
{
    const struct stream *stream = &streams[sensor];
    struct reading discarded;
    for (unsigned tries = TRIES; tries != 0 && port_line_is_high(sensor) && stream->edges == stream->edges_seen; tries--)
        read_sensor(sensor, &discarded);
}

static const struct batch_layout *get_layout(const struct setup_payload *setup)
{
    if (setup->range_t > 0.0)
        return &batch_field_samples;
    return setup->range_m_s2 > 0.0 ? &batch_imu_samples : &batch_samples;
}

struct correction *acquisition_correction(unsigned sensor)
{
    return &streams[sensor].correction;
}

bool acquisition_start(uint8_t calibrated)
{
    uint8_t configured = 0;
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        configured |= (uint8_t)((streams[i].period_us != 0) << i);
    port_listen(configured);
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        struct stream *stream = &streams[i];
        stream->conversions = stream->sent = stream->dropped = 0;
        stream->written = stream->read = 0;
        stream->layout = get_layout(setups_of(i));
        if (is_named(calibrated, i))
            stream->layout = &batch_rates;
        stream->distrust = 0;
        stream->overtaken = false;
        stream->silence_reported = stream->bad_reads_reported = false;
        stream->last_us = stream->watched_us = clock_now();
        stream->good_us = 0;
        if (is_named(configured, i))
            rearm(i);
    }
    running = configured != 0;
    return running;
}

void acquisition_stop(void)
{
    running = false;
    port_listen(0); /* an ADIS16465 cannot be stopped */
}

bool acquisition_is_running(void)
{
    return running;
}

bool acquisition_is_empty(void)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        if (streams[i].written != streams[i].read)
            return false;
    return true;
}

/* Returns the conversions since the last one. A line kept high by an unread conversion makes no edges, so the
   elapsed time is used too. */
static uint32_t count_conversions(const struct stream *stream, uint32_t edges, uint64_t time_us)
{
    if (stream->conversions == 0)
        return edges; /* the first may come late: the part is starting up */
    uint32_t elapsed = ((uint32_t)(time_us - stream->last_us) + stream->period_us / 2) / stream->period_us;
    return elapsed > edges ? elapsed : edges;
}

static bool report_error(unsigned sensor, enum error_code code)
{
    struct error_payload error = {.code = (uint8_t)code, .sensor = (uint8_t)sensor};
    return link_send(MESSAGE_ERROR, &error, sizeof error);
}

/* Tries to release a line that stayed high, but not in every pass: the other sensors have to be read too. */
static void watch_silence(unsigned sensor)
{
    struct stream *stream = &streams[sensor];
    uint64_t now_us = clock_now();
    if (now_us - stream->watched_us < SILENCE_PERIODS * stream->period_us + SILENCE_US)
        return;
    stream->watched_us = now_us;
    rearm(sensor);
    if (!stream->silence_reported)
        stream->silence_reported = report_error(sensor, ERROR_SENSOR_SILENT);
}

static void watch_reads(unsigned sensor, enum read_result result)
{
    static const enum error_code meaning[] = {
        [READ_STALE] = ERROR_SENSOR_ABSENT, /* it signals, but does not answer */
        [READ_DAMAGED] = ERROR_CHECKSUM_FAILED,
        [READ_FAULTY] = ERROR_SENSOR_FAULT,
    };
    struct stream *stream = &streams[sensor];
    if (result == READ_FRESH) {
        stream->distrust -= stream->distrust != 0;
        return;
    }
    bus_errors++;
    if (stream->distrust < BAD_READS * GOOD_READS)
        stream->distrust += GOOD_READS;
    if (stream->distrust >= BAD_READS * GOOD_READS && !stream->bad_reads_reported)
        stream->bad_reads_reported = report_error(sensor, meaning[result]);
}

static struct sample *get_sample(const struct stream *stream, uint32_t number)
{
    return &stream->ring[number % stream->ring_size];
}

static void acquire(unsigned sensor)
{
    struct stream *stream = &streams[sensor];
    uint32_t edges, captured_us;
    do { /* an edge in between would pair one conversion's number with another's time */
        edges = stream->edges;
        captured_us = stream->captured_us;
    } while (edges != stream->edges);
    if (edges == stream->edges_seen) {
        watch_silence(sensor);
        return;
    }
    uint64_t time_us = clock_at(captured_us);
    uint32_t conversions = count_conversions(stream, edges - stream->edges_seen, time_us);
    stream->edges_seen = edges;
    stream->last_us = stream->watched_us = time_us;

    const struct sensor_driver *driver = drivers[sensor];
    struct reading reading;
    uint32_t start_us = port_time_us();
    enum read_result result = read_sensor(sensor, &reading);
    /* After an edge between the check and the latching of the values they may belong to the next conversion, with the time of
       the one before. Then the next reading repeats them. Later edges do not change latched values. */
    bool is_repeat = stream->overtaken && result == READ_STALE;
    stream->overtaken = stream->edges != edges && (int32_t)(stream->captured_us - start_us) <= driver->latched_within_us;
    if (driver->holds_line)
        lower_line(sensor);
    if (result == READ_FRESH) {
        stream->good_us = time_us;
        stream->temperature_counts = reading.temperature_counts;
    }
    if (!is_repeat && result != READ_TORN)
        watch_reads(sensor, result);
    if (stream->settling != 0) {
        stream->settling--;
        return;
    }
    stream->conversions += conversions;
    stream->dropped += conversions - 1;
    bool good = result == READ_FRESH && !stream->overtaken;
    if (good) {
        kept_add(sensor, time_us, reading.counts);
        hand_add(sensor, time_us, stream->conversions, &reading);
    }
    bool full = stream->written - stream->read == stream->ring_size;
    if (!good || full) {
        stream->dropped++;
        return;
    }
    *get_sample(stream, stream->written) = (struct sample){time_us, stream->conversions - 1, reading};
    stream->written++;
}

static unsigned get_batch_capacity(const struct stream *stream)
{
    return (PAYLOAD_MAX - sizeof(struct samples_payload)) / stream->layout->item_size;
}

/* Sends the oldest samples up to a gap in the sequence: a batch numbers its samples by the first. The link has room. */
static void send_batch(unsigned sensor)
{
    struct stream *stream = &streams[sensor];
    const struct batch_layout *layout = stream->layout;
    const struct sample *first = get_sample(stream, stream->read);
    uint8_t payload[PAYLOAD_MAX];
    size_t size = sizeof(struct samples_payload);
    uint8_t count = 0;
    while (count < get_batch_capacity(stream) && stream->read + count != stream->written) {
        const struct sample *sample = get_sample(stream, stream->read + count);
        if (sample->sequence != first->sequence + count)
            break;
        layout->write(sample, (uint32_t)(sample->time_us - first->time_us), &stream->correction, &payload[size]);
        size += layout->item_size;
        count++;
    }
    struct samples_payload head = {
        .sensor = (uint8_t)sensor,
        .mode = layout->mode,
        .sequence = first->sequence,
        .dropped = stream->dropped,
        .base_time_us = first->time_us,
        .count = count,
    };
    memcpy(payload, &head, sizeof head);
    link_send(layout->message, payload, size);
    stream->read += count;
    stream->sent += count;
}

static bool batch_is_due(const struct stream *stream)
{
    uint32_t waiting = stream->written - stream->read;
    if (waiting == 0 || !link_has_room())
        return false;
    uint64_t age_us = stream->last_us - get_sample(stream, stream->read)->time_us;
    return waiting >= get_batch_capacity(stream) || age_us >= BATCH_AGE_US || !running;
}

void acquisition_run(void)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        if (running && streams[i].period_us != 0)
            acquire(i);
        while (batch_is_due(&streams[i]))
            send_batch(i);
    }
}

void acquisition_report(unsigned sensor, struct report_item *item)
{
    const struct stream *stream = &streams[sensor];
    *item = (struct report_item){.conversions = stream->conversions, .samples = stream->sent, .dropped = stream->dropped};
}

uint32_t acquisition_bus_errors(void)
{
    return bus_errors;
}

bool acquisition_temperature(unsigned sensor, int16_t *counts, uint64_t *read_us)
{
    const struct stream *stream = &streams[sensor];
    *counts = stream->temperature_counts;
    *read_us = stream->good_us;
    return running && stream->good_us != 0;
}
