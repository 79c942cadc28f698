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

/* Sensor has just been configured to this rate; 0 takes it out of the stream. */
void acquisition_set_rate(unsigned sensor, double rate_hz);

/* Where the correction of a sensor's rates is kept: to be filled in before a start that names it. */
struct correction *acquisition_correction(unsigned sensor);

/* Starts counting at sequence 0 with the first conversion of a settled part; false when no sensor is configured. Those with
   their bit in `calibrated` send rates by their correction, the others raw samples. */
bool acquisition_start(uint8_t calibrated);
void acquisition_stop(void);
bool acquisition_is_running(void);

/* Nothing is left to send. */
bool acquisition_is_empty(void);

/* Reads what is ready, sends what is due. */
void acquisition_run(void);

void acquisition_report(unsigned sensor, struct report_item *item);
uint32_t acquisition_bus_errors(void);

/* What a sensor's thermometer told with its newest good reading, and when; false when that was before the latest start, or
   nothing streams. */
bool acquisition_temperature(unsigned sensor, int16_t *counts, uint64_t *read_us);

#endif
