#include "stored.h"

#include <stdbool.h>
#include <string.h>

#include "acquisition.h"
#include "link.h"
#include "reply.h"
#include "sensors.h"
#include "setups.h"
#include "store.h"

void stored_on_read(const struct frame *request)
{
    uint8_t sensor = request->payload[0];
    struct calibration_payload record;
    enum error_code error = sensors_check_gyroscope(sensor);
    if (error) {
        reply_refused(request, error, sensor);
    } else if (!store_read(sensor, &record)) {
        reply_refused(request, ERROR_NO_CALIBRATION, sensor);
    } else {
        record.reply_to = request->sequence;
        link_send(MESSAGE_CALIBRATION, &record, sizeof record);
    }
}

#define LARGEST 1e6f /* matrix, or bias in rad/s: far beyond any sensor's, so that no product of two overflows */

/* Returns whether a matrix is K, or possible for a sensor: its axes are nearer to right angles than to each other. */
static bool is_usable_matrix(const struct write_calibration_payload *calibration)
{
    bool is_full_matrix = calibration->model == MODEL_MATRIX_TIMES_M_PLUS_B;
    bool usable = is_full_matrix || calibration->model == MODEL_K_TIMES_M_PLUS_B;
    for (unsigned row = 0; row < 3; row++) {
        float diagonal = calibration->matrix[row][row], off_diagonal = 0.0f;
        for (unsigned column = 0; column < 3; column++)
            if (column != row)
                off_diagonal += __builtin_fabsf(calibration->matrix[row][column]);
        usable = usable && diagonal > 0.0f && diagonal < LARGEST &&
                 (is_full_matrix ? off_diagonal < diagonal : off_diagonal == 0.0f);
    }
    return usable;
}

/* Returns a bound on the change of an axis by a polynomial over a range of temperature. */
static float compute_largest_change(const float change[3][3], unsigned axis, float range_k)
{
    return range_k * (__builtin_fabsf(change[0][axis]) +
                     range_k * (__builtin_fabsf(change[1][axis]) + range_k * __builtin_fabsf(change[2][axis])));
}

#define MAX_SCALE_CHANGE 0.5f /* largest change for any sensor over any temperatures */

/* NaN fails every comparison. */
static bool is_usable(const struct write_calibration_payload *calibration)
{
    float scale_change[3][3], bias_change_rad_s[3][3], reference_c = calibration->temperature_c;
    memcpy(scale_change, calibration->scale_change, sizeof scale_change);
    memcpy(bias_change_rad_s, calibration->bias_change_rad_s, sizeof bias_change_rad_s);
    float range_k = calibration->highest_c - calibration->lowest_c;
    bool usable = is_usable_matrix(calibration) && calibration->lowest_c <= reference_c &&
                  reference_c <= calibration->highest_c && range_k < LARGEST;
    for (unsigned axis = 0; axis < 3; axis++)
        usable = usable && __builtin_fabsf(calibration->bias_rad_s[axis]) < LARGEST &&
                 compute_largest_change(scale_change, axis, range_k) < MAX_SCALE_CHANGE &&
                 compute_largest_change(bias_change_rad_s, axis, range_k) < LARGEST;
    return usable;
}

/* Writes the part of a calibration: the driver's name and the identity register, and the configured range. */
static enum error_code describe(unsigned sensor, struct calibration_payload *record)
{
    uint16_t who_am_i;
    enum error_code error = sensors_identify(sensor, &who_am_i);
    if (error)
        return error;
    *record = (struct calibration_payload){
        .sensor = (uint8_t)sensor,
        .who_am_i = who_am_i,
        .range_deg_s = (float)setups_of(sensor)->range_deg_s,
    };
    memcpy(record->part, drivers[sensor]->part, sizeof record->part);
    return 0;
}

/* A host that missed the ack repeats the request: a stored record is not written twice, because the flash wears. */
static bool is_stored(const struct calibration_payload *record)
{
    struct calibration_payload stored;
    if (!store_read(record->sensor, &stored))
        return false;
    stored.sequence = record->sequence;
    return memcmp(&stored, record, sizeof stored) == 0;
}

static enum error_code write(const struct write_calibration_payload *wanted)
{
    enum error_code error = setups_check(wanted->sensor);
    if (error)
        return error;
    if (acquisition_is_running())
        return ERROR_BUSY_STREAMING; /* the flash stops the processor while it erases: samples would be lost */
    if (!is_usable(wanted))
        return ERROR_BAD_CALIBRATION;
    struct calibration_payload record;
    error = describe(wanted->sensor, &record);
    if (error)
        return error;
    record.model = wanted->model;
    memcpy(record.serial_number, wanted->serial_number, sizeof record.serial_number);
    record.written_unix_s = wanted->written_unix_s;
    record.temperature_c = wanted->temperature_c;
    memcpy(record.matrix, wanted->matrix, sizeof record.matrix);
    memcpy(record.bias_rad_s, wanted->bias_rad_s, sizeof record.bias_rad_s);
    record.lowest_c = wanted->lowest_c;
    record.highest_c = wanted->highest_c;
    memcpy(record.scale_change, wanted->scale_change, sizeof record.scale_change);
    memcpy(record.bias_change_rad_s, wanted->bias_change_rad_s, sizeof record.bias_change_rad_s);
    return is_stored(&record) || store_write(wanted->sensor, &record) ? 0 : ERROR_FLASH_FAILED;
}

static enum error_code erase(uint8_t sensor)
{
    enum error_code error = sensors_check_gyroscope(sensor);
    if (error)
        return error;
    if (acquisition_is_running())
        return ERROR_BUSY_STREAMING;
    return store_erase(sensor) ? 0 : ERROR_FLASH_FAILED;
}

static void answer(const struct frame *request, enum error_code error)
{
    if (error)
        reply_refused(request, error, request->payload[0]);
    else
        reply_done(request->sequence);
}

void stored_on_write(const struct frame *request)
{
    struct write_calibration_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    answer(request, write(&wanted));
}

void stored_on_erase(const struct frame *request)
{
    answer(request, erase(request->payload[0]));
}

enum error_code stored_correction(unsigned sensor, struct correction *correction)
{
    struct calibration_payload record, present;
    if (!store_read(sensor, &record))
        return ERROR_NO_CALIBRATION;
    enum error_code error = describe(sensor, &present);
    if (error)
        return error;
    if (memcmp(record.part, present.part, sizeof record.part) != 0 || record.who_am_i != present.who_am_i ||
        record.range_deg_s != present.range_deg_s)
        return ERROR_OTHER_SENSOR;
    *correction = correction_of(&record, setups_of(sensor));
    return 0;
}
