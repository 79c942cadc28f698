/* From data-ready edges to batches of samples, with every conversion accounted for. */
#ifndef ACQUISITION_H
#define ACQUISITION_H

#include <stdbool.h>
#include <stdint.h>

#include "correction.h"
#include "sensors.h"

void acquisition_reset(void);

/* Called from the data-ready interrupt with the counter value captured there. */
void acquisition_data_ready(unsigned sensor, uint32_t captured_us);

/* Sets the rate of a newly configured sensor; 0 removes it from the stream. */
void acquisition_set_rate(unsigned sensor, double rate_hz);

/* The correction of a sensor's rates, to be set before a calibrated start of it. */
struct correction *acquisition_correction(unsigned sensor);

/* Starts counting at sequence 0 with the first conversion of a settled part; false when no sensor is configured. Those with
   their bit in `calibrated` send rates by their correction, the others raw samples. */
bool acquisition_start(uint8_t calibrated);
void acquisition_stop(void);
bool acquisition_is_running(void);

/* True if no sample waits to be sent. */
bool acquisition_is_empty(void);

/* Reads new conversions and sends batches that are due. */
void acquisition_run(void);

void acquisition_report(unsigned sensor, struct report_item *item);
uint32_t acquisition_bus_errors(void);

/* The temperature and the time of a sensor's newest good reading; false without one since the latest start, or without a
   stream. */
bool acquisition_temperature(unsigned sensor, int16_t *counts, uint64_t *read_us);

#endif
