/* The functions of the board that hand.c needs for a count of its instructions: one configured sensor, and no host. */
#include "clock.h"
#include "hand.h"
#include "link.h"
#include "port.h"
#include "reply.h"
#include "setups.h"

static struct setup_payload setup;

struct record {
    uint64_t time_us;
    uint32_t sequence;
    struct reading reading;
};

void begin(const struct setup_payload *as);
void add(const struct record *record);

void begin(const struct setup_payload *as)
{
    setup = *as;
    hand_begin(0, 12, 1e-3f);
}

void add(const struct record *record)
{
    hand_add(0, record->time_us, record->sequence, &record->reading);
}

const struct setup_payload *setups_of(unsigned sensor)
{
    (void)sensor;
    return &setup;
}

enum error_code setups_check(uint8_t sensor)
{
    (void)sensor;
    return 0;
}

void port_health(struct port_health *health)
{
    health->clock_locked = 1;
}

bool link_send(enum message_type type, const void *payload, size_t size)
{
    (void)type, (void)payload, (void)size;
    return true;
}

void reply_done(uint8_t sequence)
{
    (void)sequence;
}

void reply_refused(const struct frame *request, enum error_code code, uint8_t sensor)
{
    (void)request, (void)code, (void)sensor;
}
